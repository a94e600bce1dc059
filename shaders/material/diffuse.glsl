// Diffuse surfaces (MODEL.md section 7.2). n_f is the normal on the side of the incoming ray.
#ifndef DIFFUSE_GLSL
#define DIFFUSE_GLSL
#include "material/scattering.glsl"

Scattering scatter_diffuse(vec3 n_f, vec4 u) {
    vec3 local = sample_cosine_hemisphere(u.x, PLANT(number_exchanged, u.w, u.y));
    if (PLANTED(pdf_not_of_sampler)) local = vec3(sqrt(u.x * (2.0 - u.x)) * cos_sin_turn(u.y), 1.0 - u.x);
    const vec3 direction = normalize(frame_of(n_f) * local);
    return Scattering(direction, vec3(1.0), dot(direction, n_f) / pi);
}

Response diffuse_response(vec3 colour, vec3 n_f, vec3 direction) {
    const float cosine = dot(n_f, direction);
    if (cosine <= 0.0) return Response(colour, 0.0, 0.0);
    const float f_cosine = (PLANTED(inverse_pi_dropped) ? 1.0 : 1.0 / pi) * (PLANTED(cosine_dropped) ? 1.0 : cosine);
    return Response(colour, f_cosine, cosine / pi);
}

#endif
