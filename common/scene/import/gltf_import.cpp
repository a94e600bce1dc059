// glTF 2.0: its camera, lights and nodes, and what Tandem's own exports keep in "extras". Meshes stay in the glTF file,
// which the scene file names; so do materials, unless "extras" have them.
#include <fmt/format.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <glm/gtc/matrix_transform.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/mat4x4.hpp>
#include <glm/trigonometric.hpp>
#include <optional>
#include <set>

#include "common/error.h"
#include "common/files/read_file.h"
#include "common/scene/export/parts_json.h"
#include "common/scene/import/import.h"
#include "common/scene/loader/gltf_materials.h"
#include "common/scene/loader/json.h"
#include "common/scene/loader/parts.h"

namespace tandem::scene_import {

namespace {

using scene_export::matrix_json;
using scene_export::vector_json;
using scene_json::Value;

constexpr int greatest_depth = 64;
constexpr std::uint32_t plain_height = 512;  // glTF knows no pixels, only their aspect

// The JSON of either form; the loader checks the rest of the container.
std::string json_of(const std::filesystem::path& file) {
    std::string bytes = read_file(file, scene_json::greatest_file_bytes);
    if (!bytes.starts_with("glTF")) return bytes;
    constexpr std::size_t header = 12, chunk = 8;
    std::size_t length = 0;
    for (std::size_t i = 4; i-- > 0 && bytes.size() > header + chunk;)
        length = length << 8 | static_cast<unsigned char>(bytes[header + i]);
    if (length == 0 || length > bytes.size() - header - chunk)
        throw input_error(file.string(), "", "is no sound binary glTF file", "export it again");
    return bytes.substr(header + chunk, length);
}

const Json* extras_of(const Json& thing) {
    const auto extras = thing.find("extras");
    if (extras == thing.end() || !extras->is_object()) return nullptr;
    const auto own = extras->find("tandem");
    return own == extras->end() ? nullptr : &*own;
}

bool is_rigid(const glm::dmat3& m) {
    const glm::dmat3 gram = glm::transpose(m) * m;
    for (int i = 0; i < 3; ++i)
        for (int k = 0; k < 3; ++k)
            if (!(std::abs(gram[i][k] - (i == k ? 1.0 : 0.0)) < 1e-5)) return false;
    return true;
}

class GltfImport {
public:
    GltfImport(const std::filesystem::path& file, const std::filesystem::path& out)
        : file_(file.string()),
          model_(name_beside(file, out)),
          folder_(std::filesystem::path(model_).parent_path()),
          source_(scene_json::parse_strict(json_of(file), file_)),
          root_(source_, file_),
          native_(root_, scene_json::ModelImages(file.parent_path(), root_.place()), embedded_) {}

    ImportedScene read() {
        const Value scene = chosen_scene();
        const Json* extras = extras_of(scene.json());
        own_ = extras != nullptr && extras->is_object();
        Json& document = result_.document;
        document = {{"description", "Imported from " + std::filesystem::path(file_).filename().string()},
            {"entities", Json::array()}};
        if (own_) take_extras(*extras);
        if (scene.has("nodes"))
            for (std::size_t i = 0; i < scene.member("nodes").array_size(); ++i)
                read_node(scene.member("nodes").element(i), glm::dmat4(1.0), nullptr, 0);
        if (!own_) document["entities"].push_back({{"primitives", {{{"gltf", {{"file", model_}}}}}}});
        finish();
        return std::move(result_);
    }

private:
    [[nodiscard]] Value element(std::string_view list, const Value& index) const {
        if (!root_.has(list)) index.refuse(fmt::format("the file has no {}", list), "export it again");
        const Value elements = root_.member(list);
        if (elements.array_size() == 0) elements.refuse("holds nothing", "export it again");
        return elements.element(index.integer(0, static_cast<std::uint32_t>(elements.array_size() - 1)));
    }

    [[nodiscard]] Value chosen_scene() const {
        if (root_.has("scene")) return element("scenes", root_.member("scene"));
        const Value scenes = root_.required("scenes");
        if (scenes.array_size() == 0) scenes.refuse("holds nothing", "export it again");
        return scenes.element(0);
    }

    // -- What Tandem's exports keep

