#include "common/render/contacts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <glm/glm.hpp>
#include <map>
#include <optional>
#include <span>
#include <tuple>
#include <vector>

#include "common/render/floating_origin.h"

namespace tandem {

namespace {

using glm::dvec3;

// As shares of the size of a contact: faces so near are taken to touch, and are held twice as far apart. Single
// precision knows a plane to 13 u = 2^-20 of it (cpu_ref/path_tracer/geometry/surface.h). A ray that goes on through a
// face takes what lies within 8 of such bounds for the same place: 2^-17.
constexpr double touching = 0x1p-16, hair = 0x1p-15;
constexpr double most_of_body = 0.25;      // of its thickness, that a face is drawn back
constexpr double least_overlap = 0x1p-20;  // of coordinates, of faces that do not only share an edge

struct FaceBox {
    dvec3 low{INFINITY}, high{-INFINITY};
    void add(const dvec3& point) {
        low = glm::min(low, point);
        high = glm::max(high, point);
    }
    [[nodiscard]] bool meets(const FaceBox& other, double margin) const {
        return glm::all(glm::lessThanEqual(low, other.high + margin)) &&
               glm::all(glm::greaterThanEqual(high, other.low - margin));
    }
    [[nodiscard]] double size() const {
        const dvec3 most = glm::max(glm::abs(low), glm::abs(high));
        return std::max({most.x, most.y, most.z});
    }
};

// A triangle or a side of a cuboid in the world, from the floating origin.
struct Face {
    std::uint32_t primitive = 0;  // of the scene
    int axis = 0, side = 0;       // cuboid: 0 is the least
    std::uint32_t corner_count = 3;
    std::array<dvec3, 4> corner{};
    dvec3 normal{0.0};  // unit, outwards
    FaceBox box{};
    [[nodiscard]] std::span<const dvec3> corners() const { return {corner.data(), corner_count}; }
};

// The triangles of an entity, or one of its cuboids.
struct Body {
    std::uint32_t entity = 0;
    bool passes = false;  // a dielectric
    bool ranked = false;  // that is meant to overlap others (section 9.4)
    std::vector<Face> faces;
    FaceBox box;

