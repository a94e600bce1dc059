// One side of a verdict as a job has sampled it. About another program's job less is known. Whether its pixels go
// together (a pixel filter) is not, and perhaps not even the variance of a sample, but that of whole images
// (common/render/foreign_job.h).
#pragma once

#include <vector>

#include "common/render/renderer.h"
#include "common/validation/verdict/sampled_image.h"

namespace tandem {

// `batches` have equally many samples. Where variances stand on values that are coarser than samples, pixels count
// those, so that tests know how few they are.
[[nodiscard]] SampledImage sampled_by(const RenderJob& job, const Estimate& estimate, std::vector<Batch> batches);

// The side that counts finer values is made to count as many as the other: its variance of the mean stays.
void count_alike(SampledImage& a, SampledImage& b);

}  // namespace tandem
