// The host's two renderers: the Embree path tracer and the reference oracle.
#pragma once

#include "common/render/renderer.h"

namespace tandem {

[[nodiscard]] Backend cpu_backend();     // "cpu"
[[nodiscard]] Backend oracle_backend();  // "oracle"

}  // namespace tandem
