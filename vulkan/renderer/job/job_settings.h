// What a job makes of a scene and of settings before anything is on the device: what it refuses, the tables of the
// scene, and the constants of its kernels.
#pragma once

#include "common/render/renderer.h"
#include "vulkan/core/device.h"
#include "vulkan/renderer/kernels/stages.h"
#include "vulkan/renderer/scene/scene_data.h"

namespace tandem {

// The same with the accumulation that is left open (own_accumulation). Throws UnsupportedError where no job has such
// settings.
[[nodiscard]] RenderSettings checked_settings(
    const Device& device, const Scene& scene, RenderSettings settings, GeometryPrecision precision);
// With the bounces of a planted fault.
[[nodiscard]] RenderSettings mutated_settings(RenderSettings settings, PlantedFault fault);

// What a device does where settings leave it open: in double where it and this build can.
[[nodiscard]] Accumulation own_accumulation(const Device& device);

// Infinity becomes the greatest float: Vulkan need not keep infinities.
[[nodiscard]] float to_distance(double distance);

[[nodiscard]] SceneData flatten_for(
    const Scene& scene, const RenderSettings& settings, Acceleration acceleration, GeometryPrecision precision);

// `described`: the scene that `scene` was made of. Throws UnsupportedError for effects that there are no shaders for.
[[nodiscard]] Specialisation specialise(const Device& device, const Scene& described, const SceneData& scene,
    const RenderSettings& settings, PlantedFault fault);
// Segments that a path can have: later ones would find their queues empty.
[[nodiscard]] std::uint32_t most_segments(EffectSet effects, const RenderSettings& settings);

}  // namespace tandem
