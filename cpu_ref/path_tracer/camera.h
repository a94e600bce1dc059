// Camera rays in lanes (MODEL.md section 4).
#pragma once

#include "cpu_ref/path_tracer/arithmetic/sampling.h"
#include "cpu_ref/path_tracer/pixel_filter.h"
#include "cpu_ref/path_tracer/tables.h"

namespace tandem::cpu {

// Blocks of random numbers (section 3) beside those that common/render/random.h names.
inline constexpr std::uint32_t time_block = 1;
inline constexpr std::uint32_t medium_of_vertex = 2;  // within a vertex's blocks

template <class V>
struct CameraFrame {
    Vec3<V> position, forward, right, up;
};
template <class Real>
TANDEM_INLINE CameraFrame<Lanes<Real>> camera_at_rest(const CameraForm<Real>& camera) {
    using V = Lanes<Real>;
    return {splat<V>(camera.position), splat<V>(camera.forward), splat<V>(camera.right), splat<V>(camera.up)};
}
template <class Real>
TANDEM_INLINE CameraFrame<Lanes<Real>> camera_at(const CameraForm<Real>& camera, Lanes<Real> time) {
    using V = Lanes<Real>;
    const Vec3<V> position = along(splat<V>(camera.position), time, splat<V>(camera.position_motion));
    const Vec3<V> target = along(splat<V>(camera.target), time, splat<V>(camera.target_motion));
    const Vec3<V> forward = unit(target - position), right = unit(cross(forward, splat<V>(camera.vertical)));
    return {position, forward, right, cross(right, forward)};
}

// A zero-length ray comes out with direction 0.
template <class Real>
struct CameraRay {
    Vec3<Lanes<Real>> origin, direction;
};
template <class Real>
TANDEM_INLINE CameraRay<Real> camera_ray(
    const Tables<Real>& tables, const SampleId<Real>& id, const CameraFrame<Lanes<Real>>& frame, RandomLanes<Real> u) {
    using V = Lanes<Real>;
    const CameraForm<Real>& camera = tables.camera;
    if (const PixelFilter filter = tables.settings.filter; filter != PixelFilter::box) [[unlikely]]
        for (std::size_t axis = 0; axis < 2; ++axis) u[axis] = place_by_filter(filter, u[axis]);
    Ints<Real> x, y;
    for (int i = 0; i < lane_count<Real>; ++i) {
        const auto pixel = static_cast<std::uint32_t>(id.pixel.v[i]);
        y.v[i] = pixel / tables.settings.width;
        x.v[i] = pixel % tables.settings.width;
    }
    const V shift(static_cast<Real>(planted(PlantedBug::film_shifted) ? planted_amount() : 0.0)), one(Real(1)),
        zero(Real(0));
    const V sx = to_real(x) + u[0] - shift, sy = to_real(y) + u[1] - shift;
    const V h = V(camera.half_width) * (V(camera.film_scale_x) * sx - one);
    const V v = V(camera.half_height) * (one - V(camera.film_scale_y) * sy);
    Vec3<V> q = along(along(frame.forward, h, frame.right), v, frame.up);
    Vec3<V> origin = frame.position;
    if (camera.lens_radius > Real(0)) {
        const auto [a, b] = sample_disc(planted(PlantedBug::lens_uneven) ? u[2] * u[2] : u[2], u[3]);
        const Vec3<V> lens = (frame.right * a + frame.up * b) * V(camera.lens_radius);
        origin = origin + lens;
        q = q * V(camera.focus_distance) - lens;
    }
    const V square = dot(q, q);
    const Mask<Real> real_ray = square > zero;
    return {origin, select(real_ray, q * V(one / sqrt(square)), Vec3<V>{zero, zero, zero})};
}

}  // namespace tandem::cpu
