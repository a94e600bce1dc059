// What every stage is told: specialisation constants (fixed for a scene and its settings) and push constants (changing
// from dispatch to dispatch). The thesis's set "Settings".
#ifndef SETTINGS_GLSL
#define SETTINGS_GLSL

layout(local_size_x_id = 0) in;

#include "effects.glsl"

layout(constant_id = 3) const bool carries_radiance = true;  // a path may gather light and go on
layout(constant_id = 4) const bool few_primitives = false;   // each kind's world primitives fit a uniform block
layout(constant_id = 5) const bool unrolled = false;  // the loops over primitives
layout(constant_id = 6) const uint fixed_triangles = 0;
layout(constant_id = 7) const uint fixed_spheres = 0;
layout(constant_id = 8) const uint fixed_cuboids = 0;
layout(constant_id = 9) const bool triangle_tree = false;  // a tree in place of the loop
layout(constant_id = 10) const bool sphere_tree = false;
layout(constant_id = 11) const bool cuboid_tree = false;
layout(constant_id = 12) const uint triangle_root = 0;
layout(constant_id = 13) const uint sphere_root = 0;
layout(constant_id = 14) const uint cuboid_root = 0;
layout(constant_id = 15) const float ray_min = 0.0;  // those of Settings
layout(constant_id = 16) const float ray_max = 0.0;

layout(push_constant, std430) uniform Settings {
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
} settings;

// Kernels made for a scene have its counts built in, general ones are told.
const uint told = 0xffffffffu;
uint triangle_total() { return fixed_triangles == told ? settings.triangle_count : fixed_triangles; }
uint sphere_total() { return fixed_spheres == told ? settings.sphere_count : fixed_spheres; }

#ifdef PLANTED_BUGS
// Values of tandem::PlantedBug (common/planted_bugs.h); test builds only.
layout(constant_id = 31) const uint planted_bug = 0;
const uint bug_cosine_dropped = 1, bug_inverse_pi_dropped = 2, bug_roulette_not_divided = 3;
const uint bug_relative_index_inverted = 6, bug_pdf_not_of_sampler = 7, bug_mis_weights_unequal = 8;
const uint bug_jacobian_missing = 9, bug_light_from_behind = 10, bug_dimension_reused = 11, bug_half_pixel_shift = 12;
const uint bug_albedo_off_3_percent = 13, bug_albedo_off_1_percent = 14, bug_self_hit_not_excluded = 15;
const uint bug_epsilon_too_large = 16, bug_total_reflection_lost = 17, bug_normal_transform_wrong = 18;
const uint bug_radiance_clamped = 19, bug_lens_radius_doubled = 20, bug_alpha_ignored = 21;
#define PLANTED(bug) (planted_bug == bug_##bug)
#else
#define PLANTED(bug) false
#endif

const float pi = 3.14159265358979;

#endif
