#include "common/exercise/mark_picture.h"

#include <algorithm>
#include <cmath>
#include <glm/vec3.hpp>

namespace tandem {

namespace {

constexpr std::uint32_t panel_side = 192, gap = 6;  // pixels

class Panels {
public:
    explicit Panels(const MarkPicture& picture) : picture_(picture) {
        const auto [least, most] = std::ranges::minmax(picture.right);
        // Wrong values stretch the range, but not beyond three times that of the right ones.
        const double range = most > least ? most - least : std::max(1.0, std::abs(most));
        double low = least, high = most;
        for (const double value : picture.yours)
            if (std::isfinite(value)) low = std::min(low, value), high = std::max(high, value);
        least_ = std::max(low, least - range);
        range_ = std::max(std::min(high, most + range) - least_, range);
    }

    // Panel 0 is right, 1 yours, 2 the difference.
    [[nodiscard]] glm::dvec3 colour(std::uint32_t panel, std::size_t i) const {
        const double right = picture_.right[i], yours = picture_.yours[i];
        if (panel > 0 && !std::isfinite(yours)) return {1.0, 0.0, 1.0};
        if (panel < 2) return glm::dvec3(share((panel == 0 ? right : yours) - least_));
        const double off = share(std::abs(yours - right));
        return yours > right ? glm::dvec3(1.0, 1.0 - off, 1.0 - off) : glm::dvec3(1.0 - off, 1.0 - off, 1.0);
    }

private:
    [[nodiscard]] double share(double part) const { return std::clamp(part / range_, 0.0, 1.0); }

    const MarkPicture& picture_;
    double least_, range_;
};

}  // namespace

Image image_of(const MarkPicture& picture) {
    const Panels panels(picture);
    Image image;
    image.width = 3 * panel_side + 2 * gap;
    image.height = panel_side;
    image.channels = {"R", "G", "B"};
    for (std::uint32_t y = 0; y < image.height; ++y)
        for (std::uint32_t x = 0; x < image.width; ++x) {
            const std::uint32_t panel = x / (panel_side + gap), within = x % (panel_side + gap);
            glm::dvec3 colour(0.2);
            if (within < panel_side)
                colour = panels.colour(panel,
                    std::size_t{y * picture.side / panel_side} * picture.side + within * picture.side / panel_side);
            for (int c = 0; c < 3; ++c) image.pixels.push_back(static_cast<float>(colour[c]));
        }
    return image;
}

}  // namespace tandem
