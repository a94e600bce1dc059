// The triangles and materials of model files: Wavefront OBJ, by tinyobjloader, and glTF 2.0, by tinygltf.
// scenes/format/FORMAT.md says what becomes of the materials. Groups, cameras, lights and animations are ignored.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/scene/loader/json.h"
#include "common/scene/loader/parts.h"
#include "common/scene/scene.h"

namespace tandem::scene_json {

// What is read of a model beside its triangles.
struct ModelParts {
    bool coordinates = false, normals = false, materials = false;
    std::optional<std::uint32_t> mesh = {};  // of glTF: this one alone, without the nodes' transforms
};

struct ModelMaterial {
    Material material;                           // its name, without the file's; without a texture
    std::shared_ptr<const Pixels> colour_image;  // takes the place of the colour
    std::optional<Medium> interior = {};         // its name is the material's
};

struct TriangleModel {
    std::vector<glm::dvec3> vertices;
    std::vector<std::array<std::uint32_t, 3>> triangles;  // front: counter-clockwise, as in the file
    std::vector<glm::dvec2> texture_coordinates;          // of the vertices, v upwards; none unless asked for
    std::vector<glm::dvec3> normals;         // of the vertices, unit, or 0 at flat triangles; or none at all
    std::vector<std::uint32_t> material_of;  // of the triangles, index into materials; none unless asked for
    std::vector<ModelMaterial> materials;    // those that triangles have
    std::set<std::string> passed_over;       // features of the file that are not taken over
};

// Both throw InputError at `place`, naming `shown` and, in an OBJ model, the line. Refused is a model that is missing,
// too large (64 MiB, 2²⁴ triangles) or not sound. That is coordinates that are no finite numbers, or faces that name
// missing vertices. With `coordinates` the corners of a triangle to which the model gives none have those of MODEL.md
// section 5.1.
[[nodiscard]] TriangleModel read_obj(
    const std::filesystem::path& path, const Place& place, const std::string& shown, ModelParts parts);
[[nodiscard]] TriangleModel read_gltf(
    const std::filesystem::path& path, const Place& place, const std::string& shown, ModelParts parts);

// What a triangle's corner has beside its place. A triangle without a normal at some corner is flat.
struct Corner {
    glm::dvec2 coordinates{0.0};
    glm::dvec3 normal{0.0};  // of any length
};
using Corners = std::array<Corner, 3>;
inline constexpr std::array<glm::dvec2, 3> default_coordinates{{{0.0, 0.0}, {1.0, 0.0}, {0.0, 1.0}}};
inline constexpr double greatest_coordinate = 1e6;  // beyond, single precision loses the place in an image

// Gives `model` what is read of its triangles' corners, of the last ones nothing where they are fewer; a vertex whose
// corners differ becomes several.
void set_corners(TriangleModel& model, std::vector<Corners> corners, ModelParts parts);

// The images of a model's materials, each read once for each factor that its colours are multiplied by.
class ModelImages {
public:
    ModelImages(std::filesystem::path folder, Place place) : folder_(std::move(folder)), place_(std::move(place)) {}

    // `name` is relative to the model's folder. `bytes`: where the image stands within the model.
    [[nodiscard]] std::shared_ptr<const Pixels> read(
        const std::string& name, bool srgb, const glm::dvec3& factor, std::string_view bytes = {});

private:
    std::filesystem::path folder_;
    Place place_;
    std::map<std::string, std::shared_ptr<const Pixels>> read_;  // by name, encoding and factor
};

}  // namespace tandem::scene_json
