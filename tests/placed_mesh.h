// A mesh that entities place by all kinds of maps, among other primitives, and rays at it. Tests of instancing compare
// it with the same scene with every triangle in world space.
#pragma once

#include <algorithm>
#include <random>
#include <vector>

#include "common/render/instancing.h"
#include "common/render/ray_batch.h"
#include "tests/scene_builder.h"

namespace tandem::test {

// A bumpy ball about (3, -2, 1) in object space, of 2 rows (rows - 1) * 2 triangles, smooth at its vertices.
inline void add_ball(Scene& scene, std::uint32_t rows) {
    const std::uint32_t columns = 2 * rows, first = static_cast<std::uint32_t>(scene.vertices.size());
    for (std::uint32_t i = 0; i <= rows; ++i)
        for (std::uint32_t j = 0; j < columns; ++j) {
            const double t = 3.141592653589793 * i / rows, p = 2.0 * 3.141592653589793 * j / columns;
            const dvec3 way(std::sin(t) * std::cos(p), std::cos(t), std::sin(t) * std::sin(p));
            scene.vertices.push_back(dvec3(3, -2, 1) + (1.0 + 0.2 * std::sin(5.0 * t) * std::sin(3.0 * p)) * way);
            scene.normals.push_back(way);
            scene.texture_coordinates.emplace_back(1.0 * j / columns, 1.0 * i / rows);
        }
    for (std::uint32_t i = 0; i < rows; ++i)
        for (std::uint32_t j = 0; j < columns; ++j) {
            const std::uint32_t a = first + i * columns + j, b = first + i * columns + (j + 1) % columns;
            if (i > 0) scene.primitives.push_back({PrimitiveKind::triangle, {a, b, b + columns}, 0.0});
            if (i + 1 < rows) scene.primitives.push_back({PrimitiveKind::triangle, {a, b + columns, a + columns}, 0.0});
        }
}

inline dmat4 placed_at(const dvec3& place, const dmat4& turn) {
    return glm::translate(dmat4(1.0), place) * turn * glm::translate(dmat4(1.0), dvec3(-3, 2, -1));
}

// Turned, mirrored, sheared, flattened, and a speck.
inline std::vector<dmat4> places() {
    const dmat4 one(1.0);
    dmat4 sheared(1.0);
    sheared[1][0] = 0.9;
    sheared[2][1] = -0.7;
    return {placed_at({0, 0.2, 0}, glm::rotate(one, 0.7, dvec3(1, 2, 3))),
        placed_at({-2.4, 0.5, 0.3}, glm::rotate(one, -1.1, dvec3(0, 1, 1)) * glm::scale(one, dvec3(-0.9, 0.6, 0.8))),
        placed_at({2.5, 0.2, -0.5}, sheared * glm::scale(one, dvec3(0.7))),
        placed_at({0.3, -1.2, 1.5}, glm::rotate(one, 0.3, dvec3(0, 0, 1)) * glm::scale(one, dvec3(1.3, 0.02, 0.9))),
        placed_at({1.2, 0.9, 2.0}, glm::scale(one, dvec3(1e-2)))};
}

// Its own entities first, in the middle and last are no places; one places the mesh and emits.
inline Scene scene_of_places(const Material& material, std::uint32_t rows = 10) {
    SceneBuilder b;
    b.camera({0.5, 1.5, 7}, {0, 0, 0}, 50.0).background(dvec3(0.3, 0.4, 0.6));
    b.floor(diffuse(dvec3(0.6)), -1.6, 6.0);
    b.sphere(mirror(dvec3(0.8)), {-1.1, 1.8, -1.0}, 0.6);
    Scene scene = b.scene();
    scene.normals.assign(scene.vertices.size(), dvec3(0.0));
    scene.texture_coordinates.assign(scene.vertices.size(), glm::dvec2(0.0));
    const auto mesh = static_cast<std::uint32_t>(scene.primitives.size());
    add_ball(scene, rows);
    const auto count = static_cast<std::uint32_t>(scene.primitives.size()) - mesh;
    const auto place = [&](const Material& of, const dmat4& map) {
        scene.materials.push_back(of);
        Entity& entity = scene.entities.emplace_back();
        entity.material = static_cast<std::uint32_t>(scene.materials.size()) - 1;
        entity.first_primitive = mesh;
        entity.primitive_count = count;
        entity.object_to_world = map;
    };
    const std::vector<dmat4> maps = places();
    place(material, maps[0]);
    place(material, maps[1]);
    place(emitter(dvec3(4.0)), placed_at({-1.5, 3.2, 1.0}, glm::scale(dmat4(1.0), dvec3(0.4))));
    for (std::size_t i = 2; i < maps.size(); ++i) place(material, maps[i]);
    const auto corner = static_cast<std::uint32_t>(scene.vertices.size());
    for (const dvec3& p : {dvec3(-3, -1, -2), dvec3(3, -1, -2), dvec3(0, 3, -3)}) {
        scene.vertices.push_back(p);
        scene.normals.emplace_back(0.0);
        scene.texture_coordinates.emplace_back(0.0);
    }
    scene.primitives.push_back({PrimitiveKind::triangle, {corner, corner + 1, corner + 2}, 0.0});
    place(diffuse(dvec3(0.5, 0.2, 0.2)), dmat4(1.0));
    scene.entities.back().first_primitive = static_cast<std::uint32_t>(scene.primitives.size()) - 1;
    scene.entities.back().primitive_count = 1;
    return scene;
}

inline RenderSettings with_instancing(RenderSettings settings, Instancing instancing) {
    settings.instancing = instancing;
    return settings;
}

// At vertices, at edges and within triangles of each place, from far and near; along the planes of its box; at random.
inline std::vector<GivenRay> rays_at_places(const Scene& scene, std::size_t each) {
    std::mt19937_64 engine(7);
    std::uniform_real_distribution<double> unit(0.0, 1.0);
    const auto from = [&](double distance) {
        return distance * glm::normalize(dvec3(unit(engine), unit(engine), unit(engine)) * 2.0 - 1.0);
    };
    std::vector<GivenRay> rays;
    const auto add = [&](const dvec3& origin, const dvec3& target) {
        GivenRay& ray = rays.emplace_back();
        ray.origin = origin;
        ray.direction = glm::normalize(target - origin);
    };
    for (const Entity& entity : scene.entities) {
        const auto point = [&](const Primitive& primitive, std::size_t k) {
            return dvec3(entity.object_to_world * glm::dvec4(scene.vertices[primitive.index.at(k)], 1.0));
        };
        dvec3 low(1e30), high(-1e30);
        for (std::uint32_t i = 0; i < entity.primitive_count; ++i)
            for (std::size_t k = 0; k < 3 && entity.primitive_count > 2; ++k) {
                const dvec3 p = point(scene.primitives[entity.first_primitive + i], k);
                low = glm::min(low, p);
                high = glm::max(high, p);
            }
        for (std::size_t i = 0; i < each && entity.primitive_count > 2; ++i) {
            const auto chosen = static_cast<std::uint32_t>(unit(engine) * entity.primitive_count);
            const Primitive& primitive = scene.primitives[entity.first_primitive + chosen];
            const dvec3 a = point(primitive, 0), b = point(primitive, 1), c = point(primitive, 2);
            const double s = unit(engine), t = unit(engine) * (1.0 - s);
            add(from(8.0), a);
            add(a + from(0.3 * glm::length(high - low)), a + s * (b - a));
            add(from(100.0), a + s * (b - a) + t * (c - a));
            add(a + from(0.5), a + s * (b - a) + t * (c - a));
            const int axis = static_cast<int>(i % 3);  // in a plane of the box, and a corner's width beside it
            dvec3 start = low + dvec3(unit(engine), unit(engine), unit(engine)) * (high - low), end = start;
            start[axis] = end[axis] = (i / 3) % 2 == 0 ? low[axis] : high[axis];
            start[(axis + 1) % 3] = low[(axis + 1) % 3] - 5.0;
            end[(axis + 1) % 3] = high[(axis + 1) % 3] + 5.0;
            add(start, end);
        }
    }
    for (std::size_t i = 0; i < each; ++i) add(from(6.0), from(2.0));
    return rays;
}

// From where `hits` were found, to both sides of the surfaces that they leave.
inline std::vector<GivenRay> leaving(const std::vector<RayHit>& hits) {
    std::vector<GivenRay> rays;
    for (const RayHit& hit : hits) {
        if (hit.primitive == no_index) continue;
        for (const double side : {1.0, -1.0}) {
            GivenRay& ray = rays.emplace_back();
            ray.origin = side > 0.0 ? hit.leaving_front : hit.leaving_back;
            ray.direction = glm::normalize(side * hit.normal + dvec3(0.3, -0.2, 0.25));
            ray.left_primitive = hit.primitive;
            ray.inside = side < 0.0;
        }
    }
    return rays;
}

inline bool same(const RayHit& a, const RayHit& b) {
    return a.t == b.t && a.primitive == b.primitive && a.point == b.point && a.normal == b.normal &&
           a.leaving_front == b.leaving_front && a.leaving_back == b.leaving_back;
}

// Those that differ, at most `shown` of them as text beside their number.
inline std::size_t count_different(const std::vector<RayHit>& a, const std::vector<RayHit>& b) {
    std::size_t count = a.size() == b.size() ? 0 : a.size();
    for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i) count += same(a[i], b[i]) ? 0 : 1;
    return count;
}

}  // namespace tandem::test
