#include "common/validation/verdict/sampled_image.h"

#include <algorithm>
#include <cmath>

namespace tandem {

namespace {

RegionFigures region_figures(const Estimate::Plane& totals, std::uint64_t count, const TileGrid& grid) {
    RegionFigures figures;
    figures.means.assign(grid.size() * channel_count, 0.0);
    figures.variances.assign(grid.size() * channel_count, 0.0);
    std::vector<double> pixels(grid.size(), 0.0);
    const std::vector<std::uint32_t>& tile_of_pixel = grid.tile_of_pixel();
    for (std::size_t pixel = 0; pixel < tile_of_pixel.size(); ++pixel) {
        const std::uint32_t tile = tile_of_pixel[pixel];
        pixels[tile] += 1.0;
        for (std::size_t c = 0; c < channel_count; ++c) {
            const Moments& moments = totals[pixel * channel_count + c];
            figures.means[tile * channel_count + c] += mean_from(moments, count);
            figures.variances[tile * channel_count + c] += variance_from(moments, count);
        }
    }
    for (std::size_t i = 0; i < figures.means.size(); ++i) {
        figures.means[i] /= pixels[i / channel_count];
        figures.variances[i] /= pixels[i / channel_count];
    }
    return figures;
}

}  // namespace

std::vector<PixelStatistics> pixel_statistics(const Estimate& estimate) {
    const std::uint64_t count = estimate.count();
    const Estimate::Plane totals = estimate.totals();
    std::vector<PixelStatistics> pixels(totals.size());
    std::ranges::transform(totals, pixels.begin(), [&](const Moments& moments) {
        return PixelStatistics{mean_from(moments, count), variance_from(moments, count), static_cast<double>(count)};
    });
    return pixels;
}

SampledImage sampled_image_of(const Estimate& estimate, std::vector<Batch> batches) {
    SampledImage image;
    image.width = estimate.width();
    image.height = estimate.height();
    image.pixels = pixel_statistics(estimate);
    image.batches = std::move(batches);
    image.samples = estimate.count();
    image.invalid = estimate.invalid();
    return image;
}

Batch batch_of(const Estimate& batch, const TileGrid& tiles) {
    const Estimate::Plane totals = batch.totals();
    const TileGrid whole(batch.width(), batch.height(), 0);
    return {region_figures(totals, batch.count(), whole), region_figures(totals, batch.count(), tiles)};
}

std::array<double, channel_count> channel_means(const SampledImage& image) {
    std::array<double, channel_count> means{};
    for (std::size_t i = 0; i < image.pixels.size(); ++i) means[i % channel_count] += image.pixels[i].mean;
    for (double& mean : means) mean /= static_cast<double>(image.pixels.size()) / channel_count;
    return means;
}

}  // namespace tandem
