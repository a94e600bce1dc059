#include "common/validation/explanation/explained_share.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "common/statistics/distributions.h"
#include "common/statistics/multiple_tests.h"
#include "common/validation/compare/pixel_correlation.h"
#include "common/validation/verdict/levels.h"

namespace tandem {

namespace {

constexpr std::uint32_t least_block = 4, usual_block = 16;

// A pixel's variance is the mean of its 8x8 tile's: its own goes with its value, and weights must not.
Misfit::Scale misfit_at(const ImagePair& pair, std::uint32_t edge, std::uint32_t block, double both_correlations) {
    const SampledImage &a = pair.reference, &b = pair.candidate;
    const TileGrid tiles(a.width, a.height, edge == 1 ? standard_tile_edge / 2 : edge),
        blocks(a.width, a.height, block);
    const std::size_t count = tiles.size() * channel_count;
    std::vector<double> differences(count, 0.0), variances(count, 0.0), pixels(tiles.size(), 0.0);
    std::vector<std::uint32_t> block_of(tiles.size(), 0);
    for (std::size_t i = 0; i < a.pixels.size(); ++i) {
        const std::size_t pixel = i / channel_count, tile = tiles.tile_of_pixel()[pixel], c = i % channel_count;
        const PixelStatistics &x = a.pixels[i], &y = b.pixels[i];
        differences[tile * channel_count + c] += y.mean - x.mean;
        variances[tile * channel_count + c] += x.variance / x.count + y.variance / y.count;
        if (c == 0) pixels[tile] += 1.0;
        block_of[tile] = blocks.tile_of_pixel()[pixel];
    }
    std::array<double, channel_count> floors{};
    for (std::size_t i = 0; i < a.pixels.size(); ++i) floors[i % channel_count] += std::abs(a.pixels[i].mean);
    for (double& floor : floors) floor *= misfit_floor * channel_count / static_cast<double>(a.pixels.size());

    Misfit::Scale scale{edge, std::vector<double>(blocks.size(), 0.0)};
    const auto add = [&](std::size_t to, double difference, double variance, std::size_t c) {
        scale.blocks[to] += (difference * difference - variance) / (variance + floors[c] * floors[c] + 1e-300);
    };
    if (edge > 1) {
        for (std::size_t i = 0; i < count; ++i) {
            const double n = pixels[i / channel_count];
            add(block_of[i / channel_count], differences[i] / n, both_correlations * variances[i] / (n * n),
                i % channel_count);
        }
        return scale;
    }
    for (std::size_t i = 0; i < a.pixels.size(); ++i) {
        const std::size_t pixel = i / channel_count, tile = tiles.tile_of_pixel()[pixel], c = i % channel_count;
        add(blocks.tile_of_pixel()[pixel], b.pixels[i].mean - a.pixels[i].mean,
            variances[tile * channel_count + c] / pixels[tile], c);
    }
    return scale;
}

// What ties pixels together: filters of the mend's own, and what the sides say, but no more than this pair shows. For a
// difference that is not explained looks like noise that goes together.
double correlation_of(const ImagePair& pair) {
    const double said = std::max(pair.reference.correlation, pair.candidate.correlation);
    if (!(said > pair.tied)) return pair.tied;
    return std::clamp(neighbour_correlation(pair.reference, pair.candidate), pair.tied, said);
}

// Mean of both sides over the up to eight pixels around, the pixel itself left out: its own noise must not choose its
// class.
std::vector<double> surroundings(const ImagePair& pair) {
    const std::int64_t width = pair.reference.width, height = pair.reference.height;
    std::vector<double> result(pair.reference.pixels.size());
    for (std::int64_t y = 0; y < height; ++y)
        for (std::int64_t x = 0; x < width; ++x)
            for (std::size_t c = 0; c < channel_count; ++c) {
                double sum = 0.0, count = 0.0;
                for (std::int64_t v = std::max<std::int64_t>(0, y - 1); v <= std::min(height - 1, y + 1); ++v)
                    for (std::int64_t u = std::max<std::int64_t>(0, x - 1); u <= std::min(width - 1, x + 1); ++u) {
                        if (u == x && v == y) continue;
                        const auto i = static_cast<std::size_t>(v * width + u) * channel_count + c;
                        sum += pair.reference.pixels[i].mean + pair.candidate.pixels[i].mean;
                        count += 2.0;
                    }
                result[static_cast<std::size_t>(y * width + x) * channel_count + c] = count > 0.0 ? sum / count : 0.0;
            }
    return result;
}

// p of the classes of values, corrected for their number.
double p_of_values(const ImagePair& pair, double correlation, double negligible) {
    constexpr std::size_t classes = 16;
    const std::vector<double> around = surroundings(pair);
    const std::size_t pixels = around.size() / channel_count;
    const Scales scales = scales_of(pair.reference, pair.candidate, Margins{});
    std::vector<double> p_values;
    std::vector<std::size_t> order(pixels);
    for (std::size_t c = 0; c < channel_count; ++c) {
        for (std::size_t k = 0; k < pixels; ++k) order[k] = k * channel_count + c;
        std::ranges::sort(order, {}, [&](std::size_t i) { return around[i]; });
        for (std::size_t k = 0; k < classes; ++k) {
            MeanOfMeans a, b;
            for (std::size_t n = k * pixels / classes; n < (k + 1) * pixels / classes; ++n) {
                const PixelStatistics &x = pair.reference.pixels[order[n]], &y = pair.candidate.pixels[order[n]];
                a.add(x.mean, correlation * x.variance / x.count, x.count - 1.0);
                b.add(y.mean, correlation * y.variance / y.count, y.count - 1.0);
            }
            const MeanEstimate of_a = a.result();
            const double scale = std::max(of_a.mean, Margins{}.tile_floor * scales.image[c]);
            p_values.push_back(welch(of_a, b.result()).p_value(negligible * scale));
        }
    }
    return bonferroni(p_values);
}

}  // namespace

std::vector<std::uint32_t> misfit_edges(const ImagePair& pair) {
    std::vector<std::uint32_t> edges{1};
    for (const std::uint32_t edge : {standard_tile_edge / 2, standard_tile_edge, 2 * standard_tile_edge})
        if (edge <= std::min(pair.reference.width, pair.reference.height) / 2) edges.push_back(edge);
    return edges;
}

Misfit::Scale misfit_of(const ImagePair& pair, std::uint32_t edge) {
    const std::uint32_t side = std::min(pair.reference.width, pair.reference.height);
    const std::uint32_t block = std::clamp(side / 4, least_block, usual_block);
    return misfit_at(pair, edge, std::max(edge, block), edge == 1 ? 1.0 : correlation_of(pair));
}

Misfit misfit_of(const ImagePair& pair) {
    Misfit misfit;
    for (const std::uint32_t edge : misfit_edges(pair)) misfit.scales.push_back(misfit_of(pair, edge));
    return misfit;
}

ExplainedShare explained_share(const Misfit& before, const Misfit& after, double doubt, bool pixels_alone) {
    ExplainedShare best;
    const std::size_t scales = pixels_alone ? 1 : before.scales.size();
    const double level = doubt / static_cast<double>(scales);
    for (std::size_t s = 0; s < scales; ++s) {
        const std::vector<double>&x = before.scales[s].blocks, &y = after.scales[s].blocks;
        const double all_x = std::reduce(x.begin(), x.end()), all_y = std::reduce(y.begin(), y.end());
        const auto blocks = static_cast<double>(x.size());
        if (blocks < 3.0 || !(all_x > 0.0)) continue;
        SampleMoments without_one;
        bool sound = true;
        for (std::size_t i = 0; i < x.size(); ++i) {
            sound = sound && all_x - x[i] > 0.0;
            without_one.add(1.0 - (all_y - y[i]) / (all_x - x[i]));
        }
        if (!sound) continue;
        const double error = std::sqrt((blocks - 1.0) / blocks * without_one.squared_deviations);
        const double share = 1.0 - all_y / all_x;
        const double at_least = share - student_quantile(1.0 - level, blocks - 1.0) * error;
        if (at_least > best.at_least) best = {std::min(share, 1.0), at_least};
    }
    return best;
}

bool contradicted(const Misfit::Scale& before, const Misfit::Scale& after, double share, double doubt) {
    SampleMoments left;
    for (std::size_t i = 0; i < before.blocks.size(); ++i) left.add(after.blocks[i] - (1.0 - share) * before.blocks[i]);
    return left.count >= 3.0 &&
           left.mean > student_quantile(1.0 - doubt, left.count - 1.0) * std::sqrt(left.variance_of_mean());
}

double typical_difference(const ImagePair& pair) {
    const SampledImage &a = pair.reference, &b = pair.candidate;
    const TileGrid grid(a.width, a.height, standard_tile_edge);
    const double correlation = correlation_of(pair);
    std::vector<double> differences(grid.size() * channel_count, 0.0), variances = differences, means = differences;
    for (std::size_t i = 0; i < a.pixels.size(); ++i) {
        const PixelStatistics &x = a.pixels[i], &y = b.pixels[i];
        const std::size_t tile = grid.tile_of_pixel()[i / channel_count] * channel_count + i % channel_count;
        differences[tile] += y.mean - x.mean;
        variances[tile] += correlation * (x.variance / x.count + y.variance / y.count);
        means[tile] += std::max(x.mean, y.mean);
    }
    double squares = 0.0, scale = 0.0;
    for (std::size_t tile = 0; tile < means.size(); ++tile) {
        squares += differences[tile] * differences[tile] - variances[tile];
        scale += means[tile] * means[tile];
    }
    return squares > 0.0 && scale > 0.0 ? std::sqrt(squares / scale) : 0.0;
}

bool differ(const ImagePair& pair, const Criteria& declared, double tolerated, bool interpolated) {
    Criteria criteria = declared;
    for (double* negligible : {&criteria.negligible.image, &criteria.negligible.tile, &criteria.negligible.pixel})
        *negligible = std::min(*negligible, tolerated);
    const double correlation = correlation_of(pair);
    ImagePair tested = pair;
    tested.reference.correlation = tested.candidate.correlation = correlation;
    const Scales scales = scales_of(tested.reference, tested.candidate, criteria.margins);
    const Negligible& negligible = criteria.negligible;
    std::vector<double> p_values;
    for (const std::uint32_t edge : {0u, 2 * standard_tile_edge, standard_tile_edge, standard_tile_edge / 2})
        p_values.push_back(compare_regions("", tested.reference, tested.candidate, edge, scales,
            edge == 0 ? negligible.image : negligible.tile, criteria.margins.tile_floor, 0.5 * criteria.doubt)
                               .p);
    p_values.push_back(p_of_values(tested, correlation, negligible.tile));
    if (!interpolated) {
        FixedPixels none;  // what has no noise is held to what is negligible, as a fitted figure has an error
        none.fixed.assign(tested.reference.pixels.size(), false);
        p_values.push_back(compare_pixels(tested.reference, tested.candidate, none, scales, criteria).level.p);
    }
    return bonferroni(p_values) <= criteria.false_alarm;
}

}  // namespace tandem
