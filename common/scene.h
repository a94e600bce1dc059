// The scene as plain data, what every backend renders. Its meaning is MODEL.md's; its file format is
// scenes/format/FORMAT.md's. Lengths are in scene units, colours and radiances in linear Rec. 709 RGB, angles in
// degrees where the name says so.
#pragma once

#include <array>
#include <cstdint>
#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>
#include <limits>
#include <optional>
#include <string>
#include <vector>

namespace tandem {

enum class PrimitiveKind : std::uint32_t { triangle = 0, sphere = 1, cuboid = 2 };

// One primitive in the object space of its entity (MODEL.md section 5). It names its points by index into
// Scene::vertices: a triangle its three corners (counter-clockwise seen from the front), a sphere its centre
// (index[0]), a cuboid its least and greatest corner (index[0], index[1]). `radius` (> 0) is the sphere's alone.
struct Primitive {
    PrimitiveKind kind = PrimitiveKind::triangle;
    std::array<std::uint32_t, 3> index{};
    double radius = 0.0;
};

enum class MaterialKind : std::uint32_t { diffuse = 0, specular = 1, emissive = 2 };
enum class Fresnel : std::uint32_t { exact = 0, schlick = 1 };
enum class EmittingSides : std::uint32_t { both = 0, front = 1 };

// A material (MODEL.md section 7). Which fields count depends on `kind`; the loader refuses the others.
struct Material {
    std::string name;
    MaterialKind kind = MaterialKind::diffuse;
    glm::dvec3 colour{1.0};    // C, each in [0, 1]
    glm::dvec3 radiance{0.0};  // L_e >= 0: emissive, and diffuse surfaces that also emit
    EmittingSides sides = EmittingSides::both;
    bool translucent = false;          // specular and emissive only
    double alpha = 1.0;                // [0, 1], translucent only
    double fuzz = 0.0;                 // [0, 1], specular and translucent emissive only
    double refractive_index = 1.5;     // > 0, inside against outside, translucent only
    Fresnel fresnel = Fresnel::exact;  // translucent only
};

// Primitives [first_primitive, first_primitive + primitive_count) of Scene::primitives under one transform and one
// material. Ranges may be shared by several entities (instances).
struct Entity {
    std::string name;
    std::uint32_t material = 0;
    std::uint32_t first_primitive = 0;
    std::uint32_t primitive_count = 0;
    glm::dmat4 object_to_world{1.0};  // affine and invertible; column vectors: p_world = object_to_world * p_object
};

// Thin-lens camera (MODEL.md section 4); lens_radius 0 is a pinhole.
struct Camera {
    glm::dvec3 position{0.0, 0.0, 0.0};
    glm::dvec3 target{0.0, 0.0, -1.0};
    glm::dvec3 up{0.0, 1.0, 0.0};
    double vertical_field_degrees = 40.0;  // (0, 180)
    double lens_radius = 0.0;              // >= 0
    double focus_distance = 1.0;           // > 0, along the view axis
};

// Radiance of rays that leave the scene (MODEL.md section 8): mixed from `down` (direction y = -1) to `up` (y = +1),
// linear in y; equal colours make it constant.
struct Background {
    glm::dvec3 down{0.0};
    glm::dvec3 up{0.0};
};

struct Film {
    std::uint32_t width = 512;
    std::uint32_t height = 512;
};

// path: scattering alone finds the light, as the thesis does; next_event: light sampling at diffuse vertices, combined
// with scattering by multiple importance sampling (MODEL.md section 9).
enum class Integrator : std::uint32_t { path = 0, next_event = 1 };

// Value of a roulette start that means: never (MODEL.md section 9.3).
inline constexpr std::uint32_t no_roulette = std::numeric_limits<std::uint32_t>::max();

// Defaults for RenderSettings that the scene file carries.
struct SceneDefaults {
    Integrator integrator = Integrator::path;
    std::uint32_t bounces = 12;
    std::uint32_t roulette_start = no_roulette;
    double ray_min = 0.0;
    double ray_max = std::numeric_limits<double>::infinity();
};

// The closed form that a scene's file may carry: the mean radiance of the image, at the file's own bounces and ray
// interval, and the formula it follows from.
struct Expectation {
    glm::dvec3 radiance{0.0};
    std::string formula;
};

struct Scene {
    std::string name;  // file name without folder and ending
    Film film;
    Camera camera;
    Background background;
    SceneDefaults defaults;
    std::vector<Material> materials;
    std::vector<glm::dvec3> vertices;
    std::vector<Primitive> primitives;
    std::vector<Entity> entities;
    std::optional<Expectation> expect;
};

// A primitive as placed in the world. Its position in `placed_primitives(scene)` is its *primitive id*: entities in
// order, each entity's primitives in order. Every tie and every list of lights follows this numbering.
struct PlacedPrimitive {
    std::uint32_t entity;
    std::uint32_t primitive;  // index into Scene::primitives
};
[[nodiscard]] std::vector<PlacedPrimitive> placed_primitives(const Scene& scene);

}  // namespace tandem
