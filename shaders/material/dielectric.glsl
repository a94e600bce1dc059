// Dielectrics, smooth (MODEL.md section 7.4) and rough (7.7).
#ifndef DIELECTRIC_GLSL
#define DIELECTRIC_GLSL
#include "material/microfacets.glsl"
#include "material/scattering.glsl"

// 7.4: reflectance at cosine c, cosine of the transmitted direction c_t, relative index eta.
float fresnel_exact(float c, float c_t, float eta) {
    const float r_s = (eta * c - c_t) / (eta * c + c_t), r_p = (c - eta * c_t) / (c + eta * c_t);
    return PLANT(one_polarisation, r_s * r_s, 0.5 * (r_s * r_s + r_p * r_p));
}

float fresnel_schlick(float c, float c_t, float eta) {
    const float root = (1.0 - eta) / (1.0 + eta), r0 = root * root;
    const float x = 1.0 - (eta <= 1.0 ? c : c_t), x2 = x * x;
    return r0 + (1.0 - r0) * (x2 * x2 * x);
}

// 7.4: incident against transmitted index; `outside` is the index there (9.4), 1 for vacuum.
float relative_index(Material material, bool front, float outside) {
    const float index = material.refractive_index;
    if (PLANTED(outside_index_ignored)) outside = 1.0;
    return front ? outside / index : index / outside;
}

// Section 7.4: the direction that leaves a translucent surface before fuzz; zero: none. The normal n is the one on the side that
// the ray comes from, c = -d·n.
vec3 translucent_direction(Material material, vec3 d, vec3 n, float c, float eta, float u3, out bool reflects) {
    const vec3 mirrored = d + 2.0 * c * n;
    const float inner = eta * c;
    precise float c_t2 = (1.0 - eta) * (1.0 + eta) + inner * inner;
    reflects = true;
    if (c_t2 < 0.0) return PLANTED(total_reflection_lost) ? vec3(0.0) : mirrored;
    const float c_t = sqrt(c_t2);
    const float reflectance =
        has_schlick && has_flag(material, flag_schlick) ? fresnel_schlick(c, c_t, eta) : fresnel_exact(c, c_t, eta);
    reflects = u3 < reflectance;
    return reflects ? mirrored : eta * d + (eta * c - c_t) * n;
}

// 7.7
Scattering scatter_rough_translucent(Material material, vec3 d, vec3 n_f, float eta, vec4 u) {
    const float alpha = ggx_alpha(material);
    const mat3 frame = frame_of(n_f);
    const vec3 i = -d * frame;
    if (i.z <= 0.0) return no_scattering;
    const vec3 h = sample_visible_normal(i, alpha, u.xy);
    const float cosine = min(1.0, dot(i, h));
    bool reflects;
    const vec3 o = translucent_direction(material, -i, h, cosine, eta, u.z, reflects);
    if (o == vec3(0.0) || (reflects ? o.z <= 0.0 : o.z >= 0.0)) return no_scattering;
    return Scattering(normalize(frame * o), vec3(shadowing_ratio(i, o, alpha)), 0.0);
}

#endif
