// Parts of a Scene as JSON of a scene file (scenes/format/FORMAT.md). Exports keep such parts for `tandem import`, and
// imports write them.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "common/image/image_io.h"
#include "common/scene/scene.h"

namespace tandem::scene_export {

using Json = nlohmann::json;

// What is no UTF-8 of a name that another program wrote is replaced: JSON is UTF-8.
[[nodiscard]] inline std::string text_of(const Json& json, int indent = -1) {
    return json.dump(indent, ' ', false, Json::error_handler_t::replace);
}

[[nodiscard]] inline Json vector_json(const glm::dvec3& v) { return {v.x, v.y, v.z}; }
// 16 numbers, row by row.
[[nodiscard]] Json matrix_json(const glm::dmat4& matrix);

struct SceneNames {
    explicit SceneNames(const Scene& scene);
    std::vector<std::string> materials, textures, media;
};

[[nodiscard]] Json material_json(const Material& material, const SceneNames& names);
[[nodiscard]] Json texture_json(const Texture& texture, const std::string& image_file);
[[nodiscard]] Json medium_json(const Medium& medium);
[[nodiscard]] Json background_json(const Background& background, const std::string& image_file);
[[nodiscard]] Json render_json(const SceneDefaults& defaults);
[[nodiscard]] Json camera_json(const Camera& camera);

[[nodiscard]] Image image_of(const Pixels& pixels);
// A PFM file of linear pixels.
[[nodiscard]] std::string pfm_bytes(const Pixels& pixels);

}  // namespace tandem::scene_export
