// A frame's means as they are shown: 8 bits a channel, encoded as sRGB (IEC 61966-2-1). A table of steps gives every
// kind of shader on every device the same bits.
#ifndef SHOWN_GLSL
#define SHOWN_GLSL

layout(push_constant) uniform Frame {
    uint width, pixels;
    float share;  // of a sample in the mean
} frame;
layout(constant_id = 0) const bool swaps_channels = false;  // blue comes first in memory

// From which value on a channel is 1, 2, … 255.
layout(std430, set = 0, binding = 1) readonly restrict buffer Steps { float steps[]; };

uint encoded(float value) {
    uint code = 0;
    for (uint jump = 128; jump > 0; jump >>= 1)
        if (steps[code + jump - 1] <= value) code += jump;
    return code;
}

uvec3 encoded(vec3 means) {
    const uvec3 codes = uvec3(encoded(means.r), encoded(means.g), encoded(means.b));
    return swaps_channels ? codes.bgr : codes;
}

vec4 shown(vec3 means) { return vec4(vec3(encoded(means)) / 255.0, 1.0); }

#endif
