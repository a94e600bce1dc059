// The place of a sample on the film within its pixel's filter (MODEL.md section 4.1), found by numerical inversion.
#pragma once

#include <cmath>
#include <numbers>

#include "common/render/renderer.h"

namespace tandem::oracle {

// The t >= 0 with erf(sqrt(2) t) = share: so much of a Gaussian of standard deviation 1/2 lies within t of its middle.
// Newton's method from 0. As erf is concave there, it comes from below and never passes the root but for rounding.
inline double gaussian_reach(double share) {
    constexpr int most_steps = 100;  // 3 standard deviations take ten
    double t = 0.0;
    for (int step = 0; step < most_steps; ++step) {
        const double slope = 2.0 * std::numbers::sqrt2 * std::numbers::inv_sqrtpi * std::exp(-2.0 * t * t);
        const double further = (share - std::erf(std::numbers::sqrt2 * t)) / slope;
        if (!(further > 0.0)) break;
        t += further;
    }
    return t;
}

// From number u along one axis to the place from the pixel's left or upper edge, in pixels.
inline double place_by_filter(PixelFilter filter, double u) {
    switch (filter) {
        case PixelFilter::box:
            return u;
        case PixelFilter::tent:
            return 0.5 + (u < 0.5 ? std::sqrt(2.0 * u) - 1.0 : 1.0 - std::sqrt(2.0 - 2.0 * u));
        case PixelFilter::gaussian:
            break;
    }
    const double within = std::erf(3.0 / std::numbers::sqrt2);  // 3 standard deviations: 1.5 pixels
    return 0.5 + std::copysign(gaussian_reach(within * std::abs(2.0 * u - 1.0)), u - 0.5);
}

}  // namespace tandem::oracle
