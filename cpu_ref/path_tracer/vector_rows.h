// Rows of a growing table of vectors, and the rounding of vectors from double.
#pragma once

#include <glm/glm.hpp>
#include <vector>

#include "cpu_ref/path_tracer/tables.h"

namespace tandem::cpu {

template <class Real>
[[nodiscard]] Vec3<Real> to_vec3(const glm::dvec3& a) {
    return {static_cast<Real>(a.x), static_cast<Real>(a.y), static_cast<Real>(a.z)};
}

template <class Real>
struct VectorRows {
    std::vector<Real> x, y, z;
    void push_back(const glm::dvec3& a, Real scale = Real(1)) {
        x.push_back(static_cast<Real>(a.x) * scale);
        y.push_back(static_cast<Real>(a.y) * scale);
        z.push_back(static_cast<Real>(a.z) * scale);
    }
    void push_back(const Vec3<Real>& a) {
        x.push_back(a.x);
        y.push_back(a.y);
        z.push_back(a.z);
    }
    void assign_to(VectorColumn<Real>& column) const {
        column.x.assign(x);
        column.y.assign(y);
        column.z.assign(z);
    }
};

}  // namespace tandem::cpu
