#include "common/validation/explanation/tone_fit.h"

#include <algorithm>
#include <cmath>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <glm/vec3.hpp>

#include "common/statistics/sample_moments.h"
#include "common/validation/explanation/explained_share.h"

namespace tandem {

namespace {

constexpr std::uint32_t tile_edge = 8;
constexpr std::size_t enough_tiles = 1024;  // of a large image

struct TileMean {
    double a = 0.0, b = 0.0, variance_a = 0.0, variance_b = 0.0;
    double weight = 0.0;
    std::size_t block = 0;
};

// [channel]: the tiles of each, with 1/(V + f^2).
using TileMeans = std::array<std::vector<TileMean>, channel_count>;

TileMeans tile_means(const SampledImage& a, const SampledImage& b) {
    const TileGrid grid(a.width, a.height, tile_edge), blocks(a.width, a.height, 2 * tile_edge);
    const std::size_t stride = (grid.size() + enough_tiles - 1) / enough_tiles;
    TileMeans result;
    for (std::size_t c = 0; c < channel_count; ++c) {
        double mean = 0.0;
        for (std::size_t tile = 0; tile < grid.size(); tile += stride) {
            const Rectangle r = grid.rectangle(tile);
            const double n = static_cast<double>(r.x1 - r.x0) * static_cast<double>(r.y1 - r.y0);
            TileMean one;
            for (std::uint32_t y = r.y0; y < r.y1; ++y)
                for (std::uint32_t x = r.x0; x < r.x1; ++x) {
                    const std::size_t i = (std::size_t{y} * a.width + x) * channel_count + c;
                    const PixelStatistics &p = a.pixels[i], &q = b.pixels[i];
                    one.a += p.mean / n;
                    one.b += q.mean / n;
                    one.variance_a += a.correlation * p.variance / p.count / (n * n);
                    one.variance_b += b.correlation * q.variance / q.count / (n * n);
                }
            one.block = blocks.tile_of_pixel()[std::size_t{r.y0} * a.width + r.x0];
            mean += std::abs(one.a);
            result[c].push_back(one);
        }
        const double floor = misfit_floor * mean / static_cast<double>(result[c].size());
        for (TileMean& one : result[c]) one.weight = 1.0 / (one.variance_a + one.variance_b + floor * floor + 1e-300);
    }
    return result;
}

struct Products {
    double ab = 0.0, aa = 0.0;
    void add(const TileMean& t) {
        ab += t.weight * t.a * t.b;
        aa += t.weight * (t.a * t.a - t.variance_a);
    }
    [[nodiscard]] double ratio() const { return aa > 0.0 ? ab / aa : 1.0; }
};

Factor factor_of(const TileMeans& tiles, std::size_t first, std::size_t last) {
    Products all;
    std::vector<Products> blocks;
    for (std::size_t c = first; c < last; ++c)
        for (const TileMean& tile : tiles[c]) {
            if (blocks.size() <= tile.block) blocks.resize(tile.block + 1);
            all.add(tile);
            blocks[tile.block].add(tile);
        }
    SampleMoments without_one;
    for (const Products& block : blocks)
        if (block.aa != 0.0 || block.ab != 0.0) without_one.add(Products{all.ab - block.ab, all.aa - block.aa}.ratio());
    const double error =
        without_one.count < 2.0
            ? 0.0
            : std::sqrt((without_one.count - 1.0) / without_one.count * without_one.squared_deviations);
    return {all.ratio(), error};
}

// Mean square of the tiles' differences over what their noise and the floor allow, with the best factor on a.
struct Match {
    double misfit = 0.0, factor = 1.0;
};
Match match_of(const SampledImage& a, const SampledImage& b, bool free_factor) {
    const TileMeans tiles = tile_means(a, b);
    Match match;
    if (free_factor) match.factor = factor_of(tiles, 0, channel_count).value;
    double count = 0.0;
    for (const std::vector<TileMean>& channel : tiles)
        for (const TileMean& t : channel) {
            const double difference = t.b - match.factor * t.a;
            match.misfit += t.weight * difference * difference;
            count += 1.0;
        }
    match.misfit /= count;
    return match;
}

// Every so many bands of tiles of a large image: a search looks at all of its pixels a hundred times.
ImagePair thinned(const ImagePair& pair) {
    constexpr std::size_t enough = std::size_t{1} << 15;
    const std::size_t stride = pair.reference.pixels.size() / channel_count / enough + 1;
    if (stride == 1) return pair;
    const auto bands_of = [&](const SampledImage& image) {
        SampledImage result = image;
        result.pixels.clear();
        const std::size_t row = std::size_t{image.width} * channel_count;
        for (std::size_t y = 0; y < image.height; ++y)
            if (y / tile_edge % stride == 0)
                result.pixels.insert(result.pixels.end(), image.pixels.begin() + static_cast<std::ptrdiff_t>(y * row),
                    image.pixels.begin() + static_cast<std::ptrdiff_t>((y + 1) * row));
        result.height = static_cast<std::uint32_t>(result.pixels.size() / row);
        return result;
    };
    return {bands_of(pair.reference), bands_of(pair.candidate)};
}

struct Candidate {
    double exponent = 1.0;
    Match match;
};

// The exponent in [1/4, 4] for which match(exponent) is least: a row of 17, then golden sections about the best.
template <class Try>
Candidate least(const Try& match) {
    constexpr double widest = 1.3862943611198906;  // ln 4
    constexpr int steps = 8;
    const auto at = [&](double logarithm) { return Candidate{std::exp(logarithm), match(std::exp(logarithm))}; };
    Candidate best = at(0.0);
    for (int k = -steps; k <= steps; ++k) {
        const Candidate one = at(widest * k / steps);
        if (one.match.misfit < best.match.misfit) best = one;
    }
    double low = std::log(best.exponent) - widest / steps, high = std::log(best.exponent) + widest / steps;
    constexpr double golden = 0.6180339887498949;
    Candidate left = at(high - golden * (high - low)), right = at(low + golden * (high - low));
    while (high - low > 3e-5) {
        if (left.match.misfit < right.match.misfit) {
            high = std::log(right.exponent);
            right = left;
            left = at(high - golden * (high - low));
        } else {
            low = std::log(left.exponent);
            left = right;
            right = at(low + golden * (high - low));
        }
    }
    return left.match.misfit < right.match.misfit ? left : right;
}

}  // namespace

Factor fit_factor(const ImagePair& pair) {
    return factor_of(tile_means(pair.reference, pair.candidate), 0, channel_count);
}

Factor fit_factor(const ImagePair& pair, std::uint32_t channel) {
    return factor_of(tile_means(pair.reference, pair.candidate), channel, channel + 1);
}

double fit_offset(const ImagePair& pair) {
    double sum = 0.0, weights = 0.0;
    for (const std::vector<TileMean>& channel : tile_means(pair.reference, pair.candidate))
        for (const TileMean& t : channel) {
            sum += t.weight * (t.b - t.a);
            weights += t.weight;
        }
    return sum / weights;
}

Power fit_power(const ImagePair& pair, bool free_factor) {
    const ImagePair some = thinned(pair);
    const Candidate on_candidate = least([&](double exponent) {
        return match_of(some.reference, to_power(some.candidate, exponent, 1.0), free_factor);
    });
    const Candidate on_reference = least([&](double exponent) {
        return match_of(to_power(some.reference, exponent, 1.0), some.candidate, free_factor);
    });
    Power power;
    if (on_candidate.match.misfit < on_reference.match.misfit) {
        // candidate^p = k reference
        power.exponent = 1.0 / on_candidate.exponent;
        power.factor = std::pow(on_candidate.match.factor, power.exponent);
        power.mended = {
            pair.reference, to_power(pair.candidate, on_candidate.exponent, 1.0 / on_candidate.match.factor)};
    } else {
        power.exponent = on_reference.exponent;
        power.factor = on_reference.match.factor;
        power.mended = {to_power(pair.reference, power.exponent, power.factor), pair.candidate};
    }
    return power;
}

Mixing fit_mixing(const ImagePair& pair) {
    const TileMeans tiles = tile_means(pair.reference, pair.candidate);
    Mixing mixing;
    for (std::size_t r = 0; r < channel_count; ++r) {
        glm::dmat3 normal(0.0);
        glm::dvec3 right(0.0);
        for (std::size_t k = 0; k < tiles[r].size(); ++k) {
            const glm::dvec3 a(tiles[0][k].a, tiles[1][k].a, tiles[2][k].a);
            const double weight = tiles[r][k].weight;
            normal += weight * glm::outerProduct(a, a);
            right += weight * tiles[r][k].b * a;
        }
        const bool solvable = std::abs(glm::determinant(normal)) > 1e-9 * normal[0][0] * normal[1][1] * normal[2][2];
        const glm::dvec3 row = solvable ? glm::inverse(normal) * right : glm::dvec3(0.0);
        for (std::size_t c = 0; c < channel_count; ++c) mixing.rows[r][c] = row[static_cast<glm::length_t>(c)];
    }
    mixing.mended = pair;
    for (std::size_t i = 0; i < pair.reference.pixels.size(); i += channel_count)
        for (std::size_t r = 0; r < channel_count; ++r) {
            // Channels of a pixel share their paths, so that deviations add, not variances.
            double mean = 0.0, deviation = 0.0;
            for (std::size_t c = 0; c < channel_count; ++c) {
                const PixelStatistics& from = pair.reference.pixels[i + c];
                mean += mixing.rows[r][c] * from.mean;
                deviation += std::abs(mixing.rows[r][c]) * std::sqrt(from.variance);
            }
            mixing.mended.reference.pixels[i + r].mean = mean;
            mixing.mended.reference.pixels[i + r].variance = deviation * deviation;
        }
    return mixing;
}

}  // namespace tandem
