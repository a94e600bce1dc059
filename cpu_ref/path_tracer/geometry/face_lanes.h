// Rows of FaceTable (tables.h), one for each lane, if some lanes hit triangles of placed meshes. These triangles have
// no row in the table, so the row is made at the hit.
#pragma once

#include "cpu_ref/path_tracer/tables.h"

namespace tandem::cpu {

// Looked up as a column is, but a lane has one row.
template <class Packet>
struct LaneColumn {
    Packet lanes{};
    template <class Row>
    TANDEM_INLINE const Packet& operator[](const Row& /*row*/) const {
        return lanes;
    }
};

template <class Real>
struct FaceLanes {
    using Reals = LaneColumn<Lanes<Real>>;
    using Vectors = LaneColumn<Vec3<Lanes<Real>>>;
    Vectors normal, terms;
    Reals offset, extent, terms_of_extent, least_height;
    std::array<Vectors, 3> edge_normal;
    std::array<Reals, 3> edge_offset;
    LaneColumn<Ints<Real>> primitive, material, sphere, curved;
};

template <class Real>
[[nodiscard]] FaceLanes<Real> lanes_of_faces(const Tables<Real>& tables, const Hit<Real>& hit);

extern template FaceLanes<float> lanes_of_faces(const Tables<float>&, const Hit<float>&);
extern template FaceLanes<double> lanes_of_faces(const Tables<double>&, const Hit<double>&);

}  // namespace tandem::cpu
