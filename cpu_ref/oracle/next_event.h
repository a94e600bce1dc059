// The oracle's light sampling (MODEL.md sections 9.2 and 9.5): which light is sampled, and which point on it. Only the
// integrator `whitted` uses it. The oracle's other integrators sample no light.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <variant>
#include <vector>

#include "common/render/renderer.h"
#include "common/scene/scene.h"
#include "cpu_ref/oracle/geometry.h"
#include "cpu_ref/oracle/light_tree.h"
#include "cpu_ref/oracle/sampling.h"

namespace tandem::oracle {

struct LightSample {
    glm::dvec3 direction;     // unit, to the light
    double distance;          // infinite for suns and the background
    glm::dvec3 irradiance;    // of a surface that faces it, over the sample's density and the light's probability
    std::uint32_t primitive;  // of the light, which does not block its own light; no_primitive: it has none
};

class SampledLights {
public:
    SampledLights(const Scene& scene, LightSampling sampling);  // of a scene that outlives it

    // By the numbers of the light's block, from a receiver at a time. `side`: the unit normal of its lit side; zero in
    // a medium. Nothing: no light, or one whose lit side is not seen. Whether anything blocks it is for the caller to
    // find out.
    [[nodiscard]] std::optional<LightSample> sample(
        const glm::dvec3& from, const glm::dvec3& side, double time, const Numbers& v) const;

private:
    struct Surface {
        std::uint32_t primitive;
        PrimitiveKind kind;
        glm::dvec3 radiance;
        bool back_emits;
        glm::dvec3 motion;
        glm::dmat3 map;      // of directions, to the world; of spheres, those of the unit sphere's space
        glm::dvec3 centre;   // sphere: its centre; else where the map sends the origin
        glm::dvec3 a, b, c;  // triangle: corners in the world; cuboid: its lowest and highest corner in its space
        std::vector<double> faces;  // cuboid: areas in the world, in the order -x +x -y +y -z +z
        double area;
    };
    struct Sky {};
    // A direction in which light comes, at some density over solid angle.
    struct Seen {
        glm::dvec3 direction;
        double distance, density;
    };
    struct Light {
        std::variant<Surface, const PunctualLight*, Sky> is;
        double weight = 1.0, probability = 0.0;
    };
    // The sky's image: rows of cells, and the shares of all before and within each.
    struct Cells {
        std::vector<double> rows, columns;  // cumulative; columns begin anew in each row
    };

    [[nodiscard]] static bool is_far(const Light& light);  // a sun or the sky
    [[nodiscard]] static LightLeaf leaf_of(const Surface& light);
    void add_surfaces();
    void add_sky();
    void share_probability(LightSampling sampling);
    void grow_tree();
    struct Chosen {
        std::size_t light;
        double probability;
    };
    [[nodiscard]] Chosen choose_light(const glm::dvec3& from, const glm::dvec3& side, double number) const;
    [[nodiscard]] static std::optional<Seen> seen_on(const Surface& light, const glm::dvec3& from, double a, double b);
    [[nodiscard]] static std::optional<Seen> on_triangle(
        const Surface& light, const glm::dvec3& from, double a, double b);
    [[nodiscard]] static std::optional<Seen> on_sphere(
        const Surface& light, const glm::dvec3& from, double a, double b);
    [[nodiscard]] static std::optional<Seen> on_cuboid(
        const Surface& light, const glm::dvec3& from, double a, double b);
    [[nodiscard]] Seen in_sky(double a, double b) const;

    const Scene& scene_;
    std::vector<Light> lights_;
    Cells cells_;
    std::optional<LightTree> tree_;  // of near lights
    double near_share_ = 1.0;        // N of rule 31
};

}  // namespace tandem::oracle
