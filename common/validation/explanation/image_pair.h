// Two images, one of them changed to undo a supposed fault. The remaining difference tells whether that was the fault.
// This file judges nothing.
#pragma once

#include <array>
#include <functional>
#include <span>

#include "common/validation/verdict/sampled_image.h"

namespace tandem {

struct ImagePair {
    SampledImage reference, candidate;
    double tied = 1.0;  // what filtering here has made of their correlations
};

// Candidate(x, y) of the result is that of `source`: flips and turns.
struct Place {
    std::uint32_t x, y;
};
[[nodiscard]] ImagePair with_candidate_moved(const ImagePair& pair, const std::function<Place(Place)>& source);

// Channel c of the candidate becomes channel order[c] of the result.
[[nodiscard]] ImagePair with_channels_moved(
    const ImagePair& pair, const std::array<std::uint32_t, channel_count>& order);

// Every mean of an image through a curve; variances by its slope there, or at the noise where a mean is less than that.
struct Curve {
    std::function<double(double)> value, slope;
};
[[nodiscard]] SampledImage through(const SampledImage& image, const Curve& curve);
// v^exponent times `factor`, likewise.
[[nodiscard]] SampledImage to_power(const SampledImage& image, double exponent, double factor);
// Channel c is multiplied by factors[c], after `offset` was added.
[[nodiscard]] SampledImage scaled(
    const SampledImage& image, const std::array<double, channel_count>& factors, double offset = 0.0);

// `left_out[i]`: there the candidate becomes the reference.
[[nodiscard]] ImagePair without(const ImagePair& pair, const std::vector<bool>& left_out);

// The part of both images where reference(x, y) and candidate(x + dx, y + dy) are both there, laid over each other.
[[nodiscard]] ImagePair overlapped(const ImagePair& pair, std::int32_t dx, std::int32_t dy);

// The reference moved by half of (dx, dy) and the candidate by minus half, |dx|, |dy| < 2. Both are interpolated
// linearly, so that they lose the same detail. A border of one pixel is cut off.
[[nodiscard]] ImagePair met_halfway(const ImagePair& pair, double dx, double dy);

// Both sides averaged over 3x3 pixels with weights 1 2 1 each way. A border of one pixel is cut off.
[[nodiscard]] ImagePair smoothed(const ImagePair& pair);

[[nodiscard]] ImagePair part_of(const ImagePair& pair, const Rectangle& part);

}  // namespace tandem
