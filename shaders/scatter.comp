// Stage 5, colour and scatter: gathers the light of the hit, absorbs, and spawns the next ray and the shadow ray, or ends
// the path and writes its sample (MODEL.md sections 7 to 9).
#version 460
#extension GL_GOOGLE_include_directive : require
#include "settings.glsl"
#include "random.glsl"
#include "time.glsl"
#include "sampling.glsl"
#include "scene_set.glsl"
#include "ray_state.glsl"
#include "shapes.glsl"
#include "surface.glsl"
#include "elementary.glsl"
#include "tables.glsl"
#include "noise.glsl"
#include "textures.glsl"
#include "materials.glsl"
#include "environment.glsl"
#include "background.glsl"
#include "media.glsl"
#include "interiors.glsl"
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
layout(std430, set = 2, binding = 14) readonly restrict buffer InteriorsIn { uvec2 interiors_in[]; };
layout(std430, set = 2, binding = 15) writeonly restrict buffer InteriorsOut { uvec2 interiors_out[]; };

// A path where its ray has arrived.
struct Path {
    uint index;  // in the segment's queue
    uint place;  // of the pixel in the tile
    vec3 throughput;
    vec3 radiance;   // gathered so far
    vec3 direction;  // of the ray
    float density;   // of the scattering that chose it; 0: none
    uvec2 bodies;    // that the ray is in (shaders/interiors.glsl)
    uint medium;     // that the ray is in, or no_index
};

// What leaves a vertex: a ray, a shadow ray or both.
struct Departure {
    vec3 origin;
    uint word;  // of the ray (shaders/ray_state.glsl), but for ray_dead and ray_shadow
    vec3 direction;  // zero: the path ends
    float density;
    vec3 contribution;  // zero: no shadow ray
    vec3 shadow_offset;
    uint shadow_word;
};

void end_path(uint pixel, vec3 radiance) { samples[pixel] = vec4(radiance, 0.0); }

// A place in the queue of the next segment.
uint enqueue() {
    const uint next = settings.segment + 1, size = gl_WorkGroupSize.x;
    const uint place = atomicAdd(queues[next].count, 1);
    if (place % size == 0) atomicMax(queues[next].groups_x, place / size + 1);
    return place;
}

// W_k of MODEL.md section 9.2: the weight of light that scattering finds.
float scattering_weight(Path path, uint slot, Surface surface) {
    const uint index = placed[slot].light;
    if (index == no_light || path.density == 0.0) return 1.0;
    const Light light = lights[index];
    const uvec4 start = origins_in[path.index];
    const vec3 point = uintBitsToFloat(start.xyz);
    const Receiver receiver = Receiver(point, point, start.w & slot_mask, (start.w & ray_inside) != 0u);
    const vec3 offset = surface.point - receiver.point;
    const float cosine = abs(dot(surface.normal, path.direction));
    return power_heuristic(
        path.density, light.probability * light_density(light, receiver, dot(offset, offset), cosine));
}

void leave_scene(Path path) {
    if (has_background) {
        float weight = 1.0;
        if (has_sampled_background && path.density > 0.0 && scene.background_probability > 0.0)
            weight = power_heuristic(
                path.density, scene.background_probability * background_density(path.direction));
        path.radiance += path.throughput * background(path.direction) * weight;
    }
    end_path(path.place, path.radiance);
}

// Roulette after scattering event k + 1 (9.3); false: the path ends.
bool survives(inout vec3 throughput, float u) {
    const float q = min(1.0, max(throughput.r, max(throughput.g, throughput.b)));
    if (u >= q) return false;
    if (!PLANTED(roulette_not_divided)) throughput /= q;
    return true;
}

// Ends the path or puts it into the queue of the next segment.
void depart(Path path, Departure leaving) {
    const bool goes_on = leaving.direction != vec3(0.0);
    const bool shadow = has_light_sampling && leaving.contribution != vec3(0.0);
    if (!goes_on && !shadow) {
        end_path(path.place, path.radiance);
        return;
    }
    const uint at = enqueue();
    const uint word = leaving.word | (shadow ? ray_shadow : 0) | (goes_on ? 0 : ray_dead);
    origins_out[at] = uvec4(floatBitsToUint(leaving.origin), word);
    throughputs_out[at] = uvec4(floatBitsToUint(path.throughput), path.place);
    if (carries_radiance) radiances_out[at] = vec4(path.radiance, 0.0);
    if (shadow) {
        contributions_out[at] = vec4(leaving.contribution, 0.0);
        shadows[at] = uvec4(floatBitsToUint(leaving.shadow_offset), leaving.shadow_word);
    }
    if (has_interiors) interiors_out[at] = path.bodies;
    if (goes_on) directions_out[at] = vec4(leaving.direction, leaving.density);
}

