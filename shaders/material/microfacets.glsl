// The microfacet distribution of Trowbridge and Reitz, "GGX" (MODEL.md section 7.6). Directions are local, z along the
// normal on the side of the incoming ray. i and o point away from the surface. alpha is the squared roughness.
#ifndef MICROFACETS_GLSL
#define MICROFACETS_GLSL

// The squared roughness.
float ggx_alpha(Material material) { return material.roughness * material.roughness; }

// 1 + h_z^2 (alpha^2 - 1) is the squared length of h with z scaled by alpha: nothing cancels.
float microfacet_distribution(vec3 h, float alpha) {
    const float a2 = alpha * alpha, length2 = h.x * h.x + h.y * h.y + a2 * h.z * h.z;
    return a2 / (pi * length2 * length2);
}

float microfacet_lambda(vec3 w, float alpha) {
    if (PLANTED(ggx_masking_dropped)) return 0.0;
    const float tangent2 = (w.x * w.x + w.y * w.y) / (w.z * w.z);
    return 0.5 * (sqrt(1.0 + alpha * alpha * tangent2) - 1.0);
}

// G_1 of the incoming, G_2 of both directions.
float shadowing(vec3 i, float alpha) { return 1.0 / (1.0 + microfacet_lambda(i, alpha)); }
float shadowing(vec3 i, vec3 o, float alpha) {
    return 1.0 / (1.0 + microfacet_lambda(i, alpha) + microfacet_lambda(o, alpha));
}
// Weight of a sampled direction by shadowing: G2/G1.
float shadowing_ratio(vec3 i, vec3 o, float alpha) {
    return shadowing(i, o, alpha) / shadowing(i, alpha);
}

// A normal of the distribution as seen from i [Dupuy 2023].
vec3 sample_visible_normal(vec3 i, float alpha, vec2 u) {
    const vec3 v = normalize(vec3(alpha * i.xy, i.z));
    const float z = (1.0 - u.y) * (1.0 + v.z) - v.z;
    const float sine = sqrt(max(0.0, 1.0 - z * z));
    const vec3 s = vec3(sine * cos_sin_turn(u.x), z) + v;
    return normalize(vec3(alpha * s.xy, s.z));
}

// f cos theta_o without the Fresnel factor, and the density with which sampling gives o.
float microfacet_value(vec3 i, vec3 o, vec3 h, float alpha) {
    return microfacet_distribution(h, alpha) * shadowing(i, o, alpha) / (4.0 * i.z);
}
float microfacet_density(vec3 i, vec3 h, float alpha) {
    return shadowing(i, alpha) * microfacet_distribution(h, alpha) / PLANT(ggx_jacobian_missing, 1.0, 4.0 * i.z);
}

#endif
