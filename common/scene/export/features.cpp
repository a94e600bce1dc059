#include "common/scene/export/features.h"

#include <fmt/format.h>

#include <algorithm>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <glm/vector_relational.hpp>

#include "common/error.h"
#include "common/text.h"

namespace tandem::scene_export {

namespace {

using Where = std::optional<std::string>;

template <class Test>
Where material_where(const Scene& scene, const Test& test) {
    for (const Entity& entity : scene.entities)
        if (const Material& material = scene.materials[entity.material]; test(material))
            return "the material " + printable(material.name);
    return std::nullopt;
}

template <class Test>
Where entity_where(const Scene& scene, const Test& test) {
    for (std::size_t i = 0; i < scene.entities.size(); ++i)
        if (test(scene.entities[i]))
            return scene.entities[i].name.empty() ? fmt::format("entity {}", i)
                                                  : "the entity " + printable(scene.entities[i].name);
    return std::nullopt;
}

template <class Test>
Where primitive_where(const Scene& scene, const Test& test) {
    return entity_where(scene, [&](const Entity& entity) {
        for (std::size_t p = 0; p < entity.primitive_count; ++p)
            if (test(entity, scene.primitives[entity.first_primitive + p])) return true;
        return false;
    });
}

template <class Test>
Where texture_where(const Scene& scene, const Test& test) {
    return material_where(scene, [&](const Material& material) {
        return material.colour_texture != no_index && test(scene.textures[material.colour_texture]);
    });
}

template <class Test>
Where medium_where(const Scene& scene, const Test& test) {
    for (const Medium& medium : scene.media)
        if (test(medium)) return "the medium " + printable(medium.name);
    return std::nullopt;
}

Where light_where(const Scene& scene, PunctualKind kind) {
    for (std::size_t i = 0; i < scene.lights.size(); ++i)
        if (scene.lights[i].kind == kind) return fmt::format("light {}", i);
    return std::nullopt;
}

Where there(bool is_there, const char* where) { return is_there ? Where(where) : std::nullopt; }

// Whether it consists of spheres and cuboids alone, and neither the camera nor a corner of anything else is within.
bool is_empty_solid(const Scene& scene, const Entity& entity) {
    const auto own = std::span(scene.primitives).subspan(entity.first_primitive, entity.primitive_count);
    if (std::ranges::any_of(own, [](const Primitive& p) { return p.kind == PrimitiveKind::triangle; })) return false;
    const glm::dmat4 to_object = glm::inverse(entity.object_to_world);
    const auto holds = [&](const glm::dvec3& world) {
        const glm::dvec3 point(to_object * glm::dvec4(world, 1.0));
        return std::ranges::any_of(own, [&](const Primitive& p) {
            const glm::dvec3& first = scene.vertices[p.index[0]];
            if (p.kind == PrimitiveKind::sphere) return glm::length(point - first) < p.radius;
            return glm::all(glm::lessThan(first, point)) && glm::all(glm::lessThan(point, scene.vertices[p.index[1]]));
        });
    };
    if (holds(scene.camera.position)) return false;
    for (const Entity& other : scene.entities) {
        if (&other == &entity) continue;
        for (std::size_t p = 0; p < other.primitive_count; ++p) {
            const Primitive& primitive = scene.primitives[other.first_primitive + p];
            const std::size_t points = primitive.kind == PrimitiveKind::triangle ? 3
                                       : primitive.kind == PrimitiveKind::cuboid ? 2
                                                                                 : 1;
            for (std::size_t i = 0; i < points; ++i)
                if (holds(glm::dvec3(other.object_to_world * glm::dvec4(scene.vertices[primitive.index[i]], 1.0))))
                    return false;
        }
    }
    return true;
}
bool emits(const Material& material) { return !material.translucent && material.radiance != glm::dvec3(0.0); }
bool glass(const Material& material) { return material.kind == MaterialKind::specular && material.translucent; }
bool rough(const Material& material) { return material.roughness > 0.0; }
bool coloured(const Material& material) {
    return material.translucent && material.alpha > 0.0 &&
           (material.colour != glm::dvec3(1.0) || material.colour_texture != no_index);
}
bool is_black(const Background& background) {
    return !background.image && background.down == glm::dvec3(0.0) && background.up == glm::dvec3(0.0);
}

constexpr Saying exact{};
constexpr Saying near(std::string_view reason) { return {Can::near, reason}; }
constexpr Saying kept(std::string_view reason) { return {Can::kept, reason}; }
constexpr Saying refused(std::string_view reason) { return {Can::refused, reason}; }

constexpr std::string_view smoothed = "it smooths the edges of cells over a pixel's footprint";
constexpr std::string_view equal_area = "made anew as 512 × 512 texels of equal solid angle, each of one colour";
constexpr std::string_view no_fuzz = "no lobe is the fuzz of MODEL.md 7.3";
constexpr std::string_view no_schlick = "its dielectrics have the exact Fresnel term";
constexpr std::string_view by_nodes =
    "nodes sample the lobe, which light sampling does not reach: more noise, the same mean";
constexpr std::string_view added_media = "where bodies overlap, their media add up";
constexpr std::string_view no_noise = "its noise is another function than MODEL.md 7.0's";
constexpr std::string_view no_priority = "it knows no priorities of bodies that overlap";
constexpr std::string_view other_guard = "it guards against light leaks by another rule than MODEL.md 5.4";
constexpr std::string_view unit_normals =
    "it interpolates the world's unit normals, and guards against light leaks by another rule than MODEL.md 5.4";
constexpr std::string_view no_interval = "it has no interval of ray lengths";

// In the order of the documentation's table.
const Feature rows[] = {
    // ---- Shapes
    {"spheres",
        {near("a mesh of 16 128 triangles, up to 3·10⁻⁴ radii within; extras keep the sphere"), exact, exact,
            near("a mesh of 327 680 triangles, off by up to 4·10⁻⁵ radii")},
        [](const Scene& scene) {
            return primitive_where(
                scene, [](const Entity&, const Primitive& p) { return p.kind == PrimitiveKind::sphere; });
        }},
    {"ellipsoids",
        {near("a mesh, as a sphere"), exact, refused("its spheres cannot be stretched"), near("a mesh, as a sphere")},
        [](const Scene& scene) {
            return primitive_where(scene, [](const Entity& entity, const Primitive& p) {
                return p.kind == PrimitiveKind::sphere && !is_similarity(entity.object_to_world);
            });
        }},
    {"cuboids", {near("a mesh of 12 triangles, the same surface"), exact, exact, exact},
        [](const Scene& scene) {
            return primitive_where(
                scene, [](const Entity&, const Primitive& p) { return p.kind == PrimitiveKind::cuboid; });
        }},
    {"vertex normals", {near(other_guard), near(other_guard), near(unit_normals), refused(other_guard)},
        [](const Scene& scene) { return there(!scene.normals.empty(), "a model"); }},
    {"motion of bodies",
        {kept("its animations have no shutter"), exact, refused("it has no moving bodies"),
            refused("Blender steps motion by whole frames, by curves that are not written here")},
        [](const Scene& scene) {
            return entity_where(scene, [](const Entity& entity) { return entity.motion != glm::dvec3(0.0); });
        }},
    {"lamps that move",
        {kept("its animations have no shutter"), refused("its area lights cannot move"),
            refused("it has no moving bodies"),
            refused("Blender steps motion by whole frames, by curves that are not written here")},
        [](const Scene& scene) {
            return entity_where(scene, [&](const Entity& entity) {
                return entity.motion != glm::dvec3(0.0) && emits(scene.materials[entity.material]);
            });
        }},
    // ---- Camera and estimator
    {"motion of the camera",
        {kept("its animations have no shutter"), refused("it moves cameras by turning them evenly, not by MODEL.md 4"),
            refused("it has no moving cameras"),
            refused("Blender steps motion by whole frames, by curves that are not written here")},
        [](const Scene& scene) {
            return there(
                scene.camera.position_motion != glm::dvec3(0.0) || scene.camera.target_motion != glm::dvec3(0.0),
                "the camera");
        }},
    {"thin lens", {kept("its cameras are pinholes"), exact, exact, exact},
        [](const Scene& scene) { return there(scene.camera.lens_radius > 0.0, "the camera"); }},
    {"pixel filter", {near("it says nothing of filters: Tandem's is a box of one pixel"), exact, exact, exact},
        [](const Scene&) { return there(true, "the film"); }},
    {"bounces",
        {near("it says nothing of path lengths; extras keep them"), exact,
            near("it counts path segments, one more than scattering events"),
            near("it counts the scattering events after the first")},
        [](const Scene&) { return there(true, "render"); }},
    {"russian roulette",
        {near("it says nothing of roulette, which leaves the mean as it is"),
            near("it always plays roulette, by its own rule, which leaves the mean as it is"),
            near("it plays roulette by its own rule, which leaves the mean as it is"),
            near("it plays none here, which leaves the mean as it is")},
        [](const Scene& scene) { return there(scene.defaults.roulette_start != no_roulette, "render"); }},
    {"integrator whitted",
        {kept("it says nothing of integrators"), refused("it follows whole paths"), refused("it follows whole paths"),
            refused("it follows whole paths")},
        [](const Scene& scene) { return there(scene.defaults.integrator == Integrator::whitted, "render"); }},
    {"interval of ray lengths", {kept(no_interval), refused(no_interval), refused(no_interval), refused(no_interval)},
        [](const Scene& scene) {
            return there(scene.defaults.ray_min > 0.0 || scene.defaults.ray_max < 1e300, "render");
        }},
    {"colour space",
        {near("factors are linear Rec. 709; images are sRGB of 16 bits"),
            near("it renders spectra made of the RGB values: one colour alone is kept, products of several may be off "
                 "by half"),
            near("written for the variants scalar_rgb and llvm_ad_rgb; spectral ones differ as pbrt does"), exact},
        [](const Scene&) { return there(true, "the scene"); }},
    // ---- Materials
    {"two-sided surfaces",
        {near("every material is doubleSided but those that emit from their fronts, whose backs readers may hide"),
            exact, near("every opaque material stands in a twosided one"), exact},
        [](const Scene& scene) { return there(!scene.entities.empty(), "the scene"); }},
    {"rough diffuse",
        {kept("it has no rough diffuse material"), refused("version 4 has no model of Oren and Nayar"),
            refused("version 3 has no model of Oren and Nayar"),
            refused("its fit of Oren and Nayar's model is another one than MODEL.md 7.9")},
        [](const Scene& scene) {
            return material_where(
                scene, [](const Material& m) { return m.kind == MaterialKind::rough_diffuse && rough(m); });
        }},
    {"mirrors",
        {kept("its metals reflect more at grazing angles"),
            refused("version 4 has no mirror of one reflectance, only metals"), exact, exact},
        [](const Scene& scene) {
            return material_where(
                scene, [](const Material& m) { return m.kind == MaterialKind::specular && !m.translucent; });
        }},
    {"fuzz", {kept(no_fuzz), refused(no_fuzz), refused(no_fuzz), near(by_nodes)},
        [](const Scene& scene) { return material_where(scene, [](const Material& m) { return m.fuzz > 0.0; }); }},
    {"glass",
        {exact, near("radiance is scaled by η² within glass, which camera and lights outside do not see"),
            near("radiance is scaled by η² within glass, which camera and lights outside do not see"), exact},
        [](const Scene& scene) { return material_where(scene, glass); }},
    {"coloured glass",
        {near("the colour tints what is transmitted; Tandem's tints what is reflected too"),
            refused("its dielectrics are colourless; write the colour as absorption inside"), exact, exact},
        [](const Scene& scene) { return material_where(scene, coloured); }},
    {"Schlick's reflectance",
        {kept("its glass has no choice"), refused(no_schlick), refused(no_schlick), near(by_nodes)},
        [](const Scene& scene) {
            return material_where(
                scene, [](const Material& m) { return m.translucent && m.fresnel == Fresnel::schlick; });
        }},
    {"rough glass",
        {exact, exact, near("its masking and shadowing are independent, MODEL.md 7.6's correlated by height"),
            near(by_nodes)},
        [](const Scene& scene) {
            return material_where(scene, [](const Material& m) { return glass(m) && rough(m); });
        }},
    {"conductors", {kept("it has metals of one colour and Schlick's curve"), exact, exact, exact},
        [](const Scene& scene) {
            return material_where(scene, [](const Material& m) { return m.kind == MaterialKind::conductor; });
        }},
    {"rough conductors",
        {kept("as other conductors"), exact,
            near("its masking and shadowing are independent, MODEL.md 7.6's correlated by height"), near(by_nodes)},
        [](const Scene& scene) {
            return material_where(
                scene, [](const Material& m) { return m.kind == MaterialKind::conductor && rough(m); });
        }},
    {"lamps that emit on both sides",
        {exact, exact, refused("its area lights shine from the front alone, which is enough for empty bodies only"),
            exact},
        [](const Scene& scene) {
            for (const Entity& entity : scene.entities)
                if (const Material& m = scene.materials[entity.material];
                    emits(m) && m.sides == EmittingSides::both && !is_empty_solid(scene, entity))
                    return Where("the material " + printable(m.name));
            return Where();
        }},
    {"lamps that emit from the front", {near("readers may hide their backs"), exact, exact, exact},
        [](const Scene& scene) {
            return material_where(scene, [](const Material& m) { return emits(m) && m.sides == EmittingSides::front; });
        }},
    {"translucent lamps",
        {kept("its glass does not emit"), refused("its dielectrics are colourless, and these are not"),
            refused("it has no lamp that light passes through"), exact},
        [](const Scene& scene) {
            return material_where(
                scene, [](const Material& m) { return m.kind == MaterialKind::emissive && m.translucent; });
        }},
    // ---- Textures
    {"images",
        {near("PNG images, sRGB of 16 bits: values move by up to 1.2·10⁻⁵; extras keep PFM files beside"),
            near("it resamples images whose sides are no powers of two"), exact, exact},
        [](const Scene& scene) {
            return texture_where(scene, [](const Texture& t) { return t.kind == TextureKind::image; });
        }},
    {"images on spheres",
        {exact, exact, refused("how it lays images on spheres was not tried"),
            refused("its meshes have no coordinates of MODEL.md 5.1")},
        [](const Scene& scene) {
            return primitive_where(scene, [&](const Entity& entity, const Primitive& p) {
                const std::uint32_t texture = scene.materials[entity.material].colour_texture;
                return p.kind == PrimitiveKind::sphere && texture != no_index &&
                       scene.textures[texture].space == TextureSpace::coordinates;
            });
        }},
    {"checkers by object space",
        {kept("it has images alone"), near(smoothed), refused("it has checkers by coordinates alone"), exact},
        [](const Scene& scene) {
            return texture_where(scene,
                [](const Texture& t) { return t.kind == TextureKind::checker && t.space == TextureSpace::object; });
        }},
    {"checkers by coordinates",
        {kept("it has images alone"), near(smoothed), exact, refused("the adapter has checkers by object space alone")},
        [](const Scene& scene) {
            return texture_where(scene, [](const Texture& t) {
                return t.kind == TextureKind::checker && t.space == TextureSpace::coordinates;
            });
        }},
    {"noise", {kept("it has images alone"), refused(no_noise), refused("it has no noise"), refused(no_noise)},
        [](const Scene& scene) {
            return texture_where(scene, [](const Texture& t) { return t.kind == TextureKind::noise; });
        }},
    // ---- Media
    {"media that absorb", {exact, exact, exact, near(added_media)},
        [](const Scene& scene) { return medium_where(scene, [](const Medium&) { return true; }); }},
    {"media that scatter", {kept("its volumes absorb alone"), exact, exact, near(added_media)},
        [](const Scene& scene) {
            return medium_where(scene, [](const Medium& m) { return m.scattering != glm::dvec3(0.0); });
        }},
    {"density grids",
        {kept("it has no volumes of varying density"),
            refused("its grids are interpolated between cells, MODEL.md 10's are constant in each"),
            refused("its grids are interpolated between cells, MODEL.md 10's are constant in each"),
            refused("the adapter writes no grids")},
        [](const Scene& scene) { return medium_where(scene, [](const Medium& m) { return m.grid != nullptr; }); }},
    {"a medium around everything", {kept("its volumes lie in bodies"), exact, exact, exact},
        [](const Scene& scene) { return there(scene.medium != no_index, "medium"); }},
    {"media within that medium", {kept("its volumes lie in bodies"), exact, exact, refused(added_media)},
        [](const Scene& scene) {
            return material_where(scene,
                [&](const Material& m) { return scene.medium != no_index && (m.interior != no_index || m.priority); });
        }},
    {"boundaries",
        {kept("it has no surface that changes nothing"), near("crossing one is no event there"),
            near("crossing one is no event there"), near("crossing one is no event there")},
        [](const Scene& scene) {
            return material_where(scene, [](const Material& m) { return m.kind == MaterialKind::boundary; });
        }},
    {"priorities", {kept(no_priority), refused(no_priority), refused(no_priority), refused(no_priority)},
        [](const Scene& scene) {
            return material_where(scene, [](const Material& m) { return m.priority.value_or(0) != 0; });
        }},
    // ---- Lights
    {"background of one colour", {kept("it has no background"), exact, exact, exact},
        [](const Scene& scene) {
            const Background& b = scene.background;
            return there(!is_black(b) && !b.image && b.down == b.up, "the background");
        }},
    {"background of two colours",
        {kept("it has no background"), near(equal_area),
            near("an image of the sky of 1025 rows, off by up to 6·10⁻⁷ of their difference"), exact},
        [](const Scene& scene) {
            return there(!scene.background.image && scene.background.down != scene.background.up, "the background");
        }},
    {"background image", {kept("it has no background; the image lies beside the file"), near(equal_area), exact, exact},
        [](const Scene& scene) { return there(scene.background.image != nullptr, "the background"); }},
    {"points", {exact, exact, exact, exact},
        [](const Scene& scene) { return light_where(scene, PunctualKind::point); }},
    {"spots",
        {near("its cone fades by the square of a line in cos θ, Tandem's by t²(3 − 2t)"), exact,
            refused("its cone fades by a line in the angle, MODEL.md 8.3's by t²(3 − 2t) in the cosine"),
            refused("its cone fades by another curve than MODEL.md 8.3")},
        [](const Scene& scene) { return light_where(scene, PunctualKind::spot); }},
    {"suns", {exact, exact, exact, exact}, [](const Scene& scene) { return light_where(scene, PunctualKind::sun); }},
};

}  // namespace

std::span<const Feature> features() { return rows; }

std::vector<Finding> features_of(const Scene& scene) {
    std::vector<Finding> found;
    for (const Feature& feature : rows)
        if (const auto where = feature.first(scene)) found.push_back({&feature, *where});
    return found;
}

void check_target(const Scene& scene, Target target, bool strict) {
    const auto index = static_cast<std::size_t>(target);
    for (const auto& [feature, where] : features_of(scene)) {
        const Saying& saying = feature->says[index];
        if (saying.can == Can::refused || (strict && saying.can == Can::kept))
            throw InputError(fmt::format("{}: {} cannot say: {}, in {}: {}; {}", printable(scene.name),
                target_names[index], feature->name, where, saying.reason,
                saying.can == Can::kept ? "leave --strict out, or change the scene"
                                        : "change the scene, or export to gltf"));
    }
}

std::vector<std::string> remarks_on(const Scene& scene, Target target) {
    std::vector<std::string> lines;
    for (const auto& [feature, where] : features_of(scene)) {
        const Saying& saying = feature->says[static_cast<std::size_t>(target)];
        if (saying.can == Can::exact) continue;
        lines.push_back(fmt::format(
            "{}: {}{}", feature->name, saying.reason, saying.can == Can::kept ? " (kept for tandem import)" : ""));
    }
    return lines;
}

}  // namespace tandem::scene_export
