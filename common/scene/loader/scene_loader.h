// Scene files (scenes/format/FORMAT.md, scenes/format/scene.schema.json) to Scene.
#pragma once

#include <filesystem>

#include "common/scene/scene.h"

namespace tandem {

// Throws InputError naming file, JSON pointer, reason and mend for everything that the format or MODEL.md forbids.
[[nodiscard]] Scene load_scene(const std::filesystem::path& file);

}  // namespace tandem
