// The events at a vertex of a path (MODEL.md sections 7 to 10), for every kernel that shades. The light of the hit is added, a
// light is sampled, and the path is absorbed, scattered or ended. Functions take and return plain structs. Each kernel stores its
// paths in its own way.
#ifndef VERTEX_EVENTS_GLSL
#define VERTEX_EVENTS_GLSL
#include "geometry/hit.glsl"
#include "geometry/shading_normal.glsl"
#include "kernels/noted.glsl"

// A path where its ray has arrived.
struct Path {
    uint pixel;         // of the image
    uvec2 sample_index;  // low and high word
    uint segment;       // k of section 9
    vec3 throughput;
    vec3 radiance;   // gathered so far
    real3 origin;    // of the ray; unknown unless keeps_origin
    uint word;       // that the ray left with (hit.glsl)
    real3 direction;  // of the ray
    // Density of the scattering that chose it; 0: none. Negative: the ray goes on through a surface, and starts by so
    // much before it (section 5.2).
    float density;
    uvec4 bodies;    // that the ray is in (interiors.glsl)
    uint medium;     // that the ray is in, or no_index
};
const bool keeps_origin = has_light_sampling || has_medium_absorption || has_crossing || has_far_corners;

// What leaves a vertex: a ray, a shadow ray, both or neither.
struct Departure {
    real3 origin;
    uint word;        // of the ray (hit.glsl)
    real3 direction;  // zero: the path ends
    float density;
    vec3 contribution;  // zero: no shadow ray
    ShadowRay shadow;
};

bool goes_on(Departure leaving) { return leaving.direction != vec3(0.0); }
bool has_shadow(Departure leaving) { return has_light_sampling && leaving.contribution != vec3(0.0); }

Departure departure_from(real3 origin, uint word) {
    return Departure(origin, word, vec3(0.0), 0.0, vec3(0.0), ShadowRay(vec3(0.0), 0));
}

// n_f of the vertex that the ray left, at the path's time (9.2, rule 39); zero in a medium.
real3 side_left(Path path) {
    const uint slot = path.word & slot_mask;
    if (slot == no_slot) return real3(0.0);
    real3 normal;
    if (kind_of(slot) == kind_triangle) {
        normal = triangle_facts(slot).normal;
    } else {
        const Convex shape = convex_at(slot);
        real3 point = path.origin;
        if (has_entity_motion)
            point -= path_time(path.pixel, path.sample_index) * transforms[placed_at(slot).entity].motion;
        real3 x = to_unit_space(shape, Ray(point, real3(0.0))).origin;
        if (kind_of(slot) == kind_cuboid) {  // of its faces the one that the point is nearest to
            const real3 beyond = abs(x) - convex_extent(shape);
            const uint axis = beyond.x >= max(beyond.y, beyond.z) ? 0u : beyond.y >= beyond.z ? 1u : 2u;
            x = face_axis(2 * axis + (x[axis] < 0.0 ? 0u : 1u));
        }
        normal = convex_normal(shape, x);
    }
    return (path.word & ray_inside) != 0u ? -normal : normal;
}

// W_k of MODEL.md section 9.2: the weight of light that scattering finds.
float scattering_weight(Path path, uint slot, Surface surface) {
    const uint index = placed_at(slot).light;
    if (index == no_light || path.density <= 0.0) return 1.0;
    Light light = lights[index];
    const real3 side = has_light_tree ? side_left(path) : real3(0.0);
    if (has_light_tree) light.probability *= chance_in_tree(index, path.origin, side);
    if (!has_mis) return light.probability > 0.0 ? 0.0 : 1.0;
    Receiver receiver = Receiver(path.origin, path.origin, path.word & slot_mask, (path.word & ray_inside) != 0u, side);
    const real3 offset = surface.point - receiver.point;
    const real cosine = abs(dot(surface.normal, path.direction));
    if (has_entity_motion && !PLANTED(lamp_density_at_rest))
        receiver = beside_rest(receiver, light, path_time(path.pixel, path.sample_index));
    const real chance = PLANT(mixture_ignored, light.probability * float(settings.light_count), light.probability);
    const real density = chance * light_density(light, receiver, offset, cosine);
    return shaded(
        PLANT(heuristic_swapped, power_heuristic(density, path.density), power_heuristic(path.density, density)));
}

void leave_scene(inout Path path) {
    if (!has_background || (PLANTED(background_late_missing) && path.segment == 2)) return;
    float weight = 1.0;
    if (has_sampled_background && both(scene.background_probability > 0.0, path.density > 0.0)) {
        const real density = scene.background_probability * background_density(shaded(path.direction));
        weight = has_mis ? shaded(power_heuristic(path.density, density)) : density > 0.0 ? 0.0 : 1.0;
    }
    NOTE(found_weight, weight);
    path.radiance += path.throughput * background(shaded(path.direction)) * weight;
}

