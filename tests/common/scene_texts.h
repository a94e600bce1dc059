// Scene files, and images and volumes beside them, as tests write and load them.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "common/image/image_io.h"
#include "common/scene/loader/scene_loader.h"
#include "tests/refusal.h"
#include "tests/temporary_folder.h"

namespace tandem::test {

using Json = nlohmann::json;

inline void put(const std::filesystem::path& path, const std::string& text) {
    std::ofstream(path, std::ios::binary) << text;
}

inline Json base() {
    return Json::parse(R"({"camera": {"position": [0, 0, 5], "target": [0, 0, 0], "vertical_field_degrees": 40},
        "materials": {"m": {"kind": "diffuse", "colour": [0.5, 0.25, 1]}}, "entities": []})");
}

inline Scene load(const TemporaryFolder& folder, const Json& scene) {
    put(folder / "scene.json", scene.dump());
    return load_scene(folder / "scene.json");
}

inline Scene load_patched(const std::string& patch) {
    const TemporaryFolder folder;
    Json scene = base();
    scene.merge_patch(Json::parse(patch));
    return load(folder, scene);
}

inline std::string refusal(const TemporaryFolder& folder, const Json& scene) {
    return tandem::refusal([&] { (void)load(folder, scene); });
}

inline Json image_scene(const std::string& file, const std::string& space) {
    Json scene = base();
    scene["textures"]["t"] = {{"kind", "image"}, {"file", file}, {"colour_space", space}};
    scene["materials"]["m"]["colour"] = {{"texture", "t"}};
    return scene;
}

inline void put_pfm(
    const std::filesystem::path& path, std::uint32_t width, std::uint32_t height, std::vector<float> values) {
    Image image;
    image.width = width;
    image.height = height;
    image.channels = {"R", "G", "B"};
    image.pixels = std::move(values);
    write_image(path, image);
}

inline std::string volume(
    std::int32_t encoding, std::array<std::int32_t, 3> cells, std::int32_t channels, const std::vector<float>& values) {
    std::string bytes = "VOL\x03";
    const auto append = [&](const void* data, std::size_t size) { bytes.append(static_cast<const char*>(data), size); };
    append(&encoding, 4);
    append(cells.data(), 12);
    append(&channels, 4);
    const float box[] = {-1, -2, -3, 1, 2, 3};
    append(box, sizeof box);
    append(values.data(), values.size() * sizeof(float));
    return bytes;
}

inline Json volume_scene() {
    Json scene = base();
    scene["media"]["smoke"] = {{"scattering", 2}, {"grid", {{"file", "smoke.vol"}, {"scale", 3}}}};
    return scene;
}

}  // namespace tandem::test
