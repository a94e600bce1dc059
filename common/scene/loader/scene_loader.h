// Scene files (scenes/format/FORMAT.md, scenes/format/scene.schema.json) to Scene.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "common/scene/scene.h"

namespace tandem {

// Throws InputError naming file, JSON pointer, reason and mend for everything that the format or MODEL.md forbids.
// `files` gets the names of all that was read: the file itself, models, images, grids.
[[nodiscard]] Scene load_scene(const std::filesystem::path& file, std::vector<std::string>* files = nullptr);

// The same of the text of a file that need not be there yet.
[[nodiscard]] Scene parse_scene(
    const std::string& text, const std::filesystem::path& file, std::vector<std::string>* files = nullptr);

}  // namespace tandem
