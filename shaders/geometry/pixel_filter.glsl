// The place of a sample on the film within its pixel's filter (MODEL.md section 4.1).
#ifndef PIXEL_FILTER_GLSL
#define PIXEL_FILTER_GLSL
#include "arithmetic/elementary.glsl"
#include "kernels/planted.glsl"

layout(constant_id = id_pixel_filter) const uint pixel_filter = 0;  // PixelFilter of common/render/renderer.h
const uint tent_filter = 1, gaussian_filter = 2;

// Phi(-3), which is cut off on either side.
#ifdef IN_DOUBLE
const double gaussian_tail = 0.0013498980316300945lf;

// erf(sqrt(2) t) for t in [0, 1.6], by its Taylor series; what follows is below (2 t^2)^37/37!/75 < 1e-19.
double gaussian_within(double t) {
    const double square = 2.0 * t * t;
    double sum = 1.0 / 73.0lf;
    for (double k = 36.0; k > 0.0; k -= 1.0) sum = 1.0 / (2.0 * k - 1.0) - square / k * sum;
    return 1.5957691216057307118lf * t * sum;
}
#else
const float gaussian_tail = 0.00134989803;
#endif

// The t in [0, 1.5] beyond which a Gaussian of standard deviation 1/2 has the share `beyond`: erfinv(1 - 2 beyond)/sqrt(2),
// to 4e-7 of its value. [Giles 2011, single precision] In double a step of Newton's method leaves 2 t (5e-7)^2 < 1e-12.
float gaussian_distance(float beyond) {
    const float x = 1.0 - 2.0 * beyond;
    const float w = minus_log(4.0 * beyond * (1.0 - beyond));
    const float near = w - 2.5, far = sqrt(w) - 3.0;
    const float s = w < 5.0 ?
        1.50140941 + near * (0.246640727 + near * (-0.00417768164 + near * (-0.00125372503 + near * (0.00021858087 + near *
        (-4.39150654e-06 + near * (-3.5233877e-06 + near * (3.43273939e-07 + near * 2.81022636e-08))))))) :
        2.83297682 + far * (1.00167406 + far * (0.00943887047 + far * (-0.0076224613 + far * (0.00573950773 + far *
        (-0.00367342844 + far * (0.00134932322 + far * (0.000100950558 + far * -0.000200214257)))))));
    const float t = 0.707106781 * x * s;
#ifdef IN_DOUBLE
    return t + (x - gaussian_within(t)) / (1.5957691216057307118lf * exp_minus(2.0 * t * t));
#else
    return t;
#endif
}

// From a pixel's left and upper edges, in pixels. Rising in each number.
vec2 place_by_filter(vec2 u) {
    if (pixel_filter == 0) return u;
    const vec2 rest = min(u, 1.0 - u);
    vec2 away = pixel_filter == tent_filter ?
        1.0 - sqrt(2.0 * rest) :
        vec2(gaussian_distance(gaussian_tail + (1.0 - 2.0 * gaussian_tail) * rest.x),
            gaussian_distance(gaussian_tail + (1.0 - 2.0 * gaussian_tail) * rest.y));
    away = PLANT_SCALE(filter_width_scaled, PLANT(filter_even, (pixel_filter == tent_filter ? 2.0 : 3.0) * (0.5 - rest), away));
    const vec2 middle = vec2(PLANT(filter_off_centre, 0.0, 0.5));
    return middle + vec2(u.x < 0.5 ? -away.x : away.x, u.y < 0.5 ? -away.y : away.y);
}

#endif
