// Parts of an image in which the error may be large although the mean error is small, found from the reference alone.
// `dark` is the darkest quarter of the pixels, `bright` the brightest tenth. `edges` is the tenth with the greatest
// steps of luminance to the right and lower neighbour, relative to the luminance there.
#pragma once

#include "common/cost/analysis.h"

namespace tandem {

inline constexpr double dark_share = 0.25, bright_share = 0.1, edges_share = 0.1;

struct Region {
    std::string name;
    std::vector<std::size_t> pixels;
};
using Regions = std::vector<Region>;

// None for fewer than 64 pixels, of which no part says anything.
[[nodiscard]] Regions regions_of(const CostReference& reference, std::size_t width);

// At the greatest sample count, over all replicates; the reference's own noise is taken out.
[[nodiscard]] std::vector<RegionError> region_errors(
    const ArmTrials& trials, const CostReference& reference, const Regions& regions);

// From all replicates of the trials at the greatest sample count. Nothing where a tile is the image.
[[nodiscard]] std::optional<TileBias> most_biased_tile(
    const ArmTrials& trials, const CostReference& reference, std::uint32_t width);

// Fills cost_ratio from the variances of both and the ratio of their times. 1 where either has none.
void compare_regions(const ArmFigures& baseline, ArmFigures& arm);

}  // namespace tandem
