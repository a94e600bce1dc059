// Set 1, Camera: film and thin lens (MODEL.md section 4). The host prepares the frame: right and up are scaled to half the
// film's width and height at unit distance. A camera in motion has its frame made here, for the moment of each path.
#ifndef CAMERA_GLSL
#define CAMERA_GLSL
#include "geometry/pixel_filter.glsl"

layout(std140, set = 1, binding = 0) uniform Camera {
    vec3 position;
    float lens_radius;
    vec3 forward;
    float focus_distance;
    vec3 film_right;  // h (W/H) r
    float film_width;  // h (W/H)
    vec3 film_up;     // h v
    float film_height;  // h
    vec3 right;
    uint moves;
    vec3 up;
    vec3 view;  // from the position to the target
    vec3 scene_up;
    vec3 position_motion;
    vec3 view_motion;  // that of the target less that of the position
} camera;

// Unit vector, or zero where there is none.
vec3 unit_or_zero(vec3 v) {
    const float length2 = dot(v, v);
    return length2 > 0.0 ? v * inversesqrt(length2) : vec3(0.0);
}

struct CameraFrame {
    vec3 position;
    vec3 forward;
    vec3 film_right;
    vec3 film_up;
    vec3 right;
    vec3 up;
};

CameraFrame camera_frame(float time) {
    if (!has_camera_motion || both(camera.moves == 0, time < 2.0))
        return CameraFrame(
            camera.position, camera.forward, camera.film_right, camera.film_up, camera.right, camera.up);
    const vec3 f = normalize(camera.view + time * camera.view_motion);
    const vec3 r = normalize(cross(f, camera.scene_up)), v = cross(r, f);
    return CameraFrame(camera.position + time * camera.position_motion, f, camera.film_width * r,
        camera.film_height * v, r, v);
}

Ray camera_ray(uvec2 pixel, vec4 u, float time) {
    const CameraFrame frame = camera_frame(time);
    const vec2 in_pixel = place_by_filter(u.xy);
    precise vec2 film = vec2(pixel) + PLANT(film_shifted, in_pixel - planted_amount, in_pixel);
    precise vec2 place = 2.0 * film / vec2(settings.width, settings.height) - 1.0;
    const vec3 q = frame.forward + place.x * frame.film_right - place.y * frame.film_up;
    if (!has_lens || both(camera.lens_radius == 0.0, u.z < 2.0)) return Ray(frame.position, unit_or_zero(q));
    const vec2 lens = camera.lens_radius * sample_disc(PLANT(lens_uneven, u.z * u.z, u.z), u.w);
    const vec3 shift = lens.x * frame.right + lens.y * frame.up;
    return Ray(frame.position + shift, unit_or_zero(camera.focus_distance * q - shift));
}

uvec2 pixel_position(uint pixel) { return uvec2(pixel % settings.width, pixel / settings.width); }

vec4 camera_numbers(uint pixel, uvec2 sample_index) {
    return random_block(settings.seed, pixel, sample_index, block_film_and_lens);
}

#endif
