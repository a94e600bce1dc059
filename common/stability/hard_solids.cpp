// Generators of the cases about spheres and cuboids (scenes/hard/README.md).
#include <cmath>
#include <numbers>

#include "common/stability/generators.h"
#include "common/stability/hard_scenes.h"

namespace tandem::stability {

namespace {

using glm::dmat3;
using glm::dmat4;
using glm::dvec3;

// A unit vector across `axis`.
dvec3 across(const dvec3& axis, Dice& dice) {
    dvec3 side(0.0);
    do side = glm::cross(axis, dice.direction());
    while (glm::dot(side, side) < 0.01);
    return glm::normalize(side);
}

// A unit sphere at a distance from the origin, seen from there: within 0.99 of its disc, or 1.01 and more beside it.
RayWork far_sphere(double distance, Dice& dice) {
    RayWork work;
    work.scene = empty_scene();
    const dvec3 centre = rounded(distance * dice.direction());
    add_sphere(work.scene, centre, 1.0);
    // A direction is off by sqrt(3) u at most: the ray by that much of the distance beside its aim.
    const double margin = 0.01 + 2.0 * std::sqrt(3.0) * 0x1p-24 * distance + 24.0 * 0x1p-24 * distance;
    work.aim = [=](Dice& d) {
        const bool within = d.unit() < 0.75;
        const double r = within ? (1.0 - margin) * std::sqrt(d.unit()) : 1.0 + margin + d.unit();
        const dvec3 axis = glm::normalize(centre);
        const dvec3 aim = centre + r * across(axis, d);
        return JudgedRay{.ray = ray_along(dvec3(0.0), glm::normalize(aim)), .must = within ? Must::hit : Must::miss};
    };
    return work;
}

// A sphere of a planet's radius below the origin, seen from 1 to 1000 above: down to 1 degree under the horizontal.
RayWork planet(double radius, Dice&) {
    RayWork work;
    work.scene = empty_scene();
    add_sphere(work.scene, {0.0, -radius, 0.0}, radius);
    work.aim = [](Dice& d) {
        const double height = std::exp2(d.between(0.0, 10.0)), down = glm::radians(d.between(2.0, 90.0));
        const double angle = 2.0 * std::numbers::pi * d.unit();
        const dvec3 way(std::cos(angle) * std::cos(down), -std::sin(down), std::sin(angle) * std::cos(down));
        return JudgedRay{.ray = ray_along({0.0, height, 0.0}, way), .must = Must::hit};
    };
    return work;
}

// From within a sphere, its surface included: the far side is met.
RayWork within_sphere(Dice& dice) {
    RayWork work;
    work.scene = empty_scene();
    const dvec3 centre = rounded(2.0 * dice.direction());
    add_sphere(work.scene, centre, 1.0);
    work.aim = [centre](Dice& d) {
        const dvec3 out = d.direction();
        if (d.unit() < 0.5)
            return JudgedRay{
                .ray = ray_along(centre + 0.999 * std::cbrt(d.unit()) * out, d.direction()), .must = Must::hit};
        // On the surface, inwards: leaving it, so that the exit is met whatever side rounding put the origin on.
        const dvec3 in = glm::normalize(-out + 0.999 * d.unit() * across(out, d));
        GivenRay ray = ray_along(centre + out, in);
        ray.left_primitive = 0;
        ray.inside = true;
        return JudgedRay{.ray = ray, .must = Must::hit};
    };
    return work;
}

// Rays that touch a sphere to within rounding: anything but a hit off the surface.
RayWork tangent(Dice& dice) {
    RayWork work;
    work.scene = empty_scene();
    const dvec3 centre = rounded(dice.direction());
    add_sphere(work.scene, centre, 1.0);
    work.aim = [centre](Dice& d) {
        const dvec3 out = d.direction(), way = across(out, d);
        const double lift = 1.0 + (static_cast<double>(d.below(129)) - 64.0) * 0x1p-23;
        return JudgedRay{.ray = ray_along(centre + lift * out - d.between(0.5, 8.0) * way, way)};
    };
    return work;
}

// From within a cuboid, its faces and edges included, anywhere and towards its edges and corners: the exit is met.
RayWork within_cuboid(bool turned, Dice& dice) {
    RayWork work;
    work.scene = empty_scene();
    const dmat4 place = turned ? dmat4(dice.rotation()) : dmat4(1.0);
    const dvec3 half(1.0, 0.5, 2.0);
    add_cuboid(work.scene, -half, half, place);
    const auto world = [place](const dvec3& p) { return dvec3(place * glm::dvec4(p, 1.0)); };
    work.aim = [=](Dice& d) {
        dvec3 p = half * dvec3(d.between(-0.99, 0.99), d.between(-0.99, 0.99), d.between(-0.99, 0.99)), target = p;
        // A corner, or an edge: two coordinates or all three at their ends.
        const std::size_t free = d.below(4);
        for (int axis = 0; axis < 3; ++axis) {
            target[axis] = half[axis] * (d.unit() < 0.5 ? 1.0 : -1.0);
            if (free == static_cast<std::size_t>(axis)) target[axis] *= d.between(-0.99, 0.99);
        }
        if (!turned && d.unit() < 0.5) {
            // Exactly on one face, or two, and across them or along: along the boundary is within.
            const int axis = static_cast<int>(d.below(3));
            p[axis] = half[axis];
            p = rounded(p);
            dvec3 way(0.0);
            way[(axis + 1) % 3] = d.unit() < 0.5 ? 1.0 : -1.0;
            return JudgedRay{.ray = ray_along(p, way), .must = Must::hit};
        }
        return JudgedRay{.ray = ray_towards(world(p), world(target)), .must = Must::hit};
    };
    return work;
}

// Cuboids without height, met from both sides; and along their plane, where a hit must at least lie on them.
RayWork flat_cuboid(int axis, Dice&) {
    RayWork work;
    work.scene = empty_scene();
    dvec3 half(1.0);
    half[axis] = 0.0;
    const dvec3 centre(0.25, -0.5, 0.75);
    add_cuboid(work.scene, centre - half, centre + half);
    work.aim = [=](Dice& d) {
        const bool along = d.unit() < 0.2;
        dvec3 target = centre + 0.99 * half * dvec3(d.between(-1, 1), d.between(-1, 1), d.between(-1, 1));
        dvec3 way = d.direction();
        way[axis] = along ? 0.0 : way[axis] + std::copysign(0.2, way[axis]);
        const dvec3 origin = target - 4.0 * glm::normalize(way);
        GivenRay ray = ray_towards(origin, target);
        return JudgedRay{.ray = ray, .must = along ? Must::either : Must::hit};
    };
    return work;
}

// From outside along an edge of a cuboid, in the plane of a face, or at a corner.
RayWork cuboid_rims(Dice&) {
    RayWork work;
    work.scene = empty_scene();
    const dvec3 half(1.0, 0.5, 2.0);
    add_cuboid(work.scene, -half, half);
    work.aim = [half](Dice& d) {
        const int axis = static_cast<int>(d.below(3));
        dvec3 origin = half * dvec3(d.unit() < 0.5 ? 1 : -1, d.unit() < 0.5 ? 1 : -1, d.unit() < 0.5 ? 1 : -1),
              way(0.0);
        if (d.unit() < 0.5) {
            // Along the edge, exactly, or within the plane of a face: the boundary belongs to the body.
            if (d.unit() < 0.5) origin[(axis + 1) % 3] *= d.between(-0.99, 0.99);
            origin = rounded(origin);
            way[axis] = 1.0;
            origin[axis] = -6.0;
            return JudgedRay{.ray = ray_along(origin, way), .must = Must::hit};
        }
        const dvec3 corner = origin;
        return JudgedRay{.ray = ray_towards(corner + 4.0 * d.direction(), corner)};
    };
    return work;
}

// A ray that starts on the plane of a face and lies in it, its direction +-0 there; and in planes of a hierarchy's
// boxes.
RayWork slab_planes(Dice&) {
    RayWork work;
    work.scene = empty_scene();
    for (int i = 0; i < 100; ++i) add_cuboid(work.scene, dvec3(4.0 * i, -1, -1), dvec3(4.0 * i + 2.0, 1, 1));
    work.aim = [](Dice& d) {
        const double i = static_cast<double>(d.below(100)), zero = d.unit() < 0.5 ? 0.0 : -0.0;
        const double side = d.unit() < 0.5 ? 1.0 : -1.0;
        if (d.unit() < 0.5)  // x on a face's plane
            return JudgedRay{
                .ray = ray_along(
                    {4.0 * i + (d.unit() < 0.5 ? 0.0 : 2.0), 3.0 * side, d.between(-0.9, 0.9)}, {zero, -side, zero}),
                .must = Must::hit,
                .primitive = static_cast<std::uint32_t>(i)};
        return JudgedRay{
            .ray = ray_along({4.0 * i + 1.0, d.unit() < 0.5 ? 1.0 : -1.0, 5.0 * side}, {zero, zero, -side}),
            .must = Must::hit,
            .primitive = static_cast<std::uint32_t>(i)};
    };
    return work;
}

}  // namespace

std::vector<RayWork> make_convex_work(const HardCase& c, Dice& dice) {
    if (c.generator == "far-spheres") return {far_sphere(parameter(c, "distance"), dice)};
    if (c.generator == "planet") return {planet(parameter(c, "radius"), dice)};
    if (c.generator == "within-spheres") return {within_sphere(dice), within_sphere(dice)};
    if (c.generator == "tangents") return {tangent(dice), tangent(dice)};
    if (c.generator == "within-cuboids") return {within_cuboid(false, dice), within_cuboid(true, dice)};
    if (c.generator == "flat-cuboids") return {flat_cuboid(0, dice), flat_cuboid(1, dice), flat_cuboid(2, dice)};
    if (c.generator == "cuboid-rims") return {cuboid_rims(dice)};
    if (c.generator == "slab-planes") return {slab_planes(dice)};
    return {};
}

}  // namespace tandem::stability
