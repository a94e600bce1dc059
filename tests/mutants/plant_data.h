// Faults of data (common/render/planted_bugs.h): planted by an edited scene or settings, with no hook in any tracer.
#pragma once

#include <memory>

#include "common/render/renderer.h"

namespace tandem::test {

// Edits what a renderer is given, if the fault is one of data; false: it is one of logic, which has hooks.
bool plant_data(const PlantedFault& fault, Scene& scene, RenderSettings& settings);

// The backend's renderer with the fault, of whatever kind.
[[nodiscard]] std::unique_ptr<Renderer> renderer_with(
    const Backend& backend, const PlantedFault& fault, BackendOptions options = {});

}  // namespace tandem::test
