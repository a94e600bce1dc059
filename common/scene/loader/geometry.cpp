#include "common/scene/loader/geometry.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <set>

#include "common/scene/loader/models.h"
#include "common/scene/loader/parts.h"

namespace tandem::scene_json {

namespace {

constexpr std::uint64_t greatest_primitive_count = std::uint64_t{1} << 24;
constexpr std::uint64_t greatest_entity_count = std::uint64_t{1} << 20;
constexpr std::uint32_t greatest_group_depth = 32;
constexpr std::size_t greatest_name_bytes = 200;  // an instance repeats it

// Cells of a pattern are counted in 32 bits.
constexpr double greatest_cell = 0x1p30;

std::size_t point_count(PrimitiveKind kind) {
    return kind == PrimitiveKind::triangle ? 3 : kind == PrimitiveKind::cuboid ? 2 : 1;
}

}  // namespace

void GeometryReader::read(const Value& root) {
    coordinates_ = needs_coordinates(root);
    if (root.has("groups"))
        root.member("groups").for_each_member([&](const std::string& name, const Value& value) {
            group_names_.add(name, value);
            groups_.push_back({value, {}, 0, 0, false, false});
        });
    if (root.has("entities")) {
        const Value entities = root.member("entities");
        for (std::size_t i = 0; i < entities.array_size(); ++i) {
            const Value value = entities.element(i);
            place(value, read_item(value, false), glm::dmat4(1.0), glm::dvec3(0.0));
        }
    }
    // What stands nowhere is checked, and leaves no trace.
    const std::size_t vertices = scene_.vertices.size(), primitives = scene_.primitives.size();
    for (std::uint32_t group = 0; group < groups_.size(); ++group) complete(group, groups_[group].value);
    scene_.vertices.resize(vertices);
    scene_.primitives.resize(primitives);
    if (coordinates_) scene_.texture_coordinates.resize(vertices);
}

// Whether an entity or group names a material whose texture uses coordinates; the names are checked later.
bool GeometryReader::needs_coordinates(const Value& root) const {
    std::set<std::string, std::less<>> names;
    for (const Material& material : scene_.materials)
        if (material.colour_texture != no_index &&
            scene_.textures[material.colour_texture].space == TextureSpace::coordinates)
            names.insert(material.name);
    const auto any_in = [&](const Json& items) {
        return items.is_array() && std::ranges::any_of(items, [&](const Json& item) {
            return item.is_object() && item.contains("material") && item["material"].is_string() &&
                   names.contains(item["material"].get_ref<const std::string&>());
        });
    };
    if (names.empty()) return false;
    if (root.has("entities") && any_in(root.member("entities").json())) return true;
    if (!root.has("groups")) return false;
    const Value groups = root.member("groups");
    return groups.json().is_object() && std::ranges::any_of(groups.json(), any_in);
}

// Reads a group and those in it, once.
void GeometryReader::complete(std::uint32_t index, const Value& reference) {
    if (groups_[index].complete) return;
    if (groups_[index].entered) reference.refuse("the group is within itself", "break the circle");
    if (depth_ == greatest_group_depth)
        reference.refuse(fmt::format("groups nest deeper than {} levels", greatest_group_depth), "nest fewer");
    groups_[index].entered = true;
    ++depth_;
    const Value value = groups_[index].value;
    if (value.array_size() == 0) value.refuse("a group without entities", "add some, or remove it");
    for (std::size_t i = 0; i < value.array_size(); ++i) {
        const Value element = value.element(i);
        const Item item = read_item(element, true);
        Group& group = groups_[index];
        const bool nested = item.group != no_index;
        group.primitives += nested ? groups_[item.group].primitives : item.entity.primitive_count;
        group.entities += nested ? groups_[item.group].entities : 1;
        check_room(element, group.primitives, group.entities);
        group.items.push_back(item);
    }
    --depth_;
    groups_[index].complete = true;
}

GeometryReader::Item GeometryReader::read_item(const Value& value, bool grouped) {
    Item item;
    const bool group = value.has("group");
    if (group)
        value.only({"name", "group", "transform", "motion"});
    else
        value.only({"name", "material", "transform", "primitives", "motion"});
    if (value.has("name")) {
        item.entity.name = value.member("name").text();
        if (item.entity.name.size() > greatest_name_bytes)
            value.member("name").refuse("the name is too long", fmt::format("keep to {} bytes", greatest_name_bytes));
    }
    if (value.has("transform")) item.entity.object_to_world = read_transform(value.member("transform"));
    if (value.has("motion")) item.entity.motion = read_point(value.member("motion"));
    if (group) {
        item.group = group_names_.find(value.member("group"));
        complete(item.group, value.member("group"));
    } else {
        read_entity(value, grouped, item.entity);
    }
    return item;
}

void GeometryReader::read_entity(const Value& value, bool grouped, Entity& entity) {
    entity.material = materials_.find(value.required("material"));
    entity.first_primitive = static_cast<std::uint32_t>(scene_.primitives.size());
    const Value primitives = value.required("primitives");
    if (primitives.array_size() == 0) primitives.refuse("an entity without primitives", "add some, or remove it");
    for (std::size_t i = 0; i < primitives.array_size(); ++i) {
        const std::size_t first = scene_.primitives.size();
        const Value primitive = primitives.element(i);
        read_primitive(primitive);
        const std::size_t end = scene_.primitives.size();
        if (end > greatest_primitive_count)
            primitive.refuse(
                fmt::format("the scene has more than {} primitives", greatest_primitive_count), "simplify its models");
        if (!grouped) check_reach(primitive, entity, first, end);
        check_texture(primitive, entity, first, end);
    }
    entity.primitive_count = static_cast<std::uint32_t>(scene_.primitives.size()) - entity.first_primitive;
}

// Appends an entity, or those of a group, under an outer transform. A group's transform leads to the space in which its
// displacement is meant, so displacements are turned and scaled by what is outside of their own item.
void GeometryReader::place(
    const Value& value, const Item& item, const glm::dmat4& outer, const glm::dvec3& outer_motion) {
    Entity entity = item.entity;
    const bool nested = outer != glm::dmat4(1.0);
    if (nested) {
        entity.object_to_world = outer * item.entity.object_to_world;
        check_transform(value, entity.object_to_world);
    }
    entity.motion = (nested ? glm::dmat3(outer) * item.entity.motion : item.entity.motion) + outer_motion;
    check_motion(value, entity.motion);
    if (item.group != no_index) {
        const Group& group = groups_[item.group];
        check_room(value, placed_primitives_ + group.primitives, scene_.entities.size() + group.entities);
        for (const Item& inner : group.items) place(value, inner, entity.object_to_world, entity.motion);
        return;
    }
    check_reach(value, entity, entity.first_primitive, entity.first_primitive + std::size_t{entity.primitive_count});
    placed_primitives_ += entity.primitive_count;
    check_room(value, placed_primitives_, scene_.entities.size() + 1);
    scene_.entities.push_back(std::move(entity));
}

// Asked of a group before it is repeated: a few lines of nested groups could ask for any number.
void GeometryReader::check_room(const Value& value, std::uint64_t primitives, std::uint64_t entities) const {
    if (primitives > greatest_primitive_count)
        value.refuse(
            fmt::format("the scene has more than {} primitives", greatest_primitive_count), "repeat fewer groups");
    if (entities > greatest_entity_count)
        value.refuse(fmt::format("the scene has more than {} entities", greatest_entity_count), "repeat fewer groups");
}

void GeometryReader::check_motion(const Value& value, const glm::dvec3& motion) const {
    if (!(glm::length(motion) <= 2.0 * greatest_length))
        value.refuse("moves too far", fmt::format("keep lengths below {}", shown(greatest_length)));
}

// Refuses primitives that the entity's transform carries out of the renderers' range.
void GeometryReader::check_reach(const Value& value, const Entity& entity, std::size_t first, std::size_t end) const {
    const glm::dmat4& object_to_world = entity.object_to_world;
    for (std::size_t p = first; p < end; ++p) {
        const Primitive& primitive = scene_.primitives[p];
        double reach = 0.0;
        for (std::size_t i = 0; i < point_count(primitive.kind); ++i) {
            const glm::dvec3& point = scene_.vertices[primitive.index[i]];
            reach = std::max(reach, glm::length(glm::dvec3(object_to_world * glm::dvec4(point, 1.0))));
        }
        for (int axis = 0; axis < 3; ++axis)
            reach = std::max(reach, primitive.radius * glm::length(glm::dvec3(object_to_world[axis])));
        if (!(reach <= 2.0 * greatest_length))  // √3 is a corner's share
            value.refuse("lies too far out", fmt::format("keep lengths below {}", shown(greatest_length)));
    }
}

// Refuses a pattern so fine that the numbers of its cells overflow (MODEL.md section 7.0).
void GeometryReader::check_texture(const Value& value, const Entity& entity, std::size_t first, std::size_t end) const {
    const std::uint32_t index = scene_.materials[entity.material].colour_texture;
    if (index == no_index || scene_.textures[index].space != TextureSpace::object) return;
    const Texture& texture = scene_.textures[index];
    const bool octaves = texture.kind == TextureKind::noise && texture.style != NoiseStyle::smooth;
    const double finest = octaves ? std::ldexp(1.0, static_cast<int>(texture.octaves) - 1) : 1.0;
    for (std::size_t p = first; p < end; ++p) {
        const Primitive& primitive = scene_.primitives[p];
        for (std::size_t i = 0; i < point_count(primitive.kind); ++i) {
            const glm::dvec3 cells =
                finest * texture.frequency * (glm::abs(scene_.vertices[primitive.index[i]]) + primitive.radius);
            if (!(std::max({cells.x, cells.y, cells.z}) <= greatest_cell))
                value.refuse(fmt::format("texture \"{}\" has too many cells here", printable(texture.name)),
                    "lower its frequency");
        }
    }
}

void GeometryReader::read_primitive(const Value& value) {
    value.only({"sphere", "cuboid", "triangle", "quad", "obj", "gltf"});
    if (value.json().size() != 1)
        value.refuse(fmt::format("holds {} of sphere, cuboid, triangle, quad, obj, gltf", value.json().size()),
            "write one an object");
    if (value.has("sphere")) return read_sphere(value.member("sphere"));
    if (value.has("cuboid")) return read_cuboid(value.member("cuboid"));
    if (value.has("triangle")) return read_triangle(value.member("triangle"));
    if (value.has("quad")) return read_quad(value.member("quad"));
    if (value.has("obj")) return read_model(value.member("obj"), false);
    read_model(value.member("gltf"), true);
}

std::uint32_t GeometryReader::add_vertex(const glm::dvec3& point, const glm::dvec2& coordinates) {
    scene_.vertices.push_back(point);
    if (coordinates_) scene_.texture_coordinates.push_back(coordinates);
    return static_cast<std::uint32_t>(scene_.vertices.size() - 1);
}

void GeometryReader::add_triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    scene_.primitives.push_back({PrimitiveKind::triangle, {a, b, c}, 0.0});
}

