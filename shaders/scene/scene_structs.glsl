// What a scene is made of on the device. The host's counterparts stand in vulkan/renderer/scene/gpu_layout.h; the build checks
// their layouts against the SPIR-V.
#ifndef SCENE_STRUCTS_GLSL
#define SCENE_STRUCTS_GLSL

// Mixed precision holds geometry, lights and media in double. Double precision holds materials and textures in double too.
#include "arithmetic/real.glsl"
#ifdef DOUBLE_GEOMETRY
#define GEOMETRY_VEC4 dvec4
#define EntityTransform DoubleEntityTransform
#define Triangle DoubleTriangle
#define Convex DoubleConvex
#define Medium DoubleMedium
#define Light DoubleLight
#define Camera DoubleCamera
#else
#define GEOMETRY_VEC4 vec4
#endif
#ifdef DOUBLE_SHADING
#define Material DoubleMaterial
#define Texture DoubleTexture
#define SceneHeader DoubleSceneHeader
#endif

// A primitive in object space.
struct PrimitiveSource {
    uint kind;
    uint index0;
    uint index1;
    uint index2;
    uint entity;
    float radius;
};

// Rows of an entity's object_to_world, and of the inverse of its linear part, and the sign of its determinant. Its
// world displacement is from the shutter's opening to its closing (MODEL.md section 6).
struct EntityTransform {
    GEOMETRY_VEC4 to_world0;
    GEOMETRY_VEC4 to_world1;
    GEOMETRY_VEC4 to_world2;
    real3 to_object0;
    real determinant_sign;
    real3 to_object1;
    real3 to_object2;
    real3 motion;
};

struct Placed {
    uint id;
    uint material;
    uint entity;
    uint light;  // index into lights, or no_light
};

// A triangle's world corners; the w parts are its normal (v1 - v0) x (v2 - v0), towards the front.
struct Triangle {
    GEOMETRY_VEC4 corner0;
    GEOMETRY_VEC4 corner1;
    GEOMETRY_VEC4 corner2;
};

// A sphere or cuboid as the image of the unit sphere or of the cube [-extent, extent]. extent is 1 on each axis, or 0
// where the cuboid is flat. x = to_unit (p - centre), p = centre + to_world x.
struct Convex {
    GEOMETRY_VEC4 to_unit0;  // row, centre x
    GEOMETRY_VEC4 to_unit1;  // row, centre y
    GEOMETRY_VEC4 to_unit2;  // row, centre z
    GEOMETRY_VEC4 to_world0;  // row, extent x
    GEOMETRY_VEC4 to_world1;
    GEOMETRY_VEC4 to_world2;
};

// Two boxes, [centre - half, centre + half], and what they hold (shaders/geometry/bvh.glsl).
struct BvhNode {
    vec3 centre0;
    uint child0;
    vec3 half0;
    uint child1;
    vec3 centre1;
    uint unused0;
    vec3 half1;
    uint unused1;
};

const uint no_index = 0xffffffffu;  // in place of an index: none

struct Material {
    shading_real3 colour;
    shading_real alpha;
    shading_real3 radiance;
    shading_real fuzz;
    shading_real refractive_index;
    uint kind;
    uint flags;
    uint colour_texture;  // in place of the colour, or no_index
    shading_real3 eta;        // of conductors
    shading_real roughness;
    shading_real3 k;
    int priority;
    uint interior;   // a medium, or no_index
    uint bodies;     // spheres and cuboids of it; no_index if there are triangles of it, too
};
const uint material_diffuse = 0, material_specular = 1, material_emissive = 2, material_conductor = 3, material_boundary = 4;
const uint flag_translucent = 1, flag_schlick = 2, flag_front_only = 4, flag_tracked = 8;

// MODEL.md section 7.0.
struct Texture {
    shading_real3 first;
    uint kind;
    shading_real3 second;
    uint space;
    shading_real3 frequency;
    uint style;
    uint octaves;
    uint seed;
    shading_real amount;
    uint texels;  // in tables
    uint width;
    uint height;
};
const uint texture_checker = 0, texture_noise = 1, texture_image = 2;
const uint texture_space_object = 0, texture_space_coordinates = 1;
const uint noise_smooth = 0, noise_turbulence = 1, noise_marble = 2;

// MODEL.md section 10.
struct Medium {
    real3 absorption;
    real anisotropy;
    real3 scattering;
    uint densities;  // in tables; no_index: 1 everywhere
    real3 low;
    uint cells_x;
    real3 high;
    uint cells_y;
    uint cells_z;
};

// A sampled light (MODEL.md section 9.2).
struct Light {
    uint slot;
    uint kind;
    real cumulative;   // P_0 + … + P_i
    real probability;  // P_i
    real3 centre;        // sphere; point, spot: the position
    real radius;       // ellipsoid: of the sphere of equal volume
    real area;  // world
    real face0;  // cuboid: cumulative shares of the faces -x +x -y +y -z, the sixth being 1
    real face1;
    real face2;
    real face3;
    real face4;
    real3 axis;       // spot, sun: in which its light travels
    real outer;     // spot: cosines of the outer and the inner half angle
    real3 intensity;  // point, spot: radiant intensity; sun: irradiance
    real inner;
};
const uint no_light = 0xffffffffu;
const uint kind_triangle = 0, kind_sphere = 1, kind_cuboid = 2;
const uint kind_point = 3, kind_spot = 4, kind_sun = 5, kind_background = 6, kind_ellipsoid = 7;

// The image that surrounds the scene (shaders/light/environment.glsl).
struct Environment {
    uvec2 size;     // texels; (0, 0): there is none
    uint texels;    // these four in tables
    uint density;   // over solid angle, by texel
    uint rows;      // cumulative shares of rows
    uint columns;   // of each row's columns
    vec2 rotation;  // its cosine and sine
};

#endif
