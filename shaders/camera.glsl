// Set 1, Camera: film and thin lens (MODEL.md section 4). The host prepares the frame: right and up are scaled to half the
// film's width and height at unit distance.
#ifndef CAMERA_GLSL
#define CAMERA_GLSL

layout(std140, set = 1, binding = 0) uniform Camera {
    vec3 position;
    float lens_radius;
    vec3 forward;
    float focus_distance;
    vec3 film_right;  // h (W/H) r
    vec3 film_up;     // h v
    vec3 right;
    vec3 up;
} camera;

// Unit vector, or zero where there is none.
vec3 unit_or_zero(vec3 v) {
    const float length2 = dot(v, v);
    return length2 > 0.0 ? v * inversesqrt(length2) : vec3(0.0);
}

Ray camera_ray(uvec2 pixel, vec4 u) {
    precise vec2 film = vec2(pixel) + (PLANTED(half_pixel_shift) ? u.xy - 0.5 : u.xy);
    precise vec2 place = 2.0 * film / vec2(settings.width, settings.height) - 1.0;
    const vec3 q = camera.forward + place.x * camera.film_right - place.y * camera.film_up;
    if (!has_lens || camera.lens_radius == 0.0) return Ray(camera.position, unit_or_zero(q));
    const float radius = PLANTED(lens_radius_doubled) ? 2.0 * camera.lens_radius : camera.lens_radius;
    const vec2 lens = radius * sample_disc(u.z, u.w);
    const vec3 shift = lens.x * camera.right + lens.y * camera.up;
    return Ray(camera.position + shift, unit_or_zero(camera.focus_distance * q - shift));
}

#endif
