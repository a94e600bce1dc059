#include "common/scene/loader/scene_loader.h"

#include "common/error.h"
#include "common/files/read_file.h"
#include "common/scene/loader/geometry.h"
#include "common/scene/loader/json.h"
#include "common/scene/loader/parts.h"

namespace tandem {

namespace {

using namespace scene_json;

constexpr std::size_t greatest_bytes = std::size_t{16} << 20;

// Each member of the object "section" by `read`, its name among `names`.
template <class Read>
void read_named(const Value& root, std::string_view section, Names& names, const Read& read) {
    if (!root.has(section)) return;
    root.member(section).for_each_member([&](const std::string& name, const Value& value) {
        names.add(name, value);
        read(value, name);
    });
}

Scene read_scene(const Value& root, const std::filesystem::path& file) {
    root.only({"$schema", "description", "film", "camera", "background", "render", "textures", "media", "medium",
        "materials", "lights", "groups", "entities", "expect"});
    for (const std::string_view key : {"$schema", "description"})
        if (root.has(key)) (void)root.member(key).text();
    const std::filesystem::path folder = file.parent_path();
    Scene scene;
    scene.name = file.stem().string();
    if (root.has("film")) scene.film = read_film(root.member("film"));
    scene.camera = read_camera(root.required("camera"));
    if (root.has("background")) scene.background = read_background(root.member("background"), folder);
    if (root.has("render")) scene.defaults = read_render(root.member("render"));
    if (root.has("expect")) scene.expect = read_expectation(root.member("expect"));

    Names textures("texture", "textures"), media("medium", "media"), materials("material", "materials");
    read_named(root, "textures", textures, [&](const Value& value, const std::string& name) {
        scene.textures.push_back(read_texture(value, name, folder));
    });
    read_named(root, "media", media,
        [&](const Value& value, const std::string& name) { scene.media.push_back(read_medium(value, name, folder)); });
    if (root.has("medium")) scene.medium = media.find(root.member("medium"));
    read_named(root, "materials", materials, [&](const Value& value, const std::string& name) {
        scene.materials.push_back(read_material(value, name, textures, media));
    });
    if (root.has("lights")) {
        const Value lights = root.member("lights");
        for (std::size_t i = 0; i < lights.array_size(); ++i) scene.lights.push_back(read_light(lights.element(i)));
    }
    GeometryReader(scene, materials, folder).read(root);
    return scene;
}

}  // namespace

Scene load_scene(const std::filesystem::path& file, std::vector<std::string>* files) {
    return parse_scene(read_file(file, greatest_bytes), file, files);
}

Scene parse_scene(const std::string& text, const std::filesystem::path& file, std::vector<std::string>* files) {
    const std::string name = file.string();
    if (text.size() > greatest_bytes)
        throw input_error(name, "", "a scene of more than 16 MiB", "put its triangles into a model");
    const Json document = parse_strict(text, name);
    const Value root(document, name);
    Scene scene = read_scene(root, file);
    if (files != nullptr) {
        files->push_back(name);
        files->insert(files->end(), root.files_read().begin(), root.files_read().end());
    }
    return scene;
}

}  // namespace tandem
