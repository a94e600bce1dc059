// Scene to tables: transforms, planes, areas and light probabilities (MODEL.md sections 4 to 9.2), all in double.
#include "cpu_ref/path_tracer/tables.h"

#include <array>
#include <cmath>
#include <glm/glm.hpp>
#include <limits>
#include <utility>

#include "common/error.h"
#include "common/scene/materials.h"
#include "cpu_ref/path_tracer/light/light_table.h"
#include "cpu_ref/path_tracer/vector_rows.h"

namespace tandem::cpu {

namespace {

using glm::dmat3;
using glm::dvec3;

// Greatest singular value of a linear map: square root of that eigenvalue of A^T A, by the trigonometric solution of
// the characteristic cubic.
double greatest_scale_of(const dmat3& a) {
    const dmat3 s = glm::transpose(a) * a;
    const double mean = (s[0][0] + s[1][1] + s[2][2]) / 3.0;
    const dmat3 k = s - dmat3(mean);
    double square = 0.0;
    for (int c = 0; c < 3; ++c) square += glm::dot(k[c], k[c]);
    const double p = std::sqrt(square / 6.0);
    if (p <= 1e-14 * mean) return std::sqrt(mean);
    const double half_determinant = glm::clamp(glm::determinant(k / p) / 2.0, -1.0, 1.0);
    const double angle = std::acos(half_determinant) / 3.0;
    return std::sqrt(std::max(0.0, mean + 2.0 * p * std::cos(angle)));
}

bool is_tracked(const Material& material) {
    const bool has_inside = material.translucent || material.kind == MaterialKind::boundary;
    return has_inside && (material.interior != no_index || material.priority);
}

template <class Real>
class TableBuilder {
public:
    TableBuilder(const Scene& scene, const RenderSettings& settings)
        : scene_(scene), placed_(placed_meshes(scene, settings)) {
        tables_.settings = settings;
        if (placed_.any()) tables_.meshes = std::make_shared<MeshTable>(scene, placed_);
        const IntersectionSettings& chosen = settings.intersection;
        tables_.default_kernels =
            chosen.triangles == TriangleKernel::watertight && chosen.convex == ConvexKernel::stable;
        tables_.excludes_left =
            chosen.guard == SelfIntersectionGuard::error_bound || chosen.guard == SelfIntersectionGuard::exclusion;
    }

    Tables<Real> build() {
        add_surroundings();
        add_motion();
        for (std::uint32_t e = 0; e < scene_.entities.size(); ++e) {
            const Entity& entity = scene_.entities[e];
            if (!tables_.meshes || !placed_.places(e))
                for (std::uint32_t i = 0; i < entity.primitive_count; ++i) add({e, entity.first_primitive + i});
        }
        add_places();
        add_materials();
        finish_lights();
        finish_faces();
        finish_spheres();
        add_camera();
        add_interval();
        return std::move(tables_);
    }

private:
    void add(const PlacedPrimitive& placed) {
        const Entity& entity = scene_.entities[placed.entity];
        const Primitive& primitive = scene_.primitives[placed.primitive];
        const Material& material = scene_.materials[entity.material];
        PrimitiveRef ref{primitive.kind, 0, face_count(), material.radiance != dvec3(0.0), entity.motion != dvec3(0.0),
            placed.entity};
        material_ = entity.material;
        entity_ = placed.entity;
        map_ = entity_map(entity.object_to_world);
        id_ = static_cast<std::uint32_t>(tables_.primitives.size());
        switch (primitive.kind) {
            case PrimitiveKind::triangle:
                ref.form = add_triangle(primitive);
                break;
            case PrimitiveKind::sphere:
                ref.form = add_sphere(primitive);
                break;
            case PrimitiveKind::cuboid:
                ref.form = add_cuboid(primitive);
                break;
        }
        tables_.primitives.push_back(ref);
        BoundingBox& box = tables_.bounds.back();
        box = {glm::min(box.low, box.low + entity.motion), glm::max(box.high, box.high + entity.motion)};
        widen_whole(box.low, box.high, id_ == 0);
    }