    [[nodiscard]] double thickness(const dvec3& normal) const {
        double least = INFINITY, greatest = -INFINITY;
        for (const Face& face : faces)
            for (const dvec3& corner : face.corners()) {
                least = std::min(least, glm::dot(normal, corner));
                greatest = std::max(greatest, glm::dot(normal, corner));
            }
        return greatest - least;
    }
};

bool finish(Face& face, const dvec3& outwards) {
    const double length = glm::length(outwards);
    face.normal = outwards / length;
    for (const dvec3& corner : face.corners()) face.box.add(corner);
    return length > 0.0 && std::isfinite(length);
}

void add_face(Body& body, Face face, const dvec3& outwards) {
    if (!finish(face, outwards)) return;
    body.box.add(face.box.low);
    body.box.add(face.box.high);
    body.faces.push_back(face);
}

void add_cuboid(Body& body, std::uint32_t primitive, const std::array<dvec3, 2>& corners, const glm::dmat4& map) {
    const glm::dmat3 normals = glm::transpose(glm::inverse(glm::dmat3(map)));
    for (int axis = 0; axis < 3; ++axis)
        for (int side = 0; side < 2; ++side) {
            Face face{.primitive = primitive, .axis = axis, .side = side, .corner_count = 4};
            constexpr std::array<std::array<int, 2>, 4> around{{{0, 0}, {1, 0}, {1, 1}, {0, 1}}};
            for (std::size_t i = 0; i < 4; ++i) {
                dvec3 p;
                p[axis] = corners[static_cast<std::size_t>(side)][axis];
                for (int k = 0; k < 2; ++k) {
                    const int other = (axis + 1 + k) % 3;
                    p[other] = corners[static_cast<std::size_t>(around[i][static_cast<std::size_t>(k)])][other];
                }
                face.corner[i] = dvec3(map * glm::dvec4(p, 1.0));
            }
            add_face(body, face, side == 0 ? -normals[axis] : normals[axis]);
        }
}

// Those of entities that stand still.
std::vector<Body> bodies_of(const Scene& scene, const dvec3& origin) {
    std::vector<Body> bodies;
    for (std::uint32_t e = 0; e < scene.entities.size(); ++e) {
        const Entity& entity = scene.entities[e];
        const Material& material = scene.materials[entity.material];
        if (entity.motion != dvec3(0.0) || material.kind == MaterialKind::boundary) continue;
        glm::dmat4 map = entity.object_to_world;
        map[3] -= glm::dvec4(origin, 0.0);
        const bool mirrored = glm::determinant(glm::dmat3(map)) < 0.0;
        const Body empty{e, material.translucent, material.priority.value_or(0) != 0, {}, {}};
        Body mesh = empty;
        for (std::uint32_t i = 0; i < entity.primitive_count; ++i) {
            const std::uint32_t index = entity.first_primitive + i;
            const Primitive& primitive = scene.primitives[index];
            const auto point = [&](std::size_t k) { return scene.vertices[primitive.index[k]]; };
            if (primitive.kind == PrimitiveKind::triangle) {
                Face face{.primitive = index};
                for (std::size_t k = 0; k < 3; ++k) face.corner[k] = dvec3(map * glm::dvec4(point(k), 1.0));
                const dvec3 normal = glm::cross(face.corner[1] - face.corner[0], face.corner[2] - face.corner[0]);
                add_face(mesh, face, mirrored ? -normal : normal);
            } else if (primitive.kind == PrimitiveKind::cuboid) {
                Body cuboid = empty;
                add_cuboid(cuboid, index, {point(0), point(1)}, map);
                bodies.push_back(std::move(cuboid));
            }
        }
        if (!mesh.faces.empty()) bodies.push_back(std::move(mesh));
    }
    return bodies;
}

// Calls `meet` with each pair of boxes that meet, to within the margin, the lower index first. Where there is a
// `second`, one of a pair is before it: faces of one body, which are many at one place, are not held against each
// other.
void for_each_meeting(std::span<const FaceBox> boxes, std::optional<std::size_t> second, double margin,
    const std::function<void(std::size_t, std::size_t)>& meet) {
    std::vector<std::size_t> order(boxes.size());
    for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
    std::ranges::sort(order, {}, [&](std::size_t i) { return boxes[i].low.x; });
    std::array<std::vector<std::size_t>, 2> open;  // those that may reach as far as the one in hand, of either side
    for (const std::size_t i : order) {
        const std::size_t side = second && i >= *second ? 1 : 0;
        std::vector<std::size_t>& others = open[second ? 1 - side : 0];
        std::erase_if(others, [&](std::size_t j) { return boxes[j].high.x + margin < boxes[i].low.x; });
        for (const std::size_t j : others)
            if (boxes[i].meets(boxes[j], margin)) meet(std::min(i, j), std::max(i, j));
        open[side].push_back(i);
    }
}

double greatest_distance(const Face& from_plane, const Face& of_corners) {
    double most = 0.0;
    for (const dvec3& corner : of_corners.corners())
        most = std::max(most, std::abs(glm::dot(from_plane.normal, corner - from_plane.corner[0])));
    return most;
}

// Whether they overlap in more than an edge, seen along the normal of the first [separating axes].
bool overlap(const Face& a, const Face& b) {
    const double least = least_overlap * std::max(a.box.size(), b.box.size());
    for (const Face* face : {&a, &b})
        for (std::uint32_t i = 0; i < face->corner_count; ++i) {
            const dvec3 edge = face->corner[(i + 1) % face->corner_count] - face->corner[i];
            const dvec3 axis = glm::cross(a.normal, edge);
            const double length = glm::length(axis);
            if (!(length > 0.0)) continue;
            std::array<double, 2> low{INFINITY, INFINITY}, high{-INFINITY, -INFINITY};
            for (std::size_t k = 0; k < 2; ++k)
                for (const dvec3& corner : (k == 0 ? a : b).corners()) {
                    const double along = glm::dot(axis, corner) / length;
                    low[k] = std::min(low[k], along);
                    high[k] = std::max(high[k], along);
                }
            if (std::min(high[0], high[1]) - std::max(low[0], low[1]) <= least) return false;
        }
    return true;
}

// What roundings of both planes are relative to: the terms of n.p, and less of the coordinates themselves. `thickness`
// is the face's body's along its normal; an infinite one gives the most that it can be.
double size_of_contact(const Face& face, const Face& other, double thickness) {
    double terms = 0.0;
    for (int i = 0; i < 3; ++i) {
        double most = 0.0;
        for (const Face* each : {&face, &other})
            for (const dvec3& corner : each->corners()) most = std::max(most, std::abs(corner[i]));
        terms += std::abs(face.normal[i]) * most;
    }
    const auto [small, large] = std::minmax({face.box.size(), other.box.size()});
    return terms + std::min(thickness, face.box.size() + other.box.size()) + 0.125 * (small + 0x1p-10 * large);
}

class Contacts {
public:
    Contacts(const Scene& scene, const dvec3& origin) : scene_(scene), bodies_(bodies_of(scene, origin)) {}

