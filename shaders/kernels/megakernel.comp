// Ray generation, intersection, scattering and post-processing in one kernel. An invocation renders several samples of one pixel,
// with the path and the sums of its samples in registers. When a path ends, the path of the next sample begins in the same
// iteration of the loop. So no invocation waits for the longest path of its subgroup. If a dispatch has fewer invocations than
// pixels, they claim pixels one by one. So none waits for the slowest pixel either. The arithmetic is that of the stages.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#define SHARES_SCENE
#include "kernels/whole_paths.glsl"

void main() {
    preload_primitives();
    const uint launched = gl_NumWorkGroups.x * gl_WorkGroupSize.x, i = gl_GlobalInvocationID.x;
    const uint claimants = launched < settings.invocations ? launched : 0;
    uint place = no_place;
    if (claimants > 0)
        place = claim_place(claimants);
    else if (i < settings.invocations)
        place = place_of(settings.first_invocation + i);
    render_pixels(place, claimants);
}
