// A script for Blender: scripts/adapters/cycles.py with the scene in it, models taken apart, so that it stands alone.
#include <fmt/format.h>

#include "common/scene/export/cycles_script.h"
#include "common/scene/export/export.h"
#include "common/scene/export/parts_json.h"
#include "common/scene/export/shapes.h"

namespace tandem::scene_export {

namespace {

// Two triangles that a scene file's "quad" makes, as cycles.py gives lamps of that shape lights of their own.
Json quad_at(const Scene& scene, const Entity& entity, std::size_t p) {
    if (p + 1 >= entity.primitive_count) return nullptr;
    const Primitive& one = scene.primitives[entity.first_primitive + p];
    const Primitive& two = scene.primitives[entity.first_primitive + p + 1];
    if (one.kind != PrimitiveKind::triangle || two.kind != PrimitiveKind::triangle) return nullptr;
    const auto& [a, b, c] = one.index;
    if (two.index[0] != a || two.index[1] != c) return nullptr;
    const std::vector<glm::dvec3>& v = scene.vertices;
    const glm::dvec3 e = v[b] - v[a], g = v[c] - v[b];
    if (v[a] + e + g != v[c] || v[a] + g != v[two.index[2]]) return nullptr;
    const std::vector<glm::dvec2>& at = scene.texture_coordinates;
    if (!at.empty() && (at[a] != glm::dvec2(0, 0) || at[b] != glm::dvec2(1, 0) || at[c] != glm::dvec2(1, 1)))
        return nullptr;
    return {{"quad", {{"corner", vector_json(v[a])}, {"edges", {vector_json(e), vector_json(g)}}}}};
}

Json solid_json(const Scene& scene, const Primitive& primitive) {
    const glm::dvec3& first = scene.vertices[primitive.index[0]];
    if (primitive.kind == PrimitiveKind::sphere)
        return {{"sphere", {{"centre", vector_json(first)}, {"radius", primitive.radius}}}};
    return {
        {"cuboid", {{"minimum", vector_json(first)}, {"maximum", vector_json(scene.vertices[primitive.index[1]])}}}};
}

Json mesh_json(const Mesh& mesh) {
    Json points = Json::array(), faces = Json::array(), coordinates = Json::array();
    for (const glm::dvec3& point : mesh.points) points.push_back(vector_json(point));
    for (std::size_t i = 0; i < mesh.indices.size(); i += 3)
        faces.push_back({mesh.indices[i], mesh.indices[i + 1], mesh.indices[i + 2]});
    for (const glm::dvec2& at : mesh.coordinates) coordinates.push_back({at.x, at.y});
    return {{"mesh", {{"points", points}, {"faces", faces}, {"coordinates", coordinates}}}};
}

Json entity_json(const Scene& scene, const Entity& entity, const SceneNames& names) {
    Json json{{"name", entity.name}, {"material", names.materials[entity.material]}, {"primitives", Json::array()},
        {"transform", {{{"matrix", matrix_json(entity.object_to_world)}}}}};
    Scene rest;  // the triangles that are no quads
    rest.vertices = scene.vertices;
    rest.texture_coordinates = scene.texture_coordinates;
    for (std::size_t p = 0; p < entity.primitive_count; ++p) {
        const Primitive& primitive = scene.primitives[entity.first_primitive + p];
        if (primitive.kind != PrimitiveKind::triangle) {
            json["primitives"].push_back(solid_json(scene, primitive));
        } else if (Json quad = quad_at(scene, entity, p); !quad.is_null()) {
            json["primitives"].push_back(std::move(quad));
            ++p;
        } else {
            rest.primitives.push_back(primitive);
        }
    }
    const Entity all{.name = {}, .primitive_count = static_cast<std::uint32_t>(rest.primitives.size())};
    if (!rest.primitives.empty()) json["primitives"].push_back(mesh_json(triangles_of(rest, all, false)));
    return json;
}

Json light_json(const PunctualLight& light) {
    if (light.kind == PunctualKind::point)
        return {{"point", {{"position", vector_json(light.position)}, {"intensity", vector_json(light.intensity)}}}};
    return {{"sun", {{"direction", vector_json(light.direction)}, {"irradiance", vector_json(light.intensity)}}}};
}

}  // namespace

std::vector<ExportedFile> to_blender(const Scene& scene, const ExportOptions& options) {
    std::vector<ExportedFile> files(1);
    const auto image = [&](const Pixels& pixels, const std::string& ending) {
        files.push_back({beside(options.name, ending), pfm_bytes(pixels)});
        return files.back().name;
    };
    const SceneNames names(scene);
    Json json{{"film", {{"width", scene.film.width}, {"height", scene.film.height}}},
        {"camera", camera_json(scene.camera)}, {"render", render_json(scene.defaults)}};
    json["background"] = background_json(
        scene.background, scene.background.image ? image(*scene.background.image, ".background.pfm") : std::string());
    for (std::size_t i = 0; i < scene.textures.size(); ++i)
        json["textures"][names.textures[i]] = texture_json(scene.textures[i],
            scene.textures[i].image ? image(*scene.textures[i].image, fmt::format(".image{}.pfm", i)) : std::string());
    for (std::size_t i = 0; i < scene.materials.size(); ++i)
        json["materials"][names.materials[i]] = material_json(scene.materials[i], names);
    for (std::size_t i = 0; i < scene.media.size(); ++i) json["media"][names.media[i]] = medium_json(scene.media[i]);
    if (scene.medium != no_index) json["medium"] = names.media[scene.medium];
    for (const PunctualLight& light : scene.lights) json["lights"].push_back(light_json(light));
    json["entities"] = Json::array();
    for (const Entity& entity : scene.entities) json["entities"].push_back(entity_json(scene, entity, names));

    constexpr std::string_view place = "EXPORTED = None";
    std::string script(cycles_script);
    std::string text;
    for (const std::string& remark : remarks_on(scene, Target::blender)) text += "# " + remark + "\n";
    // A JSON text within JSON quotation marks is a Python text.
    text += "EXPORTED = json.loads(" + Json(text_of(json)).dump(-1, ' ', true) + ")";
    script.replace(script.find(place), place.size(), text);
    files[0] = {options.name, script};
    return files;
}

}  // namespace tandem::scene_export
