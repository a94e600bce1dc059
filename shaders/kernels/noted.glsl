// What trace.comp writes down of a vertex beside the path's state: NOTE(field, value). In kernels that render it is nothing.
#ifndef NOTED_GLSL
#define NOTED_GLSL
#ifdef RECORDS_PATHS
#include "arithmetic/real.glsl"

// TracedVertex of common/render/path_trace.h.
struct Noted {
    vec3 shading_normal, light_radiance, light_response, light_transmittance;
    float light_pdf, light_weight, found_weight, survival;
};
Noted noted;
#define NOTE(field, value) noted.field = as_float(value)
#else
#define NOTE(field, value)
#endif
#endif
