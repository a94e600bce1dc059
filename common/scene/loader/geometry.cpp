#include "common/scene/loader/geometry.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <set>

#include "common/scene/loader/models.h"
#include "common/scene/loader/parts.h"

namespace tandem::scene_json {

namespace {

constexpr std::uint64_t greatest_primitive_count = std::uint64_t{1} << 24;  // of the file
constexpr std::uint64_t greatest_placed_count = std::uint64_t{1} << 27;     // with all repetitions
constexpr std::uint64_t greatest_entity_count = std::uint64_t{1} << 20;
constexpr std::uint32_t greatest_group_depth = 32;
constexpr std::size_t greatest_name_bytes = 200;  // an instance repeats it

// Cells of a pattern are counted in 32 bits.
constexpr double greatest_cell = 0x1p30;

constexpr std::string_view primitive_keys[] = {"sphere", "cuboid", "triangle", "quad", "obj", "gltf"};

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
            for (const Item& item : read_item(value, false)) place(value, item, glm::dmat4(1.0), glm::dvec3(0.0));
        }
    }
    // What stands nowhere is checked, and leaves no trace.
    const std::size_t vertices = scene_.vertices.size(), primitives = scene_.primitives.size();
    for (std::uint32_t group = 0; group < groups_.size(); ++group) complete(group, groups_[group].value);
    scene_.vertices.resize(vertices);
    scene_.primitives.resize(primitives);
    if (coordinates_) scene_.texture_coordinates.resize(vertices);
    if (!scene_.normals.empty()) scene_.normals.resize(vertices, glm::dvec3(0.0));
}

// Whether an entity or group names a material whose texture uses coordinates, or leaves its materials to a model; the
// names are checked later.
bool GeometryReader::needs_coordinates(const Value& root) const {
    std::set<std::string, std::less<>> names;
    for (const Material& material : scene_.materials)
        if (material.colour_texture != no_index &&
            scene_.textures[material.colour_texture].space == TextureSpace::coordinates)
            names.insert(material.name);
    const auto any_in = [&](const Json& items) {
        return items.is_array() && std::ranges::any_of(items, [&](const Json& item) {
            if (!item.is_object() || item.contains("group")) return false;
            if (!item.contains("material")) return true;
            return item["material"].is_string() && names.contains(item["material"].get_ref<const std::string&>());
        });
    };
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
        for (const Item& item : read_item(element, true)) {
            Group& group = groups_[index];
            const bool nested = item.group != no_index;
            group.primitives += nested ? groups_[item.group].primitives : item.entity.primitive_count;
            group.entities += nested ? groups_[item.group].entities : 1;
            check_room(element, group.primitives, group.entities);
            group.items.push_back(item);
        }
    }
    --depth_;
    groups_[index].complete = true;
}

// A group or an entity of the file; without a material, an entity for each material of its models.
std::vector<GeometryReader::Item> GeometryReader::read_item(const Value& value, bool grouped) {
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
    } else if (value.has("material")) {
        read_entity(value, grouped, item.entity);
    } else {
        return read_models(value, grouped, item);
    }
    return {item};
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
        check_primitives(primitive, grouped, entity, first);
    }
    entity.primitive_count = static_cast<std::uint32_t>(scene_.primitives.size()) - entity.first_primitive;
}

void GeometryReader::check_primitives(const Value& value, bool grouped, const Entity& entity, std::size_t first) {
    const std::size_t end = scene_.primitives.size();
    if (end > greatest_primitive_count)
        value.refuse(
            fmt::format("the scene has more than {} primitives", greatest_primitive_count), "simplify its models");
    if (!grouped) check_reach(value, entity, first, end);
    check_texture(value, entity, first, end);
}

