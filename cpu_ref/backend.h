// The host's renderers: the Embree path tracer, the reference oracle, and a path tracer to read.
#pragma once

#include "common/render/renderer.h"

namespace tandem {

[[nodiscard]] Backend cpu_backend();     // "cpu"
[[nodiscard]] Backend oracle_backend();  // "oracle"
[[nodiscard]] Backend first_backend();   // "first"

}  // namespace tandem
