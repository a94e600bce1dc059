// Compares the variance of one sample, candidate against reference. The same mean with three times the noise is a
// fault.
#include <algorithm>
#include <cmath>

#include "common/statistics/batch_tests.h"
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

}  // namespace

LevelResult compare_variances(const std::string& name, const SampledImage& reference, const SampledImage& candidate,
    bool whole_image, double tolerated_ratio, double rounding, double alpha_each_side) {
    LevelResult level;
    level.name = name;
    level.test = "log variances of batches, Bonferroni";
    const TileGrid grid(reference.width, reference.height, whole_image ? 0 : standard_tile_edge);
    level.columns = grid.columns();
    level.rows = grid.rows();
    if (reference.batches.size() < 2 || candidate.batches.size() < 2) return level;
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
        region.p = ratio.p;
        p_values.push_back(ratio.p);
        level.regions.push_back(region);
    }
    level.tests = p_values.size();
    level.p = bonferroni(p_values);
    level.worst = *std::ranges::min_element(level.regions, {}, &RegionComparison::p);
    return level;
}

}  // namespace tandem
