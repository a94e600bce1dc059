// Settings of which those that no dispatch of a job changes are specialisation constants (vulkan/renderer/kernels/bindings.cpp).
#ifndef SPECIALISED_SETTINGS_GLSL
#define SPECIALISED_SETTINGS_GLSL

#include "made/constant_ids.glsl"

layout(constant_id = id_fixed_width) const uint fixed_width = 0;
layout(constant_id = id_fixed_height) const uint fixed_height = 0;
layout(constant_id = id_fixed_bounces) const uint fixed_bounces = 0;
layout(constant_id = id_fixed_roulette_start) const uint fixed_roulette_start = 0;
layout(constant_id = id_fixed_light_count) const uint fixed_light_count = 0;
layout(constant_id = id_fixed_triangle_count) const uint fixed_triangle_count = 0;
layout(constant_id = id_fixed_sphere_count) const uint fixed_sphere_count = 0;
layout(constant_id = id_fixed_cuboid_count) const uint fixed_cuboid_count = 0;
layout(constant_id = id_fixed_direct_only) const uint fixed_direct_only = 0;

struct SpecialisedSettings {
    uvec2 seed;
    uvec2 sample_index;
    uint first_pixel;
    uint pixel_count;
    uint segment;
    uint width;
    uint height;
    uint bounces;
    uint roulette_start;
    uint light_count;
    uint triangle_count;
    uint sphere_count;
    uint cuboid_count;
    uint direct_only;
    float ray_min;
    float ray_max;
    uint first_invocation;
    uint invocations;
    uint listed;
};

SpecialisedSettings settings = SpecialisedSettings(pushed.seed, pushed.sample_index, pushed.first_pixel, pushed.pixel_count,
    pushed.segment, fixed_width, fixed_height, fixed_bounces, fixed_roulette_start, fixed_light_count, fixed_triangle_count,
    fixed_sphere_count, fixed_cuboid_count, fixed_direct_only, pushed.ray_min, pushed.ray_max,
    pushed.first_invocation, pushed.invocations, pushed.listed);

#endif
