// Which effects are simulated: bit i of the two words is effect i of common/render/effects.h. An absent effect's code is dropped
// when the pipeline is built. What is present but not called for finds nothing to do in the data: the general kernels,
// which simulate everything, do the same arithmetic to the last bit (shaders/tools/exact_arithmetic.py).
#ifndef EFFECTS_GLSL
#define EFFECTS_GLSL

layout(constant_id = 1) const uint effects_low = 0xffffffffu;
layout(constant_id = 2) const uint effects_high = 0xffffffffu;

const bool has_triangles = (effects_low & (1u << 0)) != 0u;
const bool has_spheres = (effects_low & (1u << 1)) != 0u;
const bool has_cuboids = (effects_low & (1u << 2)) != 0u;
const bool has_entity_motion = (effects_low & (1u << 3)) != 0u;
const bool has_lens = (effects_low & (1u << 4)) != 0u;
const bool has_camera_motion = (effects_low & (1u << 5)) != 0u;
const bool has_diffuse = (effects_low & (1u << 6)) != 0u;
const bool has_specular = (effects_low & (1u << 7)) != 0u;
const bool has_fuzz = (effects_low & (1u << 8)) != 0u;
const bool has_translucent = (effects_low & (1u << 9)) != 0u;
const bool has_schlick = (effects_low & (1u << 10)) != 0u;
const bool has_rough_translucent = (effects_low & (1u << 11)) != 0u;
const bool has_smooth_conductor = (effects_low & (1u << 12)) != 0u;
const bool has_rough_conductor = (effects_low & (1u << 13)) != 0u;
const bool has_rough_diffuse = (effects_low & (1u << 14)) != 0u;
const bool has_boundary = (effects_low & (1u << 15)) != 0u;
const bool has_emission = (effects_low & (1u << 16)) != 0u;
const bool has_one_sided_emission = (effects_low & (1u << 17)) != 0u;
const bool has_translucent_emission = (effects_low & (1u << 18)) != 0u;
const bool has_texture_coordinates = (effects_low & (1u << 19)) != 0u;
const bool has_checker = (effects_low & (1u << 20)) != 0u;
const bool has_noise = (effects_low & (1u << 21)) != 0u;
const bool has_image_texture = (effects_low & (1u << 22)) != 0u;
const bool has_background = (effects_low & (1u << 23)) != 0u;
const bool has_background_gradient = (effects_low & (1u << 24)) != 0u;
const bool has_background_image = (effects_low & (1u << 25)) != 0u;
const bool has_medium_absorption = (effects_low & (1u << 26)) != 0u;
const bool has_medium_scattering = (effects_low & (1u << 27)) != 0u;
const bool has_anisotropic_phase = (effects_low & (1u << 28)) != 0u;
const bool has_density_grid = (effects_low & (1u << 29)) != 0u;
const bool has_interiors = (effects_low & (1u << 30)) != 0u;
const bool has_nested_dielectrics = (effects_low & (1u << 31)) != 0u;
const bool has_light_sampling = (effects_high & (1u << 0)) != 0u;
const bool has_triangle_lights = (effects_high & (1u << 1)) != 0u;
const bool has_sphere_lights = (effects_high & (1u << 2)) != 0u;
const bool has_cuboid_lights = (effects_high & (1u << 3)) != 0u;
const bool has_ellipsoid_lights = (effects_high & (1u << 4)) != 0u;
const bool has_point_lights = (effects_high & (1u << 5)) != 0u;
const bool has_spot_lights = (effects_high & (1u << 6)) != 0u;
const bool has_suns = (effects_high & (1u << 7)) != 0u;
const bool has_sampled_background = (effects_high & (1u << 8)) != 0u;
const bool has_direct_only = (effects_high & (1u << 9)) != 0u;
const bool has_roulette = (effects_high & (1u << 10)) != 0u;

#endif
