// Stage 4 (MODEL.md sections 5 and 9.2): the closest hit of every ray of the segment's queue. It also finds whether the
// pending shadow ray of a next event meets anything.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "kernels/settings.glsl"
#include "kernels/pixel_list.glsl"
#define LOOPS_OVER_PRIMITIVES
#include "scene/scene_set.glsl"
#include "kernels/ray_state.glsl"
#define RAY_PARITY (settings.segment & 1u)
#include "kernels/ray_buffers.glsl"
#include "arithmetic/random.glsl"
#include "geometry/time.glsl"
#include "arithmetic/sampling.glsl"
#include "geometry/shapes.glsl"
#include "geometry/closest_hit.glsl"
#include "geometry/occlusion.glsl"

READ_HALF(0, OriginsIn, uvec4, origins_in);
READ_HALF(1, DirectionsIn, vec4, directions_in);
READ_HALF(2, ThroughputsIn, uvec4, throughputs_in);
layout(std430, set = 2, binding = 10) writeonly restrict buffer Hits { uvec4 hits[]; };
layout(std430, set = 2, binding = 11) readonly restrict buffer Shadows { uvec4 shadows[]; };
layout(std430, set = 2, binding = 13) readonly restrict buffer Queues { RayQueue queues[]; };

void main() {
    preload_primitives();
    const uint i = gl_GlobalInvocationID.x;
#ifdef RAYS_IN_PLACE
    if (i >= settings.invocations) return;
#else
    if (i >= queues[settings.segment].count) return;
#endif
    const uvec4 start = origins_in[i];
    const uint word = start.w;
#ifdef RAYS_IN_PLACE
    if ((word & (ray_dead | ray_shadow)) == ray_dead) {
        hits[i] = uvec4(hit_nothing, 0, 0, 0);
        return;
    }
#endif
    const vec3 origin = uintBitsToFloat(start.xyz);
    if (has_entity_motion)
        ray_time = path_time(pixel_at(settings.segment == 0 ? settings.first_invocation + i : throughputs_in[i].w),
            settings.sample_index);
    uint flags = 0;
    if (has_light_sampling && (word & ray_shadow) != 0u) {
        const uvec4 shadow = shadows[i];
        if (is_lit(origin, word, ShadowRay(uintBitsToFloat(shadow.xyz), shadow.w))) flags |= hit_lit;
        if ((word & ray_dead) != 0u) {
            hits[i] = uvec4(hit_ended | flags, 0, 0, 0);
            return;
        }
    }
    const Hit best =
        closest_hit(Ray(origin, directions_in[i].xyz), word & slot_mask, (word & ray_inside) != 0u);
    hits[i] = uvec4(best.slot | best.face << hit_face_shift | flags, floatBitsToUint(best.local));
}