    [[nodiscard]] std::optional<Scene> apart() {
        const auto passes = [](const Body& body) { return body.passes; };
        if (std::ranges::none_of(bodies_, passes)) return std::nullopt;
        std::vector<FaceBox> boxes;
        double size = 0.0;
        for (const Body& body : bodies_) {
            boxes.push_back(body.box);
            size = std::max(size, body.box.size());
        }
        for_each_meeting(boxes, std::nullopt, touching * size, [&](std::size_t a, std::size_t b) {
            const Body &one = bodies_[a], &other = bodies_[b];
            if (one.passes && other.passes ? !one.ranked && !other.ranked : one.passes || other.passes)
                look_at(one, other);
        });
        if (cuboids_.empty() && meshes_.empty()) return std::nullopt;
        return changed();
    }

private:
    using Position = std::array<double, 3>;
    struct Pull {
        dvec3 normal;  // outwards, in the world
        double distance;
    };

    // The faces of both that lie where the bodies may touch.
    void look_at(const Body& a, const Body& b) {
        const double margin = 4.0 * touching * std::max(a.box.size(), b.box.size());
        std::vector<const Face*> faces;
        std::vector<FaceBox> boxes;
        std::size_t of_a = 0;
        for (const Body* body : {&a, &b}) {
            for (const Face& face : body->faces) {
                if (!face.box.meets(body == &a ? b.box : a.box, margin)) continue;
                faces.push_back(&face);
                boxes.push_back(face.box);
            }
            if (body == &a) of_a = faces.size();
        }
        for_each_meeting(
            boxes, of_a, margin, [&](std::size_t i, std::size_t j) { look_at(a, *faces[i], b, *faces[j]); });
    }

    void look_at(const Body& a, const Face& of_a, const Body& b, const Face& of_b) {
        const double alignment = glm::dot(of_a.normal, of_b.normal);
        if (std::abs(alignment) < 0.99) return;
        const bool first = a.passes && (!b.passes || lies_within(a, b, alignment > 0.0));
        const Body& body = first ? a : b;
        const Face &face = first ? of_a : of_b, &other = first ? of_b : of_a;
        const double distance = std::min(greatest_distance(of_a, of_b), greatest_distance(of_b, of_a));
        if (distance > touching * size_of_contact(face, other, INFINITY) || !overlap(of_a, of_b)) return;
        const double thickness = thickness_of(body, face.normal), size = size_of_contact(face, other, thickness);
        if (distance > touching * size) return;
        pull(body, face, std::min(hair * size, most_of_body * thickness));
    }

    // Faces of one plane ask for the same.
    double thickness_of(const Body& body, const dvec3& normal) {
        const auto [known, is_new] = thickness_.try_emplace({&body, normal.x, normal.y, normal.z}, 0.0);
        if (is_new) known->second = body.thickness(normal);
        return known->second;
    }

    // Two dielectrics: the smaller one where faces look the same way, else the later one.
    [[nodiscard]] static bool lies_within(const Body& a, const Body& b, bool same_way) {
        const double of_a = glm::length(a.box.high - a.box.low), of_b = glm::length(b.box.high - b.box.low);
        return same_way && of_a < of_b * (1.0 - 0x1p-20);
    }

