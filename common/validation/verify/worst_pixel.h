// The pixel in which two sides differ most significantly, and a sample of it to trace.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/render/renderer.h"
#include "common/validation/verdict/sampled_image.h"

namespace tandem {

struct WorstPixel {
    std::uint32_t x = 0, y = 0;
    std::uint64_t sample = 0, seed = 0;  // of both sides
    bool parts = false;                  // the two paths of that sample do, as far as was looked at
    std::string reason;                  // where and why the two paths of that sample part; empty: not looked at
    std::string command;                 // that traces it; empty: none was made
};

// The pixel with the least p in any channel, of equal ones that with the greatest difference in standard errors.
[[nodiscard]] WorstPixel worst_pixel_of(
    const SampledImage& reference, const SampledImage& candidate, const std::vector<double>& pixel_p);

// Traces the pixel's first samples on both sides, which must have the same seed, and chooses the one whose radiances
// lie furthest apart. Leaves all as it is where one of them cannot be traced.
void choose_sample(WorstPixel& pixel, RenderJob& reference, RenderJob& candidate);

}  // namespace tandem
