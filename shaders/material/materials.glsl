// Absorption, scattering directions and the answer to lights (MODEL.md section 7).
#ifndef MATERIALS_GLSL
#define MATERIALS_GLSL
#include "material/microfacets.glsl"
#include "material/rough_diffuse.glsl"

bool has_flag(Material material, uint flag) { return (material.flags & flag) != 0u; }

bool is_conductor(Material material) {
    return (has_smooth_conductor || has_rough_conductor) && material.kind == material_conductor;
}

// Whether next events are taken there (9.2).
bool receives_light(Material material) {
    return (has_diffuse && material.kind == material_diffuse) || is_rough_diffuse(material) ||
           (has_rough_conductor && material.kind == material_conductor && material.roughness > 0.0);
}

// Whether an event changes the throughput by 7.1, and by the weight of its direction.
bool is_absorbed(Material material) {
    return !is_conductor(material) && !(has_boundary && material.kind == material_boundary);
}
bool is_weighted(Material material) {
    return is_conductor(material) || has_rough_translucent || is_rough_diffuse(material);
}

bool emits_to(Material material, bool front) {
    return front || !(has_one_sided_emission && has_flag(material, flag_front_only));
}

// 7.1
vec3 absorbed(Material material, vec3 throughput) {
    if (has_translucent && has_flag(material, flag_translucent))
        return throughput * (1.0 - material.alpha * (1.0 - material.colour));
    return throughput * material.colour;
}

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

// 7.4: the direction that leaves a translucent surface before fuzz; zero: none. n is the normal on the side that the ray
// comes from, c = -d·n.
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

// 7.3: w perturbed by fuzz; zero: the path ends.
vec3 fuzzed(vec3 w, float fuzz, vec3 n, vec4 u) {
    const vec3 moved = w + fuzz * sample_sphere(u.x, u.y);
    const float length2 = dot(moved, moved);
    if (length2 < 9.094947017729282e-13) return vec3(0.0);  // 2^-40
    return dot(moved, n) * dot(w, n) <= 0.0 ? vec3(0.0) : moved;
}

// What an event does to a path: the next direction, unit, or zero where the path ends; the factor on its throughput
// besides 7.1; the density of the direction, 0 where there is none.
struct Scattering {
    vec3 direction;
    vec3 weight;
    float density;
};
const Scattering no_scattering = Scattering(vec3(0.0), vec3(1.0), 0.0);

// 7.2
Scattering scatter_diffuse(vec3 n_f, vec4 u) {
    vec3 local = sample_cosine_hemisphere(u.x, PLANT(number_exchanged, u.w, u.y));
    if (PLANTED(pdf_not_of_sampler)) local = vec3(sqrt(u.x * (2.0 - u.x)) * cos_sin_turn(u.y), 1.0 - u.x);
    const vec3 direction = normalize(frame_of(n_f) * local);
    // Planted: the density is still that of the cosine rule's direction.
    const float cosine = PLANT(pdf_not_of_sampler, sqrt(1.0 - u.x), dot(direction, n_f));
    return Scattering(direction, vec3(1.0), cosine / pi);
}

// 7.9: as 7.2, but for the weight.
Scattering scatter_rough_diffuse(Material material, vec3 d, vec3 n_f, vec4 u) {
    Scattering scattering = scatter_diffuse(n_f, u);
    if (!PLANTED(rough_diffuse_unweighted))
        scattering.weight = vec3(rough_diffuse_ratio(material.roughness, d, n_f, scattering.direction));
    return scattering;
}

float ggx_alpha(Material material) { return material.roughness * material.roughness; }

// 7.6
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

// The event at a surface. n_f is the normal on the side of the incoming ray, front tells whether that is the front side,
// c = -d·n_f, outside the index beyond the material's own.
Scattering scatter_at(Material material, vec3 d, vec3 n_f, float c, bool front, float outside, vec4 u) {
    if (PLANTED(dimension_reused)) u.y = u.x;
    if (has_diffuse && material.kind == material_diffuse) return scatter_diffuse(n_f, u);
    if (is_rough_diffuse(material)) return scatter_rough_diffuse(material, d, n_f, u);
    if (is_conductor(material))
        return scatter_conductor(material, d, n_f, c, u);
    if (has_boundary && material.kind == material_boundary) {
        if (PLANTED(boundary_refracts)) {
            const float eta = front ? 1.0 / 1.1 : 1.1;
            bool reflects;
            return Scattering(normalize(translucent_direction(material, d, n_f, c, eta, 1.0, reflects)), vec3(1.0), 0.0);
        }
        return Scattering(d, vec3(1.0), 0.0);
    }
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

// How a vertex answers to light from a direction: colour times f_cosine is f |cos theta| (a phase function for a medium),
// density that of scattering into the direction.
struct Response {
    vec3 colour;
    float f_cosine;
    float density;
};

Response diffuse_response(vec3 colour, vec3 n_f, vec3 direction) {
    const float cosine = dot(n_f, direction);
    if (cosine <= 0.0) return Response(colour, 0.0, 0.0);
    const float f_cosine = (PLANTED(inverse_pi_dropped) ? 1.0 : 1.0 / pi) * (PLANTED(cosine_dropped) ? 1.0 : cosine);
    return Response(colour, f_cosine, cosine / pi);
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

Response rough_diffuse_response(Material material, vec3 n_f, vec3 d, vec3 direction) {
    Response response = diffuse_response(material.colour, n_f, direction);
    if (response.f_cosine > 0.0) response.f_cosine *= rough_diffuse_ratio(material.roughness, d, n_f, direction);
    return response;
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
