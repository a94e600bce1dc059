// What a difference between two images looks like, by name: a flip, a factor, a gamma, a missing rectangle. A cause is
// named only if it is shown to account for the difference. If no known cause does, none is named.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/validation/explanation/explained_share.h"

namespace tandem {

struct Explanation {
    std::string text;
    std::optional<ExplainedShare> share;  // of the squared difference beyond noise; none for what is a plain fact
};

// A supposed change is undone, and its name is given where both hold.
// - What is left is no difference any more (`differ`; negligible is at most a tenth of the typical difference).
// - At 99 % it accounts for `shown_share` of the squared difference beyond noise at one scale, and at no scale for
//   less. So what it leaves is less than a third of the root mean square. Undoing a shift interpolates: laid over each
//   other halfway, ideal edges at random places leave 9 % after half a pixel. A zoom about a corner, taken for a shift,
//   leaves 25 %, and lines shifted by turns 40 %. `shown_share_of_shift`, of pixels, lies between. What is plainly seen
//   in one image (plain_facts.h) is told where nothing else differs. Changes with fewer figures to fit come first, and
//   with the first that are shown the search ends. All that are shown together are named, as the images do not tell
//   which it was; more than three are none.
//
// These are known. Rectangles of one value, in all channels or one; values cut off; invalid pixels and nothing else (no
// name). Flips, turns and transposes; channels in another order; sRGB once too often or too seldom, cut off or not. A
// factor, and one that a missing sample makes; a gamma; an offset; a shift. A gamma with a factor; a factor for each
// channel; a shift with a factor; channels that are copies or mixings.
inline constexpr double shown_share = 0.9, shown_share_of_shift = 0.8, share_doubt = 0.01, left_over = 0.1;
[[nodiscard]] std::vector<Explanation> explain(
    const SampledImage& reference, const SampledImage& candidate, const Criteria& criteria);

// "it looks like a vertical flip, or a half turn (99 % of the squared difference beyond noise)".
[[nodiscard]] std::string told(const std::vector<Explanation>& explanations);

}  // namespace tandem
