// Stage 5, colour and scatter (MODEL.md sections 7 to 9). It gathers the light of the hit and absorbs. It then spawns
// the next ray and the shadow ray, or ends the path and writes its sample.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "kernels/settings.glsl"
#include "kernels/pixel_list.glsl"
#include "arithmetic/random.glsl"
#include "geometry/time.glsl"
#include "arithmetic/sampling.glsl"
#include "scene/scene_set.glsl"
#include "kernels/ray_state.glsl"
#define RAY_PARITY (settings.segment & 1u)
#include "kernels/ray_buffers.glsl"
#include "geometry/shapes.glsl"
#include "geometry/surface.glsl"
#include "arithmetic/elementary.glsl"
#include "material/tables.glsl"
#include "material/noise.glsl"
#include "material/textures.glsl"
#include "material/materials.glsl"
#include "light/environment.glsl"
#include "light/background.glsl"
#include "material/media.glsl"
#include "geometry/interiors.glsl"
#include "light/lights.glsl"
#include "kernels/vertex_events.glsl"

READ_HALF(0, OriginsIn, uvec4, origins_in);
READ_HALF(1, DirectionsIn, vec4, directions_in);
READ_HALF(2, ThroughputsIn, uvec4, throughputs_in);
#ifdef HALF_STATE
#include "kernels/half_state.glsl"
READ_HALF(4, ContributionsIn, uvec2, contributions_in);
#else
READ_HALF(3, RadiancesIn, vec4, radiances_in);
READ_HALF(4, ContributionsIn, vec4, contributions_in);
#endif
WRITTEN_HALF(5, OriginsOut, uvec4, origins_out);
WRITTEN_HALF(6, DirectionsOut, vec4, directions_out);
WRITTEN_HALF(7, ThroughputsOut, uvec4, throughputs_out);
#ifdef HALF_STATE
WRITTEN_HALF(9, ContributionsOut, uvec2, contributions_out);
#else
WRITTEN_HALF(8, RadiancesOut, vec4, radiances_out);
WRITTEN_HALF(9, ContributionsOut, vec4, contributions_out);
#endif
layout(std430, set = 2, binding = 10) readonly restrict buffer Hits { uvec4 hits[]; };
layout(std430, set = 2, binding = 11) writeonly restrict buffer Shadows { uvec4 shadows[]; };
layout(std430, set = 2, binding = 12) writeonly restrict buffer Samples { vec4 samples[]; };
layout(std430, set = 2, binding = 13) restrict buffer Queues { RayQueue queues[]; };
READ_HALF(14, InteriorsIn, uvec4, interiors_in);
WRITTEN_HALF(15, InteriorsOut, uvec4, interiors_out);
#ifdef SUMS_AT_PATH_END
#include "kernels/film.glsl"
layout(std430, set = 3, binding = 0) restrict buffer PixelSums { Sums pixel_sums[]; };
#include "kernels/counters.glsl"
#endif

// Without a primitive and shadow rays there is no intersect stage: every ray leaves the scene.
#ifdef RAYS_IN_PLACE
const bool reads_hits = true;
#else
const bool reads_hits = has_triangles || has_spheres || has_cuboids || has_light_sampling;
#endif

// A place in the queue of the next segment.
uint enqueue() {
#ifdef RAYS_IN_PLACE
    return gl_GlobalInvocationID.x;
#endif
    const uint next = settings.segment + 1, size = gl_WorkGroupSize.x;
    const uint place = atomicAdd(queues[next].count, 1);
    if (place % size == 0) atomicMax(queues[next].groups_x, place / size + 1);
    return place;
}

// Nothing is at this invocation's place any more, which in queues nobody would look at.
void leave_place() {
#ifdef RAYS_IN_PLACE
    origins_out[gl_GlobalInvocationID.x] = uvec4(0, 0, 0, ray_dead);
#endif
}

