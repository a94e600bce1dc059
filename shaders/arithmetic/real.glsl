// Conversions between geometry and shading, which may differ in precision. Mixed precision (MODEL.md section 5.3) is
// DOUBLE_GEOMETRY alone. Double precision is DOUBLE_GEOMETRY and DOUBLE_SHADING.
#ifndef REAL_GLSL
#define REAL_GLSL

#ifdef DOUBLE_GEOMETRY
#define real double
#define real3 dvec3
float as_float(double x) { return float(x); }
vec3 as_float(dvec3 v) { return vec3(v); }
#else
#define real float
#define real3 vec3
#define as_float(x) (x)
#endif

#ifdef DOUBLE_SHADING
#define shading_real double
#define shading_real3 dvec3
#else
#define shading_real float
#define shading_real3 vec3
#endif

// What geometry gives, as shading computes.
#if defined(DOUBLE_GEOMETRY) && !defined(DOUBLE_SHADING)
float shaded(double x) { return float(x); }
vec2 shaded(dvec2 v) { return vec2(v); }
vec3 shaded(dvec3 v) { return vec3(v); }
float as_float(float x) { return x; }
vec3 as_float(vec3 v) { return v; }
#else
#define shaded(x) (x)
#endif

#endif
