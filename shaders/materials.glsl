// Absorption and scattering directions (MODEL.md section 7).
#ifndef MATERIALS_GLSL
#define MATERIALS_GLSL

bool has_flag(Material material, uint flag) { return (material.flags & flag) != 0u; }

bool emits_to(Material material, bool front) {
    return front || !(has_one_sided_emission && has_flag(material, flag_front_only)) || PLANTED(light_from_behind);
}

// 7.1
vec3 absorbed(Material material, vec3 throughput) {
    if (has_translucent && has_flag(material, flag_translucent)) {
        const float alpha = PLANTED(alpha_ignored) ? 1.0 : material.alpha;
        return throughput * (1.0 - alpha * (1.0 - material.colour));
    }
    vec3 colour = material.colour;
#ifdef PLANTED_BUGS
    if (material.kind == material_diffuse && PLANTED(albedo_off_3_percent)) colour *= 1.03;
    if (material.kind == material_diffuse && PLANTED(albedo_off_1_percent)) colour *= 1.01;
#endif
    return throughput * colour;
}

// 7.4: reflectance at cosine c, cosine of the transmitted direction c_t, relative index eta.
float fresnel_exact(float c, float c_t, float eta) {
    const float r_s = (eta * c - c_t) / (eta * c + c_t), r_p = (c - eta * c_t) / (c + eta * c_t);
    return 0.5 * (r_s * r_s + r_p * r_p);
}

float fresnel_schlick(float c, float c_t, float eta) {
    const float root = (1.0 - eta) / (1.0 + eta), r0 = root * root;
    const float x = 1.0 - (eta <= 1.0 ? c : c_t), x2 = x * x;
    return r0 + (1.0 - r0) * (x2 * x2 * x);
}

// 7.4: the direction that leaves a translucent surface before fuzz; zero: none.
vec3 translucent_direction(Material material, vec3 d, vec3 n_f, float c, bool front, float u3) {
    float eta = front ? 1.0 / material.refractive_index : material.refractive_index;
    if (PLANTED(relative_index_inverted)) eta = 1.0 / eta;
    const vec3 mirrored = d + 2.0 * c * n_f;
    precise float sine2 = eta * eta * (1.0 - c * c);
    if (sine2 > 1.0) return PLANTED(total_reflection_lost) ? vec3(0.0) : mirrored;
    const float c_t = sqrt(1.0 - sine2);
    const float reflectance =
        has_schlick && has_flag(material, flag_schlick) ? fresnel_schlick(c, c_t, eta) : fresnel_exact(c, c_t, eta);
    return u3 < reflectance ? mirrored : eta * d + (eta * c - c_t) * n_f;
}

// 7.3: w perturbed by fuzz; zero: the path ends.
vec3 fuzzed(vec3 w, float fuzz, vec3 n, vec4 u) {
    const vec3 moved = w + fuzz * sample_sphere(u.x, u.y);
    const float length2 = dot(moved, moved);
    if (length2 < 9.094947017729282e-13) return vec3(0.0);  // 2^-40
    return dot(moved, n) * dot(w, n) <= 0.0 ? vec3(0.0) : moved;
}

// The next direction, unit, or zero where the path ends. n_f is the normal on the side of the incoming ray, front tells
// whether that is the front side, c = -d·n_f.
vec3 scattered_direction(Material material, vec3 d, vec3 n_f, float c, bool front, vec4 u) {
    if (PLANTED(dimension_reused)) u.y = u.x;
    if (has_diffuse && material.kind == material_diffuse) {
        vec3 local = sample_cosine_hemisphere(u.x, u.y);
        if (PLANTED(pdf_not_of_sampler)) local = vec3(sqrt(u.x * (2.0 - u.x)) * cos_sin_turn(u.y), 1.0 - u.x);
        return normalize(frame_of(n_f) * local);
    }
    if (!has_specular && !has_translucent) return vec3(0.0);
    vec3 w = d + 2.0 * c * n_f;
    if (has_translucent && has_flag(material, flag_translucent))
        w = translucent_direction(material, d, n_f, c, front, u.z);
    if (has_fuzz && material.fuzz > 0.0 && w != vec3(0.0)) w = fuzzed(w, material.fuzz, n_f, u);
    return w == vec3(0.0) ? w : normalize(w);
}

vec3 background(vec3 direction) {
    const vec3 down = scene.background_down, up = scene.background_up;
    if (!has_background_gradient || down == up) return down;
    return mix(down, up, 0.5 * (direction.y + 1.0));
}

#endif
