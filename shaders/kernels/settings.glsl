// The settings of every stage: specialisation constants (fixed for a scene and its settings) and push constants (changing from
// dispatch to dispatch). The thesis's set "Settings".
#ifndef SETTINGS_GLSL
#define SETTINGS_GLSL

#include "made/constant_ids.glsl"

#ifndef NOT_COMPUTE
layout(local_size_x_id = id_workgroup) in;
#endif

#include "kernels/effects.glsl"

layout(constant_id = id_carries_radiance) const bool carries_radiance = true;  // a path may gather light and go on
layout(constant_id = id_few_primitives) const bool few_primitives = false;   // each kind's world primitives fit a uniform block
layout(constant_id = id_unrolled) const bool unrolled = false;  // the loops over primitives
layout(constant_id = id_fixed_triangles) const uint fixed_triangles = 0;
layout(constant_id = id_fixed_spheres) const uint fixed_spheres = 0;
layout(constant_id = id_fixed_cuboids) const uint fixed_cuboids = 0;
layout(constant_id = id_triangle_tree) const bool triangle_tree = false;  // a tree in place of the loop
layout(constant_id = id_sphere_tree) const bool sphere_tree = false;
layout(constant_id = id_cuboid_tree) const bool cuboid_tree = false;
layout(constant_id = id_triangle_root) const uint triangle_root = 0;
layout(constant_id = id_sphere_root) const uint sphere_root = 0;
layout(constant_id = id_cuboid_root) const uint cuboid_root = 0;
#ifdef GIVEN_INTERVALS
#ifdef DOUBLE_GEOMETRY
double ray_min, ray_max;
#else
float ray_min, ray_max;  // of the ray in hand (ray_batch.comp)
#endif
#elif defined(DOUBLE_GEOMETRY)
layout(constant_id = id_ray_min) const float told_ray_min = 0.0;
layout(constant_id = id_ray_max) const float told_ray_max = 0.0;
const double ray_min = told_ray_min, ray_max = told_ray_max;
#else
layout(constant_id = id_ray_min) const float ray_min = 0.0;  // those of Settings
layout(constant_id = id_ray_max) const float ray_max = 0.0;
#endif

layout(constant_id = id_aligned_cuboids) const uint aligned_cuboids = 0;  // of unrolled loops: bit i: its faces are square to the axes
layout(constant_id = id_clamps) const bool clamps = false;
layout(constant_id = id_clamp_at) const float clamp_at = 0.0;
layout(constant_id = id_has_mis) const bool has_mis = true;  // else next events alone find the lights that they sample (9.2)

// How they arrive is one of the patterns (vulkan/patterns.h); push constants are the rule.
#if defined(PARAMETERS_UNIFORM)
layout(std140, set = 4, binding = 0) uniform Settings {
#elif defined(PARAMETERS_STORAGE)
layout(std430, set = 4, binding = 0) readonly restrict buffer Settings {
#elif defined(PARAMETERS_ADDRESS)
#extension GL_EXT_buffer_reference : require
layout(buffer_reference, std430, buffer_reference_align = 16) readonly restrict buffer Settings {
#else
layout(push_constant, std430) uniform Settings {
#endif
    uvec2 seed;          // low and high word
    uvec2 sample_index;  // low and high word
    uint width;
    uint height;
    uint first_pixel;  // this tile's pixels are first_pixel + [0, pixel_count)
    uint pixel_count;
    uint segment;  // k of MODEL.md section 9
    uint bounces;
    uint roulette_start;
    uint light_count;
    uint triangle_count;
    uint sphere_count;
    uint cuboid_count;
    float ray_min;
    float ray_max;
    uint direct_only;  // 9.5
    uint sample_count;      // the megakernel's alone: samples from sample_index on
    uint first_invocation;  // the share of the tile's invocations that is in hand
    uint invocations;
    uint keeps_sums;  // a block's first sample is added to those of the block before
    uint changed_block;   // trace.comp's alone: ChangedNumber of common/render/path_trace.h
    uint changed_number;  // number | bit << 2
    uint listed;      // the tile's pixels are those of a list, of so many (pixel_list.glsl); 0: no list
#if defined(PARAMETERS_ADDRESS)
};
layout(push_constant, std430) uniform SettingsAddress { Settings settings; };
#elif defined(PARAMETERS_SPECIALISED)
} pushed;
#include "kernels/specialised_settings.glsl"
#else
} settings;
#endif

// Kernels made for a scene have its counts built in, general ones are told.
const uint told = 0xffffffffu;
uint triangle_total() { return fixed_triangles == told ? settings.triangle_count : fixed_triangles; }
uint sphere_total() { return fixed_spheres == told ? settings.sphere_count : fixed_spheres; }

#include "kernels/planted.glsl"

// Both, without a branch on `told` alone. For each branch on nothing but uniforms, Mesa's lavapipe makes kernels anew
// for its value, in every dispatch, and keeps them. That costs milliseconds and half a megabyte each. So where `told`
// is uniform, `own` is what always holds of a number that the thread has.
bool both(bool told, bool own) { return bool(uint(told) & uint(own)); }

#ifdef DOUBLE_SHADING
const double pi = 3.14159265358979324lf;
#else
const float pi = 3.14159265358979;
#endif

#endif
