// Conductors, smooth and rough (MODEL.md section 7.6). n_f is the normal on the side of the incoming ray.
#ifndef CONDUCTOR_GLSL
#define CONDUCTOR_GLSL
#include "material/microfacets.glsl"
#include "material/scattering.glsl"

bool is_conductor(Material material) {
    return (has_smooth_conductor || has_rough_conductor) && material.kind == material_conductor;
}

// Reflectance for unpolarised light at cosine c of a channel of index eta + ik.
float fresnel_conductor(float c, float eta, float k) {
    const float c2 = c * c, s2 = 1.0 - c2, less = eta - 1.0, more = eta + 1.0;
    const float t = less * more + c2 - k * k, product = 2.0 * eta * k;
    const float p = 0.5 * (abs(t) + sqrt(t * t + product * product));
    const float q = p > 0.0 ? 0.25 * product * product / p : 0.0;  // both 0 at the critical angle
    const float a2 = t >= 0.0 ? p : q, b2 = t >= 0.0 ? q : p;
    const float a = sqrt(a2), denominator = (a + c) * (a + c) + b2;
    if (denominator == 0.0) return 0.0;  // eta = 1, k = 0: no surface, seen at 90 degrees
    const float r_s = min(1.0, (less * less + k * k) * (more * more + k * k) / denominator / denominator);
    const float minus = a * c - s2, plus = a * c + s2;
    return 0.5 * r_s * (1.0 + (minus * minus + b2 * c2) / (plus * plus + b2 * c2));
}
vec3 fresnel_conductor(float c, vec3 eta, vec3 k) {
    return vec3(fresnel_conductor(c, eta.r, k.r), fresnel_conductor(c, eta.g, k.g), fresnel_conductor(c, eta.b, k.b));
}

Scattering scatter_conductor(Material material, vec3 d, vec3 n_f, float c, vec4 u) {
    const float alpha = ggx_alpha(material);
    if (has_smooth_conductor && alpha == 0.0)
        return Scattering(normalize(d + 2.0 * c * n_f), fresnel_conductor(c, material.eta, material.k), 0.0);
    if (!has_rough_conductor) return no_scattering;
    const mat3 frame = frame_of(n_f);
    const vec3 i = -d * frame;
    if (i.z <= 0.0) return no_scattering;
    const vec3 h = sample_visible_normal(i, alpha, u.xy);
    const float cosine = min(1.0, dot(i, h));
    const vec3 o = 2.0 * cosine * h - i;
    if (o.z <= 0.0) return no_scattering;
    return Scattering(normalize(frame * o),
        fresnel_conductor(cosine, material.eta, material.k) * shadowing_ratio(i, o, alpha),
        microfacet_density(i, h, alpha));
}

Response conductor_response(Material material, vec3 n_f, vec3 d, vec3 direction) {
    const float alpha = ggx_alpha(material);
    const mat3 frame = frame_of(n_f);
    const vec3 i = -d * frame, o = direction * frame, sum = i + o;
    if (i.z <= 0.0 || o.z <= 0.0) return Response(vec3(1.0), 0.0, 0.0);
    const vec3 h = normalize(sum);
    return Response(fresnel_conductor(min(1.0, dot(i, h)), material.eta, material.k),
        microfacet_value(i, o, h, alpha), microfacet_density(i, h, alpha));
}

#endif
