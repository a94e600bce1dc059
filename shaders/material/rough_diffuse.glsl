// Rough diffuse surfaces (MODEL.md section 7.9). n_f is the normal on the side of the incoming ray.
#ifndef ROUGH_DIFFUSE_GLSL
#define ROUGH_DIFFUSE_GLSL
#include "kernels/planted.glsl"
#include "material/diffuse.glsl"

const uint material_rough_diffuse = 5;  // of MaterialKind in common/scene/scene.h

bool is_rough_diffuse(Material material) { return has_rough_diffuse && material.kind == material_rough_diffuse; }

// f of a path that comes along d and goes on along o, divided by that of a diffuse surface [Oren 1994]. The parts of -d
// and o within the surface's plane have the product sin theta_i sin theta_o cos(phi_i - phi_o). tan beta is the sine
// over the greater cosine. Numbers are whole, which every precision keeps.
float rough_diffuse_ratio(float sigma, vec3 d, vec3 n_f, vec3 o) {
    const float s2 = sigma * sigma;
    const float a = 1.0 - 50.0 * s2 / (100.0 * s2 + 33.0);
    const float b = PLANT(rough_diffuse_term_dropped, 0.0, 45.0 * s2 / (100.0 * s2 + 9.0));
    const float cos_i = -dot(d, n_f), cos_o = dot(o, n_f);
    const float along = dot(-d - cos_i * n_f, o - cos_o * n_f);
    return a + b * max(0.0, along) / max(max(cos_i, cos_o), 1e-6);
}

// As 7.2, but for the weight.
Scattering scatter_rough_diffuse(Material material, vec3 d, vec3 n_f, vec4 u) {
    Scattering scattering = scatter_diffuse(n_f, u);
    if (!PLANTED(rough_diffuse_unweighted))
        scattering.weight = vec3(rough_diffuse_ratio(material.roughness, d, n_f, scattering.direction));
    return scattering;
}

Response rough_diffuse_response(Material material, vec3 n_f, vec3 d, vec3 direction) {
    Response response = diffuse_response(material.colour, n_f, direction);
    if (response.f_cosine > 0.0) response.f_cosine *= rough_diffuse_ratio(material.roughness, d, n_f, direction);
    return response;
}

#endif
