#include "common/cost/regions.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "common/statistics/distributions.h"
#include "common/validation/verdict/sampled_image.h"
#include "common/validation/verdict/tile_grid.h"

namespace tandem {

namespace {

double luminance(const PixelValues& image, std::size_t pixel) {
    return 0.2126 * image[3 * pixel] + 0.7152 * image[3 * pixel + 1] + 0.0722 * image[3 * pixel + 2];
}

// So many pixels that come first by `key`, ascending.
Region first_by(std::string name, const std::vector<double>& key, double share) {
    std::vector<std::size_t> order(key.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::ranges::stable_sort(order, {}, [&](std::size_t pixel) { return key[pixel]; });
    order.resize(static_cast<std::size_t>(share * static_cast<double>(key.size())));
    return {std::move(name), std::move(order)};
}

}  // namespace

Regions regions_of(const CostReference& reference, std::size_t width) {
    constexpr std::size_t fewest = 64;
    const std::size_t count = reference.mean.size() / channel_count;
    if (count < fewest || width == 0) return {};
    std::vector<double> level(count), negated(count), step(count, 0.0);
    for (std::size_t i = 0; i < count; ++i) {
        level[i] = luminance(reference.mean, i);
        negated[i] = -level[i];
    }
    const double little = 1e-3 * std::accumulate(level.begin(), level.end(), 0.0) / static_cast<double>(count);
    for (std::size_t i = 0; i < count; ++i) {
        const auto relative = [&](std::size_t other) {
            return std::abs(level[i] - level[other]) / (level[i] + level[other] + little);
        };
        if ((i + 1) % width != 0) step[i] = -relative(i + 1);
        if (i + width < count) step[i] = std::min(step[i], -relative(i + width));
    }
    return {first_by("dark", level, dark_share), first_by("bright", negated, bright_share),
        first_by("edges", step, edges_share)};
}

std::vector<RegionError> region_errors(
    const ArmTrials& trials, const CostReference& reference, const Regions& regions) {
    std::vector<RegionError> errors;
    const auto replicates = static_cast<double>(trials.replicates.size());
    for (const Region& region : regions) {
        double square = 0.0, mean = 0.0, variance = 0.0;
        for (const std::size_t pixel : region.pixels)
            for (std::size_t i = channel_count * pixel; i < channel_count * (pixel + 1); ++i) {
                const double half = reference.half_difference[i];
                square += trials.sum_of_squares[i] / replicates - half * half;
                variance += between_replicates(trials, i);
                mean += reference.mean[i];
            }
        const auto count = static_cast<double>(channel_count * region.pixels.size());
        const double pixels = static_cast<double>(reference.mean.size()) / channel_count;
        RegionError error;
        error.name = region.name;
        error.share = static_cast<double>(region.pixels.size()) / pixels;
        error.rmse = mean > 0.0 ? std::sqrt(std::max(0.0, square / count)) / (mean / count) : 0.0;
        error.variance = mean > 0.0 ? variance / count / (mean / count * mean / count) : 0.0;
        errors.push_back(error);
    }
    return errors;
}

std::optional<TileBias> most_biased_tile(const ArmTrials& trials, const CostReference& reference, std::uint32_t width) {
    const std::size_t pixels = reference.mean.size() / channel_count;
    if (width == 0 || pixels % width != 0) return std::nullopt;
    const TileGrid grid(width, static_cast<std::uint32_t>(pixels / width), standard_tile_edge);
    if (grid.size() < 2) return std::nullopt;
    struct Sums {
        double difference = 0.0, mean = 0.0, variance = 0.0, values = 0.0;
    };
    std::vector<Sums> tiles(grid.size());
    const auto r = static_cast<double>(trials.replicates.size());
    for (std::size_t pixel = 0; pixel < pixels; ++pixel) {
        Sums& tile = tiles[grid.tile_of_pixel()[pixel]];
        double deviation = 0.0;  // the channels of a pixel share their paths: their deviations add up
        for (std::size_t i = channel_count * pixel; i < channel_count * (pixel + 1); ++i) {
            tile.difference += trials.sum[i] / r;
            tile.mean += reference.mean[i];
            tile.values += 1.0;
            deviation += std::sqrt(between_replicates(trials, i) / r + 0.5 * reference.half_variance[i]);
        }
        tile.variance += deviation * deviation;
    }
    constexpr double least_share = 0.01, level = 0.05;  // of the image's mean; of the interval
    const auto count = static_cast<double>(grid.size());
    const double least = least_share * reference.image_mean();
    const double quantile = normal_quantile(1.0 - 0.5 * level / count);
    TileBias worst;
    double greatest = -1.0;
    for (std::size_t i = 0; i < tiles.size(); ++i) {
        const Sums& tile = tiles[i];
        const double error = std::sqrt(tile.variance);
        const double z = error > 0.0 ? std::abs(tile.difference) / error : 0.0;
        if (z <= greatest) continue;
        greatest = z;
        const double scale = 1.0 / (tile.values * std::max(least, tile.mean / tile.values));
        const Rectangle place = grid.rectangle(i);
        worst.x = place.x0;
        worst.y = place.y0;
        worst.relative = {scale * tile.difference, scale * (tile.difference - quantile * error),
            scale * (tile.difference + quantile * error)};
        worst.p = std::min(1.0, 2.0 * count * normal_upper_tail(z));
    }
    return worst;
}

void compare_regions(const ArmFigures& baseline, ArmFigures& arm) {
    // A sample's variance.
    const auto variance = [](const ArmFigures& one, std::size_t region) {
        const double found = one.regions[region].variance;
        return found < no_variance ? 0.0 : found * static_cast<double>(one.points.back().samples);
    };
    for (std::size_t i = 0; i < arm.regions.size() && i < baseline.regions.size(); ++i) {
        const double own = variance(arm, i), other = variance(baseline, i);
        if (own > 0.0 && other > 0.0) arm.regions[i].cost_ratio = own / other * arm.time_ratio.value;
    }
}

}  // namespace tandem
