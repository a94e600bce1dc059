// The point and normal of a hit, and the origin of the next ray (MODEL.md section 5, "Leaving a surface"). They are
// rebuilt from the primitive, not from the ray, so that the error does not grow with the ray's length.
#ifndef SURFACE_GLSL
#define SURFACE_GLSL
#include "geometry/intersection_choices.glsl"
#include "geometry/roundoff.glsl"

struct Surface {
    vec3 point;
    vec3 normal;  // unit, to the front
    vec3 error;   // bound on the rounding error of each coordinate of the point
    vec3 rest;    // the point with the entity's motion taken out
};

uint kind_of(uint slot) {
    if (has_triangles && (in_mesh(slot) || slot < triangle_total())) return kind_triangle;
    return has_spheres && slot < triangle_total() + sphere_total() ? kind_sphere : kind_cuboid;
}

// A plane is met again by its neighbours as dot(corner - origin, normal). Roundings: two points subtracted (1),
// products (1), sums (2). Both normals have rounded edges (3 each), and the unit one 1 more. In all these are 11,
// besides those of the point. Where all terms vanish, as on planes through 0, one unit of the largest corner still
// keeps the origin off them.
#ifdef DEVICE_TRIANGLES
// A device's own test is its own matter; Vulkan bounds none of its errors. Taken for granted is what watertight tests have in
// common [Woop 2013]. Corners, rounded when they were placed (3), are moved to the origin (1) and sheared along the ray (3).
// Weights are differences of products of two such numbers (7 + 7 + 2). Depths, rounded 5 times, are weighed (1) and summed
// up (2): 24 roundings, besides the 12 of the point.
// Errors of the weights move the hit within the plane, by the roundings of a corner times length over height of the triangle.
// Along a ray that grazes the plane this is a distance from it. For slimmer triangles than 4 the offset stays below the
// gap between bodies in contact (rule 30). A neighbour in the same plane may then be met anew. The triangle itself is
// not (traced_rays.glsl).
const float gamma_plane = 36.0001 * unit_roundoff;  // gamma(36), rounded up
const float most_slimness = 4.0;
float slimness(Triangle triangle, TriangleFacts facts) {
    const vec3 a = triangle.corner1.xyz - triangle.corner0.xyz, b = triangle.corner2.xyz - triangle.corner1.xyz,
               c = triangle.corner0.xyz - triangle.corner2.xyz;
    return clamp(max(dot(a, a), max(dot(b, b), dot(c, c))) / facts.doubled_area, 1.0, most_slimness);
}
#else
const float gamma_plane = 23.0001 * unit_roundoff;  // gamma(23), rounded up
#endif
const float least_offset = unit_roundoff;

// By rounding, a hit next to an edge may lie beyond the neighbour there. A ray that leaves towards that neighbour would
// miss it and get out of a closed mesh. So points within a margin of an edge move inwards by it, in the plane. The
// margin: weights are off by 10 u, and points by gamma(11), of the largest corner; together below gamma(32) of it. A
// neighbour may also stand over the triangle at an angle, and the ray starts up to twice the point's error above it.
// Moving by 8 times that error is more than enough where the angle's tangent is above 1/4, 14 degrees. No move is more
// than a quarter of the triangle's least height, since what moves away from one edge moves as far towards others.
const float gamma_margin = 32.0001 * unit_roundoff;
const float margin_of_error = 8.0;

vec3 drawn_in(Triangle triangle, TriangleFacts facts, vec3 weights, vec3 point, float error) {
    const vec3 normal = facts.normal;
    const float reach = facts.reach, doubled_area = facts.doubled_area;
    const vec3 corners[3] = vec3[3](triangle.corner0.xyz, triangle.corner1.xyz, triangle.corner2.xyz);
    // Handed on as a float, the point lies up to sqrt(3) roundings of itself elsewhere.
    const float handed = 4.0 * handed_roundoff * max(abs(point.x), max(abs(point.y), abs(point.z)));
    const float margin = max(gamma_margin * reach + handed, margin_of_error * error);
    // No edge is longer than the diagonal of the cube that holds the corners, 2 sqrt(3) reach.
    if (min(weights.x, min(weights.y, weights.z)) * doubled_area >= margin * 3.465 * reach) return point;
    const vec3 sides =
        vec3(length(corners[1] - corners[0]), length(corners[2] - corners[1]), length(corners[0] - corners[2]));
    const float longest = max(sides.x, max(sides.y, sides.z));
    if (longest == 0.0) return point;
    const float move = min(margin, 0.25 * doubled_area / longest);
    for (uint i = 0; i < 3; ++i) {
        const vec3 begin = corners[(i + 1) % 3], edge = corners[(i + 2) % 3] - begin;  // across from corner i
        const float long_side = length(edge);
        if (long_side == 0.0) continue;
        const vec3 across = cross(normal, edge) / long_side;
        const float height = dot(across, corners[i] - begin);
        if (weights[i] * abs(height) < margin) point += (height < 0.0 ? -move : move) * across;
    }
    return point;
}

