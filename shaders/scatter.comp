// Stage 5, colour and scatter: gathers the light of the hit, absorbs, and spawns the next ray and the shadow ray, or ends
// the path and writes its sample (MODEL.md sections 7 to 9).
#version 460
#extension GL_GOOGLE_include_directive : require
#include "settings.glsl"
#include "random.glsl"
#include "sampling.glsl"
#include "scene_set.glsl"
#include "ray_state.glsl"
#include "shapes.glsl"
#include "surface.glsl"
#include "materials.glsl"
#include "lights.glsl"

layout(std430, set = 2, binding = 0) readonly restrict buffer OriginsIn { uvec4 origins_in[]; };
layout(std430, set = 2, binding = 1) readonly restrict buffer DirectionsIn { vec4 directions_in[]; };
layout(std430, set = 2, binding = 2) readonly restrict buffer ThroughputsIn { uvec4 throughputs_in[]; };
layout(std430, set = 2, binding = 3) readonly restrict buffer RadiancesIn { vec4 radiances_in[]; };
layout(std430, set = 2, binding = 4) readonly restrict buffer ContributionsIn { vec4 contributions_in[]; };
layout(std430, set = 2, binding = 5) writeonly restrict buffer OriginsOut { uvec4 origins_out[]; };
layout(std430, set = 2, binding = 6) writeonly restrict buffer DirectionsOut { vec4 directions_out[]; };
layout(std430, set = 2, binding = 7) writeonly restrict buffer ThroughputsOut { uvec4 throughputs_out[]; };
layout(std430, set = 2, binding = 8) writeonly restrict buffer RadiancesOut { vec4 radiances_out[]; };
layout(std430, set = 2, binding = 9) writeonly restrict buffer ContributionsOut { vec4 contributions_out[]; };
layout(std430, set = 2, binding = 10) readonly restrict buffer Hits { uvec4 hits[]; };
layout(std430, set = 2, binding = 11) writeonly restrict buffer Shadows { uvec4 shadows[]; };
layout(std430, set = 2, binding = 12) writeonly restrict buffer Samples { vec4 samples[]; };
layout(std430, set = 2, binding = 13) restrict buffer Queues { RayQueue queues[]; };

void end_path(uint pixel, vec3 radiance) { samples[pixel] = vec4(radiance, 0.0); }

// A place in the queue of the next segment.
uint enqueue() {
    const uint next = settings.segment + 1, size = gl_WorkGroupSize.x;
    const uint place = atomicAdd(queues[next].count, 1);
    if (place % size == 0) atomicMax(queues[next].groups_x, place / size + 1);
    return place;
}

// W_k of MODEL.md section 9.2: the weight of light that scattering finds. pdf is that of the scattering, 0 after specular.
float scattering_weight(uint i, uint slot, Surface surface, vec3 direction, float pdf) {
    const uint index = placed[slot].light;
    if (index == no_light || pdf == 0.0) return 1.0;
    const Light light = lights[index];
    const uvec4 start = origins_in[i];
    const Receiver receiver =
        Receiver(uintBitsToFloat(start.xyz), start.w & slot_mask, (start.w & ray_inside) != 0u);
    const vec3 offset = surface.point - receiver.point;
    const float cosine = abs(dot(surface.normal, direction));
    return power_heuristic(pdf, light.probability * light_density(light, receiver, dot(offset, offset), cosine));
}

// Roulette after scattering event k + 1 (9.3); false: the path ends.
bool survives(inout vec3 throughput, float u) {
    const float q = min(1.0, max(throughput.r, max(throughput.g, throughput.b)));
    if (u >= q) return false;
    if (!PLANTED(roulette_not_divided)) throughput /= q;
    return true;
}

