// A forecast of the memory that the tables and trees of a scene will take.
#pragma once

#include "common/render/memory_forecast.h"

namespace tandem::cpu {

// `precision`: of geometry. 0 threads: all.
[[nodiscard]] MemoryForecast memory_forecast(
    const Scene& scene, const RenderSettings& settings, Precision precision, unsigned threads);

}  // namespace tandem::cpu
