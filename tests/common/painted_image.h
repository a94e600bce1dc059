// Images of a picture without symmetries, with noise of known variance, for tests of what a difference looks like.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <random>
#include <string>

#include "common/validation/compare/compare.h"

namespace tandem::test {

using Colour3 = std::array<double, 3>;

// Light at (x, y) of the unit square: a bright lamp, a red and a blue wall, a ball, a chequered floor, a dark corner.
inline Colour3 painted(double x, double y) {
    const auto times = [](Colour3 c, double f) { return Colour3{c[0] * f, c[1] * f, c[2] * f}; };
    if (x > 0.55 && x < 0.8 && y > 0.08 && y < 0.16) return {4.0, 3.4, 2.5};  // the lamp
    const double dx = x - 0.36, dy = y - 0.62, r2 = (dx * dx + dy * dy) / (0.17 * 0.17);
    if (r2 < 1.0) return times({0.25, 0.7, 0.35}, 0.15 + 0.85 * std::sqrt(1.0 - r2) * (1.2 - y));
    if (y > 0.75) {
        const bool light = (static_cast<int>(x * 9.0) + static_cast<int>(y * 13.0)) % 2 == 0;
        return times(light ? Colour3{0.8, 0.75, 0.6} : Colour3{0.12, 0.1, 0.14}, 0.4 + 0.6 * x);
    }
    if (x < 0.2) return times({0.7, 0.12, 0.08}, 0.2 + y);
    if (x > 0.88) return times({0.08, 0.15, 0.6}, 1.1 - 0.9 * y);
    return times({0.55, 0.5, 0.42}, 0.15 + 0.8 * x * (1.0 - y) + 0.1 * y);
}

using Picture = std::function<Colour3(double, double)>;  // over the unit square
using Change = std::function<void(std::vector<Colour3>& pixels, std::uint32_t size)>;

struct Painting {
    Picture picture = painted;
    Change afterwards = [](std::vector<Colour3>&, std::uint32_t) {};  // changes of the finished image, noise and all
    std::uint32_t size = 96;
    double noise = 0.02;  // relative deviation of a pixel's mean
    std::uint32_t samples = 64;
};

inline NamedImage paint(const Painting& painting, std::uint64_t seed) {
    std::mt19937_64 engine(seed);
    std::normal_distribution<double> normal;
    const std::uint32_t size = painting.size;
    constexpr std::uint32_t grid = 4;  // the box filter of a pixel
    std::vector<Colour3> pixels;
    for (std::uint32_t y = 0; y < size; ++y)
        for (std::uint32_t x = 0; x < size; ++x) {
            Colour3 mean{};
            for (std::uint32_t k = 0; k < grid * grid; ++k) {
                const Colour3 light =
                    painting.picture((x + (k % grid + 0.5) / grid) / size, (y + (k / grid + 0.5) / grid) / size);
                for (std::size_t c = 0; c < 3; ++c) mean[c] += light[c] / (grid * grid);
            }
            const double noise = std::max(0.0, 1.0 + painting.noise * normal(engine));
            for (double& channel : mean) channel *= noise;
            pixels.push_back(mean);
        }
    painting.afterwards(pixels, size);
    Image image;
    image.width = image.height = size;
    image.channels = {"R", "G", "B", "variance.R", "variance.G", "variance.B", "count"};
    for (const Colour3& pixel : pixels) {
        for (const double channel : pixel) image.pixels.push_back(static_cast<float>(channel));
        for (const double channel : pixel) {
            const double deviation = painting.noise * channel;
            image.pixels.push_back(static_cast<float>(deviation * deviation * painting.samples));
        }
        image.pixels.push_back(static_cast<float>(painting.samples));
    }
    return {"painting " + std::to_string(seed), image};
}

}  // namespace tandem::test
