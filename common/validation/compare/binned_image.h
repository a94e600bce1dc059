// Images that are too large to be compared pixel by pixel. The means of squares of pixels are compared instead.
#pragma once

#include <cstdint>
#include <filesystem>

#include "common/image/image_io.h"
#include "common/validation/compare/compare.h"

namespace tandem {

// The file's image, each square of edge x edge pixels as one, which is what is left of it at the right and lower edges.
// It is read in bands. Colours are means. Variances are such that a square's mean is known as well as its pixels' means
// make it known, these being independent. Counts are sums. Throws InputError, also for values that are encoded
// (colour_space.h), whose means are no means of light.
[[nodiscard]] Image read_binned_image(const std::filesystem::path& path, std::uint32_t edge, VarianceOf variance_of);

}  // namespace tandem