    void widen_whole(const dvec3& low, const dvec3& high, bool first) {
        BoundingBox& all = whole_;
        all = first ? BoundingBox{low, high} : BoundingBox{glm::min(all.low, low), glm::max(all.high, high)};
    }

    void add_places() {
        tables_.first_placed_face = face_count();
        if (!tables_.meshes) return;
        bool first = tables_.primitives.empty();
        for (const MeshTable::Place& place : tables_.meshes->places)
            widen_whole(place.low, place.high, std::exchange(first, false));
    }

    [[nodiscard]] dvec3 to_world(const dvec3& p) const { return map_.to_world(p); }

    // A face of a sphere or cuboid, which has no edges.
    TriangleFace<Real> face_on(const dvec3& object_normal, const dvec3& point, double extent) {
        const dvec3 n = map_.normal_to_world(object_normal);
        TriangleFace<Real> face;
        face.normal = to_vec3<Real>(n);
        face.offset = static_cast<Real>(glm::dot(n, point));
        face.extent = static_cast<Real>(extent);
        return face;
    }

    void add_face(const TriangleFace<Real>& face, std::uint32_t sphere, bool curved) {
        face_normal_.push_back(face.normal);
        face_offset_.push_back(face.offset);
        face_extent_.push_back(face.extent);
        face_terms_.push_back(face.terms);
        face_terms_of_extent_.push_back(face.terms_of_extent);
        face_primitive_.push_back(id_);
        face_entity_.push_back(entity_);
        face_material_.push_back(material_);
        face_sphere_.push_back(sphere);
        face_curved_.push_back(curved ? curved_bits::curved : 0u);
        face_density_.push_back(Real(0));
        for (std::size_t i = 0; i < 3; ++i) {
            edge_normal_[i].push_back(face.edge_normal[i]);
            edge_offset_[i].push_back(face.edge_offset[i]);
        }
        least_height_.push_back(face.least_height);
    }

    std::uint32_t add_triangle(const Primitive& primitive) {
        Corners object;
        for (std::size_t i = 0; i < 3; ++i) object[i] = scene_.vertices[primitive.index[i]];
        const PlacedTriangle triangle = placed_triangle(map_, object);
        const Corners& world = triangle.corner;
        tables_.bounds.push_back(
            {glm::min(glm::min(world[0], world[1]), world[2]), glm::max(glm::max(world[0], world[1]), world[2])});
        add_face(face_of<Real>(triangle), 0, false);
        tables_.triangles.push_back(form_of<Real>(triangle));
        if (!triangle.degenerate && add_light(LightKind::triangle, triangle.area, 0, triangle.normal))
            add_patch(world[0], world[1] - world[0], world[2] - world[0], 1.0, face_count() - 1);
        return static_cast<std::uint32_t>(tables_.triangles.size() - 1);
    }

    std::uint32_t add_sphere(const Primitive& primitive) {
        const dvec3 centre = to_world(scene_.vertices[primitive.index[0]]);
        const double r = primitive.radius;
        const dmat3 linear = map_.linear * r, to_local = map_.inverse / r;
        const dvec3 half(
            std::sqrt(linear[0][0] * linear[0][0] + linear[1][0] * linear[1][0] + linear[2][0] * linear[2][0]),
            std::sqrt(linear[0][1] * linear[0][1] + linear[1][1] * linear[1][1] + linear[2][1] * linear[2][1]),
            std::sqrt(linear[0][2] * linear[0][2] + linear[1][2] * linear[1][2] + linear[2][2] * linear[2][2]));
        tables_.bounds.push_back({centre - half, centre + half});
        const dvec3 local_shift = -(to_local * centre);
        const std::uint32_t index = static_cast<std::uint32_t>(tables_.spheres.size());
        SphereForm<Real> form;
        const dmat3 rows = glm::transpose(to_local), world_rows = glm::transpose(linear);
        for (std::size_t i = 0; i < 3; ++i) {
            const int row = static_cast<int>(i);
            form.to_local.rows[i] = to_vec3<Real>(rows[row]);
            sphere_to_local_[i].push_back(rows[row]);
            sphere_to_world_[i].push_back(world_rows[row]);
            // Rows of M^-T are the columns of M^-1.
            sphere_normal_[i].push_back(map_.inverse[row]);
        }
        form.to_local.shift = to_vec3<Real>(local_shift);
        tables_.spheres.push_back(form);
        sphere_shift_.push_back(local_shift);
        sphere_centre_.push_back(centre);
        const double extent = r * greatest_scale_of(map_.linear);
        const double radius = r * std::cbrt(std::abs(glm::determinant(map_.linear)));
        sphere_radius_.push_back(static_cast<Real>(radius));
        sphere_extent_.push_back(static_cast<Real>(extent));
        sphere_chance_.push_back(Real(0));
        for (const unsigned side : {0u, curved_bits::left}) {
            add_face(face_on({0.0, 0.0, 1.0}, centre, extent), index, true);
            face_curved_.back() |= side;
        }
        const bool similar = is_similarity(scene_.entities[entity_].object_to_world);
        const double area = 4.0 * 3.14159265358979323846 * radius * radius;
        if (add_light(similar ? LightKind::sphere : LightKind::ellipsoid, area, index) && !similar)
            for (std::size_t face = face_curved_.size() - 2; face < face_curved_.size(); ++face)
                face_curved_[face] |= curved_bits::ellipsoid_light;
        return index;
    }

