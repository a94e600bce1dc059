// Stage 3: one camera ray for each pixel of this submission's share (MODEL.md section 4). They are the queue of segment 0. The
// later queues are emptied.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "kernels/settings.glsl"
#include "kernels/pixel_list.glsl"
#include "arithmetic/random.glsl"
#include "geometry/time.glsl"
#include "arithmetic/sampling.glsl"
#include "scene/scene_set.glsl"
#include "kernels/ray_state.glsl"
#define RAY_PARITY 1u
#include "kernels/ray_buffers.glsl"
#include "geometry/shapes.glsl"
#include "geometry/camera.glsl"

WRITTEN_HALF(5, OriginsOut, uvec4, origins_out);
WRITTEN_HALF(6, DirectionsOut, vec4, directions_out);
layout(std430, set = 2, binding = 13) writeonly restrict buffer Queues { RayQueue queues[]; };

void main() {
    const uint i = gl_GlobalInvocationID.x;
    if (i >= settings.invocations) return;
    const uint pixel = pixel_at(settings.first_invocation + i);
    const float time = has_camera_motion ? path_time(pixel, settings.sample_index) : 0.0;
    const Ray ray = camera_ray(pixel_position(pixel), camera_numbers(pixel, settings.sample_index), time);
    origins_out[i] = uvec4(floatBitsToUint(ray.origin), no_slot);
    directions_out[i] = vec4(ray.direction, 0.0);
    if (i == 0) {
        const uint size = gl_WorkGroupSize.x;
        queues[0] = RayQueue((settings.invocations + size - 1) / size, 1, 1, settings.invocations);
    }
    for (uint k = i + 1; k <= settings.bounces + 1; k += settings.invocations) queues[k] = RayQueue(0, 1, 1, 0);
}