    // Images lie beside the glTF file.
    void rename_images(Json& value) const {
        for (const char* key : {"file", "image"})
            if (value.is_object() && value.contains(key) && value[key].is_string())
                value[key] = (folder_ / value[key].get<std::string>()).generic_string();
    }

    void take_extras(const Json& extras) {
        for (const char* key : {"film", "render", "background", "textures", "media", "medium"})
            if (extras.contains(key)) result_.document[key] = extras[key];
        if (result_.document.contains("background")) rename_images(result_.document["background"]);
        if (result_.document.contains("textures"))
            for (auto& [name, texture] : result_.document["textures"].items()) rename_images(texture);
    }

    // -- Nodes

    static glm::dmat4 transform_of(const Value& node) {
        glm::dmat4 matrix(1.0);
        const auto numbers = [](const Value& value, std::size_t count) {
            if (value.array_size() != count) value.refuse("has another size", fmt::format("write {} numbers", count));
        };
        if (node.has("matrix")) {
            numbers(node.member("matrix"), 16);
            for (int i = 0; i < 16; ++i)
                matrix[i / 4][i % 4] = node.member("matrix")
                                           .element(static_cast<std::size_t>(i))
                                           .number(-scene_json::greatest_length, scene_json::greatest_length);
            return matrix;
        }
        if (node.has("translation"))
            matrix = glm::translate(matrix, scene_json::read_point(node.member("translation")));
        if (node.has("rotation")) {
            const Value turn = node.member("rotation");
            numbers(turn, 4);
            const auto part = [&](std::size_t i) { return turn.element(i).number(-1e6, 1e6); };
            glm::dquat q;
            q.x = part(0);
            q.y = part(1);
            q.z = part(2);
            q.w = part(3);
            if (!(glm::length(q) > 0.0)) turn.refuse("is no rotation", "write a unit quaternion");
            matrix = matrix * glm::mat4_cast(glm::normalize(q));
        }
        if (node.has("scale")) matrix = glm::scale(matrix, scene_json::read_point(node.member("scale")));
        return matrix;
    }

    // An entity that is being filled.
    struct Building {
        Json entity;
        glm::dmat4 world{1.0};
        std::optional<std::uint32_t> material;
    };

    void read_node(const Value& index, const glm::dmat4& outer, Building* building, int depth) {
        if (depth > greatest_depth) index.refuse("nodes that are no tree", "export it again");
        const Value node = element("nodes", index);
        if (!visited_.insert(&node.json()).second) index.refuse("nodes that are no tree", "export it again");
        const glm::dmat4 world = outer * transform_of(node);
        if (node.has("camera")) read_camera(element("cameras", node.member("camera")), node, world);
        if (node.has("extensions") && node.member("extensions").has("KHR_lights_punctual"))
            read_light(node.member("extensions").member("KHR_lights_punctual").required("light"), world);
        Building own;
        if (own_ && building == nullptr) {
            own.world = world;
            own.entity["primitives"] = Json::array();
            if (node.has("name") && !node.member("name").text().empty())
                own.entity["name"] = node.member("name").text();
            if (const Json* extras = extras_of(node.json()); extras != nullptr && extras->contains("motion"))
                own.entity["motion"] = (*extras)["motion"];
            building = &own;
        }
        if (own_ && node.has("mesh")) read_shape(node, world, *building);
        if (node.has("children"))
            for (std::size_t i = 0; i < node.member("children").array_size(); ++i)
                read_node(node.member("children").element(i), world, building, depth + 1);
        if (building == &own) place(own);
    }

    void place(Building& building) {
        if (building.entity["primitives"].empty()) return;
        if (building.world != glm::dmat4(1.0))
            building.entity["transform"] = {{{"matrix", matrix_json(building.world)}}};
        result_.document["entities"].push_back(std::move(building.entity));
    }

    // The one material of a mesh that a scene file can name; nothing where the model has to bring its own.
    std::optional<std::uint32_t> material_of(const Value& mesh) const {
        const Value parts = mesh.required("primitives");
        std::set<std::uint32_t> found;
        for (std::size_t i = 0; i < parts.array_size(); ++i) {
            if (!parts.element(i).has("material")) return std::nullopt;
            found.insert(parts.element(i).member("material").integer(0, no_index - 1));
        }
        if (found.size() != 1) return std::nullopt;
        const Json number = *found.begin();
        const Value material = element("materials", Value(number, file_));
        if (extras_of(material.json()) == nullptr && material.has("pbrMetallicRoughness"))
            for (const char* texture : {"baseColorTexture", "metallicRoughnessTexture"})
                if (material.member("pbrMetallicRoughness").has(texture)) return std::nullopt;
        return *found.begin();
    }

