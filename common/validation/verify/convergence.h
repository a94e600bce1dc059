// How the error of two renderers falls with the number of samples: MSE = b^2 + s^2/n against a long reference. Its two
// halves r1 and r2 give (x - r1)(x - r2), which is free of the reference's own noise.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <stop_token>
#include <vector>

#include "common/render/renderer.h"
#include "common/statistics/interval.h"
#include "common/stopwatch.h"

namespace tandem {

// Intervals are the jackknife's over independent groups of samples, and the noise of the long reference, which all
// groups share.
struct ConvergenceSide {
    std::vector<Estimated> squared_errors;  // relative to the squared mean of the image, at ConvergenceReport::samples
    Estimated slope;                        // d log(root mean square error) / d log(samples); -1/2 without bias
    Estimated squared_bias;                 // b^2, relative to the squared mean; may come out below 0 by chance
    Estimated variance_ratio;               // s^2 over the variance that the samples themselves show; 1
};

struct ConvergenceReport {
    std::vector<std::uint64_t> samples;  // n, ascending
    std::uint64_t reference_samples = 0;
    double reference_relative_error = 0.0;  // standard error of the reference, root mean square over the image
    ConvergenceSide reference, candidate;
    std::vector<Estimated> between;  // |A - B|^2 / (variance of A + variance of B) at each n; 1 without bias
    double seconds = 0.0;
};

struct ConvergenceOptions {
    double budget_seconds = 60.0;
    std::uint64_t seed = 3;  // of the reference's side; the candidate's is the next, the long reference's the one after
    std::stop_token stop;
    std::function<void(double fraction)> progress;
    std::function<double()> now = steady_seconds;  // the clock of the budget
};

// The long reference is rendered by `reference`. Nothing where the budget is too short for three values of n, the image
// is black, or a stop was requested.
[[nodiscard]] std::optional<ConvergenceReport> measure_convergence(const Scene& scene, const RenderSettings& settings,
    Renderer& reference, Renderer& candidate, const ConvergenceOptions& options);

}  // namespace tandem
