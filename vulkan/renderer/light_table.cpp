#include "vulkan/renderer/light_table.h"

#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <numbers>

namespace tandem {

namespace {

// A light before probabilities are known.
struct Candidate {
    gpu::Light light;
    double power = 0.0;  // area times the sum of its radiance: what the choice is proportional to
};

// Squared singular values of a matrix: eigenvalues of its Gram matrix by Jacobi rotations.
std::array<double, 3> squared_singular_values(const glm::dmat3& m) {
    glm::dmat3 s = glm::transpose(m) * m;
    for (int sweep = 0; sweep < 12; ++sweep)  // convergence is quadratic; 12 sweeps are beyond double precision
        for (const auto& [p, q] : {std::pair{0, 1}, std::pair{0, 2}, std::pair{1, 2}}) {
            if (s[q][p] == 0.0) continue;
            const double theta = 0.5 * std::atan2(2.0 * s[q][p], s[q][q] - s[p][p]);
            glm::dmat3 rotation(1.0);
            rotation[p][p] = rotation[q][q] = std::cos(theta);
            rotation[q][p] = std::sin(theta);
            rotation[p][q] = -std::sin(theta);
            s = glm::transpose(rotation) * s * rotation;
        }
    return {s[0][0], s[1][1], s[2][2]};
}

// All singular values equal to a relative 10^-5.
bool is_similarity(const glm::dmat3& m) {
    const auto [a, b, c] = squared_singular_values(m);
    return std::sqrt(std::max({a, b, c})) <= std::sqrt(std::min({a, b, c})) * (1.0 + 1e-5);
}

double triangle_area(const Scene& scene, const Primitive& primitive, const glm::dmat3& m) {
    const glm::dvec3 origin = scene.vertices[primitive.index[0]];
    return 0.5 * glm::length(glm::cross(m * (scene.vertices[primitive.index[1]] - origin),
                     m * (scene.vertices[primitive.index[2]] - origin)));
}

// World areas of the faces, and their cumulative shares into the light.
double cuboid_area(const Scene& scene, const Primitive& primitive, const glm::dmat3& m, gpu::Light& light) {
    const glm::dvec3 size = scene.vertices[primitive.index[1]] - scene.vertices[primitive.index[0]];
    const glm::dvec3 x = m[0] * size.x, y = m[1] * size.y, z = m[2] * size.z;
    const std::array areas{glm::length(glm::cross(y, z)), glm::length(glm::cross(z, x)), glm::length(glm::cross(x, y))};
    const double total = 2.0 * (areas[0] + areas[1] + areas[2]);
    double before = 0.0;
    const std::array<float*, 5> shares{&light.face0, &light.face1, &light.face2, &light.face3, &light.face4};
    for (std::size_t face = 0; face < shares.size(); ++face) {
        before += areas[face / 2];
        double after = 0.0;
        for (std::size_t other = face + 1; other < 6; ++other) after += areas[other / 2];
        // Exactly 1 where only empty faces follow, so that rounding never chooses one of a flat cuboid.
        *shares[face] = after == 0.0 ? 1.0f : static_cast<float>(before / total);
    }
    return total;
}

// The light that the primitive in `slot` makes, of power 0 if it is not a sampled light.
Candidate candidate(const Scene& scene, std::uint32_t slot, const PlacedPrimitive& placed) {
    const Entity& entity = scene.entities[placed.entity];
    const Material& material = scene.materials[entity.material];
    const Primitive& primitive = scene.primitives[placed.primitive];
    const glm::dmat3 linear(entity.object_to_world);
    Candidate result;
    gpu::Light& light = result.light;
    light.slot = slot;
    light.kind = static_cast<std::uint32_t>(primitive.kind);
    const double radiance = material.radiance.x + material.radiance.y + material.radiance.z;
    if (material.translucent || radiance == 0.0) return result;
    double area = 0.0;
    if (primitive.kind == PrimitiveKind::triangle) {
        area = triangle_area(scene, primitive, linear);
    } else if (primitive.kind == PrimitiveKind::cuboid) {
        area = cuboid_area(scene, primitive, linear, light);
    } else if (is_similarity(linear)) {
        const double radius = primitive.radius * std::cbrt(std::abs(glm::determinant(linear)));
        const glm::dvec3 centre(entity.object_to_world * glm::dvec4(scene.vertices[primitive.index[0]], 1.0));
        light.centre = {static_cast<float>(centre.x), static_cast<float>(centre.y), static_cast<float>(centre.z)};
        light.radius = static_cast<float>(radius);
        area = 4.0 * std::numbers::pi * radius * radius;
    }
    light.area = static_cast<float>(area);
    result.power = area * radiance;
    return result;
}

}  // namespace

std::vector<gpu::Light> make_light_table(const Scene& scene, const std::vector<gpu::Placed>& placed) {
    const std::vector<PlacedPrimitive> all = placed_primitives(scene);
    std::vector<std::uint32_t> slot_of(all.size());
    for (std::uint32_t slot = 0; slot < placed.size(); ++slot) slot_of[placed[slot].id] = slot;
    std::vector<Candidate> candidates;
    double total = 0.0;
    for (std::size_t id = 0; id < all.size(); ++id) {
        Candidate found = candidate(scene, slot_of[id], all[id]);
        if (!(found.power > 0.0)) continue;
        total += found.power;
        candidates.push_back(found);
    }
    std::vector<gpu::Light> lights;
    double before = 0.0;
    for (Candidate& found : candidates) {
        before += found.power;
        found.light.probability = static_cast<float>(found.power / total);
        found.light.cumulative = static_cast<float>(before / total);
        lights.push_back(found.light);
    }
    return lights;
}

}  // namespace tandem
