// A forecast of the memory that a scene will take on a device and on the host.
#pragma once

#include "common/render/memory_forecast.h"
#include "vulkan/core/device.h"
#include "vulkan/renderer/kernels/stages.h"

namespace tandem {

// With `pixels` in flight. A device that is the processor has its buffers in the machine's memory.
[[nodiscard]] MemoryForecast memory_forecast(const Device& device, const Scene& scene, const RenderSettings& settings,
    KernelShape shape, GeometryPrecision precision, std::uint64_t pixels);

// The most that all trees have.
[[nodiscard]] std::uint64_t nodes_of(const PlacedCounts& counts);

}  // namespace tandem
