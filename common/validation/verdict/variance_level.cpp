// Compares the variance of one sample, candidate against reference. The same mean with three times the noise is a
// fault.
#include <algorithm>
#include <cmath>

#include "common/statistics/batch_tests.h"
#include "common/statistics/mean_tests.h"
#include "common/statistics/multiple_tests.h"
#include "common/validation/verdict/levels.h"

namespace tandem {

namespace {

std::vector<double> variances_over_batches(
    const std::vector<Batch>& batches, bool whole_image, std::size_t figure, double rounding) {
    std::vector<double> variances;
    for (const Batch& batch : batches) {
        const RegionFigures& figures = whole_image ? batch.image : batch.tiles;
        const double deviation = rounding * figures.means[figure];
        variances.push_back(figures.variances[figure] + deviation * deviation);
    }
    return variances;
}

// What the pixels' variances say of a region, whatever their distribution. Few batches may scatter by nothing: light
// that comes in equal rare hits has a batch variance in steps.
struct VarianceSums {
    double reference = 0.0, candidate = 0.0, squared_differences = 0.0;
    void add(double of_reference, double of_candidate) {
        reference += of_reference;
        candidate += of_candidate;
        squared_differences += (of_candidate - of_reference) * (of_candidate - of_reference);
    }
    // Differences of equal sides of as many samples have either sign. `correlation`: of pixels, as SampledImage's.
    [[nodiscard]] double p(double tolerated_ratio, double correlation) const {
        const double excess = std::max(candidate, reference) - tolerated_ratio * std::min(candidate, reference);
        if (!(excess > 0.0)) return 1.0;
        return symmetric_sum_tail(excess / std::sqrt(correlation * squared_differences));
    }
};

std::vector<VarianceSums> variance_sums(
    const SampledImage& reference, const SampledImage& candidate, const TileGrid& grid) {
    std::vector<VarianceSums> sums(grid.size() * channel_count);
    for (std::size_t pixel = 0; pixel < grid.tile_of_pixel().size(); ++pixel)
        for (std::size_t c = 0; c < channel_count; ++c)
            sums[grid.tile_of_pixel()[pixel] * channel_count + c].add(
                reference.pixels[pixel * channel_count + c].variance,
                candidate.pixels[pixel * channel_count + c].variance);
    return sums;
}

}  // namespace

LevelResult compare_variances(const std::string& name, const SampledImage& reference, const SampledImage& candidate,
    bool whole_image, double tolerated_ratio, double rounding, double alpha_each_side) {
    LevelResult level;
    level.name = name;
    level.test = "log variances of batches and distribution-free bound, Bonferroni";
    const TileGrid grid(reference.width, reference.height, whole_image ? 0 : standard_tile_edge);
    level.columns = grid.columns();
    level.rows = grid.rows();
    if (reference.batches.size() < 2 || candidate.batches.size() < 2) return level;
    const std::vector<VarianceSums> sums = variance_sums(reference, candidate, grid);
    const double correlation = std::max(reference.correlation, candidate.correlation);
    std::vector<double> p_values;
    for (std::size_t i = 0; i < grid.size() * channel_count; ++i) {
        const VarianceRatio ratio =
            variance_ratio_test(variances_over_batches(reference.batches, whole_image, i, rounding),
                variances_over_batches(candidate.batches, whole_image, i, rounding), tolerated_ratio, alpha_each_side);
        RegionComparison region;
        region.region = grid.rectangle(i / channel_count);
        region.channel = static_cast<std::uint32_t>(i % channel_count);
        region.relative = ratio.ratio - 1.0;
        region.relative_low = ratio.interval.low - 1.0;
        region.relative_high = ratio.interval.high - 1.0;
        region.statistic = ratio.statistic;
        region.dof = ratio.dof;
        region.p = std::max(ratio.p, sums[i].p(tolerated_ratio, correlation));
        p_values.push_back(region.p);
        level.regions.push_back(region);
    }
    level.tests = p_values.size();
    level.p = bonferroni(p_values);
    level.worst = *std::ranges::min_element(level.regions, {}, &RegionComparison::p);
    return level;
}

}  // namespace tandem
