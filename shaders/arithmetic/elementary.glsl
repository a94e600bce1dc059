// Elementary functions with an error of a few ulp. Vulkan allows its own far more (atan 4096). Kernels that switch between float
// and double have both.
#ifdef IN_DOUBLE
#ifndef ELEMENTARY_IN_DOUBLE_GLSL
#define ELEMENTARY_IN_DOUBLE_GLSL

// As below. The polynomial leaves 0.35^15/15! < 2e-19; below 2^-1000 the result is 0. The high part of ln 2 has 33 bits.
double exp_minus(double x) {
    const double n = floor(min(x, 1000.0) * 1.4426950408889634lf + 0.5);
    const double y = (n * 0.693147180369123816lf - min(x, 1000.0)) + n * 1.90821492927058770e-10lf;  // -f ln 2
    double s = 1.0lf;
    for (double k = 14.0; k > 0.0; k -= 1.0) s = 1.0lf + y / k * s;
    return n > 1000.0 ? 0.0 : s * packDouble2x32(uvec2(0, uint(1023.0 - n) << 20));
}
dvec3 exp_minus(dvec3 x) { return dvec3(exp_minus(x.x), exp_minus(x.y), exp_minus(x.z)); }

// As below; the series leaves 2 |s|^23/23 < 3e-19.
double minus_log(double x) {
    const uvec2 bits = unpackDouble2x32(x);
    const uint lift = (bits.y & 0x000fffffu) > 0x0006a09eu ? 1u : 0u;
    const double e = double(int(bits.y >> 20) - 1023 + int(lift));
    const double m = packDouble2x32(uvec2(bits.x, (bits.y & 0x000fffffu) | ((1023u - lift) << 20)));
    const double s = (m - 1.0) / (m + 1.0), s2 = s * s;
    double series = 0.0;
    for (double k = 21.0; k > 0.0; k -= 2.0) series = 1.0 / k + s2 * series;
    return -(e * 0.693147180559945309lf + 2.0 * s * series);
}

// As below; the series leaves a^47/47 < 3e-20.
double turn_of(double y, double x) {
    const double low = min(abs(x), abs(y)), high = max(abs(x), abs(y));
    if (high == 0.0) return 0.0;
    double a = low / high, angle = 0.0;
    if (a > 0.414213562) {
        a = (a - 1.0) / (a + 1.0);
        angle = 0.125;
    }
    const double a2 = a * a;
    double series = 0.0;
    for (double k = 45.0; k > 0.0; k -= 2.0) series = 1.0 / k - a2 * series;
    angle += a * series * 0.159154943091895336lf;
    if (abs(y) > abs(x)) angle = 0.25 - angle;
    if (x < 0.0) angle = 0.5 - angle;
    return y < 0.0 ? -angle : angle;
}

#endif
#else
#ifndef ELEMENTARY_GLSL
#define ELEMENTARY_GLSL

// e^-x for x >= 0. Let x = (n + f) ln 2 with n a whole number, |f| <= 1/2. The Taylor polynomial of e^(-f ln 2) leaves 0.35^8/8!
// < 6e-9. Below 2^-125 the result is 0. ln 2 is split so that n times its high part is exact.
float exp_minus(float x) {
    const float n = floor(min(x, 200.0) * 1.44269504 + 0.5);
    const float y = (n * 0.693145752 - min(x, 200.0)) + n * 1.42860677e-6;  // -f ln 2
    const float s = 1.0 + y * (1.0 + y * (1.0 / 2.0 + y * (1.0 / 6.0 + y * (1.0 / 24.0 + y * (1.0 / 120.0 +
        y * (1.0 / 720.0 + y * (1.0 / 5040.0)))))));
    return n > 125.0 ? 0.0 : s * uintBitsToFloat(uint(127.0 - n) << 23);
}
vec3 exp_minus(vec3 x) { return vec3(exp_minus(x.x), exp_minus(x.y), exp_minus(x.z)); }

// -ln x for x in [2^-24, 1]. x = 2^e m, m in (0.7, 1.42). ln m = 2 artanh s with s = (m - 1)/(m + 1). The series leaves
// 2 |s|^11/11 < 7e-10.
float minus_log(float x) {
    const uint bits = floatBitsToUint(x);
    const uint lift = (bits & 0x007fffffu) > 0x003504f3u ? 1u : 0u;  // mantissas above sqrt 2 go to the next exponent
    const float e = float(int(bits >> 23) - 127 + int(lift));
    const float m = uintBitsToFloat((bits & 0x007fffffu) | ((127u - lift) << 23));
    const float s = (m - 1.0) / (m + 1.0), s2 = s * s;
    const float log_m =
        2.0 * s + 2.0 * s * s2 * (1.0 / 3.0 + s2 * (1.0 / 5.0 + s2 * (1.0 / 7.0 + s2 * (1.0 / 9.0))));
    return -(e * 0.693147181 + log_m);
}

// atan2(y, x)/(2 pi) in [-1/2, 1/2], 0 for (0, 0). |a| <= tan(pi/8) after the reduction; the series leaves
// a^17/17 < 2e-8.
float turn_of(float y, float x) {
    const float low = min(abs(x), abs(y)), high = max(abs(x), abs(y));
    if (high == 0.0) return 0.0;
    float a = low / high, angle = 0.0;
    if (a > 0.414213562) {
        a = (a - 1.0) / (a + 1.0);
        angle = 0.125;
    }
    const float a2 = a * a;
    const float series = 1.0 + a2 * (-1.0 / 3.0 + a2 * (1.0 / 5.0 + a2 * (-1.0 / 7.0 + a2 * (1.0 / 9.0 +
        a2 * (-1.0 / 11.0 + a2 * (1.0 / 13.0 + a2 * (-1.0 / 15.0)))))));
    angle += a * series * 0.159154943;
    if (abs(y) > abs(x)) angle = 0.25 - angle;
    if (x < 0.0) angle = 0.5 - angle;
    return y < 0.0 ? -angle : angle;
}

#endif

#endif