    std::uint32_t add_cuboid(const Primitive& primitive) {
        const dvec3 low = scene_.vertices[primitive.index[0]], high = scene_.vertices[primitive.index[1]];
        const dvec3 size = high - low, middle = 0.5 * (low + high);
        CuboidForm<Real> form;
        const dmat3 rows = glm::transpose(map_.inverse);
        const dvec3 shift = -(map_.inverse * (map_.shift + map_.linear * middle));
        std::array<Real, 3> half{}, local_shift{};
        dvec3 reach(0.0);
        for (int i = 0; i < 3; ++i) {
            const double scale = size[i] > 0.0 ? 2.0 / size[i] : 1.0;
            half[static_cast<std::size_t>(i)] = size[i] > 0.0 ? Real(1) : Real(0);
            form.to_local.rows[static_cast<std::size_t>(i)] = to_vec3<Real>(rows[i] * scale);
            local_shift[static_cast<std::size_t>(i)] = static_cast<Real>(shift[i] * scale);
            reach += glm::abs(map_.linear[i]) * (0.5 * size[i]);
        }
        form.to_local.shift = {local_shift[0], local_shift[1], local_shift[2]};
        form.half = {half[0], half[1], half[2]};
        tables_.cuboids.push_back(form);
        const dvec3 centre = to_world(middle);
        tables_.bounds.push_back({centre - reach, centre + reach});

        std::array<double, 6> areas{};
        double total = 0.0;
        for (int axis = 0; axis < 3; ++axis) {
            const int j = axis == 0 ? 1 : 0, k = axis == 2 ? 1 : 2;
            const double area = glm::length(glm::cross(map_.linear[j], map_.linear[k])) * size[j] * size[k];
            for (int side = 0; side < 2; ++side) {
                dvec3 n(0.0), corner = low;
                n[axis] = side == 0 || (axis == 2 && planted(PlantedBug::face_normal_flipped)) ? -1.0 : 1.0;
                corner[axis] = side == 0 ? low[axis] : high[axis];
                TriangleFace<Real> face = face_on(n, to_world(corner), glm::length(reach));
                const dvec3 terms = terms_of<Real>(map_.linear[j] * size[j], map_.linear[k] * size[k]);
                face.terms = to_vec3<Real>(terms);
                face.terms_of_extent = static_cast<Real>(glm::dot(terms, 2.0 * reach));
                add_face(face, 0, false);
                areas[static_cast<std::size_t>(2 * axis + side)] = area;
                total += area;
            }
        }
        if (total > 0.0 && add_light(LightKind::cuboid, total, 0)) add_cuboid_patches(low, high, areas, total);
        return static_cast<std::uint32_t>(tables_.cuboids.size() - 1);
    }

