#include "common/validation/compare/pixel_correlation.h"

#include <algorithm>
#include <cmath>

namespace tandem {

namespace {

constexpr std::int64_t farthest = 7;  // ring at which neighbours are taken to be independent
constexpr std::uint32_t least_side = 32;
constexpr std::size_t enough_tiles = 1024;  // a quarter of a million pixels: rho is known to 0.001

// Candidate - reference less a common factor of their mean, and the variances of the difference.
struct Differences {
    std::vector<double> value, variance;  // [(y * width + x) * 3 + channel]
};

Differences differences_of(const SampledImage& a, const SampledImage& b) {
    Differences result;
    double products = 0.0, squares = 0.0;
    for (std::size_t i = 0; i < a.pixels.size(); ++i) {
        const PixelStatistics &x = a.pixels[i], &y = b.pixels[i];
        result.value.push_back(y.mean - x.mean);
        result.variance.push_back(x.variance / x.count + y.variance / y.count);
        const double middle = 0.5 * (x.mean + y.mean);
        products += middle * result.value.back();
        squares += middle * middle;
    }
    const double factor = squares > 0.0 ? products / squares : 0.0;
    for (std::size_t i = 0; i < a.pixels.size(); ++i)
        result.value[i] -= factor * 0.5 * (a.pixels[i].mean + b.pixels[i].mean);
    return result;
}

// For each ring: sum of (difference of z)^2/2 over pairs of pixels, a channel each, and how many.
struct Rings {
    std::array<double, farthest + 1> squares{}, pairs{};
};

void add_tile(Rings& rings, const Differences& differences, std::size_t row, const Rectangle& tile, std::size_t c) {
    const auto at = [&](std::int64_t x, std::int64_t y) {
        return static_cast<std::size_t>(y) * row + static_cast<std::size_t>(x) * channel_count + c;
    };
    const std::int64_t x0 = tile.x0, x1 = tile.x1, y0 = tile.y0, y1 = tile.y1;
    double variance = 0.0;
    for (std::int64_t y = y0; y < y1; ++y)
        for (std::int64_t x = x0; x < x1; ++x) variance += differences.variance[at(x, y)];
    variance /= static_cast<double>((x1 - x0) * (y1 - y0));
    if (!(variance > 0.0)) return;
    // Each pair once: the second pixel is in a later row, or to the right in the same one.
    for (std::int64_t dy = 0; dy <= farthest; ++dy)
        for (std::int64_t dx = dy == 0 ? 1 : -farthest; dx <= farthest; ++dx) {
            double squares = 0.0;
            for (std::int64_t y = y0; y + dy < y1; ++y)
                for (std::int64_t x = std::max(x0, x0 - dx); x < std::min(x1, x1 - dx); ++x) {
                    const double step = differences.value[at(x + dx, y + dy)] - differences.value[at(x, y)];
                    squares += step * step;
                }
            const auto ring = static_cast<std::size_t>(std::max(std::abs(dx), dy));
            rings.squares[ring] += 0.5 * squares / variance;
            rings.pairs[ring] += static_cast<double>(
                std::max<std::int64_t>(0, x1 - x0 - std::abs(dx)) * std::max<std::int64_t>(0, y1 - y0 - dy));
        }
}

}  // namespace

double neighbour_correlation(const SampledImage& reference, const SampledImage& candidate) {
    if (std::min(reference.width, reference.height) < least_side) return 1.0;
    const Differences differences = differences_of(reference, candidate);
    const TileGrid grid(reference.width, reference.height, standard_tile_edge);
    const std::size_t stride = (grid.size() + enough_tiles - 1) / enough_tiles;
    const std::size_t row = std::size_t{reference.width} * channel_count;
    Rings rings;
    for (std::size_t tile = 0; tile < grid.size(); tile += stride)
        for (std::size_t c = 0; c < channel_count; ++c) add_tile(rings, differences, row, grid.rectangle(tile), c);
    // In units of the variance g is 1 without correlation. What exceeds that is a difference, and no noise.
    const double far = std::min(1.0, rings.squares[farthest] / std::max(1.0, rings.pairs[farthest]));
    if (!(far > 0.0)) return 1.0;
    double factor = 1.0;
    for (std::size_t ring = 1; ring < farthest; ++ring) {
        const double correlation = 1.0 - rings.squares[ring] / rings.pairs[ring] / far;
        // Channels go together, so they count as one.
        if (!(correlation > 2.0 / std::sqrt(rings.pairs[ring] / channel_count))) break;
        factor += 8.0 * static_cast<double>(ring) * correlation;
    }
    return factor;
}

}  // namespace tandem
