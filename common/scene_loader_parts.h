// The parts of a scene file that stand alone: film, camera, background, render defaults, materials, transforms. Each
// reads one JSON value after scenes/format/FORMAT.md and refuses what the format or MODEL.md forbids.
#pragma once

#include "common/scene.h"
#include "common/scene_loader_json.h"

namespace tandem::scene_json {

// Magnitudes of lengths and radiances: single-precision renderers square and sum them, and 3 · (10¹⁸)² still lies
// within a float's range as 10⁻³⁶ lies above its least normal number, 1.2 · 10⁻³⁸.
inline constexpr double greatest_length = 1e18;
inline constexpr double least_length = 1e-18;

[[nodiscard]] Film read_film(const Value& value);
[[nodiscard]] Camera read_camera(const Value& value);
[[nodiscard]] Background read_background(const Value& value);
[[nodiscard]] SceneDefaults read_render(const Value& value);
[[nodiscard]] Material read_material(const Value& value, const std::string& name);
[[nodiscard]] glm::dmat4 read_transform(const Value& value);
[[nodiscard]] Expectation read_expectation(const Value& value);

}  // namespace tandem::scene_json
