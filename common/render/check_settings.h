// What every backend refuses alike of a scene and its settings. A backend adds only refusals of its own.
#pragma once

#include "common/render/renderer.h"

namespace tandem {

// Throws UnsupportedError, with the reason and the mend, for:
// - an image size outside what RenderSettings declares.
// - an interval of ray lengths that is empty or begins below 0.
// - more bounces than there are random numbers for (MODEL.md section 3).
// - what adaptive sampling does not go with (check_sampling).
// - a camera whose target is its position, or whose up vector lies along its view (section 4).
// - radiances that sums in single precision cannot hold, where `accumulation` asks for such sums.
void check_settings(const Scene& scene, const RenderSettings& settings);

// Throws UnsupportedError for adaptive sampling with settings that it does not go with.
void check_sampling(const RenderSettings& settings);

}  // namespace tandem