    // A node's sphere, cuboid or mesh joins the entity where it has its material and, but for spheres, its place.
    void read_shape(const Value& node, const glm::dmat4& world, Building& entity) {
        const Value mesh = element("meshes", node.member("mesh"));
        const std::optional<std::uint32_t> material = material_of(mesh);
        const bool same_place = world == entity.world;
        const Json* extras = extras_of(node.json());
        Json shape{{"gltf", {{"file", model_}, {"mesh", node.member("mesh").integer(0, no_index - 1)}}}};
        bool joins = same_place;
        if (extras != nullptr && extras->contains("sphere") && material) {
            shape = unit_sphere_at(node);
            joins = !shape.is_null();
            if (!joins) shape = {{"sphere", {{"centre", {0.0, 0.0, 0.0}}, {"radius", 1.0}}}};
        } else if (extras != nullptr && extras->contains("cuboid") && material) {
            shape = {{"cuboid", (*extras)["cuboid"]}};
        }
        joins = joins && material && (entity.entity["primitives"].empty() || entity.material == material);
        if (joins) {
            entity.material = material;
            entity.entity["material"] = material_name(*material);
            entity.entity["primitives"].push_back(std::move(shape));
            return;
        }
        Building other{.entity = {{"primitives", {std::move(shape)}}}, .world = world, .material = material};
        if (material) other.entity["material"] = material_name(*material);
        if (entity.entity.contains("motion")) other.entity["motion"] = entity.entity["motion"];
        place(other);
    }

    // That of a node which only moves and scales; null for others.
    static Json unit_sphere_at(const Value& node) {
        if (node.has("matrix") || node.has("rotation")) return nullptr;
        const glm::dvec3 centre =
            node.has("translation") ? scene_json::read_point(node.member("translation")) : glm::dvec3(0.0);
        const glm::dvec3 scale = node.has("scale") ? scene_json::read_point(node.member("scale")) : glm::dvec3(1.0);
        if (!(scale.x > 0.0 && scale.x == scale.y && scale.x == scale.z)) return nullptr;
        return {{"sphere", {{"centre", vector_json(centre)}, {"radius", scale.x}}}};
    }

    // -- Materials

    std::string material_name(std::uint32_t index) {
        if (const auto found = material_names_.find(index); found != material_names_.end()) return found->second;
        const Json number = index;
        const Value source = element("materials", Value(number, file_));
        std::string name = source.has("name") ? source.member("name").text() : "";
        if (name.empty() || result_.document["materials"].contains(name)) name += fmt::format(" {}", index);
        const Json* extras = extras_of(source.json());
        result_.document["materials"][name] = extras != nullptr ? *extras : native_material(index, name);
        return material_names_[index] = name;
    }

    Json native_material(std::uint32_t index, const std::string& name) {
        const std::uint32_t place = native_.index_of(static_cast<int>(index));
        const scene_json::ModelMaterial& read = native_.read_so_far()[place];
        Scene scene;  // whose names the material's JSON takes
        Material material = read.material;
        if (read.interior) {
            Json& media = result_.document["media"];
            std::string inside = name;
            while (media.contains(inside)) inside += "'";
            scene.media.push_back(*read.interior);
            scene.media[0].name = inside;
            media[inside] = scene_export::medium_json(*read.interior);
            material.interior = 0;
        }
        return scene_export::material_json(material, scene_export::SceneNames(scene));
    }

    // -- Camera and lights