std::vector<GeometryReader::Item> GeometryReader::read_models(const Value& value, bool grouped, const Item& item) {
    const Value primitives = value.required("primitives");
    if (primitives.array_size() == 0) primitives.refuse("an entity without primitives", "add some, or remove it");
    for (std::size_t i = 0; i < primitives.array_size(); ++i) {
        const Value primitive = primitives.element(i);
        primitive.only(primitive_keys);
        if (primitive.json().size() != 1 || !(primitive.has("gltf") || primitive.has("obj")))
            value.refuse("is without \"material\", and not all of its primitives are models", "name its material");
    }
    std::vector<Item> items;
    for (std::size_t i = 0; i < primitives.array_size(); ++i) {
        const Value primitive = primitives.element(i);
        const bool gltf = primitive.has("gltf");
        const ModelTriangles& model = read_model(primitive.member(gltf ? "gltf" : "obj"), gltf, true);
        std::map<std::uint32_t, std::vector<std::size_t>> of_material;
        for (std::size_t t = 0; t < model.triangles.size(); ++t) of_material[model.materials[t]].push_back(t);
        for (const auto& [material, triangles] : of_material) {
            Item& part = items.emplace_back(item);
            const std::size_t first = scene_.primitives.size();
            part.entity.material = material;
            part.entity.first_primitive = static_cast<std::uint32_t>(first);
            part.entity.primitive_count = static_cast<std::uint32_t>(triangles.size());
            for (const std::size_t t : triangles)
                scene_.primitives.push_back({PrimitiveKind::triangle, model.triangles[t], 0.0});
            check_primitives(primitive, grouped, part.entity, first);
        }
    }
    return items;
}

// Appends an entity, or those of a group, under an outer transform. A group's transform leads to the space in which its
// displacement is meant. So displacements are turned and scaled by what is outside of their own item.
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
    if (primitives > greatest_placed_count)
        value.refuse(
            fmt::format("the scene has more than {} primitives", greatest_placed_count), "repeat fewer groups");
    if (entities > greatest_entity_count)
        value.refuse(fmt::format("the scene has more than {} entities", greatest_entity_count), "repeat fewer groups");
}

void GeometryReader::check_motion(const Value& value, const glm::dvec3& motion) const {
    if (!(glm::length(motion) <= 2.0 * greatest_length))
        value.refuse("moves too far", fmt::format("keep lengths below {}", shown(greatest_length)));
}

// The box of a range of primitives, which entities may share.
const GeometryReader::RangeBox& GeometryReader::box_of(std::size_t first, std::size_t end) {
    const auto [found, is_new] = boxes_.try_emplace({first, end});
    RangeBox& box = found->second;
    for (std::size_t p = first; is_new && p < end; ++p) {
        const Primitive& primitive = scene_.primitives[p];
        for (std::size_t i = 0; i < point_count(primitive.kind); ++i) {
            box.low = glm::min(box.low, scene_.vertices[primitive.index[i]]);
            box.high = glm::max(box.high, scene_.vertices[primitive.index[i]]);
        }
        box.radius = std::max(box.radius, primitive.radius);
    }
    return box;
}

