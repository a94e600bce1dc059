// What a job derives from a scene and settings before it uses the device. These are refusals, the scene's tables, and
// the constants of its kernels.
#pragma once

#include <optional>

#include "common/render/renderer.h"
#include "vulkan/core/device.h"
#include "vulkan/renderer/kernels/stages.h"
#include "vulkan/renderer/scene/scene_data.h"

namespace tandem {

// In place of a count, for kernels that serve any scene (shaders/kernels/settings.glsl).
inline constexpr std::uint32_t told_at_run_time = 0xffffffffu;

// The settings, without instancing where kernels cannot do it. These are kernels in more than single precision, and
// those of a `shape` with its own trees. nullopt: kernels for given rays.
[[nodiscard]] RenderSettings with_possible_instancing(
    RenderSettings settings, GeometryPrecision precision, std::optional<KernelShape> shape);

// The settings with the accumulation chosen where it is left open (own_accumulation), and with_possible_instancing.
// Throws UnsupportedError where no job has such settings.
[[nodiscard]] RenderSettings checked_settings(
    const Device& device, const Scene& scene, RenderSettings settings, GeometryPrecision precision, KernelShape shape);

// What a device does where settings leave it open: in double where it and this build can.
[[nodiscard]] Accumulation own_accumulation(const Device& device);

// Whether kernels that follow whole paths may have such settings: they cannot stop within a path (megakernel_plan.h).
[[nodiscard]] bool fits_whole_paths(const RenderSettings& settings);

// Infinity becomes the greatest float: Vulkan need not keep infinities.
[[nodiscard]] float to_distance(double distance);

[[nodiscard]] SceneData flatten_for(
    const Scene& scene, const RenderSettings& settings, Acceleration acceleration, GeometryPrecision precision);

// `described`: the scene that `scene` was made of. Throws UnsupportedError for effects that there are no shaders for.
[[nodiscard]] Specialisation specialise(const Device& device, const Scene& described, const SceneData& scene,
    const RenderSettings& settings, PlantedFault fault);
// The same, of kernels made as the patterns say; `told`: what every dispatch is told. Throws UnsupportedError where
// device, scene and patterns do not go together.
[[nodiscard]] Specialisation with_patterns(
    Specialisation specialisation, const Device& device, const JobPatterns& patterns, const gpu::Settings& told);
// What every dispatch of a job is told; tile, sample and the rest are each dispatch's own.
[[nodiscard]] gpu::Settings told_settings(const RenderSettings& settings, const SceneData& scene);
// Segments that a path can have: later ones would find their queues empty.
[[nodiscard]] std::uint32_t most_segments(EffectSet effects, const RenderSettings& settings);

}  // namespace tandem