    void read_camera(const Value& camera, const Value& node, const glm::dmat4& world) {
        Json& document = result_.document;
        if (document.contains("camera")) return remark("cameras after the first");
        if (!camera.has("perspective")) camera.refuse("is no perspective camera", "use one");
        if (!is_rigid(glm::dmat3(world))) node.refuse("a camera is scaled", "scale the scene instead");
        const Value lens = camera.member("perspective");
        const Json* extras = extras_of(camera.json());
        const auto kept = [&](const char* key) { return extras != nullptr && extras->contains(key); };
        const double distance = kept("target_distance") && (*extras)["target_distance"].is_number()
                                    ? (*extras)["target_distance"].get<double>()
                                    : 1.0;
        const glm::dvec3 position(world[3]), back(world[2]), up(world[1]);
        document["camera"] = {{"position", vector_json(position)}, {"target", vector_json(position - distance * back)},
            {"up", vector_json(up)},
            {"vertical_field_degrees", glm::degrees(lens.required("yfov").number(1e-9, 3.1415))}};
        for (const char* key : {"lens_radius", "focus_distance", "motion", "up"})
            if (kept(key)) document["camera"][key] = (*extras)[key];
        if (document.contains("film")) return;
        const double aspect = scene_json::optional_number(lens, "aspectRatio", 1e-3, 1e3, 4.0 / 3.0);
        document["film"] = {{"width", std::max(1L, std::lround(aspect * plain_height))}, {"height", plain_height}};
    }

    void read_light(const Value& index, const glm::dmat4& world) {
        const Value extensions = root_.required("extensions").required("KHR_lights_punctual");
        const Value lights = extensions.required("lights");
        if (lights.array_size() == 0) lights.refuse("holds nothing", "export it again");
        const Value light = lights.element(index.integer(0, static_cast<std::uint32_t>(lights.array_size() - 1)));
        const double strength = scene_json::optional_number(light, "intensity", 0.0, scene_json::greatest_length, 1.0);
        const glm::dvec3 colour = light.has("color") ? light.member("color").vector(0.0, 1.0) : glm::dvec3(1.0);
        const glm::dvec3 direction = -glm::normalize(glm::dvec3(world[2]));
        const Json intensity = vector_json(strength * colour), position = vector_json(glm::dvec3(world[3]));
        Json written;
        if (light.has("name") && !light.member("name").text().empty()) written["name"] = light.member("name").text();
        if (light.has("range")) remark("ranges of lights");
        switch (light.required("type").choice({"point", "spot", "directional"})) {
            case 0:
                written["point"] = {{"position", position}, {"intensity", intensity}};
                break;
            case 1: {
                const Value none(empty_, file_), cone = light.has("spot") ? light.member("spot") : none;
                const double inner = scene_json::optional_number(cone, "innerConeAngle", 0.0, 1.5708, 0.0);
                const double outer =
                    scene_json::optional_number(cone, "outerConeAngle", 0.0, 1.5708, glm::radians(45.0));
                written["spot"] = {{"position", position}, {"direction", vector_json(direction)},
                    {"intensity", intensity}, {"inner_degrees", glm::degrees(inner)},
                    {"outer_degrees", std::min(90.0, glm::degrees(outer))}};
                break;
            }
            default:
                written["sun"] = {{"direction", vector_json(direction)}, {"irradiance", intensity}};
        }
        result_.document["lights"].push_back(std::move(written));
    }

    // -- The end

    void remark(const std::string& what) { result_.remarks.push_back("is imported without " + what); }

    void finish() {
        Json& document = result_.document;
        if (!document.contains("camera"))
            root_.refuse("has no camera", "add one where you export it; a scene is looked at from somewhere");
        if (!document.contains("background")) remark("a background, which glTF has no word for: it is black");
        // Lights without a surface are found by light sampling alone (MODEL.md section 8.3).
        if (!document.contains("render")) document["render"] = {{"integrator", "next-event"}};
        for (const std::string& lost : native_.passed_over()) remark(lost);
        result_.inputs.push_back(file_);
    }

    std::string file_, model_;
    std::filesystem::path folder_;
    Json source_;
    Value root_;
    std::map<std::size_t, std::string> embedded_;
    std::set<const Json*> visited_;  // nodes
    scene_json::GltfMaterials native_;
    bool own_ = false;  // whether it is an export of Tandem's
    Json empty_ = Json::object();
    std::map<std::uint32_t, std::string> material_names_;
    ImportedScene result_;
};

}  // namespace

ImportedScene from_gltf(const std::filesystem::path& file, const std::filesystem::path& out) {
    return GltfImport(file, out).read();
}

}  // namespace tandem::scene_import
