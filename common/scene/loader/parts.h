// The parts of a scene file that stand alone. Each function reads one JSON value by scenes/format/FORMAT.md and refuses
// what the format or MODEL.md forbids. geometry.h reads entities, groups and primitives.
#pragma once

#include <filesystem>

#include "common/files/read_file.h"
#include "common/scene/loader/json.h"
#include "common/scene/scene.h"

namespace tandem::scene_json {

// Magnitudes of lengths and radiances. Single-precision renderers square and sum them. 3 · (10¹⁸)² still lies within a
// float's range, and 10⁻³⁶ above its least normal number, 1.2 · 10⁻³⁸.
inline constexpr double greatest_length = 1e18;
inline constexpr double least_length = 1e-18;

// Models, images and grids: a grid of 2²⁴ cells takes 64 MiB and its header.
inline constexpr std::size_t greatest_file_bytes = std::size_t{128} << 20;

// The bytes of a file that the scene names `shown` at `place`, which is noted among the files read. Throws InputError.
[[nodiscard]] inline std::string read_named_file(
    const std::filesystem::path& path, const Place& place, const std::string& shown) {
    if (place.files) place.files->push_back(path.string());
    return read_file(path, greatest_file_bytes, {place.file, place.pointer, printable(shown)});
}

[[nodiscard]] inline glm::dvec3 read_point(const Value& value) {
    return value.vector(-greatest_length, greatest_length);
}
[[nodiscard]] inline glm::dvec3 read_radiance(const Value& value) { return value.vector(0.0, greatest_length); }
[[nodiscard]] inline double optional_number(
    const Value& object, std::string_view key, double least, double greatest, double otherwise) {
    return object.has(key) ? object.member(key).number(least, greatest) : otherwise;
}
// Refuses `key` in an object that would ignore it.
inline void without(const Value& object, std::string_view key, const std::string& reason) {
    if (object.has(key)) object.member(key).refuse(reason, "remove it");
}

[[nodiscard]] Film read_film(const Value& value);
[[nodiscard]] Camera read_camera(const Value& value);
[[nodiscard]] SceneDefaults read_render(const Value& value);
[[nodiscard]] glm::dmat4 read_transform(const Value& value);
[[nodiscard]] Expectation read_expectation(const Value& value);
// Refuses, at `value`, a map that is singular to double precision or too large (MODEL.md section 6).
void check_transform(const Value& value, const glm::dmat4& matrix);

// `folder` is the scene file's, to which the names of files are relative.
[[nodiscard]] Background read_background(const Value& value, const std::filesystem::path& folder);
[[nodiscard]] PunctualLight read_light(const Value& value);
[[nodiscard]] Texture read_texture(const Value& value, const std::string& name, const std::filesystem::path& folder);
[[nodiscard]] Medium read_medium(const Value& value, const std::string& name, const std::filesystem::path& folder);
[[nodiscard]] Material read_material(
    const Value& value, const std::string& name, const Names& textures, const Names& media);

// An image that the scene, or a model of it, names `shown` at `place`.
struct PixelSource {
    std::filesystem::path path;
    Place place;
    std::string shown;
    bool srgb = false;         // encoded by IEC 61966-2-1
    double greatest = 1.0;     // of its values
    bool alpha = false;        // it may have alpha, which is passed over
    std::string_view bytes{};  // of the file, where they stand within a model
    glm::dvec3 factor{1.0};    // of the linear values
};

// Its pixels, made linear. Refuses what is no number, negative or above `greatest`.
[[nodiscard]] std::shared_ptr<const Pixels> read_pixels(const PixelSource& source);

// The source of the file that `file` names.
[[nodiscard]] inline PixelSource pixel_source(const Value& file, const std::filesystem::path& folder) {
    const std::string name = file.relative_file();
    return {folder / name, file.place(), name};
}

}  // namespace tandem::scene_json
