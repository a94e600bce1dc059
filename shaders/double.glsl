// From here on float means double: the geometry of double.glsl's includers computes in double by the same text.
// Constants without the suffix lf still round to float, which is enough where they are exact or mere limits.
#ifndef DOUBLE_GLSL
#define DOUBLE_GLSL
#define float double
#define vec2 dvec2
#define vec3 dvec3
#define vec4 dvec4
#define mat3 dmat3
#endif
