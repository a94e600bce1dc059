// The means of a frame, from the sums of its samples (kernels/moments.glsl: a sum and its rest come first).
#ifndef MEANS_GLSL
#define MEANS_GLSL

layout(std430, set = 0, binding = 0) readonly restrict buffer Sums { vec4 sums[]; };  // [channel * pixels + pixel]

vec3 means_of(uint pixel) {
    precise vec3 means;
    for (uint channel = 0; channel < 3; ++channel) {
        const vec4 sum = sums[channel * frame.pixels + pixel];
        means[channel] = (sum.x + sum.y) * frame.share;
    }
    return means;
}

#endif
