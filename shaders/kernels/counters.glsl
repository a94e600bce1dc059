// The counters of kernels, by their places in the buffer of set 3. The list of pixels follows them (pixel_list.glsl).
#ifndef COUNTERS_GLSL
#define COUNTERS_GLSL

layout(std430, set = 3, binding = 2) restrict buffer Counters { uint counters[]; };
const uint invalid_samples = 0, unfinished = 1, begun = 2;

#endif
