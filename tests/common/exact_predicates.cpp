#include "tests/common/exact_predicates.h"

#include <boost/multiprecision/cpp_int.hpp>

namespace tandem::test {

namespace {

using Number = boost::multiprecision::cpp_rational;
using Vector = std::array<Number, 3>;

Vector exact(const glm::dvec3& v) { return {Number(v.x), Number(v.y), Number(v.z)}; }

Vector difference(const Vector& a, const Vector& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }

Number determinant(const Vector& a, const Vector& b, const Vector& c) {
    return a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0]);
}

std::array<Vector, 3> seen_from(const glm::dvec3& origin, const std::array<glm::dvec3, 3>& corners) {
    const Vector o = exact(origin);
    return {difference(exact(corners[0]), o), difference(exact(corners[1]), o), difference(exact(corners[2]), o)};
}

}  // namespace

Passage exact_passage(const glm::dvec3& origin, const glm::dvec3& direction, const std::array<glm::dvec3, 3>& corners) {
    const std::array<Vector, 3> p = seen_from(origin, corners);
    const Vector d = exact(direction);
    int left = 0, right = 0, on = 0;
    for (std::size_t i = 0; i < 3; ++i) {
        const int side = determinant(d, p[i], p[(i + 1) % 3]).sign();
        (side > 0 ? left : side < 0 ? right : on) += 1;
    }
    if (on == 3) return Passage::in_plane;
    if (left > 0 && right > 0) return Passage::outside;
    return on == 0 ? Passage::inside : on == 1 ? Passage::edge : Passage::vertex;
}

int exact_side(const glm::dvec3& origin, const glm::dvec3& direction, const std::array<glm::dvec3, 3>& corners) {
    const std::array<Vector, 3> p = seen_from(origin, corners);
    const Vector e = difference(p[1], p[0]), f = difference(p[2], p[0]);
    const int ahead = determinant(p[0], e, f).sign(), slope = determinant(exact(direction), e, f).sign();
    return ahead * slope;
}

}  // namespace tandem::test
