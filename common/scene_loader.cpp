#include "common/scene_loader.h"

#include <fmt/format.h>

#include <algorithm>
#include <glm/geometric.hpp>
#include <map>

#include "common/scene_loader_json.h"
#include "common/scene_loader_obj.h"
#include "common/scene_loader_parts.h"

namespace tandem {

namespace {

using namespace scene_json;

constexpr std::size_t greatest_bytes = std::size_t{16} << 20;
constexpr std::size_t greatest_primitive_count = std::size_t{1} << 24;

class SceneReader {
public:
    explicit SceneReader(const std::filesystem::path& file) : folder_(file.parent_path()) {
        scene_.name = file.stem().string();
    }

    Scene read(const Value& root) {
        root.only(
            {"$schema", "description", "film", "camera", "background", "render", "materials", "entities", "expect"});
        for (const std::string_view key : {"$schema", "description"})
            if (root.has(key)) (void)root.member(key).text();
        if (root.has("film")) scene_.film = read_film(root.member("film"));
        scene_.camera = read_camera(root.required("camera"));
        if (root.has("background")) scene_.background = read_background(root.member("background"));
        if (root.has("render")) scene_.defaults = read_render(root.member("render"));
        if (root.has("expect")) scene_.expect = read_expectation(root.member("expect"));
        if (root.has("materials")) read_materials(root.member("materials"));
        if (root.has("entities")) {
            const Value entities = root.member("entities");
            for (std::size_t i = 0; i < entities.array_size(); ++i) read_entity(entities.element(i));
        }
        return std::move(scene_);
    }

private:
    void read_materials(const Value& materials) {
        materials.for_each_member([&](const std::string& name, const Value& value) {
            if (name.empty()) value.refuse("a material without a name", "name it");
            index_of_material_.emplace(name, static_cast<std::uint32_t>(scene_.materials.size()));
            scene_.materials.push_back(read_material(value, name));
        });
    }

    std::uint32_t find_material(const Value& value) const {
        const std::string name = value.text();
        const auto found = index_of_material_.find(name);
        if (found != index_of_material_.end()) return found->second;
        constexpr std::size_t listed_at_most = 20;
        std::vector<std::string> known;
        std::string list;
        for (const Material& material : scene_.materials) {
            if (known.size() < listed_at_most) list += (list.empty() ? "" : ", ") + printable(material.name);
            known.push_back(material.name);
        }
        if (known.size() > listed_at_most) list += ", …";
        const std::string guess = nearest(name, known);
        value.refuse("unknown material \"" + printable(name) + "\"",
            known.empty() ? "define it under \"materials\""
                          : (guess.empty() ? "" : "did you mean \"" + printable(guess) + "\"? ") + "known are " + list);
    }

    void read_entity(const Value& value) {
        value.only({"name", "material", "transform", "primitives"});
        Entity entity;
        if (value.has("name")) entity.name = value.member("name").text();
        entity.material = find_material(value.required("material"));
        if (value.has("transform")) entity.object_to_world = read_transform(value.member("transform"));
        entity.first_primitive = static_cast<std::uint32_t>(scene_.primitives.size());
        const Value primitives = value.required("primitives");
        if (primitives.array_size() == 0) primitives.refuse("an entity without primitives", "add some, or remove it");
        for (std::size_t i = 0; i < primitives.array_size(); ++i) {
            const std::size_t first = scene_.primitives.size();
            const Value primitive = primitives.element(i);
            read_primitive(primitive);
            if (scene_.primitives.size() > greatest_primitive_count)
                primitive.refuse(fmt::format("the scene has more than {} primitives", greatest_primitive_count),
                    "simplify its models");
            check_reach(primitive, entity.object_to_world, first);
        }
        entity.primitive_count = static_cast<std::uint32_t>(scene_.primitives.size()) - entity.first_primitive;
        scene_.entities.push_back(std::move(entity));
    }

    void read_primitive(const Value& value) {
        value.only({"sphere", "cuboid", "triangle", "quad", "obj"});
        if (value.json().size() != 1)
            value.refuse(fmt::format("holds {} of sphere, cuboid, triangle, quad, obj", value.json().size()),
                "write one an object");
        if (value.has("sphere")) return read_sphere(value.member("sphere"));
        if (value.has("cuboid")) return read_cuboid(value.member("cuboid"));
        if (value.has("triangle")) return read_triangle(value.member("triangle"));
        if (value.has("quad")) return read_quad(value.member("quad"));
        read_model(value.member("obj"));
    }