// Roulette after scattering event k + 1 (9.3); false: the path ends.
bool survives(inout vec3 throughput, float u) {
    const float q = min(1.0, max(throughput.r, max(throughput.g, throughput.b)));
    NOTE(survival, q);
    if (u >= q) return false;
    if (!PLANTED(roulette_not_divided)) throughput /= q;
    return true;
}

// The sample of a light that the path takes at this vertex.
Incident next_event(Path path, Receiver receiver) {
    const vec3 v = random_block(settings.seed, path.pixel, path.sample_index, block_light(path.segment)).xyz;
    return incident_light(receiver, v, has_entity_motion ? path_time(path.pixel, path.sample_index) : 0.0);
}

// drawn: these, where kernels of whole paths have them (pixel_samples.glsl).
vec4 scatter_numbers(Path path, vec4 drawn) {
#ifdef DRAWS_AHEAD
    return drawn;
#else
    return random_block(settings.seed, path.pixel, path.sample_index, block_scatter(path.segment));
#endif
}

// What remains of the light on its way through the medium at the vertex (9.2).
vec3 dimmed(Path path, Incident incident, Receiver receiver) {
    if (!has_medium_absorption || both(path.medium == no_index, path.direction.x < 2.0) || PLANTED(medium_shadow_ignored))
        return vec3(1.0);
    return transmittance(media[path.medium], Ray(receiver.surface, incident.direction), incident.distance);
}

void aim_shadow_ray(Path path, Incident incident, Receiver receiver, Response response, inout Departure leaving) {
    if (response.f_cosine <= 0.0) return;
    const vec3 transmitted = dimmed(path, incident, receiver);
    NOTE(light_transmittance, transmitted);
    leaving.contribution = path.throughput * answered_light(incident, response) * transmitted;
    leaving.shadow = ShadowRay(incident.offset, incident.shadow_word);
}

// 9.3, where it applies; zero: the path ends.
vec3 after_roulette(inout Path path, vec3 direction, float u) {
    if (direction == vec3(0.0) || path.throughput == vec3(0.0)) return vec3(0.0);
    if (has_roulette && path.segment + 1 >= settings.roulette_start && !survives(path.throughput, u))
        return vec3(0.0);
#if defined(PLANTED_BUGS) && !defined(DOUBLE_SHADING)
    if (PLANTED(throughput_half))
        path.throughput = uintBitsToFloat((floatBitsToUint(path.throughput) + 0x1000u) & 0xFFFFE000u);  // 10 bits
#endif
    return direction;
}

bool ends_here() { return has_direct_only && settings.direct_only != 0; }

// A vertex within the medium of the ray (10).
Departure meet_medium(inout Path path, real3 point, vec4 drawn) {
    Departure leaving = departure_from(point, no_slot);
    if (path.segment == settings.bounces) return leaving;
    const Medium medium = media[path.medium];
    if (has_light_sampling && settings.light_count > 0) {
        const Receiver receiver = Receiver(point, point, no_slot, false, real3(0.0));
        const Incident incident = next_event(path, receiver);
        if (incident.radiance != vec3(0.0))
            aim_shadow_ray(path, incident, receiver,
                medium_response(medium, shaded(path.direction), shaded(incident.direction)), leaving);
    }
    if (!ends_here()) {
        const vec4 u = scatter_numbers(path, drawn);
        const vec3 direction = normalize(sample_phase(shaded(medium.anisotropy), shaded(path.direction), u.xy));
        leaving.density = phase(shaded(medium.anisotropy), dot(shaded(path.direction), direction));
        leaving.direction = after_roulette(path, direction, u.w);
    }
    return leaving;
}

// The bodies of the ray beyond a tracked surface (9.4); false: it would be in nine.
bool cross_surface(Path path, uint body, bool front, out uvec4 bodies) {
    bodies = beside(path.bodies, body, front);
    return !front || append(bodies, body);
}

// 9.4: whether the surface of a tracked material is there, and the refractive index beyond it.
bool is_there(Path path, Material material, uint body, bool front, out float outside) {
    outside = 1.0;
    const uint other = uppermost(beside(path.bodies, body, front));
    if (other == no_body) return true;
    const Material around = material_at(other);
    if (has_flag(around, flag_translucent)) outside = around.refractive_index;
    return around.priority <= material.priority;
}

bool is_tracked(Material material) { return has_interiors && has_flag(material, flag_tracked); }

