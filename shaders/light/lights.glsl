// Light sampling, its density, and the MIS weight (MODEL.md section 9.2).
#ifndef LIGHTS_GLSL
#define LIGHTS_GLSL
#include "geometry/geometry_types.glsl"
#include "kernels/noted.glsl"
#include "light/light_tree.glsl"

// Where a receiver stands. Its own slot and whether it is inside its own convex primitive decide its side of that
// primitive, which rounding could not.
struct Receiver {
    vec3 point;    // where rays start
    vec3 surface;  // the hit point itself, from which lights without a surface and ways through media are measured
    uint slot;
    bool inside;  // of its own sphere or cuboid
    vec3 normal;  // of the lit side; zero in a medium
};

bool is_inside_sphere(Light light, Receiver receiver) {
    if (receiver.slot == light.slot) return receiver.inside;
    const vec3 offset = receiver.point - light.centre;
    return dot(offset, offset) <= light.radius * light.radius;
}

bool is_inside_cuboid(Light light, Receiver receiver) {
    if (receiver.slot == light.slot) return receiver.inside;
    const Convex shape = convex_at(light.slot);
    const vec3 x = to_unit_space(shape, Ray(receiver.point, vec3(0.0))).origin;
    return all(lessThanEqual(abs(x), convex_extent(shape)));
}

// The receiver of a light whose entity moves, as the entity at rest sees it.
Receiver beside_rest(Receiver receiver, Light light, float time) {
    receiver.point -= time * transforms[placed_at(light.slot).entity].motion;
    return receiver;
}

// 1 - cos of the half angle of the cone in which a sphere is seen from outside.
float sphere_cone(float radius, vec3 to_centre) {
    // Never beyond 1: a receiver on the sphere itself may lie a rounding within it.
    const float sine2 = min(1.0, radius * radius / dot(to_centre, to_centre));
    return sine2 / (1.0 + sqrt(1.0 - sine2));
}

// From a receiver outside of a sphere to a point on its near side, uniform in the cone.
vec3 to_near_side(float radius, vec3 to_centre, vec2 v) {
    const float distance = length(to_centre);
    const float k = sphere_cone(radius, to_centre);
    const float below = k * v.x;  // 1 - cos theta
    const float sine2 = below * (2.0 - below), cosine = 1.0 - below;
    const vec3 direction =
        frame_of(to_centre / distance) * vec3(sqrt(sine2) * cos_sin_turn(v.y), cosine);
    // At the rim of the cone the root may come out a rounding below zero.
    const float half_chord = sqrt(max(0.0, radius * radius - distance * distance * sine2));
    return (distance * cosine - half_chord) * direction;
}

// Where the receiver of an ellipsoid's light stands in the space in which that is the unit sphere.
struct UnitReceiver {
    vec3 point;
    bool inside;
};
UnitReceiver unit_receiver(Convex shape, Light light, Receiver receiver) {
    const vec3 x = to_unit_space(shape, Ray(receiver.point, vec3(0.0))).origin;
    return UnitReceiver(x, receiver.slot == light.slot ? receiver.inside : dot(x, x) <= 1.0);
}

// The density of unit space times |N w|^3 / |det N|. Here a world length of |offset| is one of |e|, and `radius` is the
// cube root of |det N|.
float ellipsoid_density(Light light, Receiver receiver, vec3 offset) {
    const Convex shape = convex_at(light.slot);
    const UnitReceiver from = unit_receiver(shape, light, receiver);
    const vec3 e = map_to_unit(shape, offset);
    const float stretched = length(offset) / light.radius;
    if (from.inside) return stretched * stretched * stretched / (4.0 * pi * abs(dot(from.point + e, e)));
    const float ratio = stretched / length(e);
    return ratio * ratio * ratio / (2.0 * pi * sphere_cone(1.0, -from.point));
}

float area_density(Light light, float distance2, float cosine) {
    return distance2 / (light.area * cosine);
}

bool has_cone(Light light, Receiver receiver) {
    return has_sphere_lights && light.kind == kind_sphere && !is_inside_sphere(light, receiver);
}

// Density over solid angle with which `light` (its choice not counted) gives the direction from the receiver to the point on
// it at `offset`. cosine = |n_light · direction|.
float light_density(Light light, Receiver receiver, vec3 offset, float cosine) {
    if (PLANTED(jacobian_missing)) return 1.0 / light.area;
    if (has_cone(light, receiver)) return 1.0 / (2.0 * pi * sphere_cone(light.radius, light.centre - receiver.point));
    if (has_ellipsoid_lights && light.kind == kind_ellipsoid)
        return ellipsoid_density(light, receiver, offset);
    return area_density(light, dot(offset, offset), cosine);
}

uint choose_light(float v) {
    if (PLANTED(light_choice_squared)) v *= v;
    uint first = 0, last = settings.light_count - 1;
    while (first < last) {
        const uint middle = (first + last) / 2;
        if (v < lights[middle].cumulative)
            last = middle;
        else
            first = middle + 1;
    }
    return first;
}

