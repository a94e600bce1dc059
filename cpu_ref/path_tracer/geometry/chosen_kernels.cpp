#include "cpu_ref/path_tracer/geometry/chosen_kernels.h"

#include <cmath>

namespace tandem::cpu {

namespace {

template <class Real>
Real plain_dot(const Vec3<Real>& a, const Vec3<Real>& b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

template <class Real>
Candidate<Real> accepted(const Ray<Real>& ray, Real t, std::uint32_t face = 0) {
    return {t >= ray.t_min && t < ray.limit, t, static_cast<IndexOf<Real>>(face)};
}

// [Möller 1997], without culling.
template <class Real>
Candidate<Real> moller_trumbore(const TriangleForm<Real>& triangle, const Ray<Real>& ray) {
    const Vec3<Real> e1 = triangle.corner[1] - triangle.corner[0], e2 = triangle.corner[2] - triangle.corner[0];
    const Vec3<Real> p = cross(ray.direction, e2);
    const Real determinant = plain_dot(e1, p);
    if (determinant == Real(0)) return {false, Real(0), 0};
    const Real inverse = Real(1) / determinant;
    const Vec3<Real> s = ray.origin - triangle.corner[0];
    const Real u = plain_dot(s, p) * inverse;
    if (!(u >= Real(0) && u <= Real(1))) return {false, Real(0), 0};
    const Vec3<Real> q = cross(s, e1);
    const Real v = plain_dot(ray.direction, q) * inverse;
    if (!(v >= Real(0) && u + v <= Real(1))) return {false, Real(0), 0};
    return accepted(ray, Real(plain_dot(e2, q) * inverse));
}

// [Baldwin 2016]: the map to the space in which the triangle is the unit one, rows divided by the largest component of
// the normal.
template <class Real>
Candidate<Real> baldwin_weber(const TriangleForm<Real>& triangle, const Ray<Real>& ray) {
    const Vec3<Real>&a = triangle.corner[0], &b = triangle.corner[1], &c = triangle.corner[2];
    const Vec3<Real> e1 = b - a, e2 = c - a, n = cross(e1, e2);
    const std::array<Real, 3> normal{n.x, n.y, n.z};
    std::size_t k = 0;
    for (std::size_t i = 1; i < 3; ++i)
        if (std::abs(normal[i]) > std::abs(normal[k])) k = i;
    if (normal[k] == Real(0)) return {false, Real(0), 0};
    const Real scale = Real(1) / normal[k];
    // Plane: n.p / n_k = offset. The barycentric rows drop axis k.
    const Vec3<Real> plane = n * scale;
    const Real offset = plain_dot(n, a) * scale;
    const Real slope = plain_dot(plane, ray.direction), height = offset - plain_dot(plane, ray.origin);
    if (slope == Real(0)) return {false, Real(0), 0};
    const Real t = height / slope;
    const Vec3<Real> hit = ray.origin + ray.direction * t;
    const auto part = [&](const Vec3<Real>& v, std::size_t axis) { return axis == 0 ? v.x : axis == 1 ? v.y : v.z; };
    const std::size_t i = (k + 1) % 3, j = (k + 2) % 3;
    const Real m1 = (part(c, i) * part(a, j) - part(c, j) * part(a, i)) * scale;
    const Real m2 = -(part(b, i) * part(a, j) - part(b, j) * part(a, i)) * scale;
    const Real beta = part(e2, j) * scale * part(hit, i) - part(e2, i) * scale * part(hit, j) + m1;
    const Real gamma = -part(e1, j) * scale * part(hit, i) + part(e1, i) * scale * part(hit, j) + m2;
    if (!(beta >= Real(0) && gamma >= Real(0) && beta + gamma <= Real(1))) return {false, Real(0), 0};
    return accepted(ray, t);
}

// The one of two crossings that a ray meets which may be leaving the body (MODEL.md section 5.2).
template <class Real>
Candidate<Real> first_crossing(const Ray<Real>& ray, Real entry, std::uint32_t entry_face, Real exit,
    std::uint32_t exit_face, bool departing, bool inside) {
    if (departing && !inside) return {false, Real(0), 0};
    if (departing) return accepted(ray, std::max(exit, Real(0)), exit_face);
    return entry >= ray.t_min ? accepted(ray, entry, entry_face) : accepted(ray, exit, exit_face);
}

// The quadratic formula as it stands.
template <class Real>
Candidate<Real> naive_sphere(const SphereForm<Real>& sphere, const Ray<Real>& ray, bool departing, bool inside) {
    const Vec3<Real> o = apply(sphere.to_local, ray.origin), d = apply_linear(sphere.to_local, ray.direction);
    const Real a = plain_dot(d, d), b = Real(2) * plain_dot(o, d), c = plain_dot(o, o) - Real(1);
    const Real discriminant = b * b - Real(4) * a * c;
    if (!(discriminant >= Real(0))) return {false, Real(0), 0};
    const Real root = std::sqrt(discriminant), scale = Real(0.5) / a;
    return first_crossing(ray, Real((-b - root) * scale), sphere_face::entered, Real((-b + root) * scale),
        sphere_face::left, departing, inside);
}

// Slabs by minimum and maximum, 0 times infinity included [Kay 1986].
template <class Real>
Candidate<Real> naive_cuboid(const CuboidForm<Real>& cuboid, const Ray<Real>& ray, bool departing, bool inside) {
    const Vec3<Real> o = apply(cuboid.to_local, ray.origin), d = apply_linear(cuboid.to_local, ray.direction);
    const std::array<Real, 3> origin{o.x, o.y, o.z}, direction{d.x, d.y, d.z};
    const std::array<Real, 3> half{cuboid.half.x, cuboid.half.y, cuboid.half.z};
    Real entry = -std::numeric_limits<Real>::infinity(), exit = std::numeric_limits<Real>::infinity();
    std::uint32_t entry_face = 0, exit_face = 0;
    for (std::uint32_t axis = 0; axis < 3; ++axis) {
        const Real inverse = Real(1) / direction[axis];
        const Real low = (-half[axis] - origin[axis]) * inverse, high = (half[axis] - origin[axis]) * inverse;
        const bool ascending = low < high;
        const Real near = std::min(low, high), far = std::max(low, high);
        if (near > entry) entry_face = 2 * axis + (ascending ? 0 : 1);
        if (far < exit) exit_face = 2 * axis + (ascending ? 1 : 0);
        entry = std::max(entry, near);
        exit = std::min(exit, far);
    }
    if (!(entry <= exit)) return {false, Real(0), 0};
    return first_crossing(ray, entry, entry_face, exit, exit_face, departing, inside);
}

}  // namespace

template <class Real>
Candidate<Real> intersect_as_chosen(
    const Tables<Real>& tables, const PrimitiveRef& ref, const Ray<Real>& ray, bool departing, bool inside) {
    const IntersectionSettings& chosen = tables.settings.intersection;
    const bool naive = chosen.convex == ConvexKernel::naive;
    switch (ref.kind) {
        case PrimitiveKind::triangle: {
            const TriangleForm<Real>& form = tables.triangles[ref.form];
            if (departing) return {false, Real(0), 0};
            if (chosen.triangles == TriangleKernel::moller_trumbore) return moller_trumbore(form, ray);
            if (chosen.triangles == TriangleKernel::baldwin_weber) return baldwin_weber(form, ray);
            return intersect(form, ray, departing, inside);
        }
        case PrimitiveKind::sphere:
            return naive ? naive_sphere(tables.spheres[ref.form], ray, departing, inside)
                         : intersect(tables.spheres[ref.form], ray, departing, inside);
        default:
            return naive ? naive_cuboid(tables.cuboids[ref.form], ray, departing, inside)
                         : intersect(tables.cuboids[ref.form], ray, departing, inside);
    }
}

template Candidate<float> intersect_as_chosen<float>(
    const Tables<float>&, const PrimitiveRef&, const Ray<float>&, bool, bool);
template Candidate<double> intersect_as_chosen<double>(
    const Tables<double>&, const PrimitiveRef&, const Ray<double>&, bool, bool);

}  // namespace tandem::cpu
