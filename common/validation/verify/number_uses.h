// Which random number decides what, on both sides of a comparison (MODEL.md section 3). One number is changed in many
// paths. What becomes another thing at the vertex, though the ray arrives as before, depends on that number. A number
// that decides something on one side alone is drawn twice, or not at all.
#pragma once

#include <array>
#include <cstdint>
#include <glm/vec2.hpp>
#include <span>
#include <string>
#include <string_view>

#include "common/render/renderer.h"

namespace tandem {

enum class NumberUse : std::uint8_t {
    same,    // on both sides, as far as was seen
    own,     // a number does not decide on one side what it is for
    foreign  // it decides on one side what it is not for
};

inline constexpr std::array<std::string_view, 3> number_use_names{"same", "own", "foreign"};

struct NumberUses {
    NumberUse use = NumberUse::same;
    std::string words;  // a clause, unless `same`
};

struct NumberPaths {
    RenderJob& reference;
    RenderJob& candidate;
    std::span<const glm::uvec2> pixels;
    std::size_t vertex = 0;  // at which their paths part
};
// Follows the first block of samples of the pixels, with each number of the vertex changed in turn. Throws
// UnsupportedError where a side cannot.
[[nodiscard]] NumberUses number_uses(const NumberPaths& paths);

}  // namespace tandem
