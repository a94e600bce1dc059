#include "common/validation/verify/foreign_side.h"

#include <algorithm>
#include <cmath>

#include "common/render/foreign_job.h"
#include "common/statistics/sample_moments.h"

namespace tandem {

namespace {

// How much more the means of tiles scatter over batches than independent pixels would let them. 1 unless surely more
// (as compare does with images, compare/image_side.cpp).
double batch_correlation(const SampledImage& image) {
    const double batches = static_cast<double>(image.batches.size());
    if (batches < 2.0) return 1.0;
    const TileGrid grid(image.width, image.height, standard_tile_edge);
    std::vector<double> expected(grid.size() * channel_count, 0.0), pixels(grid.size(), 0.0);
    for (std::size_t i = 0; i < image.pixels.size(); ++i) {
        const std::size_t tile = grid.tile_of_pixel()[i / channel_count];
        const PixelStatistics& pixel = image.pixels[i];
        expected[tile * channel_count + i % channel_count] += pixel.variance / pixel.count * batches;
        if (i % channel_count == 0) pixels[tile] += 1.0;
    }
    double ratios = 0.0, counted = 0.0;
    for (std::size_t i = 0; i < expected.size(); ++i) {
        if (!(expected[i] > 0.0)) continue;
        SampleMoments means;
        for (const Batch& batch : image.batches) means.add(batch.tiles.means[i]);
        const double size = pixels[i / channel_count];
        ratios += means.variance() * size * size / expected[i];
        counted += 1.0;
    }
    if (counted == 0.0) return 1.0;
    // Three standard errors of a mean of scaled chi squares; channels go together, so they count as one.
    const double dof = std::max(1.0, counted / channel_count * (batches - 1.0)), ratio = ratios / counted;
    return ratio > 1.0 + 3.0 * std::sqrt(2.0 / dof) ? ratio : 1.0;
}

void count_values(SampledImage& image, double values) {
    for (PixelStatistics& pixel : image.pixels) {
        if (pixel.count <= values) continue;
        pixel.variance *= values / pixel.count;
        pixel.count = values;
    }
}

double values_of(const SampledImage& image) { return image.pixels.empty() ? 0.0 : image.pixels.front().count; }

}  // namespace

SampledImage sampled_by(const RenderJob& job, const Estimate& estimate, std::vector<Batch> batches) {
    SampledImage image = sampled_image_of(estimate, std::move(batches));
    const auto* foreign = dynamic_cast<const ForeignJob*>(&job);
    if (foreign == nullptr) return image;
    image.foreign = true;
    image.correlation = batch_correlation(image);
    if (const double values = foreign->values_a_call(); values > 0.0)
        count_values(image, std::max(2.0, values * static_cast<double>(image.batches.size())));
    return image;
}

void count_alike(SampledImage& a, SampledImage& b) {
    const double values = std::min(values_of(a), values_of(b));
    count_values(a, values);
    count_values(b, values);
}

}  // namespace tandem
