// glTF 2.0 with KHR_materials_{ior, transmission, volume, emissive_strength, specular} and KHR_lights_punctual. What it
// has no word for stands in "extras", under "tandem": scene, camera, materials, and the spheres and cuboids of nodes.
#include <fmt/format.h>

#include <array>
#include <cmath>
#include <cstring>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/gtc/matrix_transform.hpp>
#include <glm/trigonometric.hpp>
#include <limits>
#include <map>

#include "common/error.h"
#include "common/image/image_io_parts.h"
#include "common/scene/export/export.h"
#include "common/scene/export/parts_json.h"
#include "common/scene/export/shapes.h"

namespace tandem::scene_export {

namespace {

constexpr int float_type = 5126, index_type = 5125, vertices_target = 34962, indices_target = 34963;

std::string base64(const std::string& bytes) {
    constexpr std::string_view digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string text;
    text.reserve((bytes.size() + 2) / 3 * 4);
    for (std::size_t i = 0; i < bytes.size(); i += 3) {
        std::uint32_t word = 0;
        for (std::size_t k = 0; k < 3; ++k)
            word = word << 8 | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0U);
        for (std::size_t k = 0; k < 4; ++k) text += i + k <= bytes.size() ? digits[word >> (18 - 6 * k) & 63U] : '=';
    }
    return text;
}

void append_word(std::string& bytes, std::uint32_t word) {
    for (int shift = 0; shift < 32; shift += 8) bytes += static_cast<char>(word >> shift & 255U);
}

class GltfWriter {
public:
    GltfWriter(const Scene& scene, const ExportOptions& options) : scene_(scene), options_(options), names_(scene) {}

    std::vector<ExportedFile> write() {
        document_ = {{"asset", {{"version", "2.0"}, {"generator", "Tandem"}}}, {"scene", 0}, {"nodes", Json::array()}};
        document_["asset"]["extras"]["remarks"] = remarks_on(scene_, Target::gltf);
        for (std::size_t i = 0; i < scene_.materials.size(); ++i)
            write_material(scene_.materials[i], names_.materials[i]);
        write_camera();
        write_lights();
        for (const Entity& entity : scene_.entities) write_entity(entity);
        Json roots = Json::array();
        for (const std::size_t root : roots_) roots.push_back(root);
        document_["scenes"] = {{{"name", scene_.name}, {"nodes", roots}}};
        if (!options_.strict) document_["scenes"][0]["extras"]["tandem"] = scene_extras();
        if (!extensions_.empty()) document_["extensionsUsed"] = extensions_;
        files_.insert(files_.begin(), {options_.name, options_.name.ends_with(".glb") ? container() : text()});
        return std::move(files_);
    }

private:
    // -- Data

    std::size_t add_view(const std::string& bytes, int target) {
        while (binary_.size() % 4 != 0) binary_ += '\0';
        Json view{{"buffer", 0}, {"byteOffset", binary_.size()}, {"byteLength", bytes.size()}};
        if (target != 0) view["target"] = target;
        binary_ += bytes;
        return add("bufferViews", std::move(view));
    }

    std::size_t add(const char* list, Json thing) {
        Json& things = document_[list];
        things.push_back(std::move(thing));
        return things.size() - 1;
    }

    template <int size>
    std::size_t add_floats(const std::vector<glm::vec<size, double>>& values, bool bounds) {
        std::string bytes;
        glm::vec<size, float> least(std::numeric_limits<float>::max()), greatest(-least);
        for (const auto& value : values) {
            const glm::vec<size, float> rounded(value);
            least = glm::min(least, rounded);
            greatest = glm::max(greatest, rounded);
            bytes.append(reinterpret_cast<const char*>(&rounded), sizeof rounded);
        }
        Json accessor{{"bufferView", add_view(bytes, vertices_target)}, {"componentType", float_type},
            {"count", values.size()}, {"type", size == 2 ? "VEC2" : "VEC3"}};
        if (bounds)
            for (int i = 0; i < size; ++i) {
                accessor["min"].push_back(least[i]);
                accessor["max"].push_back(greatest[i]);
            }
        return add("accessors", std::move(accessor));
    }

