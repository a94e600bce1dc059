// Which pixels see a place on the film, and with what weight (MODEL.md section 4.1). The weight is the filter's value,
// per square pixel, so it goes with densities over the film in pixels.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <span>

#include "common/render/renderer.h"

namespace tandem::cpu {

struct PixelShare {
    std::uint32_t index = 0;  // column or row
    double value = 0.0;       // of the filter along this axis
};

// Along one axis; `place` is in pixels from the film's rim, and may lie beyond it.
class PixelShares {
public:
    PixelShares(PixelFilter filter, double place, std::uint32_t size) {
        if (filter == PixelFilter::box) {
            if (place >= 0.0 && place < size) add(place, 1.0);
            return;
        }
        const double reach = filter == PixelFilter::tent ? 1.0 : gaussian_reach, middle = place - 0.5;
        const double last = std::min(size - 1.0, std::floor(middle + reach));
        for (double pixel = std::max(0.0, std::ceil(middle - reach)); pixel <= last; ++pixel)
            add(pixel, value_at(filter, middle - pixel));
    }
    [[nodiscard]] std::span<const PixelShare> all() const& { return std::span(shares_).first(count_); }
    void all() const&& = delete;  // it would outlive what it points to

private:
    static constexpr double gaussian_reach = 1.5;

    static double value_at(PixelFilter filter, double t) {
        if (filter == PixelFilter::tent) return 1.0 - std::abs(t);
        const double whole = std::erf(gaussian_reach * std::numbers::sqrt2);  // of a standard deviation of 1/2
        return std::exp(-2.0 * t * t) * std::numbers::sqrt2 * std::numbers::inv_sqrtpi / whole;
    }
    void add(double pixel, double value) { shares_.at(count_++) = {static_cast<std::uint32_t>(pixel), value}; }

    std::array<PixelShare, 4> shares_{};  // a reach of 1.5 has four where a place is at a pixel's edge
    std::size_t count_ = 0;
};

}  // namespace tandem::cpu
