#include "common/stability/hard_scenes.h"

#include <numbers>

#include "common/rounding.h"

namespace tandem::stability {

using glm::dmat3;
using glm::dmat4;
using glm::dvec3;

dvec3 Dice::direction() {
    const double z = between(-1.0, 1.0), angle = 2.0 * std::numbers::pi * unit(), r = std::sqrt(1.0 - z * z);
    return {r * std::cos(angle), r * std::sin(angle), z};
}

dmat3 Dice::rotation() {
    const dvec3 axis = direction();
    return dmat3(glm::rotate(dmat4(1.0), between(0.0, 2.0 * std::numbers::pi), axis));
}

dvec3 rounded(const dvec3& v) { return rounded_to_single(v); }

GivenRay ray_along(const dvec3& origin, const dvec3& direction) {
    GivenRay ray;
    ray.origin = rounded(origin);
    ray.direction = rounded(direction);
    return ray;
}

GivenRay ray_towards(const dvec3& origin, const dvec3& target) {
    const dvec3 from = rounded(origin);
    return ray_along(from, glm::normalize(rounded(target) - from));
}

Scene empty_scene() {
    Scene scene;
    scene.name = "hard case";
    scene.materials.emplace_back();
    scene.materials.back().name = "grey";
    scene.background.down = scene.background.up = dvec3(1.0);
    return scene;
}

namespace {

void add_entity(Scene& scene, const dmat4& placed, std::size_t count) {
    Entity entity;
    entity.name = "entity " + std::to_string(scene.entities.size());
    entity.primitive_count = static_cast<std::uint32_t>(count);
    entity.first_primitive = static_cast<std::uint32_t>(scene.primitives.size());
    entity.object_to_world = placed;
    scene.entities.push_back(entity);
}

std::uint32_t add_vertex(Scene& scene, const dvec3& p) {
    scene.vertices.push_back(p);
    return static_cast<std::uint32_t>(scene.vertices.size() - 1);
}

}  // namespace

void add_mesh(Scene& scene, const Mesh& mesh, const dmat4& placed) {
    add_entity(scene, placed, mesh.triangles.size());
    const auto first = static_cast<std::uint32_t>(scene.vertices.size());
    scene.vertices.insert(scene.vertices.end(), mesh.vertices.begin(), mesh.vertices.end());
    for (const auto& t : mesh.triangles)
        scene.primitives.push_back({PrimitiveKind::triangle, {first + t[0], first + t[1], first + t[2]}, 0.0});
}

void add_sphere(Scene& scene, const dvec3& centre, double radius, const dmat4& placed) {
    add_entity(scene, placed, 1);
    scene.primitives.push_back({PrimitiveKind::sphere, {add_vertex(scene, centre), 0, 0}, radius});
}

void add_cuboid(Scene& scene, const dvec3& low, const dvec3& high, const dmat4& placed) {
    add_entity(scene, placed, 1);
    const std::uint32_t a = add_vertex(scene, low), b = add_vertex(scene, high);
    scene.primitives.push_back({PrimitiveKind::cuboid, {a, b, 0}, 0.0});
}

Mesh ball_mesh(const dmat3& turned, const dvec3& centre, double radius, int cuts) {
    const double g = std::numbers::phi;
    Mesh mesh{{{-1, g, 0}, {1, g, 0}, {-1, -g, 0}, {1, -g, 0}, {0, -1, g}, {0, 1, g}, {0, -1, -g}, {0, 1, -g},
                  {g, 0, -1}, {g, 0, 1}, {-g, 0, -1}, {-g, 0, 1}},
        {{0, 11, 5}, {0, 5, 1}, {0, 1, 7}, {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4}, {11, 10, 2}, {10, 7, 6},
            {7, 1, 8}, {3, 9, 4}, {3, 4, 2}, {3, 2, 6}, {3, 6, 8}, {3, 8, 9}, {4, 9, 5}, {2, 4, 11}, {6, 2, 10},
            {8, 6, 7}, {9, 8, 1}}};
    for (int cut = 0; cut < cuts; ++cut) {
        std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
        const auto middle = [&](std::uint32_t a, std::uint32_t b) {
            const auto [place, fresh] = middles.try_emplace(std::minmax(a, b), 0);
            if (fresh) {
                place->second = static_cast<std::uint32_t>(mesh.vertices.size());
                mesh.vertices.push_back(0.5 * (mesh.vertices[a] + mesh.vertices[b]));
            }
            return place->second;
        };
        std::vector<std::array<std::uint32_t, 3>> finer;
        for (const auto& [a, b, c] : mesh.triangles) {
            const std::uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
            finer.insert(finer.end(), {{a, ab, ca}, {b, bc, ab}, {c, ca, bc}, {ab, bc, ca}});
        }
        mesh.triangles = finer;
        for (dvec3& v : mesh.vertices) v = glm::normalize(v);
    }
    for (dvec3& v : mesh.vertices) v = rounded(centre + radius * (turned * glm::normalize(v)));
    return mesh;
}

dvec3 seam_point(const Mesh& mesh, Dice& dice) {
    const auto& triangle = mesh.triangles[dice.below(mesh.triangles.size())];
    const std::size_t i = dice.below(3);
    const dvec3 &a = mesh.vertices[triangle[i]], &b = mesh.vertices[triangle[(i + 1) % 3]];
    return dice.unit() < 0.5 ? a : a + dice.unit() * (b - a);
}

}  // namespace tandem::stability
