// Whether a scene keeps what common/scene/scene.h promises to the backends, which trust it.
#pragma once

#include <string>

#include "common/scene/scene.h"

namespace tandem::fuzz {

// What is wrong with it, or nothing.
[[nodiscard]] std::string fault_of(const Scene& scene);

}  // namespace tandem::fuzz
