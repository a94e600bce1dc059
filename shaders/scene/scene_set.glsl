// Set 0, Scene: what changes with the scene alone. vertex.comp writes the world primitives, everyone else reads them.
// Primitives are sorted by kind (triangles, spheres, cuboids; in id order within a kind). Their position in that order
// is the `slot` by which the stages name them. Placed gives the primitive id of MODEL.md section 5.
#ifndef SCENE_SET_GLSL
#define SCENE_SET_GLSL

#include "made/constant_ids.glsl"

#include "scene/scene_structs.glsl"

layout(std140, set = 0, binding = 0) uniform SceneHeader {
    shading_real3 background_down;
    shading_real extent;  // greatest extent of the scene
    shading_real3 background_up;
    shading_real background_probability;  // with which light sampling chooses the background; 0: it is not sampled
    Environment environment;
    uint medium;               // around everything, or no_index
    uint texture_coordinates;  // in tables: three pairs a triangle (meshes.glsl)
    uint shading_normals;      // in tables: three vectors a triangle, of any length; or no_index
} scene;

layout(std430, set = 0, binding = 1) readonly restrict buffer Vertices { vec4 vertices[]; };
layout(std430, set = 0, binding = 2) readonly restrict buffer Sources { PrimitiveSource sources[]; };
#ifdef WRITES_SCENE
#define WORLD_ACCESS writeonly
#else
layout(std430, set = 0, binding = 4) readonly restrict buffer PlacedPrimitives { Placed placed[]; };
layout(std430, set = 0, binding = 5) readonly restrict buffer Materials { Material materials[]; };
layout(std430, set = 0, binding = 6) readonly restrict buffer Lights { Light lights[]; };
layout(std430, set = 0, binding = 14) readonly restrict buffer Textures { Texture textures[]; };
layout(std430, set = 0, binding = 15) readonly restrict buffer Tables { float tables[]; };
layout(std430, set = 0, binding = 16) readonly restrict buffer Media { Medium media[]; };
#define WORLD_ACCESS readonly
#endif
layout(std430, set = 0, binding = 3) readonly restrict buffer Transforms { EntityTransform transforms[]; };
layout(std430, set = 0, binding = 7) WORLD_ACCESS restrict buffer Triangles { Triangle triangles[]; };
layout(std430, set = 0, binding = 8) WORLD_ACCESS restrict buffer Spheres { Convex spheres[]; };
layout(std430, set = 0, binding = 9) WORLD_ACCESS restrict buffer Cuboids { Convex cuboids[]; };

#ifdef LOOPS_OVER_PRIMITIVES
layout(std430, set = 0, binding = 13) readonly restrict buffer BvhNodes { BvhNode bvh_nodes[]; };

// The same three buffers as uniform blocks, at most the 16 KiB that every device allows. Where all threads read the
// same primitive, that is the faster way.
#ifndef DOUBLE_GEOMETRY
layout(std140, set = 0, binding = 10) uniform FewTriangles { Triangle few_triangles[16384 / 48]; };
layout(std140, set = 0, binding = 11) uniform FewSpheres { Convex few_spheres[16384 / 96]; };
layout(std140, set = 0, binding = 12) uniform FewCuboids { Convex few_cuboids[16384 / 96]; };

// Or loaded into registers before the threads part, which CPUs do once for all threads of a vector.
const bool preloaded = unrolled && !few_primitives;
Triangle own_triangles[preloaded ? fixed_triangles + 1 : 1];
Convex own_spheres[preloaded ? fixed_spheres + 1 : 1];
Convex own_cuboids[preloaded ? fixed_cuboids + 1 : 1];
void preload_own() {
    if (!preloaded) return;
    [[unroll]] for (uint i = 0; i < fixed_triangles; ++i) own_triangles[i] = triangles[i];
    [[unroll]] for (uint i = 0; i < fixed_spheres; ++i) own_spheres[i] = spheres[i];
    [[unroll]] for (uint i = 0; i < fixed_cuboids; ++i) own_cuboids[i] = cuboids[i];
}

Triangle triangle_at(uint i) {
    if (preloaded) return own_triangles[i];
    if (few_primitives) return few_triangles[i];
    return triangles[i];
}
Convex sphere_at(uint i) {
    if (preloaded) return own_spheres[i];
    if (few_primitives) return few_spheres[i];
    return spheres[i];
}
Convex cuboid_at(uint i) {
    if (preloaded) return own_cuboids[i];
    if (few_primitives) return few_cuboids[i];
    return cuboids[i];
}
#else
void preload_own() {}
Triangle triangle_at(uint i) { return triangles[i]; }
Convex sphere_at(uint i) { return spheres[i]; }
Convex cuboid_at(uint i) { return cuboids[i]; }
#endif
#endif

#ifndef WRITES_SCENE
#include "scene/meshes.glsl"

