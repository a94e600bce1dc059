#include "common/scene/import/import.h"

#include "common/error.h"

namespace tandem::scene_import {

std::string name_beside(const std::filesystem::path& file, const std::filesystem::path& out) {
    namespace fs = std::filesystem;
    std::error_code error;
    const fs::path folder = fs::weakly_canonical(fs::absolute(out).parent_path(), error);
    const fs::path there = fs::weakly_canonical(fs::absolute(file), error);
    return there.lexically_relative(folder).generic_string();
}

ImportedScene import_scene(const std::filesystem::path& file, const std::filesystem::path& out) {
    const std::string ending = file.extension().string();
    if (ending == ".gltf" || ending == ".glb") return from_gltf(file, out);
    if (ending == ".pbrt") return from_pbrt(file, out);
    throw input_error(file.string(), "", "is neither glTF nor pbrt by its ending", "name a .gltf, .glb or .pbrt file");
}

}  // namespace tandem::scene_import
