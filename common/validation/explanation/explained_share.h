// How much of the difference of two images a correction removes, and whether the rest is still significant.
#pragma once

#include "common/validation/explanation/image_pair.h"
#include "common/validation/verdict/criteria.h"

namespace tandem {

// Squared differences beyond noise, summed in blocks, at several scales: of pixels and of tiles' means. Each term is
// (d^2 - V)/(V + f^2): d is the difference, V the variance of its noise, f a hundredth of the channel's mean. With f,
// places without noise do not count by their brightness alone.
struct Misfit {
    struct Scale {
        std::uint32_t edge = 1;      // of the tiles whose means are compared, pixels
        std::vector<double> blocks;  // [block]
    };
    std::vector<Scale> scales;
};
inline constexpr double misfit_floor = 0.01;                                   // f, of the channel's mean
[[nodiscard]] std::vector<std::uint32_t> misfit_edges(const ImagePair& pair);  // the scales, pixels first
[[nodiscard]] Misfit::Scale misfit_of(const ImagePair& pair, std::uint32_t edge);
[[nodiscard]] Misfit misfit_of(const ImagePair& pair);

// 1 - after/before, of all blocks. `at_least` is the end of a one-sided interval of level `doubt`, at the scale where
// it is highest. It is the jackknife over blocks [Tukey 1958] with Student's t. What is small beside noise shows in the
// means of tiles alone, what is fine detail in pixels alone: of `pixels_alone` that scale counts.
struct ExplainedShare {
    double value = 0.0;
    double at_least = -1.0;  // nothing is shown
};
[[nodiscard]] ExplainedShare explained_share(
    const Misfit& before, const Misfit& after, double doubt, bool pixels_alone = false);

// Whether a scale shows, at level `doubt`, that less than `share` is explained. A fault of lines or single pixels has a
// mean that a factor explains, and more beside it. Student's t of after - (1 - share) before.
[[nodiscard]] bool contradicted(const Misfit::Scale& before, const Misfit::Scale& after, double share, double doubt);

// Root mean square of the relative differences of 16x16 tiles beyond noise, 0 where there is none.
[[nodiscard]] double typical_difference(const ImagePair& pair);

// Whether the images differ in the image, tiles of 32, 16 and 8 pixels, pixels (unless they are `interpolated`), or
// values. Values are pixels sorted into 16 classes by what surrounds them, a channel each: a wrong curve shows there
// first. Each level is corrected for its own tests, all for six levels at criteria.false_alarm. No more than
// `tolerated`, relative, is negligible.
[[nodiscard]] bool differ(const ImagePair& pair, const Criteria& criteria, double tolerated, bool interpolated = false);

}  // namespace tandem
