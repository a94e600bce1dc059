// Whole paths, an invocation a pixel. It computes what an invocation of the megakernel does, but finds hits by ray queries.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#extension GL_EXT_ray_query : require
#define RAY_TRACING
#define RAY_QUERY
#include "kernels/whole_paths.glsl"

void main() {
    const uint i = gl_GlobalInvocationID.x;
    render_pixels(i < settings.invocations ? place_of(settings.first_invocation + i) : no_place, 0);
}
