// The host's two witnesses: the Embree path tracer and the brute-force oracle.
#pragma once

#include "common/render/renderer.h"

namespace tandem {

[[nodiscard]] Backend cpu_backend();     // "cpu"
[[nodiscard]] Backend oracle_backend();  // "oracle"

}  // namespace tandem
