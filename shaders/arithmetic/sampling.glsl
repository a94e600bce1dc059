// Shapes from numbers (MODEL.md section 3.1). Without a guard: kernels that go between float and double have both.

#ifdef IN_DOUBLE
// As below; what the polynomials leave, x^19/19! < 9e-20 and x^20/20! < 4e-21, is far below 2^-53.
dvec2 cos_sin_turn(double u) {
    precise double q = floor(4.0 * u + 0.5);
    precise double r = u - 0.25 * q;
    precise double x = 6.283185307179586477lf * r;
    precise double x2 = x * x;
    precise double s = x * (1.0lf - x2 * (1.0lf / 6.0lf) * (1.0lf - x2 * (1.0lf / 20.0lf) * (1.0lf - x2 * (1.0lf /
        42.0lf) * (1.0lf - x2 * (1.0lf / 72.0lf) * (1.0lf - x2 * (1.0lf / 110.0lf) * (1.0lf - x2 * (1.0lf / 156.0lf) *
        (1.0lf - x2 * (1.0lf / 210.0lf) * (1.0lf - x2 * (1.0lf / 272.0lf)))))))));
    precise double c = 1.0lf - x2 * (1.0lf / 2.0lf) * (1.0lf - x2 * (1.0lf / 12.0lf) * (1.0lf - x2 * (1.0lf /
        30.0lf) * (1.0lf - x2 * (1.0lf / 56.0lf) * (1.0lf - x2 * (1.0lf / 90.0lf) * (1.0lf - x2 * (1.0lf / 132.0lf) *
        (1.0lf - x2 * (1.0lf / 182.0lf) * (1.0lf - x2 * (1.0lf / 240.0lf) * (1.0lf - x2 * (1.0lf / 306.0lf)))))))));
    const uint quadrant = uint(q) & 3u;
    const dvec2 turned = (quadrant & 1u) != 0u ? dvec2(-s, c) : dvec2(c, s);
    return quadrant >= 2u ? -turned : turned;
}
#else
// (cos 2 pi u, sin 2 pi u) for u in [0, 1). The reduction is exact: u is a multiple of 2^-24, so are q/4 and r. The Taylor
// polynomials on |x| <= pi/4 leave x^11/11! < 1.8e-9 and x^12/12! < 1.2e-10, far below 2^-24. Their evaluation adds less than 1
// ulp of 1, whether or not fma rounds once.
vec2 cos_sin_turn(float u) {
    precise float q = floor(4.0 * u + 0.5);
    precise float r = u - 0.25 * q;
    precise float x = 6.28318530717959 * r;
    precise float x2 = x * x;
    precise float s = fma(x * x2,
        fma(x2, fma(x2, fma(x2, 1.0 / 362880.0, -1.0 / 5040.0), 1.0 / 120.0), -1.0 / 6.0), x);
    precise float c = fma(x2, fma(x2, fma(x2, fma(x2, fma(x2, -1.0 / 3628800.0, 1.0 / 40320.0), -1.0 / 720.0), 1.0 / 24.0),
        -0.5), 1.0);
    const uint quadrant = uint(q) & 3u;
    const vec2 turned = (quadrant & 1u) != 0u ? vec2(-s, c) : vec2(c, s);
    return quadrant >= 2u ? -turned : turned;
}
#endif

vec2 sample_disc(float a, float b) { return sqrt(a) * cos_sin_turn(b); }

vec3 sample_sphere(float a, float b) {
    return vec3(2.0 * sqrt(a * (1.0 - a)) * cos_sin_turn(b), 1.0 - 2.0 * a);
}

vec3 sample_cosine_hemisphere(float a, float b) { return vec3(sample_disc(a, b), sqrt(1.0 - a)); }

// Orthonormal frame (tangent, bitangent, n) [Duff 2017].
mat3 frame_of(vec3 n) {
    const float side = n.z >= 0.0 ? 1.0 : -1.0;
    const float a = -1.0 / (side + n.z);
    const float b = n.x * n.y * a;
    return mat3(vec3(1.0 + side * n.x * n.x * a, side * b, -side * n.x), vec3(b, side + n.y * n.y * a, -n.y), n);
}
