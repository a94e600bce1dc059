// Whether paths part by the rounding of one side: they do not where that side computes in double precision. Formulas
// are the same in all precisions, elementary functions and conversions are not.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "common/render/renderer.h"
#include "common/validation/verify/retraced_paths.h"

namespace tandem {

// A side that computes in single precision, in another one. Empty, nullptr from it, or an Error: not to be had.
using InPrecision = std::function<std::unique_ptr<Renderer>(VerifiedSide side, Precision)>;

struct PrecisionQuestion {
    const RetracedPaths& paths;
    const Scene& scene;       // as the paths'
    RenderSettings settings;  // as the paths'
    const InPrecision& in_precision;
    std::function<bool()> in_time;  // asked before each renderer that is made
};

struct PrecisionTrial {
    // Nine of ten paths that part do not where this side computes in double precision.
    VerifiedSide side = VerifiedSide::candidate;
    // The same where its intersections alone do (Precision::mixed). Empty: not known, or some paths part then.
    std::optional<bool> right_in_mixed;
    std::size_t parted = 0, in_double = 0;  // paths that part
};
// Empty: neither side is right in double precision, or too few paths part.
[[nodiscard]] std::optional<PrecisionTrial> try_precisions(const PrecisionQuestion& question);

// "3 of 402 paths that part do where the candidate computes in double precision"
[[nodiscard]] std::string told(const PrecisionTrial& trial);

}  // namespace tandem
