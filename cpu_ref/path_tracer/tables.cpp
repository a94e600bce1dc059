// Scene to tables (table_builder.h): the order of work, and the tables of materials, textures, media and camera.
#include "cpu_ref/path_tracer/tables.h"

#include <cmath>
#include <glm/glm.hpp>
#include <limits>
#include <utility>

#include "common/scene/materials.h"
#include "cpu_ref/path_tracer/table_builder.h"

namespace tandem::cpu {

namespace {

using glm::dvec3;

// What materials are, as bits.
unsigned bits_of(const Material& material) {
    const bool diffuse = material.kind == MaterialKind::diffuse, rough = material.roughness > 0.0;
    const bool translucent = !diffuse && material.translucent;
    const bool specular =
        material.kind == MaterialKind::specular || (material.kind == MaterialKind::emissive && translucent);
    const bool boundary = material.kind == MaterialKind::boundary;
    unsigned b = material_bits::of_kind(material.kind);
    if (diffuse) b |= material_bits::diffuse;
    if (specular) b |= material_bits::specular;
    if (translucent) b |= material_bits::translucent;
    if (translucent && rough) b |= material_bits::rough_translucent;
    if (material.kind == MaterialKind::conductor)
        b |= rough ? material_bits::rough_conductor : material_bits::smooth_conductor;
    if (boundary) b |= material_bits::boundary;
    if (receives_light(material)) b |= material_bits::lit;
    if (is_tracked(material)) b |= material_bits::tracked;
    if (material.priority.value_or(0) != 0) b |= material_bits::ranked;
    if ((b & (material_bits::lit | material_bits::specular)) != 0 && material.colour_texture != no_index)
        b |= material_bits::textured;
    if (material.radiance != dvec3(0.0)) b |= material_bits::emits;
    if (material.sides == EmittingSides::both) b |= material_bits::both_sides;
    if (material.fresnel == Fresnel::schlick) b |= material_bits::schlick;
    if (material.fuzz > 0.0) b |= material_bits::fuzzy;
    return b;
}

}  // namespace

template <class Real>
Tables<Real> TableBuilder<Real>::build() {
    add_surroundings();
    add_motion();
    for (std::uint32_t e = 0; e < scene_.entities.size(); ++e) {
        const Entity& entity = scene_.entities[e];
        if (!tables_.meshes || !placed_.places(e))
            for (std::uint32_t i = 0; i < entity.primitive_count; ++i) add({e, entity.first_primitive + i});
    }
    tables_.first_placed_face = face_count();
    add_materials();
    finish_lights();
    finish_faces();
    finish_spheres();
    add_camera();
    add_interval();
    return std::move(tables_);
}

// Textures, media and the background's image.
template <class Real>
void TableBuilder<Real>::add_surroundings() {
    tables_.textures = TextureTable(scene_, tables_.meshes);
    tables_.shading_normals = ShadingNormalTable(scene_, tables_.meshes);
    for (const Medium& medium : scene_.media) tables_.media.emplace_back(medium);
    tables_.medium = scene_.medium;
    if (scene_.background.image) tables_.environment = std::make_shared<ImageEnvironment>(scene_.background);
}

template <class Real>
void TableBuilder<Real>::add_motion() {
    VectorRows<Real> motion;
    for (const Entity& entity : scene_.entities) {
        motion.push_back(entity.motion);
        tables_.motion_list.push_back(to_vec3<Real>(entity.motion));
        tables_.moves = tables_.moves || (entity.primitive_count > 0 && entity.motion != dvec3(0.0));
    }
    if (tables_.moves) motion.assign_to(tables_.motion);
}

template <class Real>
void TableBuilder<Real>::count_bodies() {
    for (const PrimitiveRef& ref : tables_.primitives) {
        std::uint32_t& count = tables_.bodies[scene_.entities[ref.entity].material].count;
        if (ref.kind == PrimitiveKind::triangle) count = no_index;
        if (count != no_index) ++count;
    }
    if (tables_.meshes)
        for (const MeshTable::Place& place : tables_.meshes->places) tables_.bodies[place.material].count = no_index;
}

template <class Real>
void TableBuilder<Real>::add_materials() {
    VectorRows<Real> colour, radiance, eta, k;
    std::vector<Real> alpha, fuzz, index, roughness_squared;
    std::vector<Unsigned> bits;
    for (const Material& material : scene_.materials) {
        colour.push_back(material.colour);
        alpha.push_back(static_cast<Real>(material.alpha));
        radiance.push_back(material.radiance, material.translucent ? alpha.back() : Real(1));
        fuzz.push_back(static_cast<Real>(material.fuzz));
        index.push_back(static_cast<Real>(material.refractive_index));
        roughness_squared.push_back(static_cast<Real>(material.roughness * material.roughness));
        eta.push_back(material.eta);
        k.push_back(material.k);
        const unsigned b = bits_of(material);
        bits.push_back(b);
        tables_.any_specular = tables_.any_specular || (b & material_bits::specular) != 0;
        tables_.bodies.push_back({(b & material_bits::tracked) != 0, material.interior, material.priority.value_or(0),
            material.kind == MaterialKind::boundary ? 1.0 : material.refractive_index, 0});
    }
    count_bodies();
    colour.assign_to(tables_.materials.colour);
    radiance.assign_to(tables_.materials.radiance);
    eta.assign_to(tables_.materials.eta);
    k.assign_to(tables_.materials.k);
    tables_.materials.alpha.assign(alpha);
    tables_.materials.fuzz.assign(fuzz);
    tables_.materials.index.assign(index);
    tables_.materials.roughness_squared.assign(roughness_squared);
    tables_.materials.bits.assign(bits);
}

template <class Real>
void TableBuilder<Real>::add_camera() {
    const Camera& camera = scene_.camera;
    const RenderSettings& settings = tables_.settings;
    const dvec3 forward = glm::normalize(camera.target - camera.position);
    const dvec3 right = glm::normalize(glm::cross(forward, camera.up));
    const double height = std::tan(0.5 * glm::radians(camera.vertical_field_degrees));
    const double w = settings.width, h = settings.height;
    tables_.camera = {to_vec3<Real>(camera.position), to_vec3<Real>(forward), to_vec3<Real>(right),
        to_vec3<Real>(glm::cross(right, forward)), static_cast<Real>(height * w / h), static_cast<Real>(height),
        static_cast<Real>(camera.lens_radius), static_cast<Real>(camera.focus_distance), static_cast<Real>(2.0 / w),
        static_cast<Real>(2.0 / h), false, {}, {}, {}, {}};
    CameraForm<Real>& form = tables_.camera;
    form.moves = camera.position_motion != dvec3(0.0) || camera.target_motion != dvec3(0.0);
    form.target = to_vec3<Real>(camera.target);
    form.vertical = to_vec3<Real>(camera.up);
    form.position_motion = to_vec3<Real>(camera.position_motion);
    form.target_motion = to_vec3<Real>(camera.target_motion);
    tables_.background_down = to_vec3<Real>(scene_.background.down);
    tables_.background_up = to_vec3<Real>(scene_.background.up);
}

// The closed interval of section 5 as t_min <= t < limit.
template <class Real>
void TableBuilder<Real>::add_interval() {
    constexpr Real infinity = std::numeric_limits<Real>::infinity();
    tables_.t_min = static_cast<Real>(tables_.settings.ray_min);
    tables_.limit = std::nextafter(static_cast<Real>(tables_.settings.ray_max), infinity);
}

template <class Real>
Tables<Real> make_tables(const Scene& scene, const RenderSettings& settings) {
    return TableBuilder<Real>(scene, settings).build();
}

template Tables<float> make_tables<float>(const Scene&, const RenderSettings&);
template Tables<double> make_tables<double>(const Scene&, const RenderSettings&);

}  // namespace tandem::cpu
