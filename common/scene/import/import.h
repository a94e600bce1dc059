// `tandem import`: scene files from other programs' scenes. scenes/format/EXPORT.md says what is imported.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "common/scene/export/export.h"

namespace tandem::scene_import {

using Json = nlohmann::json;

struct ImportedScene {
    Json document;                                  // a scene file
    std::vector<scene_export::ExportedFile> files;  // beside it
    std::vector<std::string> remarks;               // what is not taken over
    std::vector<std::string> inputs;                // all files read
};

// By the file's ending: .gltf and .glb, or .pbrt. `out` is where the scene file will stand: it names other files
// relative to its folder. Throws InputError.
[[nodiscard]] ImportedScene import_scene(const std::filesystem::path& file, const std::filesystem::path& out);

[[nodiscard]] ImportedScene from_gltf(const std::filesystem::path& file, const std::filesystem::path& out);
[[nodiscard]] ImportedScene from_pbrt(const std::filesystem::path& file, const std::filesystem::path& out);

// `file` as a scene file at `out` names it.
[[nodiscard]] std::string name_beside(const std::filesystem::path& file, const std::filesystem::path& out);

}  // namespace tandem::scene_import
