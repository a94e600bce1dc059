// The usual error metrics of the candidate's image against the reference's, over pixels and channels. They are shown,
// but decide nothing, as noise alone makes them large. x is the candidate, r the reference.
#pragma once

#include "common/validation/verdict/sampled_image.h"

namespace tandem {

struct ErrorMetrics {
    double mse = 0.0;                        // mean of (x - r)^2
    double rmse = 0.0;                       // its root
    double noise_mse = 0.0;                  // what the noise of both sides alone foretells of the MSE
    double relative_mse = 0.0;               // mean of (x - r)^2 / (r^2 + epsilon)
    double trimmed_relative_mse = 0.0;       // the same without the greatest of the terms
    static constexpr double epsilon = 1e-2;  // of the relative ones
    static constexpr double trimmed = 1e-3;  // share of the terms that the trimmed one leaves out
};

[[nodiscard]] ErrorMetrics error_metrics(const SampledImage& reference, const SampledImage& candidate);

}  // namespace tandem
