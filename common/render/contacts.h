// Bodies in contact are kept a small gap apart (MODEL.md section 5.2). So rounding cannot decide whether a dielectric
// and the body under it are optically coupled.
#pragma once

#include <optional>

#include "common/scene/scene.h"

namespace tandem {

// The scene with the faces of dielectrics that touch another body drawn back by a hair. Empty: nothing touches, and the
// scene is to stay as it is, bit for bit.
[[nodiscard]] std::optional<Scene> with_contacts_apart(const Scene& scene);

}  // namespace tandem
