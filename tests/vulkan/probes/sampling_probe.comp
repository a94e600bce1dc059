// Directions that the samplers of microfacets, media and environments draw, and their densities. Words 0 … 63 of the
// input say which and with what; then come pairs of numbers, one an invocation. Eight words out: direction, density,
// weight.
#version 460
#extension GL_GOOGLE_include_directive : require
layout(local_size_x = 64) in;
layout(std430, set = 0, binding = 0) readonly buffer Input { float tables[]; };
layout(std430, set = 0, binding = 1) writeonly buffer Output { vec4 results[]; };
#include "kernels/effects.glsl"
#include "kernels/planted.glsl"
const float pi = 3.14159265358979;
#include "scene/scene_structs.glsl"
#include "arithmetic/sampling.glsl"
#include "geometry/shapes.glsl"
#include "arithmetic/elementary.glsl"
#include "material/tables.glsl"
#include "material/microfacets.glsl"
#include "light/environment.glsl"
#include "material/media.glsl"

const uint parameters = 64;

void sample_microfacet(vec2 u, out vec3 o, out float density, out float weight) {
    const float alpha = tables[1];
    const vec3 i = vec3(tables[2], tables[3], tables[4]);
    const vec3 h = sample_visible_normal(i, alpha, u);
    o = 2.0 * dot(i, h) * h - i;
    density = microfacet_density(i, h, alpha);
    weight = o.z > 0.0 ? shadowing(i, o, alpha) / shadowing(i, alpha) : 0.0;
}

void main() {
    const uint i = gl_GlobalInvocationID.x;
    const uint at = parameters + 2 * i;
    if (at + 1 >= uint(tables[63])) return;
    const vec2 u = vec2(tables[at], tables[at + 1]);
    const uint what = uint(tables[0]);
    vec3 direction = vec3(0.0);
    float density = 0.0, weight = 0.0;
    if (what == 0) sample_microfacet(u, direction, density, weight);
    if (what == 1) {
        const vec3 d = vec3(tables[2], tables[3], tables[4]);
        direction = sample_phase(tables[1], d, u);
        density = phase(tables[1], dot(d, direction));
    }
    if (what == 2) {
        direction = sample_gradient(tables[1], tables[2], u);
        density = gradient_density(tables[1], tables[2], direction.y);
    }
    if (what == 3) {
        const Environment image = Environment(uvec2(tables[1], tables[2]), uint(tables[3]), uint(tables[4]),
            uint(tables[5]), uint(tables[6]), vec2(tables[7], tables[8]));
        direction = sample_environment(image, u);
        density = environment_density(image, direction);
        weight = environment_radiance(image, direction).r;
    }
    results[2 * i] = vec4(direction, density);
    results[2 * i + 1] = vec4(weight, 0.0, 0.0, 0.0);
}