// u = 2^-24 is the unit roundoff. A point is a sum of products in which no term passes through more than ten roundings.
// Triangle: weight 0 (2), product (1), sums (2), and the division that gave the weights (2, shared). Sphere and cuboid:
// the unit point (5, by its normalisation), product (1), sums (3). One more is due to the move itself. So each
// coordinate is off by at most gamma(11) = 11 u / (1 - 11 u) times the sum of the absolute terms [Higham 2002, section
// 3.1].
const float gamma_point = 11.0001 * unit_roundoff;

// Bound on a point of a triangle; p1 and p2 are its corners 1 and 2 times their weights. Weight 0 alone has an absolute
// error, of 2 u.
vec3 plane_error(Triangle triangle, vec3 p1, vec3 p2, float reach) {
    return (gamma_plane + handed_roundoff) * (abs(triangle.corner0.xyz) + abs(p1) + abs(p2)) + least_offset * reach;
}

// What the motion of its entity adds to the error of a point. Product and sum round once each, and the motion was
// rounded before: three times u of both terms. One more is for moving the ray's origin to the entity at rest and back.
vec3 error_in_motion(vec3 point, vec3 motion) {
    return motion == vec3(0.0) ? vec3(0.0) : 4.0 * unit_roundoff * (abs(point) + abs(motion));
}

// Corners far beyond the view make the mean of them coarse there: each coordinate is off by the rounding of the corners.
// The ray's own point is off by roundings of what lies near, and is projected onto the plane. Off the plane it is no worse.
// With s the sum of the corners' absolute terms along an axis, no term of dot(point - corner, normal) is above its |n| s.
// Each passes difference (1), product (1) and sums (2), then the product with the normal (1), whose own rounding tilts
// it (4). With the last subtraction (1) these are 10, where gamma_plane has 11 for the mean. Within the plane the ray's
// point is off by less than 8 u of its terms. The margin of drawn_in holds that while they are below the corners'.
bool knows_better(TriangleFacts facts, Ray ray, float t) {
    const vec3 origin = abs(ray.origin);
    return facts.reach > far_corner && max(origin.x, max(origin.y, origin.z)) + t < facts.reach;
}

vec3 on_plane(Triangle triangle, vec3 normal, Ray ray, float t) {
    precise vec3 point = ray.origin + t * ray.direction;
    precise float height = dot(point - triangle.corner0.xyz, normal);
    precise vec3 projected = point - height * normal;
    return projected;
}

// local: weights of corners 1 and 2, and t. motion: of its entity.
Surface triangle_surface(Triangle triangle, TriangleFacts facts, vec3 local, Ray ray, vec3 motion) {
    const vec2 weights = local.xy;
    precise float weight0 = 1.0 - weights.x - weights.y;
    precise vec3 p0 = weight0 * triangle.corner0.xyz;
    precise vec3 p1 = weights.x * triangle.corner1.xyz;
    precise vec3 p2 = weights.y * triangle.corner2.xyz;
    precise vec3 point = p0 + p1 + p2;
    float least_reach = facts.reach;
    if (has_far_corners && motion == vec3(0.0) && knows_better(facts, ray, local.z)) {
        point = on_plane(triangle, facts.normal, ray, local.z);
        // Where all terms vanish, one unit of the point keeps the origin off the plane, too.
        least_reach = max(max(abs(point.x), abs(point.y)), max(abs(point.z), facts.reach / 1024.0));
    }
#ifdef DEVICE_TRIANGLES
    const vec3 error = slimness(triangle, facts) * plane_error(triangle, p1, p2, least_reach);
#else
    const vec3 error = plane_error(triangle, p1, p2, least_reach);
#endif
    point = drawn_in(triangle, facts, vec3(weight0, weights), point,
        dot(abs(facts.normal), error + error_in_motion(point, motion)));
    return Surface(point, facts.normal, error, point);
}

vec3 convex_extent(Convex shape) { return vec3(shape.to_world0.w, shape.to_world1.w, shape.to_world2.w); }

vec3 convex_point(Convex shape, vec3 x) {
    precise vec3 p = map_to_world(shape, x) + vec3(shape.to_unit0.w, shape.to_unit1.w, shape.to_unit2.w);
    return p;
}

// Gradients go to the world by the transpose of the world-to-unit map.
vec3 convex_normal(Convex shape, vec3 gradient) {
    if (unturned) return normalize(vec3(shape.to_unit0.x, shape.to_unit1.y, shape.to_unit2.z) * gradient);
    return normalize(shape.to_unit0.xyz * gradient.x + shape.to_unit1.xyz * gradient.y + shape.to_unit2.xyz * gradient.z);
}