void GeometryReader::read_sphere(const Value& value) {
    value.only({"centre", "radius"});
    const glm::dvec3 centre = read_point(value.required("centre"));
    const double radius = value.required("radius").number(least_length, greatest_length);
    scene_.primitives.push_back({PrimitiveKind::sphere, {add_vertex(centre)}, radius});
}

void GeometryReader::read_cuboid(const Value& value) {
    value.only({"minimum", "maximum"});
    const glm::dvec3 least = read_point(value.required("minimum"));
    const glm::dvec3 greatest = read_point(value.required("maximum"));
    int flat = 0;
    for (int axis = 0; axis < 3; ++axis) {
        if (least[axis] > greatest[axis])
            value.refuse(fmt::format("the minimum exceeds the maximum along {}", "xyz"[axis]), "exchange the two");
        flat += least[axis] == greatest[axis] ? 1 : 0;
    }
    if (flat > 1) value.refuse("the cuboid is flat along more than one axis", "give it an area at least");
    const std::uint32_t first = add_vertex(least);
    scene_.primitives.push_back({PrimitiveKind::cuboid, {first, add_vertex(greatest)}, 0.0});
}

void GeometryReader::read_triangle(const Value& value) {
    if (value.array_size() != 3) value.refuse(fmt::format("has {} corners", value.array_size()), "write three points");
    const std::uint32_t a = add_vertex(read_point(value.element(0)), default_coordinates[0]);
    const std::uint32_t b = add_vertex(read_point(value.element(1)), default_coordinates[1]);
    add_triangle(a, b, add_vertex(read_point(value.element(2)), default_coordinates[2]));
}