    void add_cuboid_patches(const dvec3& low, const dvec3& high, const std::array<double, 6>& areas, double total) {
        double cumulative = 0.0;
        for (int face = 0; face < 6; ++face) {
            const int axis = face / 2, j = axis == 0 ? 1 : 0, k = axis == 2 ? 1 : 2;
            dvec3 corner = low;
            corner[axis] = face % 2 == 0 ? low[axis] : high[axis];
            cumulative += areas[static_cast<std::size_t>(face)];
            if (planted(PlantedBug::cuboid_light_faces_even)) cumulative = total * (face + 1) / 6.0;
            add_patch(to_world(corner), map_.linear[j] * (high[j] - low[j]), map_.linear[k] * (high[k] - low[k]),
                cumulative / total, face_count() - 6 + static_cast<std::uint32_t>(face));
        }
    }

    // Notes a sampled light (section 9.2) if this primitive is one.
    bool add_light(LightKind kind, double area, std::uint32_t sphere, const dvec3& normal = dvec3(0.0)) {
        const Material& material = scene_.materials[material_];
        const double sum = (material.radiance.x + material.radiance.y + material.radiance.z) *
                           (material.translucent ? material.alpha : 1.0);
        if ((material.translucent && is_tracked(material)) || !(sum > 0.0) || !(area > 0.0)) return false;
        lights_.push_back({kind, id_, material_, static_cast<std::uint32_t>(patch_face_.size()), sphere, area,
            area * sum, scene_.entities[entity_].motion, {}});
        // Rule 32: flat lights have an axis, if they emit to one side.
        LightDraft& light = lights_.back();
        const bool flat = kind == LightKind::triangle, two_sided = material.sides == EmittingSides::both;
        light.low = glm::min(tables_.bounds.back().low, tables_.bounds.back().low + light.motion);
        light.high = glm::max(tables_.bounds.back().high, tables_.bounds.back().high + light.motion);
        if (flat && !two_sided) light.axis = normal;
        light.strength = light.weight * (!flat ? 0.25 : two_sided ? 0.5 : 1.0);
        return true;
    }

    void add_patch(const dvec3& corner, const dvec3& edge1, const dvec3& edge2, double cumulative, std::uint32_t face) {
        patch_corner_.push_back(corner);
        patch_edge1_.push_back(edge1);
        patch_edge2_.push_back(edge2);
        patch_cumulative_.push_back(static_cast<Real>(cumulative));
        patch_face_.push_back(face);
    }

    [[nodiscard]] std::uint32_t face_count() const { return static_cast<std::uint32_t>(face_material_.size()); }

    void add_surroundings();
    void add_motion();
    void add_materials();
    void count_bodies();  // of every material
    void finish_lights();
    void finish_faces();
    void finish_spheres();
    void add_camera();
    void add_interval();

    const Scene& scene_;
    PlacedMeshes placed_;
    Tables<Real> tables_;
    EntityMap map_;
    std::uint32_t id_ = 0, material_ = 0, entity_ = 0;
    BoundingBox whole_;

