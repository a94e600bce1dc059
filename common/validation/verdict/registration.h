// How the candidate's image lies over the reference: a constant exposure factor and a shift, so that these two common
// causes of a disagreement are called by their names.
#pragma once

#include <string>

#include "common/statistics/distributions.h"
#include "common/validation/verdict/sampled_image.h"

namespace tandem {

// candidate(x, y) = exposure * reference(x - shift_x, y - shift_y), to first order.
struct Registration {
    double exposure = 1.0, exposure_error = 0.0;  // standard errors
    double shift_x = 0.0, shift_x_error = 0.0;    // pixels, to the right
    double shift_y = 0.0, shift_y_error = 0.0;    // pixels, downwards
    double explained = 0.0;                       // fraction of the squared difference beyond noise
    bool exposure_found = false, shift_found = false;
    std::string text;  // empty when neither was found
};

// Weighted least squares of candidate - reference on the mean image and its two central differences, all channels
// together. The noise of the mean of both sides is independent of that of their difference (equal variances), so it
// only weakens the regressors; its part is taken out of the normal matrix. Errors after Huber and White (no model of
// the residuals). Found means: five standard errors (of three normal figures one is found by chance in 6e5 images, and
// of any distribution, after Chebyshev, in 8), and an effect worth a name:
// - a shift of 0.05 pixel. First order misses s^2/2 of the second derivative, 2.5 % of it at edges a pixel wide;
// - an exposure of 0.1 %, what `compare` calls no fault (2^-10), or of 0.5 % beside a shift, whose second order looks
//   like one: s^2/2 (2 pi/L)^2 on a pattern of period L pixels, 0.5 % at s = 0.5 and L = 31;
// and for an exposure without a shift that no 16x16 tile differs once it is taken out.
[[nodiscard]] Registration register_images(const SampledImage& reference, const SampledImage& candidate);

}  // namespace tandem
