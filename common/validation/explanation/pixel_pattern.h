// Describes which pixels of an image are wrong, in words that point to a place in a program. Examples: the last rows,
// every eighth column, the last lanes of each workgroup, all pixels from a power of two on.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace tandem {

// What is said where no place is left out: where pixels lie tells nothing then.
inline constexpr const char* every_pixel = "nearly every pixel";

// "the last 3 rows", "all pixels from number 4096 = 2^12 on, counted along rows"; empty: no such pattern. A pattern
// holds at least half of its pixels, and of all others at most one in twenty. `touched`: [y * width + x].
[[nodiscard]] std::string pixel_pattern(const std::vector<bool>& touched, std::uint32_t width, std::uint32_t height);

}  // namespace tandem