    Json add_mesh_data(const Mesh& mesh) {
        Json data{{"attributes", {{"POSITION", add_floats(mesh.points, true)}}}};
        if (!mesh.normals.empty()) data["attributes"]["NORMAL"] = add_floats(mesh.normals, false);
        if (!mesh.coordinates.empty()) {
            std::vector<glm::dvec2> downwards = mesh.coordinates;  // glTF counts v from the top of an image
            for (glm::dvec2& at : downwards) at.y = 1.0 - at.y;
            data["attributes"]["TEXCOORD_0"] = add_floats(downwards, false);
        }
        std::string bytes;
        for (const std::uint32_t index : mesh.indices) append_word(bytes, index);
        data["indices"] =
            add("accessors", {{"bufferView", add_view(bytes, indices_target)}, {"componentType", index_type},
                                 {"count", mesh.indices.size()}, {"type", "SCALAR"}});
        return data;
    }

    // -- Shapes

    // Accessors are shared by all entities of a range.
    const std::vector<Json>& triangle_data(const Entity& entity) {
        const auto [place, added] = triangles_.try_emplace({entity.first_primitive, entity.primitive_count});
        if (added)
            for (const bool smooth : {false, true})
                if (const Mesh mesh = triangles_of(scene_, entity, smooth); !mesh.indices.empty())
                    place->second.push_back(add_mesh_data(mesh));
        return place->second;
    }

    std::size_t add_mesh(std::vector<Json> parts, std::uint32_t material) {
        for (Json& part : parts) part["material"] = material;
        return add("meshes", {{"primitives", std::move(parts)}});
    }

    // `shape` is what scene files call it.
    std::size_t add_solid(const Primitive& primitive, std::uint32_t material, Json& node) {
        const glm::dvec3& first = scene_.vertices[primitive.index[0]];
        if (primitive.kind == PrimitiveKind::sphere) {
            if (sphere_.is_null()) sphere_ = add_mesh_data(unit_sphere());
            if (!spheres_.contains(material)) spheres_[material] = add_mesh({sphere_}, material);
            node["mesh"] = spheres_[material];
            node["translation"] = vector_json(first);
            node["scale"] = vector_json(glm::dvec3(primitive.radius));
            if (!options_.strict) node["extras"]["tandem"]["sphere"] = true;  // the node says where and how large
        } else {
            const glm::dvec3& second = scene_.vertices[primitive.index[1]];
            node["mesh"] = add_mesh({add_mesh_data(cuboid(first, second))}, material);
            if (!options_.strict)
                node["extras"]["tandem"]["cuboid"] = {
                    {"minimum", vector_json(first)}, {"maximum", vector_json(second)}};
        }
        return add("nodes", node);
    }

    // A node an entity, with its triangles; its spheres and cuboids are nodes below.
    void write_entity(const Entity& entity) {
        Json node{{"name", entity.name}};
        if (entity.object_to_world != glm::dmat4(1.0)) {
            Json matrix = Json::array();
            for (int i = 0; i < 16; ++i) matrix.push_back(entity.object_to_world[i / 4][i % 4]);
            node["matrix"] = matrix;
        }
        if (const std::vector<Json>& parts = triangle_data(entity); !parts.empty())
            node["mesh"] = add_mesh(parts, entity.material);
        for (std::size_t p = 0; p < entity.primitive_count; ++p) {
            const Primitive& primitive = scene_.primitives[entity.first_primitive + p];
            if (primitive.kind == PrimitiveKind::triangle) continue;
            Json solid = Json::object();
            node["children"].push_back(add_solid(primitive, entity.material, solid));
        }
        if (!options_.strict) {
            Json& extras = node["extras"]["tandem"];
            extras["entity"] = true;
            if (entity.motion != glm::dvec3(0.0)) extras["motion"] = vector_json(entity.motion);
        }
        roots_.push_back(add("nodes", std::move(node)));
    }

