// One side of a comparison: an image as a statistician sees it. It comes from a Renderer's Estimate, from an image with
// variance channels, or from several images of independent seeds.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "common/render/estimate.h"
#include "common/validation/verdict/tile_grid.h"

namespace tandem {

// One channel of one pixel: mean and unbiased variance of one sample, and how many samples.
struct PixelStatistics {
    double mean = 0.0;
    double variance = 0.0;
    double count = 0.0;
};

// What one batch of samples adds up to over regions: [tile * 3 + channel]. `means` of the pixels' batch means, and
// `variances`, the mean over pixels of the variance of one sample as seen within the batch.
struct RegionFigures {
    std::vector<double> means, variances;
};
struct Batch {
    RegionFigures image, tiles;
};

struct SampledImage {
    std::uint32_t width = 0, height = 0;
    std::vector<PixelStatistics> pixels;        // [(y * width + x) * 3 + channel]
    std::vector<Batch> batches;                 // may be empty: then variances are not tested
    std::uint64_t samples = 0;                  // a pixel (the most, where pixels differ)
    std::uint64_t invalid = 0;                  // samples that were not finite or were negative
    std::vector<std::uint32_t> invalid_pixels;  // of an image: the pixels of such values, rising
    // The variance of a region's mean over the sum of its pixels' variances. It is 1 for independent pixels, more where
    // a pixel filter or a sampler ties neighbours together.
    double correlation = 1.0;
    bool foreign = false;  // another program's sums, which may round as in single precision
};

// Edge in pixels of the tiles that margins, batches and reports speak of.
inline constexpr std::uint32_t standard_tile_edge = 16;

[[nodiscard]] std::vector<PixelStatistics> pixel_statistics(const Estimate& estimate);

// A renderer's estimate, and the batches that it was rendered in.
[[nodiscard]] SampledImage sampled_image_of(const Estimate& estimate, std::vector<Batch> batches = {});

// The figures of one batch, an estimate of that batch's samples alone. `tiles` is the standard grid of its size.
[[nodiscard]] Batch batch_of(const Estimate& batch, const TileGrid& tiles);

// Mean over the image.
[[nodiscard]] std::array<double, channel_count> channel_means(const SampledImage& image);

}  // namespace tandem
