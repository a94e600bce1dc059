// Triangles, spheres and cuboids as rows of the tables (MODEL.md sections 5 and 6): intersection constants, bounds, and
// the planes of their faces.
#include <algorithm>
#include <array>
#include <cmath>
#include <glm/glm.hpp>

#include "cpu_ref/path_tracer/table_builder.h"

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

}  // namespace

template <class Real>
void TableBuilder<Real>::add(const PlacedPrimitive& placed) {
    const Entity& entity = scene_.entities[placed.entity];
    const Primitive& primitive = scene_.primitives[placed.primitive];
    const Material& material = scene_.materials[entity.material];
    PrimitiveRef ref{
        primitive.kind, 0, face_count(), material.radiance != dvec3(0.0), entity.motion != dvec3(0.0), placed.entity};
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
}

// A face of a sphere or cuboid, which has no edges.
template <class Real>
TriangleFace<Real> TableBuilder<Real>::face_on(const dvec3& object_normal, const dvec3& point, double extent) {
    const dvec3 n = map_.normal_to_world(object_normal);
    TriangleFace<Real> face;
    face.normal = to_vec3<Real>(n);
    face.offset = static_cast<Real>(glm::dot(n, point));
    face.extent = static_cast<Real>(extent);
    return face;
}

template <class Real>
void TableBuilder<Real>::add_face(const TriangleFace<Real>& face, std::uint32_t sphere, bool curved) {
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

template <class Real>
std::uint32_t TableBuilder<Real>::add_triangle(const Primitive& primitive) {
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

template <class Real>
std::uint32_t TableBuilder<Real>::add_sphere(const Primitive& primitive) {
    const dvec3 centre = to_world(scene_.vertices[primitive.index[0]]);
    const double r = primitive.radius;
    const dmat3 linear = map_.linear * r, to_local = map_.inverse / r;
    const dvec3 half(std::sqrt(linear[0][0] * linear[0][0] + linear[1][0] * linear[1][0] + linear[2][0] * linear[2][0]),
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

template <class Real>
std::uint32_t TableBuilder<Real>::add_cuboid(const Primitive& primitive) {
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

template void TableBuilder<float>::add(const PlacedPrimitive&);
template void TableBuilder<double>::add(const PlacedPrimitive&);
template void TableBuilder<float>::finish_faces();
template void TableBuilder<double>::finish_faces();
template void TableBuilder<float>::finish_spheres();
template void TableBuilder<double>::finish_spheres();

}  // namespace tandem::cpu