    static glm::dvec3 read_point(const Value& value) { return value.vector(-greatest_length, greatest_length); }

    std::uint32_t add_vertex(const glm::dvec3& point) {
        scene_.vertices.push_back(point);
        return static_cast<std::uint32_t>(scene_.vertices.size() - 1);
    }

    void add_triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
        scene_.primitives.push_back({PrimitiveKind::triangle, {a, b, c}, 0.0});
    }

    void read_sphere(const Value& value) {
        value.only({"centre", "radius"});
        const glm::dvec3 centre = read_point(value.required("centre"));
        const double radius = value.required("radius").number(least_length, greatest_length);
        scene_.primitives.push_back({PrimitiveKind::sphere, {add_vertex(centre)}, radius});
    }

    void read_cuboid(const Value& value) {
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

    void read_triangle(const Value& value) {
        if (value.array_size() != 3)
            value.refuse(fmt::format("has {} corners", value.array_size()), "write three points");
        const std::uint32_t a = add_vertex(read_point(value.element(0)));
        const std::uint32_t b = add_vertex(read_point(value.element(1)));
        add_triangle(a, b, add_vertex(read_point(value.element(2))));
    }

    // Corner c and edges e, g: the parallelogram's front is to e × g, as that of both its triangles.
    void read_quad(const Value& value) {
        value.only({"corner", "edges"});
        const glm::dvec3 corner = read_point(value.required("corner"));
        const Value edges = value.required("edges");
        if (edges.array_size() != 2)
            edges.refuse(fmt::format("has {} elements", edges.array_size()), "write two vectors");
        const glm::dvec3 e = read_point(edges.element(0)), g = read_point(edges.element(1));
        const std::uint32_t a = add_vertex(corner), b = add_vertex(corner + e);
        const std::uint32_t c = add_vertex(corner + e + g), d = add_vertex(corner + g);
        add_triangle(a, b, c);
        add_triangle(a, c, d);
    }

    // A model named twice is read once, and its vertices are shared.
    void read_model(const Value& value) {
        value.only({"file"});
        const Value file = value.required("file");
        const std::string name = file.text();
        const std::filesystem::path relative(name);
        if (name.empty() || relative.is_absolute() || name.find('\0') != std::string::npos)
            file.refuse("is not a relative path", "name the model relative to the scene file");
        auto found = models_.find(name);
        if (found == models_.end()) {
            ObjModel model = read_obj(folder_ / relative, file.place(), name);
            const auto first = static_cast<std::uint32_t>(scene_.vertices.size());
            scene_.vertices.insert(scene_.vertices.end(), model.vertices.begin(), model.vertices.end());
            for (auto& triangle : model.triangles)
                for (std::uint32_t& index : triangle) index += first;
            found = models_.emplace(name, std::move(model.triangles)).first;
        }
        for (const auto& [a, b, c] : found->second) add_triangle(a, b, c);
    }

    // Refuses primitives from `first` on that their transform carries out of the renderers' range.
    void check_reach(const Value& value, const glm::dmat4& object_to_world, std::size_t first) const {
        for (std::size_t p = first; p < scene_.primitives.size(); ++p) {
            const Primitive& primitive = scene_.primitives[p];
            const int points = primitive.kind == PrimitiveKind::triangle ? 3
                               : primitive.kind == PrimitiveKind::cuboid ? 2
                                                                         : 1;
            double reach = 0.0;
            for (int i = 0; i < points; ++i) {
                const glm::dvec3& point = scene_.vertices[primitive.index[static_cast<std::size_t>(i)]];
                reach = std::max(reach, glm::length(glm::dvec3(object_to_world * glm::dvec4(point, 1.0))));
            }
            for (int axis = 0; axis < 3; ++axis)
                reach = std::max(reach, primitive.radius * glm::length(glm::dvec3(object_to_world[axis])));
            if (!(reach <= 2.0 * greatest_length))  // √3 is a corner's share
                value.refuse("lies too far out", fmt::format("keep lengths below {}", shown(greatest_length)));
        }
    }

    std::filesystem::path folder_;
    Scene scene_;
    std::map<std::string, std::uint32_t, std::less<>> index_of_material_;
    std::map<std::string, std::vector<std::array<std::uint32_t, 3>>> models_;
};

}  // namespace

Scene load_scene(const std::filesystem::path& file) {
    const std::string name = file.string();
    const std::string text = read_bounded_file(file, greatest_bytes, {name, ""}, "");
    const Json document = parse_strict(text, name);
    return SceneReader(file).read(Value(document, name));
}

}  // namespace tandem
