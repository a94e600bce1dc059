// Set 0, Scene: what changes with the scene alone. vertex.comp writes the world primitives, everyone else reads them.
// Primitives are sorted by kind (triangles, spheres, cuboids; in id order within a kind); their position in that order is
// the `slot` by which the stages name them, Placed gives the primitive id of MODEL.md section 5. The host's counterparts
// stand in vulkan/renderer/gpu_layout.h; the build checks their layouts against this file's SPIR-V.
#ifndef SCENE_SET_GLSL
#define SCENE_SET_GLSL

// A primitive in object space.
struct PrimitiveSource {
    uint kind;
    uint index0;
    uint index1;
    uint index2;
    uint entity;
    float radius;
};

// Rows of an entity's object_to_world, and of the inverse of its linear part; the sign of its determinant.
struct EntityTransform {
    vec4 to_world0;
    vec4 to_world1;
    vec4 to_world2;
    vec3 to_object0;
    float determinant_sign;
    vec3 to_object1;
    vec3 to_object2;
};

struct Placed {
    uint id;
    uint material;
    uint entity;
    uint light;  // index into lights, or no_light
};

// A triangle's world corners; the w parts are its normal (v1 - v0) x (v2 - v0), towards the front.
struct Triangle {
    vec4 corner0;
    vec4 corner1;
    vec4 corner2;
};

// A sphere or cuboid as the image of the unit sphere or of the cube [-extent, extent], extent 1 on each axis or 0 where
// the cuboid is flat: x = to_unit (p - centre), p = centre + to_world x.
struct Convex {
    vec4 to_unit0;  // row, centre x
    vec4 to_unit1;  // row, centre y
    vec4 to_unit2;  // row, centre z
    vec4 to_world0;  // row, extent x
    vec4 to_world1;
    vec4 to_world2;
};

// Two boxes and what they hold (shaders/bvh.glsl).
struct BvhNode {
    vec3 low0;
    uint child0;
    vec3 high0;
    uint child1;
    vec3 low1;
    uint unused0;
    vec3 high1;
    uint unused1;
};

struct Material {
    vec3 colour;
    float alpha;
    vec3 radiance;
    float fuzz;
    float refractive_index;
    uint kind;
    uint flags;
    uint unused;
};
const uint material_diffuse = 0, material_specular = 1, material_emissive = 2;
const uint flag_translucent = 1, flag_schlick = 2, flag_front_only = 4;

// A sampled light (MODEL.md section 9.2).
struct Light {
    uint slot;
    uint kind;
    float cumulative;   // P_0 + … + P_i
    float probability;  // P_i
    vec3 centre;        // sphere
    float radius;
    float area;  // world
    float face0;  // cuboid: cumulative shares of the faces -x +x -y +y -z, the sixth being 1
    float face1;
    float face2;
    float face3;
    float face4;
};
const uint no_light = 0xffffffffu;
const uint kind_triangle = 0, kind_sphere = 1, kind_cuboid = 2;

layout(std140, set = 0, binding = 0) uniform SceneHeader {
    vec3 background_down;
    float extent;  // greatest extent of the scene: test builds' epsilon alone
    vec3 background_up;
} scene;

#ifdef WRITES_SCENE
layout(std430, set = 0, binding = 1) readonly restrict buffer Vertices { vec4 vertices[]; };
layout(std430, set = 0, binding = 2) readonly restrict buffer Sources { PrimitiveSource sources[]; };
#define WORLD_ACCESS writeonly
#else
layout(std430, set = 0, binding = 4) readonly restrict buffer PlacedPrimitives { Placed placed[]; };
layout(std430, set = 0, binding = 5) readonly restrict buffer Materials { Material materials[]; };
layout(std430, set = 0, binding = 6) readonly restrict buffer Lights { Light lights[]; };
#define WORLD_ACCESS readonly
#endif
#if defined(WRITES_SCENE) || defined(PLANTED_BUGS)
layout(std430, set = 0, binding = 3) readonly restrict buffer Transforms { EntityTransform transforms[]; };
#endif
layout(std430, set = 0, binding = 7) WORLD_ACCESS restrict buffer Triangles { Triangle triangles[]; };
layout(std430, set = 0, binding = 8) WORLD_ACCESS restrict buffer Spheres { Convex spheres[]; };
layout(std430, set = 0, binding = 9) WORLD_ACCESS restrict buffer Cuboids { Convex cuboids[]; };

#ifdef LOOPS_OVER_PRIMITIVES
layout(std430, set = 0, binding = 13) readonly restrict buffer BvhNodes { BvhNode bvh_nodes[]; };

// The same three buffers as uniform blocks, of at most the 16 KiB that every device allows: where all threads read the same
// primitive, that is the faster way.
layout(std140, set = 0, binding = 10) uniform FewTriangles { Triangle few_triangles[16384 / 48]; };
layout(std140, set = 0, binding = 11) uniform FewSpheres { Convex few_spheres[16384 / 96]; };
layout(std140, set = 0, binding = 12) uniform FewCuboids { Convex few_cuboids[16384 / 96]; };

// Or loaded into registers before the threads part, which CPUs do once for all threads of a vector.
const bool preloaded = unrolled && !few_primitives;
Triangle own_triangles[preloaded ? fixed_triangles + 1 : 1];
Convex own_spheres[preloaded ? fixed_spheres + 1 : 1];
Convex own_cuboids[preloaded ? fixed_cuboids + 1 : 1];
void preload_primitives() {
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
#endif

#endif
