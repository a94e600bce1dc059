#include "cpu_ref/path_tracer/geometry/placed_triangle.h"

#include <algorithm>
#include <cmath>

namespace tandem::cpu {

namespace {

using glm::dmat3;
using glm::dvec3;

template <class Real>
Vec3<Real> rounded(const dvec3& a) {
    return {static_cast<Real>(a.x), static_cast<Real>(a.y), static_cast<Real>(a.z)};
}

// kernels.h says why.
template <class Real>
void add_doubt(TriangleForm<Real>& form) {
    double edge = 0.0, corner = 0.0;
    for (std::size_t i = 0; i < 3; ++i) {
        edge = std::max(edge, static_cast<double>(largest_magnitude(form.edge[i])));
        corner = std::max(corner, static_cast<double>(largest_magnitude(form.corner[i])));
    }
    constexpr double u = sizeof(Real) == 4 ? 0x1p-24 : 0x1p-53;
    form.doubt_of_origin = static_cast<Real>(64.0 * u * edge);
    form.doubt_at_rest = static_cast<Real>(u * corner * (48.0 * edge + 8.0 * corner));
}

template <class Real>
Real offset_of(const PlacedTriangle& triangle) {
    const Corners& c = triangle.corner;
    return static_cast<Real>(glm::dot(triangle.normal, (c[0] + c[1] + c[2]) / 3.0));
}

template <class Real>
void set_edges(const PlacedTriangle& triangle, TriangleFace<Real>& face) {
    const Corners& corners = triangle.corner;
    for (std::size_t i = 0; i < 3; ++i) {
        const dvec3 inwards = glm::normalize(glm::cross(triangle.normal, corners[(i + 1) % 3] - corners[i]));
        // The front of a mirrored triangle sees its corners clockwise.
        const double height = glm::dot(inwards, corners[(i + 2) % 3] - corners[i]);
        const dvec3 n = height < 0.0 ? -inwards : inwards;
        face.edge_normal[i] = rounded<Real>(n);
        face.edge_offset[i] = static_cast<Real>(-glm::dot(n, corners[i]));
        face.least_height = std::min(face.least_height, static_cast<Real>(std::abs(height)));
    }
}

}  // namespace

EntityMap entity_map(const glm::dmat4& object_to_world) {
    const dmat3 linear(object_to_world);
    return {linear, glm::inverse(linear), dvec3(object_to_world[3])};
}

PlacedTriangle placed_triangle(const EntityMap& map, const Corners& object) {
    PlacedTriangle triangle{};
    for (std::size_t i = 0; i < 3; ++i) triangle.corner[i] = map.to_world(object[i]);
    const Corners& world = triangle.corner;
    const dvec3 object_normal = glm::cross(object[1] - object[0], object[2] - object[0]);
    triangle.area = 0.5 * glm::length(glm::cross(world[1] - world[0], world[2] - world[0]));
    triangle.degenerate = !(triangle.area > 0.0) || object_normal == dvec3(0.0);
    triangle.normal = map.normal_to_world(triangle.degenerate ? dvec3(0.0, 0.0, 1.0) : object_normal);
    return triangle;
}

template <class Real>
TriangleForm<Real> form_of(const PlacedTriangle& triangle) {
    TriangleForm<Real> form;
    for (std::size_t i = 0; i < 3; ++i) form.corner[i] = rounded<Real>(triangle.corner[i]);
    for (std::size_t i = 0; i < 3 && !triangle.degenerate; ++i) {
        const Vec3<Real>&a = form.corner[i], &b = form.corner[(i + 1) % 3];
        form.edge[i] = b - a;
        form.edge_moment[i] = cross(a, b);
    }
    add_doubt(form);
    // A degenerate triangle keeps a zero plane, which gives t = NaN and so no hit.
    if (triangle.degenerate) return form;
    form.normal = rounded<Real>(triangle.normal);
    form.offset = offset_of<Real>(triangle);
    return form;
}

template <class Real>
TriangleFace<Real> face_of(const PlacedTriangle& triangle) {
    const Corners& world = triangle.corner;
    TriangleFace<Real> face;
    face.normal = rounded<Real>(triangle.normal);
    face.offset = offset_of<Real>(triangle);
    double extent = 0.0;
    for (std::size_t i = 0; i < 3; ++i) extent = std::max(extent, glm::length(world[(i + 1) % 3] - world[i]));
    face.extent = static_cast<Real>(extent);
    const dvec3 low = glm::min(glm::min(world[0], world[1]), world[2]),
                high = glm::max(glm::max(world[0], world[1]), world[2]);
    const dvec3 terms = terms_of<Real>(world[1] - world[0], world[2] - world[0]);
    face.terms = rounded<Real>(terms);
    face.terms_of_extent = static_cast<Real>(glm::dot(terms, high - low));
    if (!triangle.degenerate) set_edges(triangle, face);
    return face;
}

// surface.h says why needles have no more.
template <class Real>
dvec3 terms_of(const dvec3& e, const dvec3& f) {
    constexpr double terms_in_double = sizeof(Real) == 4 ? 0x1p-29 : 1.0;
    const double size = glm::length(glm::cross(e, f));
    const dvec3 a = glm::abs(e), b = glm::abs(f);
    const dvec3 terms = dvec3(a.y * b.z + a.z * b.y, a.z * b.x + a.x * b.z, a.x * b.y + a.y * b.x);
    return size > 0.0 ? glm::min(terms / size, 4.0 + terms_in_double * (terms / size)) : dvec3(0.0);
}

template TriangleForm<float> form_of<float>(const PlacedTriangle&);
template TriangleForm<double> form_of<double>(const PlacedTriangle&);
template TriangleFace<float> face_of<float>(const PlacedTriangle&);
template TriangleFace<double> face_of<double>(const PlacedTriangle&);
template dvec3 terms_of<float>(const dvec3&, const dvec3&);
template dvec3 terms_of<double>(const dvec3&, const dvec3&);

}  // namespace tandem::cpu
