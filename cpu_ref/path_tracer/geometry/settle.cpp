#include "cpu_ref/path_tracer/geometry/settle.h"

namespace tandem::cpu {

namespace {

// The sign of a b - c d, exactly, but for underflow. Rounding is monotone, so that unequal rounded products tell. The
// rests of equal ones are exact.
double sign_of_difference(double a, double b, double c, double d) {
    const double p = a * b, q = c * d;
    if (p != q) return p - q;
    return std::fma(a, b, -p) - std::fma(c, d, -q);
}

}  // namespace

Settled settle_one(
    const std::array<Vec3<double>, 3>& corners, const Vec3<double>& origin, const Vec3<double>& direction) {
    const std::array<double, 3> d{direction.x, direction.y, direction.z};
    std::size_t z = 0;
    for (std::size_t i = 1; i < 3; ++i)
        if (std::abs(d[i]) > std::abs(d[z])) z = i;
    const std::size_t x = (z + 1) % 3, y = (z + 2) % 3;
    const double shear_x = d[x] / d[z], shear_y = d[y] / d[z];
    const double length_squared = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];  // 1 but for rounding to float
    std::array<double, 3> px{}, py{}, along{};
    for (std::size_t i = 0; i < 3; ++i) {
        const std::array<double, 3> p{corners[i].x - origin.x, corners[i].y - origin.y, corners[i].z - origin.z};
        px[i] = std::fma(-shear_x, p[z], p[x]);
        py[i] = std::fma(-shear_y, p[z], p[y]);
        along[i] = (p[0] * d[0] + p[1] * d[1] + p[2] * d[2]) / length_squared;
    }
    const auto edge = [&](std::size_t a, std::size_t b) { return sign_of_difference(px[a], py[b], py[a], px[b]); };
    const double u = edge(1, 2), v = edge(2, 0), w = edge(0, 1);
    const bool left = u >= 0.0 && v >= 0.0 && w >= 0.0, right = u <= 0.0 && v <= 0.0 && w <= 0.0;
    return {left != right, std::min({along[0], along[1], along[2]}), std::max({along[0], along[1], along[2]})};
}

}  // namespace tandem::cpu
