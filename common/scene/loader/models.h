// The triangles of model files: Wavefront OBJ, by tinyobjloader, and glTF 2.0, by tinygltf. Materials are the scene
// file's, so those of the models are passed over, as are normals, groups, cameras, lights and animations.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <vector>

#include "common/scene/loader/json.h"

namespace tandem::scene_json {

struct TriangleModel {
    std::vector<glm::dvec3> vertices;
    std::vector<std::array<std::uint32_t, 3>> triangles;  // front: counter-clockwise, as in the file
    std::vector<glm::dvec2> texture_coordinates;          // of the vertices, v upwards; none unless asked for
};

// Both throw InputError at `place`, naming `shown` and, in an OBJ model, the line, for a model that is missing, too
// large (64 MiB, 2²⁴ triangles) or not sound: coordinates that are no finite numbers, faces that name vertices that are
// not there. With `coordinates` the corners of a triangle to which the model gives none have those of MODEL.md
// section 5.1.
[[nodiscard]] TriangleModel read_obj(
    const std::filesystem::path& path, const Place& place, const std::string& shown, bool coordinates);
[[nodiscard]] TriangleModel read_gltf(
    const std::filesystem::path& path, const Place& place, const std::string& shown, bool coordinates);

// Texture coordinates of a triangle's corners.
using CornerCoordinates = std::array<glm::dvec2, 3>;
inline constexpr CornerCoordinates default_coordinates{{{0.0, 0.0}, {1.0, 0.0}, {0.0, 1.0}}};
inline constexpr double greatest_coordinate = 1e6;  // beyond, single precision loses the place in an image

// Gives `model` the coordinates of its triangles' corners, as many as it has triangles; a vertex whose corners differ
// becomes several.
void set_coordinates(TriangleModel& model, const std::vector<CornerCoordinates>& corners);

}  // namespace tandem::scene_json
