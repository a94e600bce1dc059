// Boundaries of media, which rays pass as if nothing were there (MODEL.md section 7.8).
#ifndef BOUNDARY_GLSL
#define BOUNDARY_GLSL
#include "material/scattering.glsl"

bool is_boundary(Material material) { return has_boundary && material.kind == material_boundary; }

Scattering scatter_boundary(vec3 d) { return Scattering(d, vec3(1.0), 0.0); }

#endif
