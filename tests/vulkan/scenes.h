// Scenes of many features for the Vulkan renderer's tests, and short ways to render them.
#pragma once

#include "common/render/renderer.h"
#include "tests/scene_builder.h"
#include "vulkan/backend.h"

namespace tandem::testing {

using test::diffuse;
using test::emitter;
using test::glass;
using test::mirror;
using test::rough_diffuse;
using test::SceneBuilder;
using test::settings_of;

// Copper, nearly.
[[nodiscard]] Material conductor(double roughness);

// The scene with every feature: all kinds of primitives and materials, transforms, a lens and a background.
[[nodiscard]] Scene full_scene();

// Textures of all kinds, conductors, a rough diffuse ball, an image for a sky, motion of entities and camera. Lights
// without a surface too, unless for the path integrator, which cannot find them.
[[nodiscard]] Scene outdoor_scene(bool punctual);

// Fog around everything, and bodies within bodies: a cloud on a grid that scatters forward, glass in coloured glass;
// rough glass.
[[nodiscard]] Scene foggy_scene();

// One renderer for all tests on the default device: drivers allow a process few instances in its life.
[[nodiscard]] Renderer& default_renderer(Acceleration acceleration = Acceleration::automatic);

// A renderer with kernels of this shape: "stages", "megakernel".
[[nodiscard]] Renderer& renderer_with_kernel(const std::string& kernel);

// Samples [0, count) with the default device and no validation.
[[nodiscard]] RenderResult render(const Scene& scene, const RenderSettings& settings, std::uint64_t count);

// Mean over the image of one channel.
[[nodiscard]] double image_mean(const Estimate& estimate, int channel = 0);
// Its standard error, from the variances of the pixels.
[[nodiscard]] double standard_error(const Estimate& estimate, int channel = 0);

// Whether two estimates hold the same bits.
[[nodiscard]] bool same_bits(const Estimate& a, const Estimate& b);

}  // namespace tandem::testing
