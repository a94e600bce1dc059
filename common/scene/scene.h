// The scene as plain data, which every backend renders. MODEL.md defines its meaning, and scenes/format/FORMAT.md its
// file format. Lengths are in scene units, colours and radiances in linear Rec. 709 RGB, angles in degrees where the
// name says so.
#pragma once

#include <array>
#include <cstdint>
#include <glm/mat4x4.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace tandem {

enum class PrimitiveKind : std::uint32_t { triangle = 0, sphere = 1, cuboid = 2 };

// One primitive in the object space of its entity (MODEL.md section 5). It names its points by index into
// Scene::vertices. A triangle has three corners (counter-clockwise seen from the front), a sphere its centre
// (index[0]). A cuboid has its least and greatest corner (index[0], index[1]). `radius` (> 0) is the sphere's alone.
struct Primitive {
    PrimitiveKind kind = PrimitiveKind::triangle;
    std::array<std::uint32_t, 3> index{};
    double radius = 0.0;
};

// Linear RGB pixels, row by row from the top; three floats each.
struct Pixels {
    std::uint32_t width = 0, height = 0;
    std::vector<float> rgb;
};

enum class TextureKind : std::uint32_t { checker = 0, noise = 1, image = 2 };
enum class TextureSpace : std::uint32_t { object = 0, coordinates = 1 };  // checker and noise; images use coordinates
enum class NoiseStyle : std::uint32_t { smooth = 0, turbulence = 1, marble = 2 };

// A colour that varies over a surface (MODEL.md section 7.0). Which fields count depends on `kind`.
struct Texture {
    std::string name;
    TextureKind kind = TextureKind::checker;
    TextureSpace space = TextureSpace::object;
    glm::dvec3 first{0.0}, second{1.0};     // colours that checker and noise mix, each in [0, 1]
    glm::dvec3 frequency{1.0};              // cells a unit of length on each axis, >= 0; 0 leaves the axis out
    NoiseStyle style = NoiseStyle::smooth;  // noise
    std::uint32_t octaves = 7;              // noise, 1 ... 16: turbulence and marble
    double amount = 1.0;                    // marble: turns of phase by the turbulence, >= 0
    std::uint32_t seed = 0;                 // noise
    std::shared_ptr<const Pixels> image;    // image, each channel in [0, 1]
};

inline constexpr std::uint32_t no_index = 0xFFFFFFFFu;  // in place of an index into a table of the scene: none

enum class MaterialKind : std::uint32_t {
    diffuse = 0,
    specular = 1,
    emissive = 2,
    conductor = 3,
    boundary = 4,
    rough_diffuse = 5
};
enum class Fresnel : std::uint32_t { exact = 0, schlick = 1 };
enum class EmittingSides : std::uint32_t { both = 0, front = 1 };

// A material (MODEL.md section 7). Which fields count depends on `kind`; the loader refuses the others.
struct Material {
    std::string name;
    MaterialKind kind = MaterialKind::diffuse;
    glm::dvec3 colour{1.0};    // C, each in [0, 1]
    glm::dvec3 radiance{0.0};  // L_e >= 0: emissive, and (rough) diffuse surfaces that also emit
    EmittingSides sides = EmittingSides::both;
    bool translucent = false;          // specular and emissive only
    double alpha = 1.0;                // [0, 1], translucent only
    double fuzz = 0.0;                 // [0, 1], specular and translucent emissive only
    double refractive_index = 1.5;     // > 0, inside against outside, translucent only
    Fresnel fresnel = Fresnel::exact;  // translucent only
    // 0 (smooth) or [0.03, 1], GGX alpha = roughness^2: conductor, and translucent specular, there instead of fuzz.
    // Rough diffuse: the standard deviation of its slopes' angles in radians, in [0, 1].
    double roughness = 0.0;
    glm::dvec3 eta{1.0}, k{0.0};              // conductor: its complex index eta + ik, eta > 0, k >= 0
    std::uint32_t colour_texture = no_index;  // takes the place of `colour`
    std::uint32_t interior = no_index;        // medium inside: translucent and boundary only (section 9.4)
    std::optional<std::int32_t> priority;     // of nested dielectrics: translucent and boundary only (section 9.4)
};

// Values on a box of nx * ny * nz equal cells, x fastest, constant in each; 0 outside of [low, high] (world space).
struct DensityGrid {
    std::array<std::uint32_t, 3> cells{1, 1, 1};
    glm::dvec3 low{0.0}, high{1.0};
    std::vector<float> density;  // >= 0
};

// A participating medium (MODEL.md section 10): coefficients a unit of length, scaled by the grid's density, if any.
struct Medium {
    std::string name;
    glm::dvec3 absorption{0.0}, scattering{0.0};  // >= 0
    double anisotropy = 0.0;  // g of Henyey and Greenstein: 0, or 0.01 <= |g| <= 0.99; > 0 is forward
    std::shared_ptr<const DensityGrid> grid;
};

// Lights without a surface (MODEL.md section 8.3).
enum class PunctualKind : std::uint32_t { point = 0, spot = 1, sun = 2 };
struct PunctualLight {
    std::string name;
    PunctualKind kind = PunctualKind::point;
    glm::dvec3 position{0.0};              // point, spot
    glm::dvec3 direction{0.0, -1.0, 0.0};  // unit, in which light travels: spot (axis), sun
    glm::dvec3 intensity{0.0};             // point, spot: radiant intensity; sun: irradiance of a surface facing it
    double inner_degrees = 0.0, outer_degrees = 45.0;  // spot: half angles, 0 <= inner < outer <= 90
};

