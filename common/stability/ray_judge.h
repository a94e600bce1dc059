// Judges one ray case on one renderer: traces the rays, checks their hits and counts failures.
#pragma once

#include <stop_token>

#include "common/render/renderer.h"
#include "common/stability/hard_case.h"

namespace tandem::stability {

struct RayTally {
    std::uint64_t rays = 0, misses = 0, false_hits = 0, self_hits = 0;
    double worst_ulp = 0.0, seconds = 0.0;
    bool cut = false;  // by the time
};

// Shoots about `rays` rays, spread over the scenes of `work`, but no longer than `seconds`, one batch of every scene
// excepted. Throws UnsupportedError from the renderer.
[[nodiscard]] RayTally shoot(const std::vector<RayWork>& work, Renderer& renderer, const RenderSettings& settings,
    Precision precision, std::uint64_t seed, std::uint64_t rays, double seconds, const std::stop_token& stop);

}  // namespace tandem::stability
