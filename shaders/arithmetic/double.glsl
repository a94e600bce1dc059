// From here on float means double, until single.glsl: what follows computes in double by the same text. Without a guard, as
// kernels go to and fro. Constants without the suffix lf still round to float, which is enough where they are exact or mere
// limits.
#define IN_DOUBLE
#define float double
#define vec2 dvec2
#define vec3 dvec3
#define vec4 dvec4
#define mat3 dmat3
