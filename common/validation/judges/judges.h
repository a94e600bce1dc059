// Rules by which others decide whether two images of a renderer are alike, as their projects publish them. They are
// here to be measured beside Tandem's verdict (tests/records/judges), never to be part of it.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/image/image_io.h"

namespace tandem {

// Two images of equal size, [pixel * 3 + channel], linear. The variances are those of the pixels' means, and empty
// where they are not known.
struct JudgedPair {
    std::uint32_t width = 0, height = 0;
    std::vector<double> reference, candidate;
    std::vector<double> reference_variance, candidate_variance;
    double samples = 0.0;  // a pixel and side
};

struct JudgeFinding {
    std::string_view name, rule;  // as published, or the text says otherwise
    double score = 0.0;           // greater: more different
    double limit = 0.0;           // the rule notices a difference where the score is above
    [[nodiscard]] bool notices() const { return score > limit; }
};

// Those that need variances are left out where there are none.
[[nodiscard]] std::vector<JudgeFinding> ask_judges(const JudgedPair& pair);

// The pair of two files as `tandem render` writes them, with or without variance channels. Throws InputError for images
// of other sizes or without R, G, B.
[[nodiscard]] JudgedPair judged_pair(const Image& reference, const Image& candidate);

// Values in [0, 1] as an image of 8 bits has them, encoded by sRGB's curve.
[[nodiscard]] std::vector<double> displayed(const std::vector<double>& linear);

// Mean structural similarity of luma in [0, 1], by windows of 11 x 11 [Wang et al. 2004].
[[nodiscard]] double structural_similarity(
    const std::vector<double>& a, const std::vector<double>& b, std::uint32_t width, std::uint32_t height);

// Mean FLIP of images in [0, 1], linear, at 67 pixels a degree [Andersson et al. 2020].
[[nodiscard]] double flip_error(
    const std::vector<double>& reference, const std::vector<double>& test, std::uint32_t width, std::uint32_t height);

}  // namespace tandem