    // -- Materials

    Json& extension(Json& thing, const std::string& name) {
        if (std::ranges::find(extensions_, name) == extensions_.end()) extensions_.push_back(name);
        return thing["extensions"][name] = Json::object();
    }

    std::size_t image_texture(const Texture& texture) {
        const auto [place, added] = textures_.try_emplace(&texture);
        if (added) {
            const std::string png = image_files::srgb16_png_bytes(image_of(*texture.image), options_.name);
            const std::size_t image = add("images", {{"bufferView", add_view(png, 0)}, {"mimeType", "image/png"}});
            place->second = add("textures", {{"source", image}, {"sampler", 0}});
            document_["samplers"] = {{{"magFilter", 9729}, {"minFilter", 9729}, {"wrapS", 10497}, {"wrapT", 10497}}};
        }
        return place->second;
    }

    // The base colour, and whether glTF has it.
    bool write_colour(const Material& material, Json& pbr) {
        glm::dvec3 colour = material.translucent ? 1.0 - material.alpha * (1.0 - material.colour) : material.colour;
        bool said = true;
        if (material.colour_texture != no_index) {
            const Texture& texture = scene_.textures[material.colour_texture];
            said = false;
            colour = texture.image ? glm::dvec3(1.0) : 0.5 * (texture.first + texture.second);
            if (texture.image) pbr["baseColorTexture"] = {{"index", image_texture(texture)}};
        }
        pbr["baseColorFactor"] = {colour.x, colour.y, colour.z, 1.0};
        return said;
    }

    void write_emission(const Material& material, Json& json) {
        const double strength = std::max({material.radiance.x, material.radiance.y, material.radiance.z});
        if (strength == 0.0) return;
        json["emissiveFactor"] = vector_json(material.radiance / strength);
        extension(json, "KHR_materials_emissive_strength")["emissiveStrength"] = strength;
    }

    // What is no metal and not clear has no gloss.
    bool write_diffuse(const Material& material, Json& json, Json& pbr) {
        pbr["metallicFactor"] = 0.0;
        pbr["roughnessFactor"] = 1.0;
        extension(json, "KHR_materials_specular")["specularFactor"] = 0.0;
        write_emission(material, json);
        json["doubleSided"] = material.radiance == glm::dvec3(0.0) || material.sides == EmittingSides::both;
        if (material.kind == MaterialKind::emissive) pbr["baseColorFactor"] = {0.0, 0.0, 0.0, 1.0};
        if (material.kind == MaterialKind::emissive) return material.radiance != glm::dvec3(0.0);
        return write_colour(material, pbr) && (material.kind == MaterialKind::diffuse || material.roughness == 0.0);
    }

    bool write_metal(const Material& material, Json& pbr) {
        const glm::dvec3 minus = material.eta - 1.0, plus = material.eta + 1.0, square = material.k * material.k;
        const glm::dvec3 facing = (minus * minus + square) / (plus * plus + square);
        pbr["metallicFactor"] = 1.0;
        pbr["roughnessFactor"] = material.roughness;
        pbr["baseColorFactor"] = {facing.x, facing.y, facing.z, 1.0};
        return false;  // glTF's metal has one number a channel for the two of a complex index
    }

    bool write_mirror(const Material& material, Json& pbr) {
        (void)write_colour(material, pbr);
        pbr["metallicFactor"] = 1.0;
        pbr["roughnessFactor"] = material.fuzz;
        return false;
    }

