// Entities, groups and primitives of a scene file (MODEL.md sections 5 and 6) to those of a Scene. Groups are
// instanced: wherever one stands, its entities are repeated with the transform of the place, on the same primitives.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "common/scene/loader/json.h"
#include "common/scene/loader/models.h"
#include "common/scene/scene.h"

namespace tandem::scene_json {

class GeometryReader {
public:
    // `scene` holds its textures and materials, named by `materials`; the rest of it is filled.
    GeometryReader(Scene& scene, const Names& materials, std::filesystem::path folder)
        : scene_(scene), materials_(materials), folder_(std::move(folder)) {}

    // Reads "groups" and "entities" of the file's `root`.
    void read(const Value& root);

private:
    // An entity with its transform within its group, or, where `group` says so, a group in place of primitives.
    struct Item {
        Entity entity;
        std::uint32_t group = no_index;
    };
    struct Group {
        Value value;
        std::vector<Item> items;
        std::uint64_t primitives = 0, entities = 0;  // when placed
        bool entered = false, complete = false;
    };
    struct RangeBox {
        glm::dvec3 low{std::numeric_limits<double>::infinity()}, high{-std::numeric_limits<double>::infinity()};
        double radius = 0.0;  // the largest of a sphere
    };
    struct ModelTriangles {
        std::vector<std::array<std::uint32_t, 3>> triangles;  // by index into Scene::vertices
        std::vector<std::uint32_t> materials;                 // of the triangles, where the model's own are taken
    };

    [[nodiscard]] bool needs_coordinates(const Value& root) const;
    void complete(std::uint32_t group, const Value& reference);
    [[nodiscard]] std::vector<Item> read_item(const Value& value, bool grouped);
    void read_entity(const Value& value, bool grouped, Entity& entity);
    [[nodiscard]] std::vector<Item> read_models(const Value& value, bool grouped, const Item& item);
    void check_primitives(const Value& value, bool grouped, const Entity& entity, std::size_t first);
    [[nodiscard]] const RangeBox& box_of(std::size_t first, std::size_t end);
    void place(const Value& value, const Item& item, const glm::dmat4& outer, const glm::dvec3& outer_motion);
    void check_room(const Value& value, std::uint64_t primitives, std::uint64_t entities) const;
    void check_reach(const Value& value, const Entity& entity, std::size_t first, std::size_t end);
    void check_motion(const Value& value, const glm::dvec3& motion) const;
    void check_texture(const Value& value, const Entity& entity, std::size_t first, std::size_t end) const;

    void read_primitive(const Value& value);
    void read_sphere(const Value& value);
    void read_cuboid(const Value& value);
    void read_triangle(const Value& value);
    void read_quad(const Value& value);
    const ModelTriangles& read_model(const Value& value, bool gltf, bool own_materials);
    std::uint32_t add_material(const std::string& model, const ModelMaterial& source);
    std::uint32_t add_vertex(const glm::dvec3& point, const glm::dvec2& coordinates = glm::dvec2(0.0));
    void add_triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c);

    Scene& scene_;
    const Names& materials_;
    std::filesystem::path folder_;
    bool coordinates_ = false;  // vertices carry texture coordinates
    Names group_names_{"group", "groups"};
    std::vector<Group> groups_;
    std::uint32_t depth_ = 0;  // of the groups that are being read
    std::uint64_t placed_primitives_ = 0;
    std::map<std::string, ModelTriangles> models_;
    std::map<std::pair<std::size_t, std::size_t>, RangeBox> boxes_;
    std::map<const Pixels*, std::uint32_t> model_textures_;  // by the image
};

}  // namespace tandem::scene_json