// Primitives [first_primitive, first_primitive + primitive_count) of Scene::primitives under one transform and one
// material. Ranges may be shared by several entities (instances).
struct Entity {
    std::string name;
    std::uint32_t material = 0;
    std::uint32_t first_primitive = 0;
    std::uint32_t primitive_count = 0;
    glm::dmat4 object_to_world{1.0};  // affine and invertible; column vectors: p_world = object_to_world * p_object
    glm::dvec3 motion{0.0};           // world displacement from shutter opening to closing (MODEL.md section 6)
};

// Thin-lens camera (MODEL.md section 4); lens_radius 0 is a pinhole.
struct Camera {
    glm::dvec3 position{0.0, 0.0, 0.0};
    glm::dvec3 target{0.0, 0.0, -1.0};
    glm::dvec3 up{0.0, 1.0, 0.0};
    double vertical_field_degrees = 40.0;                 // (0, 180)
    double lens_radius = 0.0;                             // >= 0
    double focus_distance = 1.0;                          // > 0, along the view axis
    glm::dvec3 position_motion{0.0}, target_motion{0.0};  // displacements from shutter opening to closing
};

// Radiance of rays that leave the scene (MODEL.md section 8). It is mixed from `down` (direction y = -1) to `up` (y =
// +1), linear in y. Equal colours make it constant. Or an image over the sphere, latitude against longitude.
struct Background {
    glm::dvec3 down{0.0};
    glm::dvec3 up{0.0};
    std::shared_ptr<const Pixels> image;  // takes the place of the two; radiance, >= 0
    double image_scale = 1.0;             // > 0, of the image
    double rotation_degrees = 0.0;        // of the image, counter-clockwise about +y
    bool sampled = false;                 // a light of next-event estimation
};

struct Film {
    std::uint32_t width = 512;
    std::uint32_t height = 512;
};

// The ways to find light (MODEL.md section 9).
// - path: scattering alone finds it, as in the thesis.
// - next_event: light sampling and scattering, combined by multiple importance sampling unless RenderSettings::mis
//   is off.
// - whitted: direct light and specular chains alone.
// - bidirectional: paths from both ends.
enum class Integrator : std::uint32_t { path = 0, next_event = 1, whitted = 2, bidirectional = 3 };

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

// The closed form that a scene's file may carry: the mean radiance of the image, and the formula it follows from. It is
// at the file's own bounces and ray interval.
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
    std::vector<Texture> textures;
    std::vector<Medium> media;
    std::uint32_t medium = no_index;  // around everything, the camera included
    std::vector<Material> materials;
    std::vector<PunctualLight> lights;
    std::vector<glm::dvec3> vertices;
    std::vector<glm::dvec2> texture_coordinates;  // of the vertices, as many, or none at all (MODEL.md section 5.1)
    std::vector<glm::dvec3> normals;              // as many, or none; 0 at vertices without one (MODEL.md section 5.4)
    std::vector<Primitive> primitives;
    std::vector<Entity> entities;
    std::optional<Expectation> expect;
    std::vector<std::string> remarks;  // what of its models is not taken over, a line a file
};

// A primitive as placed in the world. Its position in `placed_primitives(scene)` is its *primitive id*: entities in
// order, each entity's primitives in order. Every tie and every list of lights follows this numbering.
struct PlacedPrimitive {
    std::uint32_t entity;
    std::uint32_t primitive;  // index into Scene::primitives
};

// All of a scene by primitive id, without a list of them. The scene must outlive it, and stay as it is.
class PlacedPrimitives {
public:
    class Iterator {
    public:
        Iterator(const std::vector<Entity>& entities, std::uint32_t entity) : entities_(&entities), entity_(entity) {
            skip_empty();
        }
        [[nodiscard]] PlacedPrimitive operator*() const {
            return {entity_, (*entities_)[entity_].first_primitive + index_};
        }
        Iterator& operator++() {
            ++index_;
            skip_empty();
            return *this;
        }
        [[nodiscard]] bool operator==(const Iterator& other) const {
            return entity_ == other.entity_ && index_ == other.index_;
        }

    private:
        void skip_empty() {
            for (; entity_ < entities_->size() && index_ == (*entities_)[entity_].primitive_count; ++entity_)
                index_ = 0;
        }
        const std::vector<Entity>* entities_;
        std::uint32_t entity_, index_ = 0;
    };

    explicit PlacedPrimitives(const Scene& scene);

    [[nodiscard]] Iterator begin() const { return {*entities_, 0}; }
    [[nodiscard]] Iterator end() const { return {*entities_, static_cast<std::uint32_t>(entities_->size())}; }
    [[nodiscard]] std::uint32_t size() const { return firsts_.back(); }
    // Throws std::out_of_range from size() on. In time of the logarithm of the number of entities.
    [[nodiscard]] PlacedPrimitive operator[](std::uint32_t id) const;
    // The id of an entity's first primitive.
    [[nodiscard]] std::uint32_t first_of(std::uint32_t entity) const { return firsts_[entity]; }

private:
    const std::vector<Entity>* entities_;
    std::vector<std::uint32_t> firsts_;  // by entity; and the number of all
};
[[nodiscard]] inline PlacedPrimitives placed_primitives(const Scene& scene) { return PlacedPrimitives(scene); }

// Whether an affine map leaves spheres spheres, to a relative 10^-5 (MODEL.md section 9.2).
[[nodiscard]] bool is_similarity(const glm::dmat4& map);

// The largest magnitude of a coordinate.
[[nodiscard]] double largest_coordinate(const glm::dvec3& v);

}  // namespace tandem