// The sample of the pixel at this place is done: it goes to the stage that adds samples up, or to the sums at once.
void finish(uint place, vec3 radiance) {
#ifdef SUMS_AT_PATH_END
    bool invalid;
    const vec3 added = summand(radiance, invalid);
    if (invalid) atomicAdd(counters[invalid_samples], 1);
    for (uint channel = 0; channel < 3; ++channel) {
        const uint at = channel * settings.pixel_count + place;
        pixel_sums[at] = add_sample(pixel_sums[at], added[channel]);
    }
#else
    samples[place] = vec4(radiance, 0.0);
#endif
    leave_place();
}

// What a path carries besides its ray.
struct Carried {
    vec3 throughput, radiance;
    uint place;
};

Carried carried_to(uint i, bool lit) {
    if (settings.segment == 0) return Carried(vec3(1.0), vec3(0.0), settings.first_invocation + i);
    const uvec4 words = throughputs_in[i];
#ifdef HALF_STATE
    Carried carried = Carried(throughput_of(words.xyz), radiance_of(words.xyz), words.w);
    if (lit) carried.radiance += light_of(contributions_in[i]);
#else
    Carried carried = Carried(uintBitsToFloat(words.rgb), vec3(0.0), words.w);
    if (carries_radiance) carried.radiance = radiances_in[i].rgb;
    if (lit) carried.radiance += contributions_in[i].rgb;
#endif
    return carried;
}

void carry(uint at, Path path, uint place) {
#ifdef HALF_STATE
    throughputs_out[at] = uvec4(in_halves(path.throughput, path.radiance), place);
#else
    throughputs_out[at] = uvec4(floatBitsToUint(path.throughput), place);
    if (carries_radiance) radiances_out[at] = vec4(path.radiance, 0.0);
#endif
}

// Ends the path or puts it into the queue of the next segment. place: of the pixel in the tile.
void depart(uint place, Path path, Departure leaving) {
    const bool onwards = goes_on(leaving), shadow = has_shadow(leaving);
    if (!onwards && !shadow) {
        finish(place, path.radiance);
        return;
    }
    const uint at = enqueue();
    const uint word = leaving.word | (shadow ? ray_shadow : 0) | (onwards ? 0 : ray_dead);
    origins_out[at] = uvec4(floatBitsToUint(leaving.origin), word);
    carry(at, path, place);
    if (shadow) {
#ifdef HALF_STATE
        contributions_out[at] = in_halves(leaving.contribution);
#else
        contributions_out[at] = vec4(leaving.contribution, 0.0);
#endif
        shadows[at] = uvec4(floatBitsToUint(leaving.shadow.offset), leaving.shadow.word);
    }
    if (has_interiors) interiors_out[at] = path.bodies;
    if (onwards) directions_out[at] = vec4(leaving.direction, leaving.density);
}

void main() {
    const uint i = gl_GlobalInvocationID.x;
    const uint k = settings.segment;
#ifdef RAYS_IN_PLACE
    if (i >= settings.invocations) return;
#else
    if (i >= queues[k].count) return;
#endif
    const uvec4 hit = reads_hits ? hits[i] : uvec4(hit_none, 0, 0, 0);
    const uint slot = hit.x & slot_mask;
#ifdef RAYS_IN_PLACE
    if (slot == hit_nothing) {
        leave_place();
        return;
    }
#endif
    const Carried carried = carried_to(i, has_light_sampling && (hit.x & hit_lit) != 0u);
    const uint place = carried.place, pixel = pixel_at(place);
    if (has_light_sampling && slot == hit_ended) {
        finish(place, carried.radiance);
        return;
    }
    const uvec4 start = keeps_origin ? origins_in[i] : uvec4(0);
    const vec4 arriving = directions_in[i];
    const uvec4 bodies = has_interiors && k > 0 ? interiors_in[i] : in_no_body;
    Path path = Path(pixel, settings.sample_index, k, carried.throughput, carried.radiance,
        uintBitsToFloat(start.xyz), start.w, arriving.xyz, arriving.w, bodies, no_index);
    const Departure leaving = arrive(path,
        Hit(0.0, slot, (hit.x >> hit_face_shift) & hit_face_mask, uintBitsToFloat(hit.yzw)),
        has_entity_motion ? path_time(pixel, settings.sample_index) : 0.0);
    depart(place, path, leaving);
}