void main() {
    const uint i = gl_GlobalInvocationID.x;
    const uint k = settings.segment;
    if (i >= queues[k].count) return;
    const uvec4 hit = hits[i];
    const uint slot = hit.x & slot_mask;
    vec3 radiance = vec3(0.0);
    if (carries_radiance && k > 0) radiance = radiances_in[i].rgb;
    if (has_light_sampling && (hit.x & hit_lit) != 0u) radiance += contributions_in[i].rgb;
    const uvec4 carried = k == 0 ? uvec4(floatBitsToUint(vec3(1.0)), i) : throughputs_in[i];
    const uint place = carried.w;  // of the pixel in the tile
    if (has_light_sampling && slot == hit_ended) {
        end_path(place, radiance);
        return;
    }
    vec3 throughput = uintBitsToFloat(carried.rgb);
    const vec4 arriving = directions_in[i];
    const vec3 d = arriving.xyz;
    if (slot == hit_none) {
        end_path(place, has_background ? radiance + throughput * background(d) : radiance);
        return;
    }

    const Surface surface = surface_at(slot, (hit.x >> hit_face_shift) & hit_face_mask, uintBitsToFloat(hit.yzw));
    const Material material = materials[placed[slot].material];
    const bool front = dot(d, surface.normal) < 0.0;
    const vec3 n_f = front ? surface.normal : -surface.normal;
    const float c = min(1.0, -dot(d, n_f));  // a rounding above 1 would make sines negative
    const bool translucent = has_translucent && has_flag(material, flag_translucent);
    const bool emissive = material.kind == material_emissive;
    if (has_emission && material.radiance != vec3(0.0) && emits_to(material, front)) {
        const float share = has_translucent_emission && emissive && translucent ? material.alpha : 1.0;
        const float weight = has_light_sampling ? scattering_weight(i, slot, surface, d, arriving.w) : 1.0;
        radiance += throughput * material.radiance * (share * weight);
    }
    if (k == settings.bounces || (emissive && !translucent)) {
        end_path(place, radiance);
        return;
    }

    const uint pixel = settings.first_pixel + place;
    const bool diffuse = has_diffuse && material.kind == material_diffuse;
    uint word = slot, light_slot = 0;
    vec3 contribution = vec3(0.0), offset = vec3(0.0);
    if (has_light_sampling && diffuse && settings.light_count > 0) {
        const vec3 v = random_block(settings.seed, pixel, settings.sample_index, block_light(k)).xyz;
        const Receiver receiver = Receiver(offset_ray_origin(surface, n_f), slot, !front);
        contribution = throughput * direct_light(receiver, n_f, absorbed(material, vec3(1.0)), v, offset, light_slot);
        if (contribution != vec3(0.0)) word |= ray_shadow;
    }

    const vec4 u = random_block(settings.seed, pixel, settings.sample_index, block_scatter(k));
    const vec3 direction = scattered_direction(material, d, n_f, c, front, u);
    throughput = absorbed(material, throughput);
    bool goes_on = direction != vec3(0.0) && throughput != vec3(0.0);
    if (has_roulette && goes_on && k + 1 >= settings.roulette_start) goes_on = survives(throughput, u.w);
    if (!goes_on && (word & ray_shadow) == 0u) {
        end_path(place, radiance);
        return;
    }
    const bool to_front = goes_on ? dot(direction, surface.normal) > 0.0 : front;
    const vec3 origin = offset_ray_origin(surface, to_front ? surface.normal : -surface.normal);
    if (!to_front) word |= ray_inside;
    if (!goes_on) word |= ray_dead;
    const uint at = enqueue();
    origins_out[at] = uvec4(floatBitsToUint(origin), word);
    throughputs_out[at] = uvec4(floatBitsToUint(throughput), place);
    if (carries_radiance) radiances_out[at] = vec4(radiance, 0.0);
    if (has_light_sampling && (word & ray_shadow) != 0u) {
        contributions_out[at] = vec4(contribution, 0.0);
        shadows[at] = uvec4(floatBitsToUint(offset), light_slot);
    }
    if (goes_on) directions_out[at] = vec4(direction, diffuse ? dot(direction, n_f) / pi : 0.0);
}