    bool write_glass(const Material& material, Json& json, Json& pbr) {
        bool said = material.kind == MaterialKind::specular && material.fuzz == 0.0 &&
                    material.fresnel == Fresnel::exact && !material.priority;
        if (material.kind == MaterialKind::boundary)
            pbr["baseColorFactor"] = {1.0, 1.0, 1.0, 1.0};
        else
            said = write_colour(material, pbr) && said;
        pbr["metallicFactor"] = 0.0;
        pbr["roughnessFactor"] = std::max(material.roughness, material.fuzz);
        extension(json, "KHR_materials_transmission")["transmissionFactor"] = 1.0;
        const double index = material.kind == MaterialKind::boundary ? 1.0 : material.refractive_index;
        extension(json, "KHR_materials_ior")["ior"] = std::max(index, 1.0);
        Json& volume = extension(json, "KHR_materials_volume");
        volume["thicknessFactor"] = 1.0;
        if (material.interior != no_index) said = write_interior(scene_.media[material.interior], volume) && said;
        if (material.kind == MaterialKind::emissive) write_emission(material, json);
        return said && index >= 1.0;
    }

    // Absorption as the colour that is left after a distance.
    static bool write_interior(const Medium& medium, Json& volume) {
        const glm::dvec3& absorption = medium.absorption;
        const double most = std::max({absorption.x, absorption.y, absorption.z});
        if (most > 0.0) {
            volume["attenuationDistance"] = 1.0 / most;
            volume["attenuationColor"] = vector_json(glm::exp(-absorption / most));
        }
        return most > 0.0 && medium.scattering == glm::dvec3(0.0) && !medium.grid;
    }

    void write_material(const Material& material, const std::string& name) {
        Json json{{"name", name}, {"doubleSided", true}}, pbr = Json::object();
        bool said = false;
        if (material.translucent || material.kind == MaterialKind::boundary)
            said = write_glass(material, json, pbr);
        else if (material.kind == MaterialKind::conductor)
            said = write_metal(material, pbr);
        else if (material.kind == MaterialKind::specular)
            said = write_mirror(material, pbr);
        else
            said = write_diffuse(material, json, pbr);
        json["pbrMetallicRoughness"] = pbr;
        if (!said && !options_.strict) json["extras"]["tandem"] = material_json(material, names_);
        add("materials", std::move(json));
    }

    // -- Camera, lights, and the rest

    // Its -z to `direction`.
    static Json pose(const glm::dvec3& position, const glm::dvec3& direction, const glm::dvec3& up) {
        const glm::dvec3 back = -glm::normalize(direction), right = glm::normalize(glm::cross(up, back));
        const glm::dvec3 above = glm::cross(back, right);
        return {right.x, right.y, right.z, 0.0, above.x, above.y, above.z, 0.0, back.x, back.y, back.z, 0.0, position.x,
            position.y, position.z, 1.0};
    }

    void write_camera() {
        const Camera& camera = scene_.camera;
        Json json{{"type", "perspective"},
            {"perspective",
                {{"yfov", glm::radians(camera.vertical_field_degrees)},
                    {"aspectRatio", double{1.0} * scene_.film.width / scene_.film.height}, {"znear", 1e-3}}}};
        if (!options_.strict) {
            Json& extras = json["extras"]["tandem"] = camera_json(camera);  // the node says where it stands
            for (const char* said : {"position", "target", "vertical_field_degrees"}) extras.erase(said);
            if (!extras.contains("motion")) extras.erase("up");  // a turned one stays upright by it
            extras["target_distance"] = glm::length(camera.target - camera.position);
        }
        document_["cameras"] = {json};
        roots_.push_back(
            add("nodes", {{"name", "camera"}, {"camera", 0},
                             {"matrix", pose(camera.position, camera.target - camera.position, camera.up)}}));
    }

