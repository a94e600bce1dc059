// Faults outside shading: planted in what a job returns, so that its traced paths stay right.
#pragma once

#include <memory>

#include "common/render/renderer.h"

namespace tandem::test {

[[nodiscard]] bool is_fault_of_film(PlantedBug bug);

// The renderer, whose jobs have the fault.
[[nodiscard]] std::unique_ptr<Renderer> with_fault_of_film(std::unique_ptr<Renderer> renderer, PlantedBug bug);

}  // namespace tandem::test