// Refuses primitives that the entity's transform carries out of the renderers' range.
void GeometryReader::check_reach(const Value& value, const Entity& entity, std::size_t first, std::size_t end) {
    const glm::dmat4& object_to_world = entity.object_to_world;
    // No point of the box around all is farther out than its corners.
    const RangeBox& box = box_of(first, end);
    double farthest = 0.0;
    for (unsigned corner = 0; corner < 8; ++corner) {
        const glm::dvec3 point((corner & 1u) != 0 ? box.high.x : box.low.x, (corner & 2u) != 0 ? box.high.y : box.low.y,
            (corner & 4u) != 0 ? box.high.z : box.low.z);
        farthest = std::max(farthest, glm::length(glm::dvec3(object_to_world * glm::dvec4(point, 1.0))));
    }
    for (int axis = 0; axis < 3; ++axis)
        farthest = std::max(farthest, box.radius * glm::length(glm::dvec3(object_to_world[axis])));
    if (farthest <= 2.0 * greatest_length) return;
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
    value.only(primitive_keys);
    if (value.json().size() != 1)
        value.refuse(fmt::format("holds {} of sphere, cuboid, triangle, quad, obj, gltf", value.json().size()),
            "write one an object");
    if (value.has("sphere")) return read_sphere(value.member("sphere"));
    if (value.has("cuboid")) return read_cuboid(value.member("cuboid"));
    if (value.has("triangle")) return read_triangle(value.member("triangle"));
    if (value.has("quad")) return read_quad(value.member("quad"));
    const bool gltf = value.has("gltf");
    for (const auto& [a, b, c] : read_model(value.member(gltf ? "gltf" : "obj"), gltf, false).triangles)
        add_triangle(a, b, c);
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

// A model named twice is read once, and its vertices are shared; once more where its own materials are taken.
const GeometryReader::ModelTriangles& GeometryReader::read_model(const Value& value, bool gltf, bool own_materials) {
    value.only({"file", "normals", "mesh"});
    if (!gltf) without(value, "mesh", "an OBJ model has no meshes by number");
    const Value file = value.required("file");
    const std::string name = file.relative_file();
    const bool smooth = !value.has("normals") || value.member("normals").choice({"smooth", "flat"}) == 0;
    std::optional<std::uint32_t> mesh;
    if (value.has("mesh")) mesh = value.member("mesh").integer(0, no_index - 1);
    const std::string key =
        fmt::format("{} {} {} {} {}", gltf, smooth, own_materials, mesh ? fmt::to_string(*mesh) : "all", name);
    if (const auto found = models_.find(key); found != models_.end()) return found->second;
    const ModelParts parts{.coordinates = coordinates_, .normals = smooth, .materials = own_materials, .mesh = mesh};
    TriangleModel model = gltf ? read_gltf(folder_ / name, file.place(), name, parts)
                               : read_obj(folder_ / name, file.place(), name, parts);
    const auto first = static_cast<std::uint32_t>(scene_.vertices.size());
    scene_.vertices.insert(scene_.vertices.end(), model.vertices.begin(), model.vertices.end());
    scene_.texture_coordinates.insert(
        scene_.texture_coordinates.end(), model.texture_coordinates.begin(), model.texture_coordinates.end());
    if (!model.normals.empty()) {
        scene_.normals.resize(first, glm::dvec3(0.0));
        scene_.normals.insert(scene_.normals.end(), model.normals.begin(), model.normals.end());
    }
    for (auto& triangle : model.triangles)
        for (std::uint32_t& index : triangle) index += first;
    std::vector<std::uint32_t> places;
    for (const ModelMaterial& material : model.materials) places.push_back(add_material(name, material));
    for (std::uint32_t& material : model.material_of) material = places[material];
    // A scene that says its own lights is not lit by those of its models; an imported one has them all.
    if (!scene_.lights.empty()) model.passed_over.erase("lights");
    if (!model.passed_over.empty())
        scene_.remarks.push_back(fmt::format("{}: {}: {} is rendered without {}", file.place().file,
            file.place().pointer, printable(name), fmt::join(model.passed_over, ", ")));
    return models_.emplace(key, ModelTriangles{std::move(model.triangles), std::move(model.material_of)}).first->second;
}

// Returns its place among the scene's materials.
std::uint32_t GeometryReader::add_material(const std::string& model, const ModelMaterial& source) {
    Material material = source.material;
    material.name = model + ": " + source.material.name;
    if (source.interior) {
        material.interior = static_cast<std::uint32_t>(scene_.media.size());
        scene_.media.push_back(*source.interior);
        scene_.media.back().name = material.name;
    }
    if (source.colour_image) {
        const auto next = static_cast<std::uint32_t>(scene_.textures.size());
        const auto [texture, added] = model_textures_.emplace(source.colour_image.get(), next);
        if (added) {
            Texture& image = scene_.textures.emplace_back();
            image.name = material.name;
            image.kind = TextureKind::image;
            image.space = TextureSpace::coordinates;
            image.image = source.colour_image;
        }
        material.colour_texture = texture->second;
    }
    scene_.materials.push_back(std::move(material));
    return static_cast<std::uint32_t>(scene_.materials.size() - 1);
}

}  // namespace tandem::scene_json
