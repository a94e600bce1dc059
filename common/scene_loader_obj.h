// The triangles of a Wavefront OBJ model; polygons are cut into triangles by tinyobjloader. Normals, texture
// coordinates, groups and material libraries are passed over: materials are the scene file's.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <glm/vec3.hpp>
#include <vector>

#include "common/scene_loader_json.h"

namespace tandem::scene_json {

struct ObjModel {
    std::vector<glm::dvec3> vertices;
    std::vector<std::array<std::uint32_t, 3>> triangles;  // front: counter-clockwise, as in the file
};

// Throws InputError at `place`, naming `shown` and the line, for a model that is missing, too large (64 MiB), or not
// sound: coordinates that are no finite numbers, faces without three corners or naming vertices that are not there.
[[nodiscard]] ObjModel read_obj(const std::filesystem::path& path, const Place& place, const std::string& shown);

}  // namespace tandem::scene_json
