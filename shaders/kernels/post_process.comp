// Stage 6: adds the finished sample of every pixel to the sums of its block (MODEL.md sections 10 and 11). In the
// thesis's frame paths add to the sums as they end. There it runs once and writes the means to the image that is shown.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "kernels/settings.glsl"
#include "kernels/film.glsl"

layout(std430, set = 3, binding = 0) readonly restrict buffer SumsIn { Sums sums_in[]; };
#ifdef WRITES_IMAGE
#ifdef PARAMETERS_UNIFORM
#define IMAGE_SET 5
#else
#define IMAGE_SET 4
#endif
layout(set = IMAGE_SET, binding = 0) uniform writeonly restrict image2D frame;

float mean(Sums sums) {
#ifdef SUMS_IN_DOUBLE
    return float(sums.x / double(settings.sample_count));
#else
    return (sums.x + sums.y) / float(settings.sample_count);
#endif
}
#else
layout(std430, set = 2, binding = 12) readonly restrict buffer Samples { vec4 samples[]; };
layout(std430, set = 3, binding = 1) writeonly restrict buffer SumsOut { Sums sums_out[]; };
#include "kernels/counters.glsl"
#endif

void main() {
    const uint i = gl_GlobalInvocationID.x;
    if (i >= settings.pixel_count) return;
#ifdef WRITES_IMAGE
    vec3 means;
    for (uint channel = 0; channel < 3; ++channel)
        means[channel] = mean(sums_in[channel * settings.pixel_count + i]);
    const uint pixel = settings.first_pixel + i;
    imageStore(frame, ivec2(pixel % settings.width, pixel / settings.width), vec4(means, 1.0));
#else
    bool invalid;
    const vec3 radiance = summand(samples[i].rgb, invalid);
    if (invalid) atomicAdd(counters[invalid_samples], 1);
    for (uint channel = 0; channel < 3; ++channel) {
        const uint at = channel * settings.pixel_count + i;
        sums_out[at] = add_sample(sums_in[at], radiance[channel]);
    }
#endif
}
