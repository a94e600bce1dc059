// The correlation of the noise of neighbouring pixels. A renderer may splat samples through a pixel filter wider than a
// pixel (Gaussian, Blackman-Harris, Mitchell). Then one sample counts in several pixels. The variance of a region's
// mean is then several times what independent pixels would have.
#pragma once

#include "common/validation/verdict/sampled_image.h"

namespace tandem {

// The factor by which the variance of a region's mean of candidate - reference exceeds that of independent pixels with
// the same variances. It is seen in the images' difference. It is at least 1, and 1 unless neighbours surely go
// together.
//
// It is the sum over all distances d of the correlation rho(d) of the differences z at places d apart. It is taken from
// pairs of pixels in one 16x16 tile, with z over the tile's mean deviation. rho(d) = 1 - g(d)/g(far), g(d) the mean of
// (z(x + d) - z(x))^2/2 [Matheron 1963: the variogram]. A constant in a tile cancels in it. A factor common to the
// whole image is taken out before, so that a true difference is not taken for noise that goes together. Distances are
// taken in rings of max(|dx|, |dy|) = 1, 2, ... 6 (filters of radius 3 reach so far). Rings are added while the ring's
// mean of rho is more than two of its standard errors above 0. The value g(far) is that of ring 7, and at most 1, which
// is the variance itself. Where it is more, the images differ unevenly within tiles, and neighbours would seem to go
// together. Images below 32 pixels either way have too few pixels to tell: 1.
[[nodiscard]] double neighbour_correlation(const SampledImage& reference, const SampledImage& candidate);

}  // namespace tandem