struct LightSample {
    vec3 offset;       // from the receiver to the point on the light
    bool from_beyond;  // a sphere or ellipsoid seen from outside: its front, whatever the normal
    vec3 normal;       // else: of the light there, to its front
    bool sees_back;    // a back side seen counts (the receiver may see it)
    float rounding;    // by which the point may be off along the normal, where coplanar neighbours could block it
};

// On the near side, whose normal would be the difference of far points: of a small or far light nothing but rounding.
LightSample near_side_sample(vec3 offset) { return LightSample(offset, true, vec3(0.0), false, 0.0); }

LightSample sample_triangle_light(Light light, Receiver receiver, vec2 v) {
    const Triangle triangle = triangle_of(light.slot);
    const float s = PLANT(triangle_light_uneven, v.x, sqrt(v.x));
    const vec3 p1 = s * (1.0 - v.y) * triangle.corner1.xyz, p2 = s * v.y * triangle.corner2.xyz;
    const vec3 point = (1.0 - s) * triangle.corner0.xyz + p1 + p2;
    const TriangleFacts facts = triangle_facts(light.slot);
    return LightSample(point - receiver.point, false, facts.normal, true,
        dot(abs(facts.normal), plane_error(triangle, p1, p2, facts.reach)));
}

LightSample sample_sphere_light(Light light, Receiver receiver, vec2 v) {
    if (is_inside_sphere(light, receiver)) {
        const vec3 n = sample_sphere(v.x, v.y);
        return LightSample(light.centre + light.radius * n - receiver.point, false, n, true, 0.0);
    }
    return near_side_sample(to_near_side(light.radius, light.centre - receiver.point, v));
}

LightSample sample_ellipsoid_light(Light light, Receiver receiver, vec2 v) {
    const Convex shape = convex_at(light.slot);
    const UnitReceiver from = unit_receiver(shape, light, receiver);
    if (!from.inside) return near_side_sample(map_to_world(shape, to_near_side(1.0, -from.point, v)));
    const vec3 e = sample_sphere(v.x, v.y) - from.point;
    return LightSample(map_to_world(shape, e), false, convex_normal(shape, from.point + e), true, 0.0);
}

LightSample sample_cuboid_light(Light light, Receiver receiver, vec2 v) {
    const float upto[6] = PLANT(cuboid_light_faces_even, float[6](1.0 / 6.0, 2.0 / 6.0, 3.0 / 6.0, 4.0 / 6.0, 5.0 / 6.0, 1.0),
        float[6](light.face0, light.face1, light.face2, light.face3, light.face4, 1.0));
    uint face = 0;
    while (face < 5 && v.x >= upto[face]) ++face;
    const float before = face == 0 ? 0.0 : upto[face - 1];
    const vec2 place = 2.0 * vec2((v.x - before) / (upto[face] - before), v.y) - 1.0;
    const vec3 axis = face_axis(face);
    const vec3 in_face = face < 2 ? vec3(0.0, place) : face < 4 ? vec3(place.x, 0.0, place.y) : vec3(place, 0.0);
    const Convex shape = convex_at(light.slot);
    const vec3 point = convex_point(shape, (axis + in_face) * convex_extent(shape));
    return LightSample(point - receiver.point, false, convex_normal(shape, axis), is_inside_cuboid(light, receiver), 0.0);
}

LightSample sample_primitive_light(Light light, Receiver receiver, vec2 v) {
    if (has_triangle_lights && light.kind == kind_triangle) return sample_triangle_light(light, receiver, v);
    if (has_sphere_lights && light.kind == kind_sphere) return sample_sphere_light(light, receiver, v);
    if (has_ellipsoid_lights && light.kind == kind_ellipsoid) return sample_ellipsoid_light(light, receiver, v);
    if (has_cuboid_lights) return sample_cuboid_light(light, receiver, v);
    return LightSample(vec3(0.0), false, vec3(0.0), false, 0.0);
}

// (P p)^2 / ((P p)^2 + q^2) for beta = 2 [Veach 1995], as a ratio so that no square overflows to inf/inf.
float power_heuristic(float density, float other) {
    const float ratio = other / density;
    return 1.0 / (1.0 + ratio * ratio);
}

// What one light sample can bring to a receiver, if nothing is in the way.
struct Incident {
    vec3 offset;     // to the end of the shadow ray; to a far light the direction
    vec3 direction;  // unit
    float distance;  // ray_max to a far light
    vec3 radiance;   // zero: nothing comes
    float density;   // P_i p over solid angle; of a delta light P_i, the radiance being that times the delta's measure
    bool is_delta;
    uint shadow_word;
};
const Incident no_incident = Incident(vec3(0.0), vec3(0.0), 0.0, vec3(0.0), 1.0, false, no_slot);