// The next event of a vertex that receives light (9.2).
void sample_lights(Path path, Material material, Surface surface, uint slot, real3 n_f, vec3 n_s, bool front,
    inout Departure leaving) {
    const Receiver receiver = Receiver(offset_ray_origin(surface, n_f), surface.point, slot, !front, n_f);
    const Incident incident = next_event(path, receiver);
    if (incident.radiance == vec3(0.0)) return;
    const vec3 direction = shaded(incident.direction);
    if (has_shading_normals && !is_on_one_side(direction, n_s, shaded(n_f))) return;
    aim_shadow_ray(
        path, incident, receiver, surface_response(material, n_s, shaded(path.direction), direction), leaving);
}

// The material of the primitive that the ray left, the side that it came to it from, and the normal there.
uint material_left(Path path) { return placed_at(path.word & slot_mask).material; }
bool left_from_front(Path path) { return (path.word & ray_inside) != 0u; }
vec3 normal_left(Path path) {
    const uint slot = path.word & slot_mask;
    if (kind_of(slot) != kind_triangle)
        return shaded(convex_normal(convex_at(slot), face_axis(2 * (path.word >> ray_axis_shift))));
    return shaded(triangle_facts(slot).normal);
}

// What lies where the face lies that the ray has gone on through (5.2).
struct Place {
    bool same_place;
    bool same_face;
};

Place place_of(Path path, uint slot, uint material, bool front, Surface surface, float c) {
    Place place = Place(false, false);
    if (!has_crossing || path.density >= 0.0 || slot == (path.word & slot_mask)) return place;
    const float way = shaded(dot(surface.point - path.origin, path.direction));
    if (way > -1.5 * path.density + 2.0 * shaded(dot(abs(surface.normal), surface.error)) / c) return place;
    place.same_face = material == material_left(path) && front == left_from_front(path);
    place.same_place = place.same_face || abs(dot(shaded(surface.normal), normal_left(path))) > 511.0 / 512.0;
    return place;
}

// The list of a path that turns back where it has gone on through another surface (9.4): as it was before that.
uvec4 before_crossing(Path path) {
    const uint left = material_left(path);
    if (!is_tracked(material_at(left))) return path.bodies;
    uvec4 bodies = path.bodies;
    if (left_from_front(path)) return without_latest(bodies, left);
    append(bodies, left);  // there is room: it was taken out
    return bodies;
}

// How far before a surface a ray starts that goes on through it, or back through another at the same place. 0: it
// starts beyond (5.2).
float start_before(Path path, uint slot, Surface surface, real3 direction, bool back) {
    if (guard != guard_error_bound || surface.error == vec3(0.0)) return 0.0;
    const float error = shaded(dot(abs(surface.normal), error_of_planes(slot, surface)));
    const float whole = 4.0 * error / shaded(abs(dot(direction, surface.normal)));
    if (back) return min(whole, 256.0 * error) - path.density;
    const float way = shaded(dot(surface.point - path.origin, path.direction)) + min(path.density, 0.0);
    return max(min(whole, 0.5 * way), 0.0);
}

