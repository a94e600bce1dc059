// Small scenes in memory for tests, and the materials of MODEL.md section 7 by one line each.
#pragma once

#include <array>
#include <cmath>
#include <glm/glm.hpp>
#include <glm/gtc/matrix_transform.hpp>
#include <optional>
#include <string>

#include "common/render/renderer.h"
#include "common/scene/scene.h"

namespace tandem::test {

using glm::dmat4;
using glm::dvec3;

inline const dvec3 black(0.0), white(1.0);

// A square image.
inline RenderSettings settings_of(
    std::uint32_t size, std::uint32_t bounces, Integrator integrator = Integrator::path, std::uint64_t seed = 1) {
    RenderSettings settings;
    settings.width = settings.height = size;
    settings.bounces = bounces;
    settings.integrator = integrator;
    settings.seed = seed;
    return settings;
}

inline Material diffuse(const dvec3& colour, const dvec3& radiance = black) {
    Material material;
    material.colour = colour;
    material.radiance = radiance;
    return material;
}

inline Material rough_diffuse(const dvec3& colour, double sigma) {
    Material material = diffuse(colour);
    material.kind = MaterialKind::rough_diffuse;
    material.roughness = sigma;
    return material;
}

inline Material emitter(const dvec3& radiance, EmittingSides sides = EmittingSides::both) {
    Material material;
    material.kind = MaterialKind::emissive;
    material.radiance = radiance;
    material.sides = sides;
    return material;
}

inline Material mirror(const dvec3& colour, double fuzz = 0.0) {
    Material material;
    material.kind = MaterialKind::specular;
    material.colour = colour;
    material.fuzz = fuzz;
    return material;
}

// Clear unless told otherwise: alpha 0.
inline Material glass(double refractive_index, Fresnel fresnel = Fresnel::exact, double alpha = 0.0,
    const dvec3& colour = white, double fuzz = 0.0) {
    Material material = mirror(colour, fuzz);
    material.translucent = true;
    material.alpha = alpha;
    material.refractive_index = refractive_index;
    material.fresnel = fresnel;
    return material;
}

// The material of a shape: one of its own, or the one of that number, which SceneBuilder::material gave.
class ShapeMaterial {
public:
    ShapeMaterial(const Material& own) : own_(own) {}
    ShapeMaterial(std::uint32_t index) : index_(index) {}
    [[nodiscard]] std::uint32_t index_in(Scene& scene) const {
        if (!own_) return index_;
        scene.materials.push_back(*own_);
        scene.materials.back().name = "material " + std::to_string(scene.materials.size());
        return static_cast<std::uint32_t>(scene.materials.size() - 1);
    }

private:
    std::optional<Material> own_;
    std::uint32_t index_ = 0;
};

// One entity a call: material, then shape, then where it stands.
class SceneBuilder {
public:
    SceneBuilder() { scene_.name = "test"; }

    SceneBuilder& camera(const dvec3& position, const dvec3& target, double field_degrees = 40.0,
        const dvec3& up = dvec3(0.0, 1.0, 0.0)) {
        scene_.camera.position = position;
        scene_.camera.target = target;
        scene_.camera.up = up;
        scene_.camera.vertical_field_degrees = field_degrees;
        return *this;
    }
    SceneBuilder& lens(double radius, double focus_distance) {
        scene_.camera.lens_radius = radius;
        scene_.camera.focus_distance = focus_distance;
        return *this;
    }
    SceneBuilder& background(const dvec3& down, const dvec3& up) {
        scene_.background.down = down;
        scene_.background.up = up;
        return *this;
    }
    SceneBuilder& background(const dvec3& everywhere) { return background(everywhere, everywhere); }

    // For several shapes.
    std::uint32_t material(const Material& material) { return ShapeMaterial(material).index_in(scene_); }

