#include "common/cost/regions.h"

#include <algorithm>
#include <cmath>
#include <numeric>

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
        double square = 0.0, mean = 0.0;
        for (const std::size_t pixel : region.pixels)
            for (std::size_t i = channel_count * pixel; i < channel_count * (pixel + 1); ++i) {
                const double half = reference.half_difference[i];
                square += trials.sum_of_squares[i] / replicates - half * half;
                mean += reference.mean[i];
            }
        const auto count = static_cast<double>(channel_count * region.pixels.size());
        const double pixels = static_cast<double>(reference.mean.size()) / channel_count;
        RegionError error;
        error.name = region.name;
        error.share = static_cast<double>(region.pixels.size()) / pixels;
        error.rmse = mean > 0.0 ? std::sqrt(std::max(0.0, square / count)) / (mean / count) : 0.0;
        errors.push_back(error);
    }
    return errors;
}

void compare_regions(const ArmFigures& baseline, ArmFigures& arm) {
    // A sample's variance: the error squared times the samples it took.
    const auto variance = [](const ArmFigures& one, std::size_t region) {
        const double rmse = one.regions[region].rmse;
        return rmse * rmse * static_cast<double>(one.points.back().samples);
    };
    for (std::size_t i = 0; i < arm.regions.size() && i < baseline.regions.size(); ++i) {
        const double own = variance(arm, i), other = variance(baseline, i);
        if (own > 0.0 && other > 0.0) arm.regions[i].cost_ratio = own / other * arm.time_ratio.value;
    }
}

}  // namespace tandem
