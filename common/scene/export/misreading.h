// What a loaded scene has otherwise than its file says. The writer of scene files, which shares no code with the loader
// but the table of materials' fields, writes the scene's parts. Then both are compared.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "common/scene/scene.h"

namespace tandem {

struct Misreading {
    std::string pointer;  // JSON pointer into the file
    std::string words;    // "/render/bounces is 256 in the file and 0 in the scene"
};
// The first of the numbers, names and vectors that the file has and a scene keeps as they are written. They are those
// of the camera, background, materials, textures, media and render settings. Nothing: all are alike, or the file is no
// scene file.
[[nodiscard]] std::optional<Misreading> misreading_of(const Scene& scene, const std::filesystem::path& file);

}  // namespace tandem
