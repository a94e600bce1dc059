// What the tables and trees of a scene will take, before they are made.
#pragma once

#include "common/render/memory_forecast.h"

namespace tandem::cpu {

// Of geometry in `precision`, with so many threads; 0: all.
[[nodiscard]] MemoryForecast memory_forecast(
    const Scene& scene, const RenderSettings& settings, Precision precision, unsigned threads);

}  // namespace tandem::cpu
