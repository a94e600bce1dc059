// One side of a verdict, from the samples of a job. Less is known about a job of another program
// (common/render/foreign_job.h). Its pixels may be correlated by a pixel filter. Perhaps only the variance of whole
// images is known, not that of a sample.
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