// Corner c and edges e, g: the parallelogram's front is to e × g, as that of both its triangles.
void GeometryReader::read_quad(const Value& value) {
    value.only({"corner", "edges"});
    const glm::dvec3 corner = read_point(value.required("corner"));
    const Value edges = value.required("edges");
    if (edges.array_size() != 2) edges.refuse(fmt::format("has {} elements", edges.array_size()), "write two vectors");
    const glm::dvec3 e = read_point(edges.element(0)), g = read_point(edges.element(1));
    const std::uint32_t a = add_vertex(corner), b = add_vertex(corner + e, {1.0, 0.0});
    const std::uint32_t c = add_vertex(corner + e + g, {1.0, 1.0}), d = add_vertex(corner + g, {0.0, 1.0});
    add_triangle(a, b, c);
    add_triangle(a, c, d);
}

// A model named twice is read once, and its vertices are shared.
void GeometryReader::read_model(const Value& value, bool gltf) {
    value.only({"file"});
    const Value file = value.required("file");
    const std::string name = file.relative_file();
    const std::string key = (gltf ? "gltf " : "obj ") + name;
    auto found = models_.find(key);
    if (found == models_.end()) {
        TriangleModel model = gltf ? read_gltf(folder_ / name, file.place(), name, coordinates_)
                                   : read_obj(folder_ / name, file.place(), name, coordinates_);
        const auto first = static_cast<std::uint32_t>(scene_.vertices.size());
        scene_.vertices.insert(scene_.vertices.end(), model.vertices.begin(), model.vertices.end());
        scene_.texture_coordinates.insert(
            scene_.texture_coordinates.end(), model.texture_coordinates.begin(), model.texture_coordinates.end());
        for (auto& triangle : model.triangles)
            for (std::uint32_t& index : triangle) index += first;
        found = models_.emplace(key, ModelTriangles{std::move(model.triangles)}).first;
    }
    for (const auto& [a, b, c] : found->second.triangles) add_triangle(a, b, c);
}

}  // namespace tandem::scene_json