Departure meet_surface(inout Path path, Hit hit, Surface surface, vec4 drawn) {
    const uint slot = hit.slot;
    Departure leaving = departure_from(vec3(0.0), slot);
    const uint material_index = placed_at(slot).material;
    Material material = material_at(material_index);
    const vec3 d = shaded(path.direction);
    const bool front = kind_of(slot) == kind_sphere ? hit.face == 0 : dot(d, surface.normal) < 0.0;
    const real3 n_f = front ? surface.normal : -surface.normal;
    float c = clamp(shaded(-dot(d, n_f)), 0.0, 1.0);  // a rounding beyond would make sines negative
    const bool translucent = has_translucent && has_flag(material, flag_translucent);
    const bool emissive = material.kind == material_emissive;
    float outside = 1.0;
    bool there = true;
    const bool transmits = translucent || (has_boundary && material.kind == material_boundary);
    const Place place = place_of(path, slot, material_index, front, surface, c);
    if (has_interiors && place.same_place && !transmits) {
        path.bodies = before_crossing(path);
        path.medium = medium_in(path.bodies);
    }
    if (place.same_face)
        there = false;
    else if (has_nested_dielectrics && is_tracked(material))
        there = is_there(path, material, material_index, front, outside);
    if (has_emission && there && material.radiance != vec3(0.0) && emits_to(material, front)) {
        const float share = has_translucent_emission && emissive && translucent ? material.alpha : 1.0;
        const float weight = has_light_sampling ? scattering_weight(path, slot, surface) : 1.0;
        NOTE(found_weight, weight);
        path.radiance += path.throughput * material.radiance * (share * weight);
    }
    if (path.segment == settings.bounces || (emissive && !translucent)) return leaving;
    if ((has_checker || has_noise || has_image_texture) && material.colour_texture != no_index)
        material.colour = texture_colour(material.colour_texture, slot, hit.face, shaded(hit.local), surface.rest);

    vec3 n_s = shaded(n_f);
    if (has_shading_normals) {
        const vec3 interpolated = shading_normal(slot, shaded(hit.local.xy), n_s, d);
        if (interpolated != n_s) c = min(1.0, -dot(d, interpolated));
        n_s = interpolated;
    }
    NOTE(shading_normal, n_s);
    const bool receives = receives_light(material);
    if (has_light_sampling && receives && settings.light_count > 0)
        sample_lights(path, material, surface, slot, n_f, n_s, front, leaving);

    bool to_front = front;
    if (!(ends_here() && receives)) {
        const vec4 u = scatter_numbers(path, drawn);
        Scattering scattering = Scattering(d, vec3(1.0), 0.0);
        if (there) {
            scattering = scatter_at(material, d, n_s, c, front, outside, u);
            if (has_shading_normals && !is_on_one_side(scattering.direction, n_s, shaded(n_f))) scattering = no_scattering;
            if (is_absorbed(material)) path.throughput = absorbed(material, path.throughput);
            if (is_weighted(material)) path.throughput *= scattering.weight;
        }
        if (scattering.direction != vec3(0.0)) to_front = dot(scattering.direction, surface.normal) > 0.0;
        if (has_interiors && scattering.direction != vec3(0.0) && to_front != front && !place.same_face && is_tracked(material) &&
            !cross_surface(path, material_index, front, path.bodies)) {
            path.radiance = vec3(uintBitsToFloat(0x7fc00000u));  // NaN: invalid (section 12)
            return departure_from(vec3(0.0), slot);
        }
        leaving.density = scattering.density;
        leaving.direction = after_roulette(path, scattering.direction, u.w);
        if (leaving.direction == vec3(0.0)) to_front = front;
    }
    leaving.origin = offset_ray_origin(surface, to_front ? surface.normal : -surface.normal);
    const bool back = place.same_place && transmits && to_front == front && goes_on(leaving);
    if (has_crossing && (back || (to_front != front && !place.same_place && material.priority == 0))) {
        const float start = start_before(path, slot, surface, leaving.direction, back);
        if (start > 0.0) {
            leaving.origin = surface.point - start * leaving.direction;
            leaving.density = -start;
            leaving.word |= (hit.face >> 1) << ray_axis_shift;
        }
    }
    if (!to_front) leaving.word |= ray_inside;
    return leaving;
}

// What the ray of a path has come to.
struct Arrival {
    bool missed;
    bool in_medium;  // scattered there, before any surface
    real distance;   // in_medium: along the ray
    Surface surface;
};

// The surface at `time`, and the medium on the way there, which weighs the path.
Arrival arrival(inout Path path, Hit hit, real time) {
    Arrival at;
    at.missed = hit.slot == hit_none;
    at.in_medium = false;
    if (!at.missed) at.surface = surface_at(hit.slot, hit.face, hit.local, Ray(path.origin, path.direction), time);
    if (!has_medium_absorption) return at;
    path.medium = medium_in(path.bodies);
    if (both(path.medium == no_index, path.direction.x < 2.0)) return at;
    Ray ray = Ray(path.origin, path.direction);
    real before = 0.0;
    if (has_crossing) {
        before = max(-path.density, 0.0);
        ray.origin += before * ray.direction;
    }
    const real end = at.missed ? ray_max : max(0.0, dot(at.surface.point - ray.origin, ray.direction));
    const vec2 m = random_block(settings.seed, path.pixel, path.sample_index, block_medium(path.segment)).xy;
    at.in_medium = is_scattered(media[path.medium], ray, end, m, path.throughput, at.distance);
    at.distance += before;
    return at;
}

real3 medium_point(Path path, Arrival at) { return path.origin + at.distance * path.direction; }

// Whether the path ends there whatever its numbers; of few others it turns out later.
bool ends_at(Path path, Hit hit, Arrival at) {
    if (path.segment == settings.bounces) return true;
    if (at.missed || at.in_medium) return !at.in_medium;
    const Material material = material_at(placed_at(hit.slot).material);
    return material.kind == material_emissive && !(has_translucent && has_flag(material, flag_translucent));
}

// The vertex there. What does not go on and leaves no shadow ray has ended, its sample being path.radiance. drawn: its
// scatter_numbers, unless it ends_at.
Departure leave(inout Path path, Hit hit, Arrival at, vec4 drawn) {
    if (at.in_medium) return meet_medium(path, medium_point(path, at), drawn);
    if (!at.missed) return meet_surface(path, hit, at.surface, drawn);
    leave_scene(path);
    return departure_from(vec3(0.0), 0);
}

Departure arrive(inout Path path, Hit hit, real time) {
    const Arrival at = arrival(path, hit, time);
    return leave(path, hit, at, vec4(0.0));
}

#endif