Incident from_primitive(Light light, Receiver receiver, vec2 v) {
    const LightSample chosen = sample_primitive_light(light, receiver, v);
    const float distance2 = dot(chosen.offset, chosen.offset), distance = sqrt(distance2);
    if (!(distance2 > 0.0) || distance < settings.ray_min || distance > settings.ray_max) return no_incident;
    if (light.kind == kind_triangle && light.slot == receiver.slot) return no_incident;
    const vec3 direction = chosen.offset / distance;
    const float light_cosine = chosen.from_beyond ? 1.0 : -dot(chosen.normal, direction);
    const Material material = material_at(placed_at(light.slot).material);
    const bool front = light_cosine > 0.0;
    if (light_cosine == 0.0 || !emits_to(material, front) || (!front && !chosen.sees_back)) return no_incident;
    float density = light.probability * light_density(light, receiver, chosen.offset, abs(light_cosine));
    density = PLANT(sphere_light_cone_scaled, has_cone(light, receiver) ? density / (1.0 + planted_amount) : density, density);
    vec3 radiance = material.radiance;
    if (has_translucent_emission && has_flag(material, flag_translucent)) radiance *= material.alpha;
    // A shadow ray ends where one that leaves the light would start (5.2): short of its coplanar neighbours.
    const vec3 end = chosen.offset + (front ? chosen.rounding : -chosen.rounding) * chosen.normal;
    return Incident(end, direction, distance, radiance, density, false, light.slot);
}

// 8.3
Incident from_point(Light light, Receiver receiver) {
    const vec3 offset = light.centre - receiver.surface;
    const float distance2 = dot(offset, offset), distance = sqrt(distance2);
    if (!(distance2 > 0.0) || distance < settings.ray_min || distance > settings.ray_max) return no_incident;
    const vec3 direction = offset / distance;
    float share = 1.0;
    if (has_spot_lights && light.kind == kind_spot) {
        const float t = clamp((-dot(light.axis, direction) - light.outer) / (light.inner - light.outer), 0.0, 1.0);
        share = PLANT(spot_falloff_linear, t, t * t * (3.0 - 2.0 * t));
    }
    return Incident(
        offset, direction, distance, light.intensity * (share / PLANT(point_falloff_linear, distance, distance2)), light.probability, true, no_slot);
}

// The light that a number chooses, with the probability that this receiver gives it (9.2). Near lights of a tree have that
// of all of them.
Light chosen_light(Receiver receiver, float v) {
    if (!has_light_tree) return lights[choose_light(v)];
    const float near_share = lights[0].probability;
    if (v >= near_share) return lights[choose_light(v)];
    const TreeChoice choice = choose_in_tree(v / near_share, receiver.point, receiver.normal);
    Light light = lights[choice.light];
    light.probability *= choice.chance;
    return light;
}

// The light that the number v.x chooses, at the time of the path.
Incident incident_light(Receiver receiver, vec3 v, float time) {
    const Light light = chosen_light(receiver, v.x);
    if (has_point_lights && (light.kind == kind_point || light.kind == kind_spot)) return from_point(light, receiver);
    if (has_suns && light.kind == kind_sun)
        return Incident(
            -light.axis, -light.axis, settings.ray_max, light.intensity, light.probability, true, shadow_far);
    if (has_sampled_background && light.kind == kind_background) {
        const vec3 direction = sample_background(shaded(v.yz));
        const float density = light.probability * background_density(shaded(direction));
        if (density <= 0.0) return no_incident;  // a rounding beside what was chosen
        return Incident(direction, direction, settings.ray_max, background(shaded(direction)), density, false, shadow_far);
    }
    if (!has_triangle_lights && !has_sphere_lights && !has_ellipsoid_lights && !has_cuboid_lights) return no_incident;
    return from_primitive(light, has_entity_motion ? beside_rest(receiver, light, time) : receiver, v.yz);
}

#include "arithmetic/shading_types.glsl"

Response medium_response(Medium medium, vec3 d, vec3 direction) {
    const float value = phase(shaded(medium.anisotropy), dot(d, direction));
    return Response(vec3(1.0), value, value);
}

// The light that a vertex sends on, per unit of its throughput, weighted against what scattering will find (9.2).
vec3 answered_light(Incident incident, Response response) {
    const bool alone = !has_mis || incident.is_delta || (has_direct_only && settings.direct_only != 0);
    float weight = alone ? 1.0 : shaded(power_heuristic(incident.density, response.density));
    if (PLANTED(balance_on_one_side) && !alone) weight = shaded(incident.density / (incident.density + response.density));
    weight = PLANT_SCALE(next_event_scaled, PLANT(mis_weights_unequal, settings.light_count > 1 ? 0.5 * weight : weight, weight));
    NOTE(light_radiance, incident.radiance);
    NOTE(light_pdf, incident.density);
    NOTE(light_response, response.colour * response.f_cosine);
    NOTE(light_weight, weight);
#if defined(PLANTED_BUGS) && !defined(DOUBLE_SHADING)
    if (PLANTED(reciprocal_short))
        return response.colour * shaded(incident.radiance) *
               shaded(response.f_cosine * weight * uintBitsToFloat(floatBitsToUint(1.0 / float(incident.density)) & 0xFFFFF800u));
#endif
    return response.colour * shaded(incident.radiance) * shaded(response.f_cosine * weight / incident.density);
}

#endif
