// Which material scatters, and which answers to lights (MODEL.md section 7). Each has a file of its own.
#ifndef MATERIALS_GLSL
#define MATERIALS_GLSL
#include "material/boundary.glsl"
#include "material/conductor.glsl"
#include "material/diffuse.glsl"
#include "material/rough_diffuse.glsl"
#include "material/specular.glsl"

// Whether next events are taken there (9.2).
bool receives_light(Material material) {
    return (has_diffuse && material.kind == material_diffuse) || is_rough_diffuse(material) ||
           (has_rough_conductor && material.kind == material_conductor && material.roughness > 0.0);
}

// Whether an event changes the throughput by 7.1, and by the weight of its direction.
bool is_absorbed(Material material) {
    return !is_conductor(material) && !is_boundary(material);
}
bool is_weighted(Material material) {
    return is_conductor(material) || has_rough_translucent || is_rough_diffuse(material);
}

bool emits_to(Material material, bool front) {
    return front || !(has_one_sided_emission && has_flag(material, flag_front_only));
}

// The event at a surface. The normal n_f is on the side of the incoming ray, and `front` tells whether that is the front side.
// c = -d·n_f. `outside` is the refractive index outside the body (9.4).
Scattering scatter_at(Material material, vec3 d, vec3 n_f, float c, bool front, float outside, vec4 u) {
    u.y = PLANT(dimension_reused, u.x, u.y);
    if (has_diffuse && material.kind == material_diffuse) return scatter_diffuse(n_f, u);
    if (is_rough_diffuse(material)) return scatter_rough_diffuse(material, d, n_f, u);
    if (is_conductor(material)) return scatter_conductor(material, d, n_f, c, u);
    if (is_boundary(material)) return scatter_boundary(d);
    return scatter_specular(material, d, n_f, c, front, outside, u);
}

// The response of a surface that receives light.
Response surface_response(Material material, vec3 n_f, vec3 d, vec3 direction) {
    if (has_rough_conductor && material.kind == material_conductor)
        return conductor_response(material, n_f, d, direction);
    if (is_rough_diffuse(material)) return rough_diffuse_response(material, n_f, d, direction);
    if (has_diffuse) return diffuse_response(absorbed(material, vec3(1.0)), n_f, direction);
    return Response(vec3(0.0), 0.0, 0.0);
}

#endif