    using Unsigned = UnsignedOf<Real>;
    VectorRows<Real> face_normal_, face_terms_;
    std::array<VectorRows<Real>, 3> edge_normal_;
    std::array<std::vector<Real>, 3> edge_offset_;
    std::vector<Real> least_height_;
    std::vector<Real> face_offset_, face_extent_, face_terms_of_extent_, face_density_;
    std::vector<Unsigned> face_primitive_, face_material_, face_sphere_, face_curved_, face_entity_, face_light_;
    std::array<VectorRows<Real>, 3> sphere_to_local_, sphere_to_world_, sphere_normal_;
    VectorRows<Real> sphere_shift_, sphere_centre_;
    std::vector<Real> sphere_radius_, sphere_extent_, sphere_chance_;
    std::vector<LightDraft> lights_;
    VectorRows<Real> patch_corner_, patch_edge1_, patch_edge2_;
    std::vector<Real> patch_cumulative_;
    std::vector<Unsigned> patch_face_;
};

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
void TableBuilder<Real>::finish_lights() {
    LightTable<Real>& table = tables_.lights;
    for (const LightDraft& light : distant_lights(scene_, tables_.environment.get())) lights_.push_back(light);
    const LightSampling sampling = tables_.settings.light_sampling;
    if (sampling == LightSampling::tree) grow_light_tree(lights_, table.tree);
    const std::vector<double> chances = fill_light_table(table, lights_, sampling);
    if (table.tree.count > 0) face_light_.assign(face_density_.size(), Unsigned{0});
    for (std::size_t i = 0; i < lights_.size(); ++i) {
        const LightDraft& light = lights_[i];
        if (light.kind > LightKind::ellipsoid) continue;
        const PrimitiveRef& ref = tables_.primitives[light.primitive];
        const std::uint32_t face_count_of = ref.kind == PrimitiveKind::triangle ? 1
                                            : ref.kind == PrimitiveKind::sphere ? 2
                                                                                : 6;
        for (std::uint32_t f = 0; f < face_count_of; ++f) {
            face_density_[ref.first_face + f] = static_cast<Real>(chances[i] / light.area);
            if (table.tree.count > 0) face_light_[ref.first_face + f] = static_cast<Unsigned>(i);
        }
        if (tables_.primitives[light.primitive].kind == PrimitiveKind::sphere)
            sphere_chance_[light.sphere] = static_cast<Real>(chances[i]);
    }
    patch_corner_.assign_to(table.patch_corner);
    patch_edge1_.assign_to(table.patch_edge1);
    patch_edge2_.assign_to(table.patch_edge2);
    table.patch_cumulative.assign(patch_cumulative_);
    table.patch_face.assign(patch_face_);
}

template <class Real>
void TableBuilder<Real>::finish_faces() {
    FaceTable<Real>& table = tables_.faces;
    face_normal_.assign_to(table.normal);
    table.offset.assign(face_offset_);
    table.extent.assign(face_extent_);
    face_terms_.assign_to(table.terms);
    for (std::size_t i = 0; i < 3; ++i) {
        edge_normal_[i].assign_to(table.edge_normal[i]);
        table.edge_offset[i].assign(edge_offset_[i]);
    }
    table.least_height.assign(least_height_);
    table.terms_of_extent.assign(face_terms_of_extent_);
    table.light_density.assign(face_density_);
    table.primitive.assign(face_primitive_);
    table.material.assign(face_material_);
    table.sphere.assign(face_sphere_);
    table.curved.assign(face_curved_);
    if (tables_.moves) table.entity.assign(face_entity_);
    if (tables_.lights.tree.count > 0) table.light.assign(face_light_);
}

template <class Real>
void TableBuilder<Real>::finish_spheres() {
    SphereTable<Real>& table = tables_.sphere_table;
    const bool wrong = planted(PlantedBug::normal_transform_wrong);
    for (std::size_t i = 0; i < 3; ++i) {
        sphere_to_local_[i].assign_to(table.to_local[i]);
        sphere_to_world_[i].assign_to(table.to_world[i]);
        (wrong ? sphere_to_world_ : sphere_normal_)[i].assign_to(table.normal_map[i]);
    }
    sphere_shift_.assign_to(table.local_shift);
    sphere_centre_.assign_to(table.centre);
    table.radius.assign(sphere_radius_);
    table.extent.assign(sphere_extent_);
    table.chance.assign(sphere_chance_);
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
    tables_.size = glm::length(whole_.high - whole_.low);
}

// The closed interval of section 5 as t_min <= t < limit.
template <class Real>
void TableBuilder<Real>::add_interval() {
    constexpr Real infinity = std::numeric_limits<Real>::infinity();
    tables_.t_min = static_cast<Real>(tables_.settings.ray_min);
    tables_.limit = std::nextafter(static_cast<Real>(tables_.settings.ray_max), infinity);
}

}  // namespace

template <class Real>
Tables<Real> make_tables(const Scene& scene, const RenderSettings& settings) {
    return TableBuilder<Real>(scene, settings).build();
}

template Tables<float> make_tables<float>(const Scene&, const RenderSettings&);
template Tables<double> make_tables<double>(const Scene&, const RenderSettings&);

}  // namespace tandem::cpu
