// How much of the difference of two images a mend takes away, and whether what it leaves is a difference still.
#pragma once

#include "common/validation/explanation/image_pair.h"
#include "common/validation/verdict/criteria.h"

namespace tandem {

// Squared differences beyond noise, summed in blocks, at several scales: of pixels and of tiles' means. Each term is
// (d^2 - V)/(V + f^2), d the difference, V the variance of its noise and f a hundredth of the channel's mean, so that
// where there is no noise not the brightest places decide alone.
struct Misfit {
    struct Scale {
        std::uint32_t edge = 1;      // of the tiles whose means are compared, pixels
        std::vector<double> blocks;  // [block]
    };
    std::vector<Scale> scales;
};
[[nodiscard]] std::vector<std::uint32_t> misfit_edges(const ImagePair& pair);  // the scales, pixels first
[[nodiscard]] Misfit::Scale misfit_of(const ImagePair& pair, std::uint32_t edge);
[[nodiscard]] Misfit misfit_of(const ImagePair& pair);

// 1 - after/before, of all blocks. `at_least` is the end of a one-sided interval of level `doubt`, over all scales: the
// jackknife over blocks [Tukey 1958] with Student's t; the scale where it is highest counts. What is small beside noise
// shows in the means of tiles alone, what is fine detail in pixels alone: of `pixels_alone` that scale counts.
struct ExplainedShare {
    double value = 0.0;
    double at_least = -1.0;  // nothing is shown
};
[[nodiscard]] ExplainedShare explained_share(
    const Misfit& before, const Misfit& after, double doubt, bool pixels_alone = false);

// Whether a scale shows, at level `doubt`, that less than `share` is explained: a fault of lines or single pixels has a
// mean that a factor explains, and more beside it. Student's t of after - (1 - share) before.
[[nodiscard]] bool contradicted(const Misfit::Scale& before, const Misfit::Scale& after, double share, double doubt);

// Root mean square of the relative differences of 16x16 tiles beyond noise, 0 where there is none.
[[nodiscard]] double typical_difference(const ImagePair& pair);

// Whether the images differ: image, tiles of 32, 16 and 8 pixels, pixels (unless they are `interpolated`), and values
// (pixels sorted into 16 classes by what surrounds them, a channel each: a wrong curve shows there first), each level
// corrected for its own tests, all for six levels at criteria.false_alarm. No more than `tolerated`, relative, is
// negligible.
[[nodiscard]] bool differ(const ImagePair& pair, const Criteria& criteria, double tolerated, bool interpolated = false);

}  // namespace tandem
