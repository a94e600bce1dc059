// The chosen intersection tests and self-intersection guard (MODEL.md section 5.3), with the numbers of
// common/render/intersection_settings.h. Also the constants of kernels that are made for one scene.
#ifndef INTERSECTION_CHOICES_GLSL
#define INTERSECTION_CHOICES_GLSL

#include "made/constant_ids.glsl"

layout(constant_id = id_triangle_kernel) const uint triangle_kernel = 0;  // as in common/render/intersection_settings.h
layout(constant_id = id_convex_kernel) const uint convex_kernel = 0;
layout(constant_id = id_guard) const uint guard = 0;
layout(constant_id = id_guard_epsilon) const float guard_epsilon = 0.0;
layout(constant_id = id_unturned) const bool unturned = false;  // the maps of all spheres and cuboids are diagonal
// Triangles with a coordinate beyond this have their points made from the ray (surface.glsl).
layout(constant_id = id_has_far_corners) const bool has_far_corners = false;
layout(constant_id = id_far_corner) const float far_corner = 0.0;
layout(constant_id = id_has_crossing) const bool has_crossing = true;  // some that rays go through coincide with others

const uint kernel_watertight = 0, kernel_moller_trumbore = 1, kernel_baldwin_weber = 2;
const bool naive_convex = convex_kernel != 0;
const uint guard_error_bound = 0, guard_fixed_epsilon = 1, guard_ulp = 2, guard_exclusion = 3;
const bool excludes_left = guard == guard_error_bound || guard == guard_exclusion;

#endif
