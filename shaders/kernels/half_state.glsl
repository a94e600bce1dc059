// What a path carries between kernels, in half precision (MODEL.md section 5.3). Throughput and gathered radiance are the
// first three words of `throughputs`. Two words are the light that a shadow ray would bring.
#ifndef HALF_STATE_GLSL
#define HALF_STATE_GLSL

const float greatest_half = 65504.0;

// The nearest half, ties to even, as a float: packHalf2x16 then has nothing to round, which drivers do in ways of their
// own. Finite values beyond the greatest half become that. Below 2^-14 halves are coarser, and there drivers do round.
vec3 nearest_half(vec3 values) {
    const uvec3 bits = floatBitsToUint(values);
    const vec3 rounded = uintBitsToFloat((bits + 0xFFFu + (bits >> 13 & 1u)) & ~uvec3(0x1FFFu));
    const bvec3 beyond = greaterThan(abs(rounded), vec3(greatest_half)), finite = not(isinf(values));
    vec3 result;
    for (int i = 0; i < 3; ++i)
        result[i] = isnan(values[i]) ? values[i] : beyond[i] && finite[i] ? sign(values[i]) * greatest_half : rounded[i];
    return result;
}

uvec3 in_halves(vec3 throughput, vec3 radiance) {
    const vec3 t = nearest_half(throughput), r = nearest_half(radiance);
    return uvec3(packHalf2x16(t.rg), packHalf2x16(vec2(t.b, r.r)), packHalf2x16(r.gb));
}
uvec2 in_halves(vec3 light) {
    const vec3 l = nearest_half(light);
    return uvec2(packHalf2x16(l.rg), packHalf2x16(vec2(l.b, 0.0)));
}
vec3 throughput_of(uvec3 words) { return vec3(unpackHalf2x16(words.x), unpackHalf2x16(words.y).x); }
vec3 radiance_of(uvec3 words) { return vec3(unpackHalf2x16(words.y).y, unpackHalf2x16(words.z)); }
vec3 light_of(uvec2 words) { return vec3(unpackHalf2x16(words.x), unpackHalf2x16(words.y).x); }

#endif
