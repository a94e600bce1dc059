#include "cpu_ref/path_tracer/geometry/face_lanes.h"

namespace tandem::cpu {

namespace {

template <class Real>
void set(LaneColumn<Vec3<Lanes<Real>>>& column, int lane, const Vec3<Real>& value) {
    column.lanes.x.v[lane] = value.x;
    column.lanes.y.v[lane] = value.y;
    column.lanes.z.v[lane] = value.z;
}

template <class Real>
Vec3<Real> at(const VectorColumn<Real>& column, std::size_t row) {
    return {column.x.at(row), column.y.at(row), column.z.at(row)};
}

template <class Real>
TriangleFace<Real> face_in_row(const FaceTable<Real>& faces, std::size_t row) {
    TriangleFace<Real> face;
    face.normal = at(faces.normal, row);
    face.terms = at(faces.terms, row);
    face.offset = faces.offset.at(row);
    face.extent = faces.extent.at(row);
    face.terms_of_extent = faces.terms_of_extent.at(row);
    for (std::size_t i = 0; i < 3; ++i) {
        face.edge_normal[i] = at(faces.edge_normal[i], row);
        face.edge_offset[i] = faces.edge_offset[i].at(row);
    }
    face.least_height = faces.least_height.at(row);
    return face;
}

template <class Real>
void set_face(FaceLanes<Real>& lanes, int lane, const TriangleFace<Real>& face) {
    set(lanes.normal, lane, face.normal);
    set(lanes.terms, lane, face.terms);
    lanes.offset.lanes.v[lane] = face.offset;
    lanes.extent.lanes.v[lane] = face.extent;
    lanes.terms_of_extent.lanes.v[lane] = face.terms_of_extent;
    for (std::size_t i = 0; i < 3; ++i) {
        set(lanes.edge_normal[i], lane, face.edge_normal[i]);
        lanes.edge_offset[i].lanes.v[lane] = face.edge_offset[i];
    }
    lanes.least_height.lanes.v[lane] = face.least_height;
}

}  // namespace

template <class Real>
FaceLanes<Real> lanes_of_faces(const Tables<Real>& tables, const Hit<Real>& hit) {
    const MeshTable& meshes = *tables.meshes;
    const FaceTable<Real>& faces = tables.faces;
    FaceLanes<Real> result;
    for (int lane = 0; lane < lane_count<Real>; ++lane) {
        const auto face = static_cast<std::size_t>(hit.face[lane]);
        if (face < tables.first_placed_face) {
            set_face(result, lane, face_in_row(faces, face));
            result.primitive.lanes.v[lane] = faces.primitive.at(face);
            result.material.lanes.v[lane] = faces.material.at(face);
            result.sphere.lanes.v[lane] = faces.sphere.at(face);
            result.curved.lanes.v[lane] = faces.curved.at(face);
            continue;
        }
        const auto slot = meshes.first_slot + static_cast<std::uint32_t>(face - tables.first_placed_face);
        const MeshTable::Place& place = meshes.place_of(slot);
        set_face(
            result, lane, face_of<Real>(placed_triangle(place.map, meshes.corners_of(meshes.indices_of(place, slot)))));
        result.primitive.lanes.v[lane] = slot;
        result.material.lanes.v[lane] = place.material;
        result.sphere.lanes.v[lane] = result.curved.lanes.v[lane] = 0;
    }
    return result;
}

template FaceLanes<float> lanes_of_faces(const Tables<float>&, const Hit<float>&);
template FaceLanes<double> lanes_of_faces(const Tables<double>&, const Hit<double>&);

}  // namespace tandem::cpu
