#include "vulkan/renderer/scene/light_table.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <glm/trigonometric.hpp>
#include <numbers>
#include <utility>

#include "vulkan/renderer/scene/light_tree.h"

namespace tandem {

namespace {

// A light before probabilities are known.
template <class Real>
struct Candidate {
    gpu::LightOf<Real> light;
    double power = 0.0;  // what the choice among near lights is proportional to; of a far one 1
    bool far = false;
    LightLeaf leaf = {};  // of a near one
};

double channel_sum(const glm::dvec3& colour) { return colour.x + colour.y + colour.z; }

double triangle_area(const Scene& scene, const Primitive& primitive, const glm::dmat3& m) {
    const glm::dvec3 origin = scene.vertices[primitive.index[0]];
    return 0.5 * glm::length(glm::cross(m * (scene.vertices[primitive.index[1]] - origin),
                     m * (scene.vertices[primitive.index[2]] - origin)));
}

// World areas of the faces, and their cumulative shares into the light.
template <class Real>
double cuboid_area(const Scene& scene, const Primitive& primitive, const glm::dmat3& m, gpu::LightOf<Real>& light) {
    const glm::dvec3 size = scene.vertices[primitive.index[1]] - scene.vertices[primitive.index[0]];
    const glm::dvec3 x = m[0] * size.x, y = m[1] * size.y, z = m[2] * size.z;
    const std::array areas{glm::length(glm::cross(y, z)), glm::length(glm::cross(z, x)), glm::length(glm::cross(x, y))};
    const double total = 2.0 * (areas[0] + areas[1] + areas[2]);
    double before = 0.0;
    const std::array<Real*, 5> shares{&light.face0, &light.face1, &light.face2, &light.face3, &light.face4};
    for (std::size_t face = 0; face < shares.size(); ++face) {
        before += areas[face / 2];
        double after = 0.0;
        for (std::size_t other = face + 1; other < 6; ++other) after += areas[other / 2];
        // Exactly 1 where only empty faces follow, so that rounding never chooses one of a flat cuboid.
        *shares[face] = after == 0.0 ? Real(1) : static_cast<Real>(before / total);
    }
    return total;
}

// Rule 32 of section 9.2.
LightLeaf leaf_of_triangle(const Scene& scene, const Primitive& primitive, const glm::dmat4& m) {
    std::array<glm::dvec3, 3> corners;
    for (std::size_t i = 0; i < 3; ++i)
        corners[i] = glm::dvec3(m * glm::dvec4(scene.vertices[primitive.index[i]], 1.0));
    const glm::dvec3 normal = glm::normalize(glm::cross(corners[1] - corners[0], corners[2] - corners[0]));
    return {glm::min(corners[0], glm::min(corners[1], corners[2])),
        glm::max(corners[0], glm::max(corners[1], corners[2])),
        glm::determinant(glm::dmat3(m)) < 0.0 ? -normal : normal};
}
LightLeaf leaf_of_convex(const Scene& scene, const Primitive& primitive, const glm::dmat4& m) {
    glm::dvec3 centre = scene.vertices[primitive.index[0]], half(0.0);
    const glm::dmat3 linear(m);
    if (primitive.kind == PrimitiveKind::sphere) {
        for (int axis = 0; axis < 3; ++axis)
            half[axis] = primitive.radius * glm::length(glm::dvec3(linear[0][axis], linear[1][axis], linear[2][axis]));
    } else {
        const glm::dvec3 size = scene.vertices[primitive.index[1]] - centre;
        centre += 0.5 * size;
        for (int axis = 0; axis < 3; ++axis) half += 0.5 * size[axis] * glm::abs(linear[axis]);
    }
    const glm::dvec3 c(m * glm::dvec4(centre, 1.0));
    return {c - half, c + half};
}

LightLeaf leaf_of(const Scene& scene, const Primitive& primitive, const Entity& entity, bool two_sided, double power) {
    const bool flat = primitive.kind == PrimitiveKind::triangle;
    LightLeaf leaf = flat ? leaf_of_triangle(scene, primitive, entity.object_to_world)
                          : leaf_of_convex(scene, primitive, entity.object_to_world);
    leaf.low = glm::min(leaf.low, leaf.low + entity.motion);
    leaf.high = glm::max(leaf.high, leaf.high + entity.motion);
    if (two_sided) leaf.axis = glm::dvec3(0.0);
    leaf.strength = !flat ? power / 4.0 : two_sided ? power / 2.0 : power;
    return leaf;
}

// The light that the primitive in `slot` makes, of power 0 if it is not a sampled light.
template <class Real>
Candidate<Real> candidate(const Scene& scene, std::uint32_t slot, const PlacedPrimitive& placed) {
    const Entity& entity = scene.entities[placed.entity];
    const Material& material = scene.materials[entity.material];
    const Primitive& primitive = scene.primitives[placed.primitive];
    const glm::dmat3 linear(entity.object_to_world);
    Candidate<Real> result;
    gpu::LightOf<Real>& light = result.light;
    light.slot = slot;
    light.kind = static_cast<std::uint32_t>(primitive.kind);
    const double radiance = channel_sum(material.radiance) * (material.translucent ? material.alpha : 1.0);
    if (material.translucent && (material.interior != no_index || material.priority)) return result;
    double area = 0.0;
    if (primitive.kind == PrimitiveKind::triangle) {
        area = triangle_area(scene, primitive, linear);
    } else if (primitive.kind == PrimitiveKind::cuboid) {
        area = cuboid_area(scene, primitive, linear, light);
    } else {
        const double radius = primitive.radius * std::cbrt(std::abs(glm::determinant(linear)));
        const glm::dvec3 centre(entity.object_to_world * glm::dvec4(scene.vertices[primitive.index[0]], 1.0));
        if (!is_similarity(entity.object_to_world)) light.kind = gpu::kind_ellipsoid;
        light.centre = gpu::rounded<Real>(centre);
        light.radius = static_cast<Real>(radius);
        area = 4.0 * std::numbers::pi * radius * radius;
    }
    light.area = static_cast<Real>(area);
    result.power = area * radiance;
    if (result.power > 0.0)
        result.leaf = leaf_of(scene, primitive, entity, material.sides == EmittingSides::both, result.power);
    return result;
}

template <class Real>
Candidate<Real> candidate(const PunctualLight& punctual) {
    Candidate<Real> result;
    gpu::LightOf<Real>& light = result.light;
    light.slot = gpu::no_index;
    light.centre = gpu::rounded<Real>(punctual.position);
    light.axis = gpu::rounded<Real>(punctual.direction);
    light.intensity = gpu::rounded<Real>(punctual.intensity);
    const double outer = std::cos(glm::radians(punctual.outer_degrees));
    light.outer = static_cast<Real>(outer);
    light.inner = static_cast<Real>(std::cos(glm::radians(punctual.inner_degrees)));
    const double sum = channel_sum(punctual.intensity);
    const glm::dvec3 axis = punctual.kind == PunctualKind::spot ? punctual.direction : glm::dvec3(0.0);
    result.leaf = {punctual.position, punctual.position, axis, sum};
    switch (punctual.kind) {
        case PunctualKind::point:
            light.kind = gpu::kind_point;
            result.power = 4.0 * sum;
            break;
        case PunctualKind::spot:
            light.kind = gpu::kind_spot;
            result.power = 2.0 * (1.0 - outer) * sum;
            break;
        case PunctualKind::sun:
            light.kind = gpu::kind_sun;
            result.power = sum > 0.0 ? 1.0 : 0.0;
            result.far = true;
            break;
    }
    return result;
}

template <class Real>
std::vector<Candidate<Real>> candidates_of(
    const Scene& scene, const std::vector<gpu::Placed>& placed, bool background) {
    std::vector<std::pair<std::uint32_t, std::uint32_t>> emitting;  // ids and slots
    for (std::uint32_t slot = 0; slot < placed.size(); ++slot)
        if (scene.materials[placed[slot].material].radiance != glm::dvec3(0.0))
            emitting.emplace_back(placed[slot].id, slot);
    std::ranges::sort(emitting);
    const PlacedPrimitives all = placed_primitives(scene);
    std::vector<Candidate<Real>> candidates;
    const auto add = [&](const Candidate<Real>& found) {
        if (found.power > 0.0) candidates.push_back(found);
    };
    for (const auto& [id, slot] : emitting) add(candidate<Real>(scene, slot, all[id]));
    for (const bool suns : {false, true})
        for (const PunctualLight& light : scene.lights)
            if ((light.kind == PunctualKind::sun) == suns) add(candidate<Real>(light));
    if (background) {
        Candidate<Real> found{{}, 1.0, true};
        found.light.slot = gpu::no_index;
        found.light.kind = gpu::kind_background;
        add(found);
    }
    return candidates;
}

// Puts near lights in the order of the tree's leaves.
template <class Real>
void grow_tree(std::vector<Candidate<Real>>& candidates, LightTable<Real>& table) {
    std::vector<LightLeaf> leaves;
    for (const Candidate<Real>& found : candidates)
        if (!found.far) leaves.push_back(found.leaf);
    if (leaves.size() < 2) return;
    LightTree tree = grow_light_tree(leaves);
    std::vector<Candidate<Real>> sorted;
    for (const std::uint32_t i : tree.order) sorted.push_back(candidates[i]);
    std::ranges::copy(sorted, candidates.begin());
    table.tree_nodes = std::move(tree.nodes);
    table.tree_leaves = static_cast<std::uint32_t>(leaves.size());
}

}  // namespace

template <class Real>
LightTable<Real> make_light_table(
    const Scene& scene, const std::vector<gpu::Placed>& placed, bool background, LightSampling sampling) {
    std::vector<Candidate<Real>> candidates = candidates_of<Real>(scene, placed, background);
    LightTable<Real> table;
    if (sampling == LightSampling::tree) grow_tree(candidates, table);
    if (sampling == LightSampling::uniform)
        for (Candidate<Real>& found : candidates) found.power = 1.0;
    double near = 0.0, far = 0.0;
    for (const Candidate<Real>& found : candidates) (found.far ? far : near) += found.power;
    double group = near > 0.0 && far > 0.0 ? 0.5 : 1.0;  // the share of near lights, if there are any
    if (sampling == LightSampling::uniform && near > 0.0) group = near / (near + far);
    double near_before = 0.0, far_before = 0.0;
    for (Candidate<Real>& found : candidates) {
        const double total = found.far ? far : near;
        double& before = found.far ? far_before : near_before;
        before += found.power;
        // Far lights come after all near ones.
        const double share = found.far && near > 0.0 ? 1.0 - group : group;
        found.light.probability = static_cast<Real>(share * (found.power / total));
        if (!found.far && table.tree_leaves > 0) found.light.probability = static_cast<Real>(share);
        const double of_near = found.far && near > 0.0 ? group : 0.0;
        found.light.cumulative = static_cast<Real>(of_near + share * (before / total));
        table.lights.push_back(found.light);
    }
    return table;
}

template LightTable<float> make_light_table<float>(const Scene&, const std::vector<gpu::Placed>&, bool, LightSampling);
template LightTable<double> make_light_table<double>(
    const Scene&, const std::vector<gpu::Placed>&, bool, LightSampling);

}  // namespace tandem
