// The scene as tables in one precision. They hold intersection constants for each primitive, and columns that lanes
// look up by face, material, sphere, light or light patch. They are built once from the Scene, in double, then rounded.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "common/render/renderer.h"
#include "common/scene/scene.h"
#include "cpu_ref/path_tracer/geometry/interiors.h"
#include "cpu_ref/path_tracer/geometry/kernels.h"
#include "cpu_ref/path_tracer/geometry/mesh_table.h"
#include "cpu_ref/path_tracer/geometry/shading_normals.h"
#include "cpu_ref/path_tracer/light/environment.h"
#include "cpu_ref/path_tracer/material/media.h"
#include "cpu_ref/path_tracer/material/textures.h"
#include "cpu_ref/planted.h"

namespace tandem::cpu {

// A column of a table, looked up by a row number a lane. Short columns are permuted in registers.
template <class Real, class Element, class Packet>
class Column {
public:
    void assign(const std::vector<Element>& rows) {
        constexpr std::size_t width = lane_count<Real>;
        short_ = rows.size() <= 2 * width;
        packets_.assign(std::max<std::size_t>(2, (rows.size() + width - 1) / width), Packet(Element{}));
        for (std::size_t i = 0; i < rows.size(); ++i) packets_[i / width].v[i % width] = rows[i];
    }
    [[nodiscard]] Element at(std::size_t row) const {
        constexpr std::size_t width = lane_count<Real>;
        return packets_[row / width].v[row % width];
    }
    TANDEM_INLINE Packet operator[](Ints<Real> row) const {
#ifdef TANDEM_LANES_AVX512
        const void* data = packets_.data();
        if (short_) return permute(register_of(row), packets_[0], packets_[1]);
        return gather(register_of(row), static_cast<const Element*>(data));
#else
        constexpr std::size_t width = lane_count<Real>;
        Packet result{};
        for (std::size_t i = 0; i < width; ++i) result.v[i] = at(row.v[i]);
        return result;
#endif
    }

private:
#ifdef TANDEM_LANES_AVX512
    TANDEM_INLINE static Lanes<float> permute(__m512i row, const Lanes<float>& low, const Lanes<float>& high) {
        return {_mm512_permutex2var_ps(low.v, row, high.v)};
    }
    TANDEM_INLINE static Lanes<double> permute(__m512i row, const Lanes<double>& low, const Lanes<double>& high) {
        return {_mm512_permutex2var_pd(low.v, row, high.v)};
    }
    TANDEM_INLINE static Ints<float> permute(__m512i row, const Ints<float>& low, const Ints<float>& high) {
        return ints_of<float>(_mm512_permutex2var_epi32(register_of(low), row, register_of(high)));
    }
    TANDEM_INLINE static Ints<double> permute(__m512i row, const Ints<double>& low, const Ints<double>& high) {
        return ints_of<double>(_mm512_permutex2var_epi64(register_of(low), row, register_of(high)));
    }
    TANDEM_INLINE static Lanes<float> gather(__m512i row, const float* data) {
        return {_mm512_i32gather_ps(row, data, 4)};
    }
    TANDEM_INLINE static Lanes<double> gather(__m512i row, const double* data) {
        return {_mm512_i64gather_pd(row, data, 8)};
    }
    TANDEM_INLINE static Ints<float> gather(__m512i row, const std::uint32_t* data) {
        return ints_of<float>(_mm512_i32gather_epi32(row, data, 4));
    }
    TANDEM_INLINE static Ints<double> gather(__m512i row, const std::uint64_t* data) {
        return ints_of<double>(_mm512_i64gather_epi64(row, data, 8));
    }
#endif
    std::vector<Packet> packets_;
    bool short_ = true;
};
template <class Real>
using RealColumn = Column<Real, Real, Lanes<Real>>;
template <class Real>
using IndexColumn = Column<Real, UnsignedOf<Real>, Ints<Real>>;

template <class Real>
struct VectorColumn {
    RealColumn<Real> x, y, z;
    TANDEM_INLINE Vec3<Lanes<Real>> operator[](Ints<Real> row) const { return {x[row], y[row], z[row]}; }
};

namespace material_bits {
inline constexpr unsigned diffuse = 1, specular = 2, translucent = 4, emits = 8, both_sides = 16, schlick = 32,
                          fuzzy = 64, smooth_conductor = 128, rough_conductor = 256, rough_translucent = 512,
                          boundary = 1024, tracked = 2048, textured = 4096;
inline constexpr unsigned ranked = 8192;   // a priority other than 0
inline constexpr unsigned medium = 16384;  // no material's: a vertex in a medium
inline constexpr unsigned lit = 32768;     // a surface of next events
inline constexpr unsigned receives = lit | medium;
inline constexpr unsigned transmits = translucent | boundary;
inline constexpr unsigned scatters = lit | specular | smooth_conductor | boundary | medium;
// The bit of a kind that has no other of its own.
[[nodiscard]] constexpr unsigned of_kind(MaterialKind kind) { return 65536u << static_cast<unsigned>(kind); }
}  // namespace material_bits

namespace curved_bits {  // of faces: none are planes
inline constexpr unsigned curved = 1, ellipsoid_light = 2, left = 4;
}  // namespace curved_bits

// Every triangle has one face, every cuboid six, every sphere two (without planes): where rays enter and leave it.
template <class Real>
struct FaceTable {
    VectorColumn<Real> normal;  // unit, front
    RealColumn<Real> offset;    // normal.p = offset
    RealColumn<Real> extent;    // about the size of the primitive, world units
    // For planes, and the bound on their rounding (surface.h). How large the terms of the normal's components are, >=
    // |normal|, and their product with the extent along each axis.
    VectorColumn<Real> terms;
    RealColumn<Real> terms_of_extent;
    // For triangles: unit normals of the edges within the plane, inwards, and edge_normal.p + edge_offset the distance
    // from the edge. Faces without edges have 0 and a great number.
    std::array<VectorColumn<Real>, 3> edge_normal;
    std::array<RealColumn<Real>, 3> edge_offset;
    RealColumn<Real> least_height;   // of a triangle, over its longest edge
    RealColumn<Real> light_density;  // chance of the light over its world area; 0: not a sampled light
    IndexColumn<Real> primitive, material, sphere, curved;  // curved: curved_bits
    IndexColumn<Real> entity;                               // in scenes with motion only
    IndexColumn<Real> light;                                // where there is a LightTree: into it
};

template <class Real>
struct SphereTable {
    std::array<VectorColumn<Real>, 3> to_local, to_world, normal_map;  // rows
    VectorColumn<Real> local_shift, centre;
    RealColumn<Real> radius, extent, chance;  // radius: of equal volume; chance 0: not a sampled light
};

template <class Real>
struct MaterialTable {
    VectorColumn<Real> colour, radiance;  // radiance: alpha times it where translucent
    RealColumn<Real> alpha, fuzz, index;
    IndexColumn<Real> bits;
    RealColumn<Real> roughness_squared;
    VectorColumn<Real> eta, k;  // of conductors
};

// The kinds of sampled lights in their order (section 9.2).
enum class LightKind : std::uint32_t {
    triangle = 0,
    sphere = 1,
    cuboid = 2,
    ellipsoid = 3,
    point = 4,
    spot = 5,
    sun = 6,
    background = 7
};

// The tree of near lights (section 9.2, rules 31 to 39), its nodes in depth-first order. The leaves, in this order, are
// the first lights of LightTable. A node with m lights has m/2 of them in its first child, which is the next row. Its
// second child is 2 (m/2) rows further.
template <class Real>
struct LightTree {
    std::size_t count = 0;  // of leaves; 0: lights are not chosen by a tree
    VectorColumn<Real> centre, axis;
    RealColumn<Real> radius, cone_cosine, strength;
};
inline constexpr double light_tree_slack = 0x1p-6;          // of cosines
inline constexpr double light_tree_least_chance = 0x1p-10;  // of a child that may contribute, beside another

// The lights, near ones in the order of the tree, and the planar patches of which they consist. A triangle has 1 patch,
// a cuboid 6, and all others none.
template <class Real>
struct LightTable {
    std::size_t count = 0;
    bool any_surface = false, any_distant = false;  // distant: without a surface
    bool any_sphere = false, any_cuboid = false, any_ellipsoid = false, any_moving = false;
    std::vector<Real> cumulative_list;
    IndexColumn<Real> primitive, material, first_patch, sphere, kind;  // kind: LightKind
    RealColumn<Real> cumulative;                                       // upper bound of v0
    VectorColumn<Real> motion;                                         // of its entity
    VectorColumn<Real> patch_corner, patch_edge1, patch_edge2;
    RealColumn<Real> patch_cumulative;  // within the light, of v1
    IndexColumn<Real> patch_face;
    // Lights without a surface (section 8.3). direction: in which light travels.
    RealColumn<Real> chance, outer_cosine, inverse_cosine_range;
    VectorColumn<Real> intensity, position, direction;
    Real background_chance = 0;  // P of the background; 0: not a sampled light
    LightTree<Real> tree;        // multiplies the chance of near lights, where it has any
    Real near_share = 1;         // N: v0 below it chooses a near light
};

struct PrimitiveRef {
    PrimitiveKind kind;
    std::uint32_t form;  // into triangles, spheres or cuboids
    std::uint32_t first_face;
    bool emits;
    bool moves;
    std::uint32_t entity;
};

struct BoundingBox {
    glm::dvec3 low{0.0}, high{0.0};
};

template <class Real>
struct CameraForm {
    Vec3<Real> position, forward, right, up;  // unit
    Real half_width, half_height;             // h W/H and h of section 4
    Real lens_radius, focus_distance;
    Real film_scale_x, film_scale_y;  // 2/W, 2/H
    bool moves = false;
    Vec3<Real> target, vertical;  // `up` of the file; with the displacements, of a camera in motion alone
    Vec3<Real> position_motion, target_motion;
};

template <class Real>
struct Tables {
    std::vector<PrimitiveRef> primitives;  // by slot; by id, where there are no meshes (mesh_table.h)
    std::vector<TriangleForm<Real>> triangles;
    std::vector<SphereForm<Real>> spheres;
    std::vector<CuboidForm<Real>> cuboids;
    std::vector<BoundingBox> bounds;  // by slot, world
    FaceTable<Real> faces;
    std::shared_ptr<const MeshTable> meshes;  // or null
    UnsignedOf<Real> first_placed_face = 0;   // from here on faces have no rows: those of the meshes' triangles
    SphereTable<Real> sphere_table;
    MaterialTable<Real> materials;
    LightTable<Real> lights;
    CameraForm<Real> camera;
    Vec3<Real> background_down, background_up;
    std::shared_ptr<const ImageEnvironment> environment;  // takes the place of the two
    TextureTable textures;
    ShadingNormalTable shading_normals;
    std::vector<MediumForm> media;
    std::uint32_t medium = no_index;  // around everything
    std::vector<BodyForm> bodies;     // by material
    VectorColumn<Real> motion;        // of entities, in scenes with motion only
    std::vector<Vec3<Real>> motion_list;
    bool moves = false;  // any entity
    Real t_min, limit;   // a hit has t_min <= t < limit
    bool any_specular = false;
    bool default_kernels = true;  // of settings.intersection
    bool excludes_left = true;    // a ray ignores the primitive that it leaves
    RenderSettings settings;
};

template <class Real>
struct Hit {
    Mask<Real> found;
    Lanes<Real> t;
    Ints<Real> face;  // 0 where nothing was found
};

template <class Real>
TANDEM_INLINE Mask<Real> is_placed(const Tables<Real>& tables, Ints<Real> face) {
    return !(face < Ints<Real>(tables.first_placed_face));
}
// For what other faces alone can be, such as lights: faces of meshes read row 0.
template <class Real>
TANDEM_INLINE Ints<Real> row_of(const Tables<Real>& tables, Ints<Real> face) {
    if (!tables.meshes) [[likely]]
        return face;
    return select(is_placed(tables, face), Ints<Real>(UnsignedOf<Real>{0}), face);
}
// The face of its primitive, which is in that slot.
template <class Real>
[[nodiscard]] std::uint32_t face_within(const Tables<Real>& tables, std::uint32_t slot, std::uint32_t face) {
    return tables.meshes && tables.meshes->holds(slot) ? 0 : face - tables.primitives[slot].first_face;
}
// The primitive's id (MODEL.md section 5); no_primitive stays what it is.
template <class Real>
[[nodiscard]] std::uint32_t id_of(const Tables<Real>& tables, std::uint32_t slot) {
    if (!tables.meshes || slot == no_primitive) return slot;
    const MeshTable& meshes = *tables.meshes;
    return meshes.id_of(slot, meshes.holds(slot) ? meshes.place_of(slot).entity : tables.primitives[slot].entity);
}

template <class Real>
[[nodiscard]] Tables<Real> make_tables(const Scene& scene, const RenderSettings& settings);

extern template Tables<float> make_tables<float>(const Scene&, const RenderSettings&);
extern template Tables<double> make_tables<double>(const Scene&, const RenderSettings&);

}  // namespace tandem::cpu