vec3 light_numbers(Path path) {
    return random_block(settings.seed, settings.first_pixel + path.place, settings.sample_index,
        block_light(settings.segment)).xyz;
}

vec4 scatter_numbers(Path path) {
    return random_block(
        settings.seed, settings.first_pixel + path.place, settings.sample_index, block_scatter(settings.segment));
}

// What remains of the light on its way through the medium at the vertex (9.2).
vec3 dimmed(Path path, Incident incident, Receiver receiver) {
    if (!has_medium_absorption || path.medium == no_index) return vec3(1.0);
    return transmittance(media[path.medium], Ray(receiver.surface, incident.direction), incident.distance);
}

void aim_shadow_ray(Path path, Incident incident, Receiver receiver, Response response, inout Departure leaving) {
    if (response.f_cosine <= 0.0) return;
    leaving.contribution = path.throughput * answered_light(incident, response) * dimmed(path, incident, receiver);
    leaving.shadow_offset = incident.offset;
    leaving.shadow_word = incident.shadow_word;
}

// 9.3, where it applies; zero: the path ends.
vec3 after_roulette(inout Path path, vec3 direction, float u) {
    if (direction == vec3(0.0) || path.throughput == vec3(0.0)) return vec3(0.0);
    if (has_roulette && settings.segment + 1 >= settings.roulette_start && !survives(path.throughput, u))
        return vec3(0.0);
    return direction;
}

bool ends_here() { return has_direct_only && settings.direct_only != 0; }

// A vertex within the medium of the ray (10).
void meet_medium(Path path, vec3 point) {
    if (settings.segment == settings.bounces) {
        end_path(path.place, path.radiance);
        return;
    }
    const Medium medium = media[path.medium];
    Departure leaving = Departure(point, no_slot, vec3(0.0), 0.0, vec3(0.0), vec3(0.0), 0);
    if (has_light_sampling && settings.light_count > 0) {
        const Receiver receiver = Receiver(point, point, no_slot, false);
        const Incident incident = incident_light(receiver, light_numbers(path));
        if (incident.radiance != vec3(0.0))
            aim_shadow_ray(
                path, incident, receiver, medium_response(medium, path.direction, incident.direction), leaving);
    }
    if (!ends_here()) {
        const vec4 u = scatter_numbers(path);
        const vec3 direction = normalize(sample_phase(medium.anisotropy, path.direction, u.xy));
        leaving.density = phase(medium.anisotropy, dot(path.direction, direction));
        leaving.direction = after_roulette(path, direction, u.w);
    }
    depart(path, leaving);
}

// The bodies of the ray beyond a tracked surface (9.4); false: it would be in five.
bool cross_surface(Path path, uint body, bool front, out uvec2 bodies) {
    bodies = path.bodies;
    if (front) return append(bodies, body);
    bodies = without_latest(bodies, body);
    return true;
}

// 9.4: whether the surface of a tracked material is there, and the refractive index beyond it.
bool is_there(Path path, Material material, uint body, bool front, out float outside) {
    outside = 1.0;
    const uint other = uppermost(front ? path.bodies : without_latest(path.bodies, body));
    if (other == no_body) return true;
    const Material around = materials[other];
    if (has_flag(around, flag_translucent)) outside = around.refractive_index;
    return around.priority <= material.priority;
}

bool is_tracked(Material material) { return has_interiors && has_flag(material, flag_tracked); }

// The next event of a diffuse or rough conductor vertex (9.2).
void sample_lights(Path path, Material material, Surface surface, uint slot, vec3 n_f, bool front,
    inout Departure leaving) {
    const Receiver receiver = Receiver(offset_ray_origin(surface, n_f), surface.point, slot, !front);
    const Incident incident = incident_light(receiver, light_numbers(path));
    if (incident.radiance == vec3(0.0)) return;
    if (has_rough_conductor && material.kind == material_conductor)
        aim_shadow_ray(path, incident, receiver,
            conductor_response(material, n_f, path.direction, incident.direction), leaving);
    else if (has_diffuse)
        aim_shadow_ray(path, incident, receiver,
            diffuse_response(absorbed(material, vec3(1.0)), n_f, incident.direction), leaving);
}

