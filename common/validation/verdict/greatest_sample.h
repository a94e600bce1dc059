// An upper bound on one sample of a correct renderer. Bounds on p that hold for any distribution of samples need it.
#pragma once

#include <array>

#include "common/render/renderer.h"

namespace tandem {

// Upper bound on one sample's radiance, per channel; infinite where there is none. Throughput never exceeds 1, also
// after roulette, which divides by its greatest component (MODEL.md section 9.3). (But for media that scatter colours
// differently: their weights, section 10, are 1 in the mean only, and count as 1 here.) Some materials may weight a
// path without bound where both directions graze (materials.h, greatest_weight): what it meets after them has no bound
// either. One event has, where the camera's rays come upon flat surfaces away from grazing. What adds up is
// - L_e of each surface and of the background that is met, the sky's image included. It comes once a path, or at each
//   of its D + 1 segments where surfaces emit and let paths go on.
// - at each of D vertices one sample of a light (section 9.2). With q the density of scattering, surfaces and skies add
//   C q L_e P p/((P p)^2 + q^2) <= L_e/2. Under `whitted` and without MIS that weight is missing, and nothing bounds
//   1/(P p).
// - points, spots and suns, whose p is 1, add f cos I/(P r^2) or f cos E/P. f cos is at most that of the material's row
//   (common/scene/materials.h), and (1 + |g|)/(4 pi (1 - |g|)^2) in media. r is at least the light's distance from the
//   nearest surface that scatters; in a medium nothing bounds it.
// - in place of these two, `bidirectional` adds every way to join up to D events, (D + 1)(D + 4)/2. Each is at most
//   what the path would add that scattering alone finds: L_e. Light without a surface is not found so: no bound.
[[nodiscard]] std::array<double, channel_count> greatest_sample(const Scene& scene, const RenderSettings& settings);

}  // namespace tandem
