// Where a planted bug (common/render/planted_bugs.h) changes what this room computes: one question, which is answered
// when compiling in release builds, so that they hold no trace.
#pragma once

#include "common/render/planted_bugs.h"

namespace tandem::cpu {

#ifdef TANDEM_PLANTED_BUGS

// The one fault of all path tracers of this process, set before a job is made and kept while it lives.
inline PlantedFault planted_fault;

[[nodiscard]] inline bool planted(PlantedBug bug) { return planted_fault.bug == bug; }
[[nodiscard]] inline double planted_amount() { return planted_fault.amount; }

#else

[[nodiscard]] constexpr bool planted(PlantedBug /*bug*/) { return false; }
[[nodiscard]] constexpr double planted_amount() { return 0.0; }

#endif

// 1, or with the bug planted 1 plus its amount.
[[nodiscard]] inline double planted_scale(PlantedBug bug) { return planted(bug) ? 1.0 + planted_amount() : 1.0; }

}  // namespace tandem::cpu
