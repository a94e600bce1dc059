// Small scenes. In each a family of planted bugs (common/render/planted_bugs.h) shows at a few hundred samples a pixel
// of a small image.
#pragma once

#include <string>

#include "common/render/renderer.h"
#include "common/scene/scene.h"

namespace tandem::test {

struct TrialScene {
    std::string name;
    Scene scene;
    RenderSettings settings;
};

[[nodiscard]] TrialScene lamps();       // light sampling: a one-sided lamp under a ceiling, and a small strong one
[[nodiscard]] TrialScene open_sky();    // scattering: bodies of every kind, turned and stretched, under a coloured sky
[[nodiscard]] TrialScene closed_box();  // few bounces between bright walls
[[nodiscard]] TrialScene roulette_box();  // the same with roulette from the first event on
[[nodiscard]] TrialScene glass_bodies();
[[nodiscard]] TrialScene wide_lens();
[[nodiscard]] TrialScene narrow_gap();  // walls nearer to each other than 1/100 of the scene

}  // namespace tandem::test
