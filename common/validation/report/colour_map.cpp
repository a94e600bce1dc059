#include "common/validation/report/colour_map.h"

#include <algorithm>
#include <cmath>
#include <span>

namespace tandem {

namespace {

constexpr Colour hex(unsigned rgb) {
    return {static_cast<double>(rgb >> 16) / 255.0, static_cast<double>(rgb >> 8 & 255u) / 255.0,
        static_cast<double>(rgb & 255u) / 255.0};
}

Colour between(std::span<const Colour> points, double t) {
    const double place = std::clamp(t, 0.0, 1.0) * static_cast<double>(points.size() - 1);
    const std::size_t below = std::min(static_cast<std::size_t>(place), points.size() - 2);
    const double part = place - static_cast<double>(below);
    Colour colour{};
    for (std::size_t c = 0; c < 3; ++c) colour[c] = (1.0 - part) * points[below][c] + part * points[below + 1][c];
    return colour;
}

// Inverse of the sRGB transfer function (IEC 61966-2-1).
double to_linear(double srgb) { return srgb <= 0.04045 ? srgb / 12.92 : std::pow((srgb + 0.055) / 1.055, 2.4); }

}  // namespace

Colour diverging_colour(double t) {
    static constexpr std::array points{hex(0x2166ac), hex(0xffffff), hex(0xb2182b)};
    return between(points, 0.5 + 0.5 * t);
}

Colour sequential_colour(double t) {
    static constexpr std::array points{hex(0xffffff), hex(0xfcbba1), hex(0xfb6a4a), hex(0xcb181d), hex(0x67000d)};
    return between(points, t);
}

Image false_colour_image(std::uint32_t width, std::uint32_t height, const std::vector<double>& figures, ColourMap map) {
    Image image;
    image.width = width;
    image.height = height;
    image.channels = {"R", "G", "B"};
    image.pixels.reserve(figures.size() * 3);
    for (const double figure : figures)
        for (const double component : map(figure)) image.pixels.push_back(static_cast<float>(to_linear(component)));
    return image;
}

}  // namespace tandem
