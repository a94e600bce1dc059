// Judges one image case on one renderer: compares the image mean, or every pixel, with the scene's closed form.
#pragma once

#include <stop_token>

#include "common/render/renderer.h"
#include "common/stability/stability.h"

namespace tandem::stability {

// Fills rays, false_hits (invalid samples), worst_ulp (of the deviation from the closed form, in ulp of that), bound
// and time of `result`. Throws InputError for a scene without a closed form, UnsupportedError from the renderer.
void judge_image(const HardCase& hard_case, Renderer& renderer, Precision precision, double seconds,
    const std::stop_token& stop, CaseResult& result);

}  // namespace tandem::stability
