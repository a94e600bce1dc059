#include "common/scene/import/import.h"

#include <algorithm>

#include "common/error.h"
#include "common/scene/export/parts_json.h"
#include "common/scene/loader/scene_loader.h"

namespace tandem::scene_import {

std::string name_beside(const std::filesystem::path& file, const std::filesystem::path& out) {
    namespace fs = std::filesystem;
    std::error_code error;
    const fs::path folder = fs::weakly_canonical(fs::absolute(out).parent_path(), error);
    const fs::path there = fs::weakly_canonical(fs::absolute(file), error);
    return there.lexically_relative(folder).generic_string();
}

namespace {

// What could not be rendered is refused here, where the file is known that it comes from. Entities whose files are not
// written yet are left out: a mesh is as sound as its importer found it.
void check(const ImportedScene& scene, const std::filesystem::path& file, const std::filesystem::path& out) {
    Json document = scene.document;
    auto& entities = document["entities"].get_ref<Json::array_t&>();
    std::erase_if(entities, [&](const Json& entity) {
        return std::ranges::any_of(entity.at("primitives"), [&](const Json& primitive) {
            const auto mesh = primitive.find("obj");
            return mesh != primitive.end() && std::ranges::find(scene.files, mesh->at("file").get<std::string>(),
                                                  &scene_export::ExportedFile::name) != scene.files.end();
        });
    });
    try {
        (void)parse_scene(scene_export::text_of(document), out);
    } catch (const InputError& error) {
        throw input_error(file.string(), "", "makes a scene that is refused: " + std::string(error.what()),
            "mend it here, as the scene file is not written");
    }
}

ImportedScene read(const std::filesystem::path& file, const std::filesystem::path& out) {
    const std::string ending = file.extension().string();
    if (ending == ".gltf" || ending == ".glb") return from_gltf(file, out);
    if (ending == ".pbrt") return from_pbrt(file, out);
    throw input_error(file.string(), "", "is neither glTF nor pbrt by its ending", "name a .gltf, .glb or .pbrt file");
}

}  // namespace

ImportedScene import_scene(const std::filesystem::path& file, const std::filesystem::path& out) {
    ImportedScene scene = read(file, out);
    check(scene, file, out);
    return scene;
}

}  // namespace tandem::scene_import
