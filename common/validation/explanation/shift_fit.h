// How far the candidate's picture is shifted against the reference's: whole pixels by search, the rest by least
// squares.
#pragma once

#include <optional>

#include "common/validation/explanation/image_pair.h"

namespace tandem {

// candidate(x, y) = exposure * reference(x - x_shift, y - y_shift), to first order in the shift; standard errors.
struct Registration {
    double exposure = 1.0, exposure_error = 0.0;
    double x = 0.0, x_error = 0.0;  // pixels, to the right
    double y = 0.0, y_error = 0.0;  // pixels, downwards
};

// Weighted least squares of candidate - reference on the mean image and its two central differences, all channels
// together. The noise of the mean of both sides is independent of that of their difference (equal variances). So it
// only weakens the regressors, and its part is taken out of the normal matrix. Errors after Huber and White (no model
// of the residuals). Nothing where noise hides a gradient, or there is none.
[[nodiscard]] std::optional<Registration> register_images(const ImagePair& pair);

struct Shift {
    double x = 0.0, y = 0.0, x_error = 0.0, y_error = 0.0;  // pixels
    ImagePair before;                                       // what of both images overlaps, where it lay
    ImagePair mended, mended_smooth;                        // the same, laid over each other; and smoothed before
};

// The shift, of up to 8 pixels or an eighth of the image, if it is one. It is found by more than five standard errors
// and 0.05 pixel. It is the same in all four quarters of the image, within five errors and a quarter of it. A zoom, a
// turn or another camera shift the quarters by different amounts. (Of three normal figures one is beyond five errors by
// chance in 6e5 images, and of any distribution, after Chebyshev, in 8.) Fitted are smoothed images, as linear
// interpolation does not move sharp edges rightly. (First order misses s^2/2 of the second derivative, 2.5 % of a shift
// of 0.05 pixel at edges a pixel wide.)
[[nodiscard]] std::optional<Shift> find_shift(const ImagePair& pair);

}  // namespace tandem
