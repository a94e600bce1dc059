// Whether a scene keeps what scene.h promises to the backends, which trust it. The loader refuses a file that asks for
// another, so a scene that does not keep it was read or changed wrongly.
#pragma once

#include <string>

#include "common/scene/scene.h"

namespace tandem {

// Where it does not: "lights"; nothing where it does.
[[nodiscard]] std::string unsound_part(const Scene& scene);

}  // namespace tandem
