// Specular surfaces (MODEL.md section 7.3): mirrors and dielectrics (7.4, 7.7), and the effect of fuzz on their directions.
#ifndef SPECULAR_GLSL
#define SPECULAR_GLSL
#include "material/dielectric.glsl"

// w perturbed by fuzz; zero: the path ends.
vec3 fuzzed(vec3 w, float fuzz, vec3 n, vec4 u) {
    const vec3 moved = w + fuzz * sample_sphere(u.x, u.y);
    const float length2 = dot(moved, moved);
    if (length2 < 9.094947017729282e-13) return vec3(0.0);  // 2^-40
    return dot(moved, n) * dot(w, n) <= 0.0 ? vec3(0.0) : moved;
}

// Arguments as of scatter_at.
Scattering scatter_specular(Material material, vec3 d, vec3 n_f, float c, bool front, float outside, vec4 u) {
    if (!has_specular && !has_translucent) return no_scattering;
    vec3 w = d + 2.0 * c * n_f;
    if (has_translucent && has_flag(material, flag_translucent)) {
        const float eta = relative_index(material, front, outside);
        if (has_rough_translucent && material.roughness > 0.0)
            return scatter_rough_translucent(material, d, n_f, eta, u);
        bool reflects;
        w = translucent_direction(material, d, n_f, c, eta, u.z, reflects);
    }
    if (has_fuzz && material.fuzz > 0.0 && w != vec3(0.0)) w = fuzzed(w, material.fuzz, n_f, u);
    return Scattering(w == vec3(0.0) ? w : normalize(w), vec3(1.0), 0.0);
}

#endif
