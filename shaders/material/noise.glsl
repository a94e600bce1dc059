// Perlin's noise over integer hashes (MODEL.md section 7.0) [Perlin 1985; Jarzynski 2020].
#ifndef NOISE_GLSL
#define NOISE_GLSL

uvec3 pcg3d(uvec3 v) {
    v = v * 1664525u + 1013904223u;
    v.x += v.y * v.z;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v ^= v >> 16u;
    v.x += v.y * v.z;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    return v;
}

// A whole number modulo 2^32, exactly: its magnitude first, as 2^32 less a small number is no float.
uvec3 lattice(vec3 cell) {
    const vec3 magnitude = abs(cell);
    const uvec3 words = uvec3(magnitude - 4294967296.0 * floor(magnitude * 2.3283064365386963e-10));
    return mix(words, 0u - words, lessThan(cell, vec3(0.0)));
}

float corner_slope(uvec3 corner, vec3 offset) {
    return dot(vec3(pcg3d(corner) >> 8) * 1.1920928955078125e-7 - 1.0, offset);  // 2 u - 1
}

float perlin_noise(vec3 q, uint seed) {
    const vec3 cell = floor(q), r = q - cell, w = r * r * (3.0 - 2.0 * r);
    const uvec3 c = lattice(cell) + uvec3(seed, 0, 0);
    vec4 along_z[2];  // corners (0, 0), (1, 0), (0, 1), (1, 1) in x, y
    for (uint z = 0; z < 2; ++z)
        for (uint i = 0; i < 4; ++i) {
            const uvec3 k = uvec3(i & 1u, i >> 1, z);
            along_z[z][i] = corner_slope(c + k, r - vec3(k));
        }
    const vec4 xy = mix(along_z[0], along_z[1], w.z);
    const vec2 x = mix(xy.xy, xy.zw, w.y);
    return mix(x.x, x.y, w.x);
}

float turbulence(vec3 q, uint seed, uint octaves) {
    float sum = 0.0, share = 1.0;
    for (uint i = 0; i < octaves; ++i) {
        sum += share * perlin_noise(q / share, seed);
        share *= 0.5;
    }
    return abs(sum);
}

#endif