    void write_lights() {
        Json lights = Json::array();
        constexpr const char* kinds[] = {"point", "spot", "directional"};
        for (const PunctualLight& light : scene_.lights) {
            const double strength = std::max({light.intensity.x, light.intensity.y, light.intensity.z, 1e-300});
            Json json{{"name", light.name}, {"type", kinds[static_cast<std::size_t>(light.kind)]},
                {"intensity", strength}, {"color", vector_json(light.intensity / strength)}};
            if (light.kind == PunctualKind::spot)
                json["spot"] = {{"innerConeAngle", glm::radians(light.inner_degrees)},
                    {"outerConeAngle", glm::radians(light.outer_degrees)}};
            const glm::dvec3 up = std::abs(light.direction.y) < 0.9 ? glm::dvec3(0, 1, 0) : glm::dvec3(1, 0, 0);
            Json node{{"name", light.name}, {"matrix", pose(light.position, light.direction, up)}};
            extension(node, "KHR_lights_punctual")["light"] = lights.size();
            roots_.push_back(add("nodes", std::move(node)));
            lights.push_back(std::move(json));
        }
        if (!lights.empty()) document_["extensions"]["KHR_lights_punctual"]["lights"] = std::move(lights);
    }

    std::string image_beside(const Pixels& pixels, const std::string& ending) {
        files_.push_back({beside(options_.name, ending), pfm_bytes(pixels)});
        return files_.back().name;
    }

    Json scene_extras() {
        Json extras{{"film", {{"width", scene_.film.width}, {"height", scene_.film.height}}},
            {"render", render_json(scene_.defaults)}};
        const Background& background = scene_.background;
        extras["background"] = background_json(
            background, background.image ? image_beside(*background.image, ".background.pfm") : std::string());
        for (std::size_t i = 0; i < scene_.textures.size(); ++i) {
            const Texture& texture = scene_.textures[i];
            extras["textures"][names_.textures[i]] = texture_json(
                texture, texture.image ? image_beside(*texture.image, fmt::format(".image{}.pfm", i)) : std::string());
        }
        for (std::size_t i = 0; i < scene_.media.size(); ++i)
            extras["media"][names_.media[i]] = medium_json(scene_.media[i]);
        if (scene_.medium != no_index) extras["medium"] = names_.media[scene_.medium];
        return extras;
    }

    // -- The file

    std::string text() {
        if (!binary_.empty())
            document_["buffers"] = {
                {{"byteLength", binary_.size()}, {"uri", "data:application/octet-stream;base64," + base64(binary_)}}};
        return text_of(document_, 1) + "\n";
    }

    std::string container() {
        while (binary_.size() % 4 != 0) binary_ += '\0';
        if (!binary_.empty()) document_["buffers"] = {{{"byteLength", binary_.size()}}};
        std::string json = text_of(document_);
        while (json.size() % 4 != 0) json += ' ';
        constexpr std::size_t header = 12, chunk = 8;
        const std::size_t size = header + chunk + json.size() + (binary_.empty() ? 0 : chunk + binary_.size());
        std::string bytes = "glTF";
        append_word(bytes, 2);
        append_word(bytes, static_cast<std::uint32_t>(size));
        append_word(bytes, static_cast<std::uint32_t>(json.size()));
        bytes += "JSON" + json;
        if (binary_.empty()) return bytes;
        append_word(bytes, static_cast<std::uint32_t>(binary_.size()));
        bytes.append("BIN\0", 4);
        return bytes + binary_;
    }

    const Scene& scene_;
    const ExportOptions& options_;
    SceneNames names_;
    Json document_;
    std::string binary_;
    std::vector<std::string> extensions_;
    std::vector<std::size_t> roots_;
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::vector<Json>> triangles_;
    Json sphere_;
    std::map<std::uint32_t, std::size_t> spheres_;  // meshes, by material
    std::map<const Texture*, std::size_t> textures_;
    std::vector<ExportedFile> files_;
};

}  // namespace

std::vector<ExportedFile> to_gltf(const Scene& scene, const ExportOptions& options) {
    return GltfWriter(scene, options).write();
}

}  // namespace tandem::scene_export
