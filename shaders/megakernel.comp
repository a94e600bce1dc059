// Ray generation, intersection, scattering and post-processing in one kernel: an invocation renders several samples of one
// pixel, with the path and the sums of its samples in registers. Where a path ends, the next sample's begins in the same
// turn of the loop, so that no invocation waits for the longest path of its subgroup. The arithmetic is that of the stages.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "whole_paths.glsl"

void main() {
    preload_primitives();
    if (gl_GlobalInvocationID.x >= settings.invocations) return;
    render_pixel(place_of(settings.first_invocation + gl_GlobalInvocationID.x));
}