// What follows from a triangle's corners.
struct TriangleFacts {
    real3 normal;  // unit
    real reach;    // greatest coordinate of a corner, by size
    real doubled_area;
};

TriangleFacts facts_of(Triangle triangle) {
    const real3 a = triangle.corner0.xyz, b = triangle.corner1.xyz, c = triangle.corner2.xyz;
    const real3 largest = max(abs(a), max(abs(b), abs(c)));
    return TriangleFacts(normalize(real3(triangle.corner0.w, triangle.corner1.w, triangle.corner2.w)),
        max(largest.x, max(largest.y, largest.z)), length(cross(b - a, c - a)));
}

Placed any_placed(uint slot) {
#ifndef DOUBLE_GEOMETRY
    if (in_mesh(slot)) return placed_in_mesh(slot);
#endif
    return placed[slot];
}
Triangle any_triangle(uint slot) {
#ifndef DOUBLE_GEOMETRY
    if (in_mesh(slot)) return mesh_triangle(slot);
#endif
    return triangles[slot];
}

#ifdef SHARES_SCENE
// What threads read one by one, for what each has hit. A workgroup shares a copy of a small scene, as drivers check
// buffers' bounds at every read.
layout(constant_id = id_shared_materials) const uint shared_materials = 0;
const bool shares = unrolled && shared_materials > 0;
const uint all_fixed = fixed_triangles + fixed_spheres + fixed_cuboids;
shared Placed copied_placed[shares ? all_fixed + 1 : 1];
shared Material copied_materials[shares ? shared_materials + 1 : 1];
shared Triangle copied_triangles[shares ? fixed_triangles + 1 : 1];
shared TriangleFacts copied_facts[shares ? fixed_triangles + 1 : 1];
shared Convex copied_convexes[shares ? fixed_spheres + fixed_cuboids + 1 : 1];
void copy_scene() {
    if (!shares) return;
    const uint first = gl_LocalInvocationIndex, step = gl_WorkGroupSize.x;
    for (uint i = first; i < all_fixed; i += step) copied_placed[i] = placed[i];
    for (uint i = first; i < shared_materials; i += step) copied_materials[i] = materials[i];
    for (uint i = first; i < fixed_triangles; i += step) {
        copied_triangles[i] = triangles[i];
        copied_facts[i] = facts_of(triangles[i]);
    }
    for (uint i = first; i < fixed_spheres; i += step) copied_convexes[i] = spheres[i];
    for (uint i = first; i < fixed_cuboids; i += step) copied_convexes[fixed_spheres + i] = cuboids[i];
    barrier();
}
Placed placed_at(uint slot) {
    if (shares) return copied_placed[slot];
    return any_placed(slot);
}
Material material_at(uint i) {
    if (shares) return copied_materials[i];
    return materials[i];
}
Triangle triangle_of(uint slot) {
    if (shares) return copied_triangles[slot];
    return any_triangle(slot);
}
TriangleFacts triangle_facts(uint slot) {
    if (shares) return copied_facts[slot];
    return facts_of(any_triangle(slot));
}
Convex sphere_of(uint i) {
    if (shares) return copied_convexes[i];
    return spheres[i];
}
Convex cuboid_of(uint i) {
    if (shares) return copied_convexes[fixed_spheres + i];
    return cuboids[i];
}
Convex convex_at(uint slot) {
    if (shares) return copied_convexes[slot - fixed_triangles];
    slot -= triangle_total();
    if (has_spheres && slot < sphere_total()) return spheres[slot];
    return cuboids[slot - sphere_total()];
}
#else
void copy_scene() {}
Placed placed_at(uint slot) { return any_placed(slot); }
Material material_at(uint i) { return materials[i]; }
Triangle triangle_of(uint slot) { return any_triangle(slot); }
TriangleFacts triangle_facts(uint slot) { return facts_of(any_triangle(slot)); }
Convex sphere_of(uint i) { return spheres[i]; }
Convex cuboid_of(uint i) { return cuboids[i]; }
Convex convex_at(uint slot) {
    slot -= triangle_total();
    if (has_spheres && slot < sphere_total()) return spheres[slot];
    return cuboids[slot - sphere_total()];
}
#endif
#endif

#ifdef LOOPS_OVER_PRIMITIVES
void preload_primitives() {
    preload_own();
    copy_scene();
}

// Whether the faces of a cuboid are square to the axes of the world, so that its planes need no map.
bool is_aligned(uint i, Convex cuboid) {
    if (unrolled) return (aligned_cuboids >> i & 1u) != 0u;
    return cuboid.to_unit0.y == 0.0 && cuboid.to_unit0.z == 0.0 && cuboid.to_unit1.x == 0.0 &&
        cuboid.to_unit1.z == 0.0 && cuboid.to_unit2.x == 0.0 && cuboid.to_unit2.y == 0.0;
}
#endif

#endif
