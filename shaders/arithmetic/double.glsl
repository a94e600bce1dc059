// From here on float means double, until single.glsl: the code that follows computes in double. There is no include guard, as
// kernels switch several times. Constants without the suffix lf still round to float. That is enough for exact ones and for
// limits.
#define IN_DOUBLE
#define float double
#define vec2 dvec2
#define vec3 dvec3
#define vec4 dvec4
#define mat3 dmat3
