// What a wrong answer looks like: a picture of the right answer, the student's, and the difference.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/exercise/marker.h"
#include "common/image/image_io.h"

namespace tandem {

// Values of a square, row by row from the top.
struct MarkPicture {
    std::uint32_t side = 0;
    std::vector<double> right, yours;
    std::string shows;  // what a pixel is, in a line
};

// Two paths from the same arguments, up to where they part and a step beyond.
struct PartedPaths {
    ExercisePath right;
    PathTrace yours;
};

// The mark, and pictures of some wrong answers. Throws as mark_of does.
struct PicturedMark {
    Mark mark;
    std::optional<MarkPicture> picture = {};
    std::optional<PartedPaths> paths = {};
};
[[nodiscard]] PicturedMark pictured_mark_of(const Exercise& exercise, const std::string& text, std::uint64_t seed);

// Its three panels beside each other. Grey from the least to the greatest value; magenta is no number. In the
// difference red is more than right, blue less, and white the same.
[[nodiscard]] Image image_of(const MarkPicture& picture);

}  // namespace tandem
