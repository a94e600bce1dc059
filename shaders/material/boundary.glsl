// Boundaries of media, which rays pass as if nothing were there (MODEL.md section 7.8).
#ifndef BOUNDARY_GLSL
#define BOUNDARY_GLSL
#include "material/dielectric.glsl"

bool is_boundary(Material material) { return has_boundary && material.kind == material_boundary; }

Scattering scatter_boundary(Material material, vec3 d, vec3 n_f, float c, bool front) {
    if (PLANTED(boundary_refracts)) {
        const float eta = front ? 1.0 / 1.1 : 1.1;
        bool reflects;
        return Scattering(normalize(translucent_direction(material, d, n_f, c, eta, 1.0, reflects)), vec3(1.0), 0.0);
    }
    return Scattering(d, vec3(1.0), 0.0);
}

#endif