vec3 face_axis(uint face) {
    const float side = (face & 1u) != 0u ? 1.0 : -1.0;
    return vec3(face < 2u ? side : 0.0, face >= 2u && face < 4u ? side : 0.0, face >= 4u ? side : 0.0);
}

vec3 convex_error(Convex shape, vec3 x) {
    const vec3 spread = mapped(abs(shape.to_world0), abs(shape.to_world1), abs(shape.to_world2), abs(x)) +
        abs(vec3(shape.to_unit0.w, shape.to_unit1.w, shape.to_unit2.w));
    return (gamma_point + handed_roundoff) * spread;
}

Surface convex_surface(Convex shape, vec3 x, vec3 gradient) {
    const vec3 point = convex_point(shape, x);
    return Surface(point, convex_normal(shape, gradient), convex_error(shape, x), point);
}

// Bound on the error of all points of the primitive, such as planes that coincide with its faces may have.
vec3 error_of_planes(uint slot, Surface surface) {
    if (kind_of(slot) == kind_triangle) return surface.error;
    const Convex shape = convex_at(slot);
    return max(surface.error, convex_error(shape, convex_extent(shape)));
}

// To where the entity is at `time` (MODEL.md section 6).
void move_surface(inout Surface surface, vec3 motion, float time) {
    if (motion == vec3(0.0)) return;
    const vec3 shift = time * motion;
    surface.error += error_in_motion(surface.rest, motion);
    surface.point = surface.rest + shift;
}

// ray: that met it; read where has_far_corners alone.
Surface surface_at(uint slot, uint face, vec3 local, Ray ray, float time) {
    Surface surface;
    const uint kind = kind_of(slot);
    const vec3 motion = has_entity_motion ? transforms[placed_at(slot).entity].motion : vec3(0.0);
    if (has_triangles && kind == kind_triangle)
        surface = triangle_surface(triangle_of(slot), triangle_facts(slot), local, ray, motion);
    else
        surface = convex_surface(convex_at(slot), local, kind == kind_sphere ? local : face_axis(face));
    // A sphere has no coplanar neighbours, and rays that leave it pass it over: moved, their origins would only get into
    // what touches it.
    if (kind == kind_sphere) surface.error = vec3(0.0);
    if (PLANTED(face_normal_flipped) && kind == kind_cuboid && face == 5u) surface.normal = -surface.normal;
    if (has_entity_motion) move_surface(surface, motion, time);
    if (PLANTED(normal_transform_wrong)) {
        const EntityTransform m = transforms[placed_at(slot).entity];
        const vec3 n = normalize(m.to_world0.xyz * surface.normal.x + m.to_world1.xyz * surface.normal.y +
                                 m.to_world2.xyz * surface.normal.z);  // in object space
        surface.normal = normalize(vec3(dot(m.to_world0.xyz, n), dot(m.to_world1.xyz, n), dot(m.to_world2.xyz, n)));
    }
    return surface;
}

// Each coordinate moved by up to 256 representable numbers, near 0 by a fixed way [Wächter 2019].
#ifdef DOUBLE_GEOMETRY
double moved_by(double x, int steps) {
    uvec2 bits = unpackDouble2x32(x);
    uint carry;
    bits.x = uaddCarry(bits.x, uint(steps), carry);
    bits.y += carry - (steps < 0 ? 1u : 0u);
    return packDouble2x32(bits);
}
dvec3 moved_by(dvec3 p, ivec3 steps) { return dvec3(moved_by(p.x, steps.x), moved_by(p.y, steps.y), moved_by(p.z, steps.z)); }
#else
vec3 moved_by(vec3 p, ivec3 steps) { return intBitsToFloat(floatBitsToInt(p) + steps); }
#endif

vec3 moved_by_ulps(vec3 point, vec3 side) {
    const ivec3 steps = ivec3(256.0 * side);
    const vec3 far = moved_by(point, mix(steps, -steps, lessThan(point, vec3(0.0))));
    precise vec3 near = point + side / 65536.0;
    return mix(far, near, lessThan(abs(point), vec3(1.0 / 32.0)));
}

// Moves the origin along `side`, the normal on the side that the ray goes to, by the bound on the point's error along it.
vec3 offset_ray_origin(Surface surface, vec3 side) {
    if (guard == guard_ulp) return moved_by_ulps(surface.point, side);
    precise float distance = dot(abs(side), surface.error);
    if (guard == guard_fixed_epsilon) distance = guard_epsilon;
    if (guard == guard_exclusion) return surface.point;
    precise vec3 origin = surface.point + distance * side;
    return origin;
}

#endif
