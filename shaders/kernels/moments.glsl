// Sums of samples (MODEL.md section 11.2), in double if the device has doubles. Else they are unevaluated sums of two floats,
// exact to about 2^-46, nearly the accuracy of double. Plain sums in float are used on request. [Dekker 1971; Knuth, The Art of
// Computer Programming 2, 4.2.2]
#ifndef MOMENTS_GLSL
#define MOMENTS_GLSL

#include "made/constant_ids.glsl"

// a + b = x + y exactly.
vec2 two_sum(float a, float b) {
    precise float x = a + b;
    precise float b_part = x - a;
    precise float a_part = x - b_part;
    precise float y = (a - a_part) + (b - b_part);
    return vec2(x, y);
}

// a * a = x + y exactly, by Dekker's splitting; fma need not be fused in Vulkan.
vec2 two_square(float a) {
    precise float scaled = 4097.0 * a;  // 2^12 + 1
    precise float high = scaled - (scaled - a);
    precise float low = a - high;
    precise float x = a * a;
    precise float y = ((high * high - x) + 2.0 * high * low) + low * low;
    return vec2(x, y);
}

vec2 add_to_pair(vec2 pair, vec2 addend) {
    const vec2 sum = two_sum(pair.x, addend.x);
    precise float rest = sum.y + (pair.y + addend.y);
    return two_sum(sum.x, rest);
}

#ifdef SUMS_IN_DOUBLE
// (sum, sum of squares) with sample x added.
#define Sums dvec2
dvec2 add_sample(dvec2 moments, float x) {
    const double wide = double(x);
    precise dvec2 sums = moments + dvec2(wide, wide * wide);
    return sums;
}
#else
// Single precision: no rests.
layout(constant_id = id_plain_sums) const bool plain_sums = false;

// (sum, its rest, sum of squares, its rest) with sample x added.
#define Sums vec4
vec4 add_sample(vec4 moments, float x) {
    if (plain_sums) {
        precise float square = x * x;
        precise vec2 sums = moments.xz + vec2(x, square);
        return vec4(sums.x, 0.0, sums.y, 0.0);
    }
    return vec4(add_to_pair(moments.xy, vec2(x, 0.0)), add_to_pair(moments.zw, two_square(x)));
}
#endif

#endif