    void pull(const Body& body, const Face& face, double distance) {
        const Primitive& primitive = scene_.primitives[face.primitive];
        if (primitive.kind == PrimitiveKind::cuboid) {
            double& so_far = cuboids_[body.entity][{face.primitive, face.axis, face.side}];
            so_far = std::max(so_far, distance);
            return;
        }
        for (const std::uint32_t vertex : primitive.index) {
            const dvec3& p = scene_.vertices[vertex];
            std::vector<Pull>& pulls = meshes_[body.entity][{p.x, p.y, p.z}];
            const auto same = std::ranges::find_if(
                pulls, [&](const Pull& one) { return glm::dot(one.normal, face.normal) > 1.0 - 1e-6; });
            if (same == pulls.end())
                pulls.push_back({face.normal, distance});
            else
                same->distance = std::max(same->distance, distance);
        }
    }

    [[nodiscard]] Scene changed() const {
        Scene scene = scene_;
        for (std::uint32_t e = 0; e < scene.entities.size(); ++e) {
            const auto cuboids = cuboids_.find(e);
            const auto mesh = meshes_.find(e);
            if (cuboids == cuboids_.end() && mesh == meshes_.end()) continue;
            own_geometry(scene, e);
            if (cuboids != cuboids_.end()) draw_back(scene, e, cuboids->second);
            if (mesh != meshes_.end()) draw_back(scene, e, mesh->second);
        }
        return scene;
    }

    // The entity gets primitives and vertices that no other has.
    static void own_geometry(Scene& scene, std::uint32_t e) {
        Entity& entity = scene.entities[e];
        const std::uint32_t first = entity.first_primitive;
        entity.first_primitive = static_cast<std::uint32_t>(scene.primitives.size());
        for (std::uint32_t i = 0; i < entity.primitive_count; ++i) {
            Primitive primitive = scene.primitives[first + i];
            for (std::uint32_t& index : primitive.index) {
                scene.vertices.push_back(dvec3(scene.vertices[index]));
                if (!scene.texture_coordinates.empty())
                    scene.texture_coordinates.push_back(glm::dvec2(scene.texture_coordinates[index]));
                if (!scene.normals.empty()) scene.normals.push_back(dvec3(scene.normals[index]));
                index = static_cast<std::uint32_t>(scene.vertices.size() - 1);
            }
            scene.primitives.push_back(primitive);
        }
    }

    using CuboidFaces = std::map<std::tuple<std::uint32_t, int, int>, double>;
    using MeshPoints = std::map<Position, std::vector<Pull>>;

    void draw_back(Scene& scene, std::uint32_t e, const CuboidFaces& faces) const {
        const Entity& entity = scene.entities[e];
        const glm::dmat3 normals = glm::transpose(glm::inverse(glm::dmat3(entity.object_to_world)));
        for (const auto& [face, distance] : faces) {
            const auto& [primitive, axis, side] = face;
            const Primitive& own =
                scene.primitives[entity.first_primitive + primitive - scene_.entities[e].first_primitive];
            const double in_object = distance * glm::length(normals[axis]);
            scene.vertices[own.index[static_cast<std::size_t>(side)]][axis] += side == 0 ? in_object : -in_object;
        }
    }

    void draw_back(Scene& scene, std::uint32_t e, const MeshPoints& points) const {
        const Entity& entity = scene.entities[e];
        const glm::dmat3 to_object = glm::inverse(glm::dmat3(entity.object_to_world));
        for (std::uint32_t i = 0; i < entity.primitive_count; ++i) {
            const Primitive& own = scene.primitives[entity.first_primitive + i];
            if (own.kind != PrimitiveKind::triangle) continue;
            for (const std::uint32_t index : own.index) {
                dvec3& p = scene.vertices[index];
                const auto found = points.find({p.x, p.y, p.z});
                if (found == points.end()) continue;
                dvec3 by(0.0);
                for (const Pull& one : found->second) by -= one.distance * one.normal;
                p += to_object * by;
            }
        }
    }

    const Scene& scene_;
    std::vector<Body> bodies_;
    std::map<std::uint32_t, CuboidFaces> cuboids_;  // by entity
    std::map<std::uint32_t, MeshPoints> meshes_;
    std::map<std::tuple<const Body*, double, double, double>, double> thickness_;
};

}  // namespace

std::optional<Scene> with_contacts_apart(const Scene& scene) {
    const auto passes = [&](const Entity& entity) { return scene.materials[entity.material].translucent; };
    if (std::ranges::none_of(scene.entities, passes)) return std::nullopt;
    return Contacts(scene, floating_origin(scene).value_or(dvec3(0.0))).apart();
}

}  // namespace tandem