    SceneBuilder& triangle(const ShapeMaterial& material, const dvec3& a, const dvec3& b, const dvec3& c,
        const dmat4& placed = dmat4(1.0)) {
        begin_entity(material, placed);
        add_triangle(vertex(a), vertex(b), vertex(c));
        return *this;
    }
    // Two triangles, counter-clockwise corners seen from the front.
    SceneBuilder& quad(const ShapeMaterial& material, const dvec3& a, const dvec3& b, const dvec3& c, const dvec3& d,
        const dmat4& placed = dmat4(1.0)) {
        begin_entity(material, placed);
        const std::uint32_t corners[] = {vertex(a), vertex(b), vertex(c), vertex(d)};
        add_triangle(corners[0], corners[1], corners[2]);
        add_triangle(corners[0], corners[2], corners[3]);
        return *this;
    }
    SceneBuilder& triangle(
        const ShapeMaterial& material, const std::array<dvec3, 3>& corners, const dmat4& placed = dmat4(1.0)) {
        return triangle(material, corners[0], corners[1], corners[2], placed);
    }
    SceneBuilder& quad(const ShapeMaterial& material, const std::array<dvec3, 4>& corners) {
        return quad(material, corners[0], corners[1], corners[2], corners[3]);
    }
    // A horizontal square about (0, y, 0), front side up.
    SceneBuilder& floor(const ShapeMaterial& material, double y, double half_width) {
        const double h = half_width;
        return quad(material, {-h, y, h}, {h, y, h}, {h, y, -h}, {-h, y, -h});
    }
    SceneBuilder& sphere(
        const ShapeMaterial& material, const dvec3& centre, double radius, const dmat4& placed = dmat4(1.0)) {
        begin_entity(material, placed);
        add({PrimitiveKind::sphere, {vertex(centre), 0, 0}, radius});
        return *this;
    }
    SceneBuilder& cuboid(
        const ShapeMaterial& material, const dvec3& least, const dvec3& greatest, const dmat4& placed = dmat4(1.0)) {
        begin_entity(material, placed);
        add({PrimitiveKind::cuboid, {vertex(least), vertex(greatest), 0}, 0.0});
        return *this;
    }
    // The boundary of a cuboid as twelve triangles, front side out.
    SceneBuilder& triangle_box(
        const ShapeMaterial& material, const dvec3& least, const dvec3& greatest, const dmat4& placed = dmat4(1.0)) {
        begin_entity(material, placed);
        std::uint32_t corner[8];
        for (std::uint32_t i = 0; i < 8; ++i)
            corner[i] = vertex({(i & 1u) != 0 ? greatest.x : least.x, (i & 2u) != 0 ? greatest.y : least.y,
                (i & 4u) != 0 ? greatest.z : least.z});
        constexpr int faces[6][4] = {
            {0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
        for (const auto& f : faces) {
            add_triangle(corner[f[0]], corner[f[1]], corner[f[2]]);
            add_triangle(corner[f[0]], corner[f[2]], corner[f[3]]);
        }
        return *this;
    }

    [[nodiscard]] const Scene& scene() const { return scene_; }
    [[nodiscard]] Scene& scene() { return scene_; }

private:
    void begin_entity(const ShapeMaterial& material, const dmat4& placed) {
        Entity entity;
        entity.name = "entity " + std::to_string(scene_.entities.size());
        entity.material = material.index_in(scene_);
        entity.first_primitive = static_cast<std::uint32_t>(scene_.primitives.size());
        entity.object_to_world = placed;
        scene_.entities.push_back(entity);
    }
    std::uint32_t vertex(const dvec3& p) {
        scene_.vertices.push_back(p);
        return static_cast<std::uint32_t>(scene_.vertices.size() - 1);
    }
    void add(const Primitive& primitive) {
        scene_.primitives.push_back(primitive);
        ++scene_.entities.back().primitive_count;
    }
    void add_triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
        add({PrimitiveKind::triangle, {a, b, c}, 0.0});
    }

    Scene scene_;
};

inline dmat4 moved(const dvec3& by) { return glm::translate(dmat4(1.0), by); }
inline dmat4 scaled(const dvec3& by) { return glm::scale(dmat4(1.0), by); }
inline dmat4 rotated(double degrees, const dvec3& axis) {
    return glm::rotate(dmat4(1.0), glm::radians(degrees), glm::normalize(axis));
}

}  // namespace tandem::test