void meet_surface(Path path, uint slot, uint face, vec3 local, Surface surface) {
    const uint material_index = placed[slot].material;
    Material material = materials[material_index];
    const vec3 d = path.direction;
    const bool front = dot(d, surface.normal) < 0.0;
    const vec3 n_f = front ? surface.normal : -surface.normal;
    const float c = min(1.0, -dot(d, n_f));  // a rounding above 1 would make sines negative
    const bool translucent = has_translucent && has_flag(material, flag_translucent);
    const bool emissive = material.kind == material_emissive;
    float outside = 1.0;
    bool there = true;
    if (has_nested_dielectrics && is_tracked(material))
        there = is_there(path, material, material_index, front, outside);
    if (has_emission && there && material.radiance != vec3(0.0) && emits_to(material, front)) {
        const float share = has_translucent_emission && emissive && translucent ? material.alpha : 1.0;
        const float weight = has_light_sampling ? scattering_weight(path, slot, surface) : 1.0;
        path.radiance += path.throughput * material.radiance * (share * weight);
    }
    if (settings.segment == settings.bounces || (emissive && !translucent)) {
        end_path(path.place, path.radiance);
        return;
    }
    if ((has_checker || has_noise || has_image_texture) && material.colour_texture != no_index)
        material.colour = texture_colour(material.colour_texture, slot, face, local, surface.rest);

    const bool diffuse = has_diffuse && material.kind == material_diffuse;
    const bool rough = has_rough_conductor && material.kind == material_conductor && material.roughness > 0.0;
    Departure leaving = Departure(vec3(0.0), slot, vec3(0.0), 0.0, vec3(0.0), vec3(0.0), 0);
    if (has_light_sampling && (diffuse || rough) && settings.light_count > 0)
        sample_lights(path, material, surface, slot, n_f, front, leaving);

    bool to_front = front;
    if (!(ends_here() && (diffuse || rough))) {
        const vec4 u = scatter_numbers(path);
        Scattering scattering = Scattering(d, vec3(1.0), 0.0);
        if (there) {
            scattering = scatter_at(material, d, n_f, c, front, outside, u);
            const bool conducts = (has_smooth_conductor || has_rough_conductor) && material.kind == material_conductor;
            const bool passes = has_boundary && material.kind == material_boundary;
            if (!conducts && !passes) path.throughput = absorbed(material, path.throughput);
            if (conducts || has_rough_translucent) path.throughput *= scattering.weight;
        }
        if (scattering.direction != vec3(0.0)) to_front = dot(scattering.direction, surface.normal) > 0.0;
        if (has_interiors && scattering.direction != vec3(0.0) && to_front != front && is_tracked(material) &&
            !cross_surface(path, material_index, front, path.bodies)) {
            end_path(path.place, vec3(uintBitsToFloat(0x7fc00000u)));  // NaN: invalid (MODEL.md section 12)
            return;
        }
        leaving.density = scattering.density;
        leaving.direction = after_roulette(path, scattering.direction, u.w);
        if (leaving.direction == vec3(0.0)) to_front = front;
    }
    leaving.origin = offset_ray_origin(surface, to_front ? surface.normal : -surface.normal);
    if (!to_front) leaving.word |= ray_inside;
    depart(path, leaving);
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
    if (has_light_sampling && slot == hit_ended) {
        end_path(carried.w, radiance);
        return;
    }
    const vec4 arriving = directions_in[i];
    Path path = Path(
        i, carried.w, uintBitsToFloat(carried.rgb), radiance, arriving.xyz, arriving.w, in_no_body, no_index);
    if (has_interiors && k > 0) path.bodies = interiors_in[i];

    const bool missed = slot == hit_none;
    const uint face = (hit.x >> hit_face_shift) & hit_face_mask;
    const vec3 local = uintBitsToFloat(hit.yzw);
    Surface surface;
    if (!missed)
        surface = surface_at(
            slot, face, local, has_entity_motion ? path_time(settings.first_pixel + path.place) : 0.0);
    if (has_medium_absorption) {
        path.medium = medium_in(path.bodies);
        if (path.medium != no_index) {
            const Ray ray = Ray(uintBitsToFloat(origins_in[i].xyz), path.direction);
            const float end = missed ? ray_max : max(0.0, dot(surface.point - ray.origin, ray.direction));
            const vec2 m = random_block(settings.seed, settings.first_pixel + path.place, settings.sample_index,
                block_medium(k)).xy;
            float distance;
            if (is_scattered(media[path.medium], ray, end, m, path.throughput, distance)) {
                meet_medium(path, ray.origin + distance * ray.direction);
                return;
            }
        }
    }
    if (missed)
        leave_scene(path);
    else
        meet_surface(path, slot, face, local, surface);
}
