// Light sampling and its density (MODEL.md section 9.2).
#ifndef LIGHTS_GLSL
#define LIGHTS_GLSL

// Where a receiver stands: its own slot and whether it is inside its own convex primitive settle on which side of that
// primitive it is, which rounding could not.
struct Receiver {
    vec3 point;
    uint slot;
    bool inside;  // of its own sphere or cuboid
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

// 1 - cos of the half angle of the cone in which a sphere is seen from outside.
float sphere_cone(Light light, vec3 to_centre) {
    // Never beyond 1: a receiver on the sphere itself may lie a rounding within it.
    const float sine2 = min(1.0, light.radius * light.radius / dot(to_centre, to_centre));
    return sine2 / (1.0 + sqrt(1.0 - sine2));
}

float area_density(Light light, float distance2, float cosine) {
    return PLANTED(jacobian_missing) ? 1.0 / light.area : distance2 / (light.area * cosine);
}

// Density over solid angle with which `light` (its choice not counted) gives the direction from the receiver to a point on
// it at `distance2`, cosine = |n_light · direction|.
float light_density(Light light, Receiver receiver, float distance2, float cosine) {
    if (has_sphere_lights && light.kind == kind_sphere && !is_inside_sphere(light, receiver))
        return PLANTED(jacobian_missing) ? 1.0 / light.area
                                         : 1.0 / (2.0 * pi * sphere_cone(light, light.centre - receiver.point));
    return area_density(light, distance2, cosine);
}

uint choose_light(float v) {
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
    vec3 offset;     // from the receiver to the point on the light
    vec3 normal;     // of the light there, to its front
    bool sees_back;  // a back side seen counts (the receiver may see it)
};

LightSample sample_triangle_light(Light light, Receiver receiver, vec2 v) {
    const Triangle triangle = triangles[light.slot];
    const float s = sqrt(v.x);
    const vec3 point = (1.0 - s) * triangle.corner0.xyz + s * (1.0 - v.y) * triangle.corner1.xyz +
        s * v.y * triangle.corner2.xyz;
    return LightSample(point - receiver.point,
        normalize(vec3(triangle.corner0.w, triangle.corner1.w, triangle.corner2.w)), true);
}

LightSample sample_sphere_light(Light light, Receiver receiver, vec2 v) {
    if (is_inside_sphere(light, receiver)) {
        const vec3 n = sample_sphere(v.x, v.y);
        return LightSample(light.centre + light.radius * n - receiver.point, n, true);
    }
    const vec3 to_centre = light.centre - receiver.point;
    const float distance = length(to_centre);
    const float k = sphere_cone(light, to_centre);
    const float below = k * v.x;  // 1 - cos theta
    const float sine2 = below * (2.0 - below), cosine = 1.0 - below;
    const vec3 direction =
        frame_of(to_centre / distance) * vec3(sqrt(sine2) * cos_sin_turn(v.y), cosine);
    // At the rim of the cone the root may come out a rounding below zero.
    const float half_chord = sqrt(max(0.0, light.radius * light.radius - distance * distance * sine2));
    const vec3 offset = (distance * cosine - half_chord) * direction;
    return LightSample(offset, (offset - to_centre) / light.radius, false);
}

LightSample sample_cuboid_light(Light light, Receiver receiver, vec2 v) {
    const float upto[6] = float[6](light.face0, light.face1, light.face2, light.face3, light.face4, 1.0);
    uint face = 0;
    while (face < 5 && v.x >= upto[face]) ++face;
    const float before = face == 0 ? 0.0 : upto[face - 1];
    const vec2 place = 2.0 * vec2((v.x - before) / (upto[face] - before), v.y) - 1.0;
    const vec3 axis = face_axis(face);
    const vec3 in_face = face < 2 ? vec3(0.0, place) : face < 4 ? vec3(place.x, 0.0, place.y) : vec3(place, 0.0);
    const Convex shape = convex_at(light.slot);
    const vec3 point = convex_point(shape, (axis + in_face) * convex_extent(shape));
    return LightSample(point - receiver.point, convex_normal(shape, axis), is_inside_cuboid(light, receiver));
}

LightSample sample_light(Light light, Receiver receiver, vec2 v) {
    if (has_triangle_lights && light.kind == kind_triangle) return sample_triangle_light(light, receiver, v);
    if (has_sphere_lights && light.kind == kind_sphere) return sample_sphere_light(light, receiver, v);
    return sample_cuboid_light(light, receiver, v);
}

// (P p)^2 / ((P p)^2 + q^2) for beta = 2 [Veach 1995], as a ratio so that no square overflows to inf/inf.
float power_heuristic(float density, float other) {
    const float ratio = other / density;
    return 1.0 / (1.0 + ratio * ratio);
}

// The direct light that one light sample brings to a diffuse vertex, and the offset to the light's point; zero: none.
vec3 direct_light(Receiver receiver, vec3 n_f, vec3 colour, vec3 v, out vec3 offset, out uint light_slot) {
    const Light light = lights[choose_light(v.x)];
    light_slot = light.slot;
    const LightSample chosen = sample_light(light, receiver, v.yz);
    offset = chosen.offset;
    const float distance2 = dot(offset, offset), distance = sqrt(distance2);
    if (!(distance2 > 0.0) || distance < settings.ray_min || distance > settings.ray_max) return vec3(0.0);
    if (light.kind == kind_triangle && light.slot == receiver.slot) return vec3(0.0);
    const vec3 direction = offset / distance;
    const float cosine = dot(n_f, direction), light_cosine = -dot(chosen.normal, direction);
    const Material material = materials[placed[light.slot].material];
    const bool front = light_cosine > 0.0;
    if (cosine <= 0.0 || light_cosine == 0.0 || !emits_to(material, front) || (!front && !chosen.sees_back))
        return vec3(0.0);
    const float density = light.probability * light_density(light, receiver, distance2, abs(light_cosine));
    float weight = power_heuristic(density, cosine / pi);
    if (PLANTED(mis_weights_unequal) && settings.light_count > 1) weight *= 0.5;
    const float f_cosine = (PLANTED(inverse_pi_dropped) ? 1.0 : 1.0 / pi) * (PLANTED(cosine_dropped) ? 1.0 : cosine);
    return colour * material.radiance * (f_cosine * weight / density);
}

#endif
