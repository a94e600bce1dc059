// Generators of the cases about triangles, and about rays as such (scenes/hard/README.md).
#include <algorithm>
#include <cfloat>
#include <cmath>
#include <numbers>

#include "common/stability/generators.h"
#include "common/stability/hard_scenes.h"

namespace tandem::stability {

namespace {

using glm::dmat3;
using glm::dmat4;
using glm::dvec3;

constexpr double infinity = std::numeric_limits<double>::infinity();

// Two triangles that share the diagonal of a crooked quadrilateral.
RayWork shared_edge(Dice& dice) {
    RayWork work;
    work.scene = empty_scene();
    const dmat3 turn = dice.rotation();
    const dvec3 shift = dice.between(0.0, 4.0) * dice.direction();
    Mesh mesh;
    for (const dvec3& p : {dvec3(-1, 0, 0), dvec3(0, -dice.between(0.1, 1.0), 0.3), dvec3(1, 0, 0),
             dvec3(0, dice.between(0.1, 1.0), -0.2)})
        mesh.vertices.push_back(rounded(turn * p + shift));
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    add_mesh(work.scene, mesh);
    work.aim = [mesh, turn](Dice& d) {
        const dvec3 target = glm::mix(mesh.vertices[0], mesh.vertices[2], d.between(0.05, 0.95));
        // From either side, never along the edge: the surface spreads to both sides of it as seen from there.
        const dvec3 way =
            turn * glm::normalize(dvec3(d.between(-1, 1), d.between(-0.2, 0.2), d.unit() < 0.5 ? 1.0 : -1.0));
        return JudgedRay{.ray = ray_towards(target + std::exp2(d.between(-3, 8)) * way, target), .must = Must::hit};
    };
    return work;
}

// A closed fan of n triangles around a vertex that stands out of the plane of the others.
RayWork fan(int count, Dice& dice) {
    RayWork work;
    work.scene = empty_scene();
    const dmat3 turn = dice.rotation();
    const dvec3 shift = dice.between(0.0, 4.0) * dice.direction();
    Mesh mesh;
    mesh.vertices.push_back(rounded(turn * dvec3(0, 0, 0.3) + shift));
    for (int i = 0; i < count; ++i) {
        const double angle = 2.0 * std::numbers::pi * (i + 0.4 * dice.unit()) / count;
        mesh.vertices.push_back(rounded(turn * dvec3(std::cos(angle), std::sin(angle), 0.0) + shift));
    }
    for (int i = 0; i < count; ++i)
        mesh.triangles.push_back(
            {0, static_cast<std::uint32_t>(1 + i), static_cast<std::uint32_t>(1 + (i + 1) % count)});
    add_mesh(work.scene, mesh);
    work.aim = [mesh, turn](Dice& d) {
        const dvec3 way =
            turn * glm::normalize(dvec3(d.between(-0.5, 0.5), d.between(-0.5, 0.5), d.unit() < 0.5 ? 1 : -1));
        return JudgedRay{.ray = ray_towards(mesh.vertices[0] + std::exp2(d.between(-3, 8)) * way, mesh.vertices[0]),
            .must = Must::hit};
    };
    return work;
}

// From within a closed mesh towards its seams: every ray hits.
RayWork closed_mesh(const dvec3& centre, double radius, int cuts, Dice& dice) {
    RayWork work;
    work.scene = empty_scene();
    const Mesh mesh = ball_mesh(dice.rotation(), centre, radius, cuts);
    add_mesh(work.scene, mesh);
    work.aim = [mesh, centre, radius](Dice& d) {
        return JudgedRay{.ray = ray_towards(centre + 0.5 * radius * d.unit() * d.direction(), seam_point(mesh, d)),
            .must = Must::hit};
    };
    return work;
}

// Through a closed convex mesh from outside, by way of a seam: in, out and no more.
RayWork parity(int cuts, Dice& dice) {
    RayWork work;
    work.scene = empty_scene();
    const Mesh mesh = ball_mesh(dice.rotation(), 2.0 * dice.direction(), 1.0, cuts);
    add_mesh(work.scene, mesh);
    const dvec3 centre = 0.5 * (mesh.vertices[0] + mesh.vertices[3]);  // opposite corners of the icosahedron
    work.aim = [mesh, centre](Dice& d) {
        const dvec3 target = seam_point(mesh, d);
        const dvec3 out = glm::normalize(target - centre);
        const dvec3 origin = target + d.between(0.5, 4.0) * glm::normalize(out + 0.7 * d.unit() * d.direction());
        return JudgedRay{.ray = ray_towards(origin, target), .must = Must::hit, .leads_on = true};
    };
    work.follow = [](const JudgedRay& before, const RayHit& hit, Dice&) -> std::optional<JudgedRay> {
        JudgedRay next = before;
        // The ray meets the surface at 45 degrees at least, so its way within is longer than 1. What lies within 2^-4
        // of a crossing is that crossing.
        if (before.ray.t_min == 0.0) {
            next.ray.t_min = hit.t + 0.0625;
            next.must = Must::hit;
        } else {
            next.ray.t_min = hit.t + 0.0625;
            next.must = Must::miss;
            next.leads_on = false;
        }
        return next;
    };
    return work;
}

// A sheet of slivers, seen at half a degree: rays towards the edges between them.
RayWork slivers(double aspect, double degrees, Dice& dice) {
    RayWork work;
    work.scene = empty_scene();
    const dmat3 turn = dice.rotation();
    const dvec3 shift = dice.between(0.0, 2.0) * dice.direction();
    Mesh mesh;
    constexpr std::uint32_t strips = 16;
    for (std::uint32_t i = 0; i <= strips; ++i)
        for (const double x : {-1.0, 1.0})
            mesh.vertices.push_back(rounded(turn * dvec3(x, 2.0 * i / aspect, 0.0) + shift));
    for (std::uint32_t i = 0; i < strips; ++i) {
        mesh.triangles.push_back({2 * i, 2 * i + 1, 2 * i + 3});
        mesh.triangles.push_back({2 * i, 2 * i + 3, 2 * i + 2});
    }
    add_mesh(work.scene, mesh);
    const double slope = std::sin(glm::radians(degrees));
    work.aim = [mesh, turn, slope](Dice& d) {
        const std::uint32_t row = 2 * static_cast<std::uint32_t>(1 + d.below(strips - 1));
        const dvec3 target = glm::mix(mesh.vertices[row], mesh.vertices[row + 1], d.between(0.2, 0.8));
        const dvec3 way = turn * glm::normalize(dvec3(d.between(-1, 1), d.between(-1, 1), 0) + dvec3(0, 0, slope));
        // The sheet is thinner than rounding may turn a ray sideways: no hit is promised, but what is hit is on it.
        return JudgedRay{.ray = ray_towards(target + d.between(1.0, 3.0) * way, target)};
    };
    return work;
}

// Triangles of no area: three equal corners, two, and three on a line. Alone nothing is hit, over a quad the quad is.
RayWork degenerate(bool over_quad, Dice& dice) {
    RayWork work;
    work.scene = empty_scene();
    const dvec3 a(0.25, 0.25, 0.0), b(-0.5, 0.25, 0.0), c(-0.125, 0.25, 0.0);
    add_mesh(work.scene, {{a, b, c}, {{0, 0, 0}, {0, 1, 1}, {0, 1, 2}, {2, 1, 0}, {0, 1, 0}}});
    if (over_quad) add_mesh(work.scene, {{{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}}, {{0, 1, 2}, {0, 2, 3}}});
    const bool on_quad = over_quad;
    work.aim = [=](Dice& d) {
        const dvec3 target = glm::mix(a, b, d.unit());
        JudgedRay ray{
            .ray = ray_towards(target + d.between(0.5, 8.0) * glm::normalize(d.direction() + dvec3(0, 0, 1.5)), target),
            .must = on_quad ? Must::hit : Must::miss};
        return ray;
    };
    static_cast<void>(dice);
    return work;
}

// Rays in the plane z = 0.5 of a triangle, exactly: a miss (MODEL.md section 5.2).
RayWork in_plane(Dice&) {
    RayWork work;
    work.scene = empty_scene();
    add_mesh(work.scene, {{{-1, -1, 0.5}, {1, -1, 0.5}, {0, 1, 0.5}}, {{0, 1, 2}}});
    work.aim = [](Dice& d) {
        const double angle = 2.0 * std::numbers::pi * d.unit();
        return JudgedRay{
            .ray = ray_along({d.between(-3, 3), d.between(-3, 3), 0.5}, {std::cos(angle), std::sin(angle), 0.0}),
            .must = Must::miss};
    };
    return work;
}

// A triangle of size 10^-6 at the origin, met along the axis from a distance of 10^3: what passes is exact.
RayWork tiny(double size, double distance, Dice&) {
    RayWork work;
    work.scene = empty_scene();
    const dvec3 a = rounded({-size, -size, 0}), b = rounded({size, -size, 0}), c = rounded({0, size, 0});
    add_mesh(work.scene, {{a, b, c}, {{0, 1, 2}}});
    work.aim = [=](Dice& d) {
        // Well within or well beyond the edges, by a quarter of the size.
        const bool within = d.unit() < 0.5;
        const double s = d.between(0.25, 0.5), r = d.between(0.25, 0.5);
        const dvec3 target =
            within ? a + s * (b - a) + r * 0.5 * (c - a) * 0.9 : size * (3.0 + d.unit()) * dvec3(1, 1, 0);
        return JudgedRay{
            .ray = ray_along({target.x, target.y, distance}, {0, 0, -1}), .must = within ? Must::hit : Must::miss};
    };
    return work;
}

// The same rays at a mesh and at its image under scaling by 2^k: the same hits, scaled, to the bit.
RayWork scaled_world(int exponent, Dice& dice) {
    RayWork work = closed_mesh(dvec3(1.0, -2.0, 3.0), 1.0, 1, dice);
    const double factor = std::exp2(exponent);
    work.scaled_twin = factor;
    work.twin = work.scene;
    for (dvec3& v : work.twin.vertices) v *= factor;
    return work;
}

// Equal triangles on top of each other: the lowest id wins.
RayWork coplanar(int copies, Dice& dice) {
    RayWork work;
    work.scene = empty_scene();
    const Mesh mesh = ball_mesh(dice.rotation(), dvec3(0.5, 0.25, -1.0), 1.0, 0);
    for (int i = 0; i < copies; ++i) add_mesh(work.scene, mesh);
    work.aim = [mesh](Dice& d) {
        const auto index = static_cast<std::uint32_t>(d.below(mesh.triangles.size()));
        const auto& t = mesh.triangles[index];
        const double s = d.between(0.1, 0.4), r = d.between(0.1, 0.4);
        const dvec3 &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
        return JudgedRay{.ray = ray_towards(dvec3(0.5, 0.25, -1.0), a + s * (b - a) + r * (c - a)),
            .must = Must::hit,
            .primitive = index};
    };
    return work;
}

// Two sheets at z = 1 and k ulp below, along the axis (exact) or aslant where the gap exceeds the bound.
RayWork sheets(double gap, bool aslant, Dice&) {
    RayWork work;
    work.scene = empty_scene();
    const auto sheet = [&](double z) {
        add_mesh(work.scene, {{{-8, -8, z}, {8, -8, z}, {8, 8, z}, {-8, 8, z}}, {{0, 1, 2}, {0, 2, 3}}});
    };
    sheet(1.0 - gap);
    sheet(1.0);
    work.aim = [aslant](Dice& d) {
        const dvec3 way = aslant ? glm::normalize(d.direction() * 0.5 + dvec3(0, 0, 1)) : dvec3(0, 0, 1);
        const dvec3 target(d.between(0.5, 2.0), d.between(-2.0, -0.5), 1.0);  // clear of the diagonal
        GivenRay ray = ray_along(target + way, -way);
        if (!aslant) ray.origin.z = 2.0;
        return JudgedRay{.ray = ray, .must = Must::hit, .primitive = target.x > target.y ? 2u : 3u};
    };
    return work;
}

// A quad, a cuboid's face and a sphere's pole at distance exactly 2: the interval is closed.
RayWork interval_ends(int kind, Dice&) {
    RayWork work;
    work.scene = empty_scene();
    if (kind == 0) add_mesh(work.scene, {{{-8, -8, 0}, {8, -8, 0}, {8, 8, 0}, {-8, 8, 0}}, {{0, 1, 2}, {0, 2, 3}}});
    if (kind == 1) add_cuboid(work.scene, {-8, -8, -4}, {8, 8, 0});
    if (kind == 2) add_sphere(work.scene, {0, 0, -1}, 1.0);
    // Above the leaf limit of the cpu backend, so that its hierarchy is asked too.
    if (kind == 3) {
        add_mesh(work.scene, {{{-8, -8, 0}, {8, -8, 0}, {8, 8, 0}, {-8, 8, 0}}, {{0, 1, 2}, {0, 2, 3}}});
        for (int i = 0; i < 100; ++i)
            add_mesh(work.scene, {{{-8, -8, -9.0 - i}, {8, -8, -9.0 - i}, {8, 8, -9.0 - i}}, {{0, 1, 2}}});
    }
    const bool pole = kind == 2;
    work.aim = [pole](Dice& d) {
        const double x = pole ? 0.0 : std::floor(d.between(1, 64)) / 16.0,
                     y = pole ? 0.0 : -std::floor(d.between(1, 64)) / 16.0;
        const double t = d.unit() < 0.1 ? 0.0 : 2.0;
        JudgedRay ray{.ray = ray_along({x, y, t}, {0, 0, -1}), .must = Must::hit};
        switch (d.below(4)) {
            case 0:
                ray.ray.t_min = t;
                ray.ray.t_max = t + 0.5;
                ray.t = t;
                break;
            case 1:
                ray.ray.t_max = t;
                ray.t = t;
                break;
            case 2:
                ray.ray.t_min = std::max(std::nextafter(static_cast<float>(t), 8.0f), FLT_MIN);  // MODEL.md 5.2
                ray.ray.t_max = t + 0.5;
                ray.must = Must::miss;
                break;
            default:
                if (t == 0.0) {
                    ray.t = 0.0;
                    break;
                }
                ray.ray.t_max = std::nextafter(static_cast<float>(t), 0.0f);
                ray.must = Must::miss;
        }
        return ray;
    };
    return work;
}

// A box of triangles, a sphere and a cuboid around the origin. Each is met from outside along an axis whose other
// components are +0, -0 or denormal.
RayWork thin_directions(double component, Dice&) {
    RayWork work;
    work.scene = empty_scene();
    Mesh box;
    for (int i = 0; i < 8; ++i) box.vertices.push_back(dvec3(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1));
    constexpr std::uint32_t faces[6][4] = {
        {0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
    for (const auto& f : faces) {
        box.triangles.push_back({f[0], f[1], f[2]});
        box.triangles.push_back({f[0], f[2], f[3]});
    }
    Mesh many = box;  // sixteen times the box, so that hierarchies and their boxes are met
    for (int copy = 1; copy < 16; ++copy) {
        const auto first = static_cast<std::uint32_t>(many.vertices.size());
        for (const dvec3& v : box.vertices) many.vertices.push_back(v + dvec3(0, 0, 4.0 * copy));
        for (const auto& t : box.triangles) many.triangles.push_back({first + t[0], first + t[1], first + t[2]});
    }
    add_mesh(work.scene, many);
    for (int i = 0; i < 16; ++i) add_sphere(work.scene, {8, 0, 4.0 * i}, 1.0);
    for (int i = 0; i < 16; ++i) add_cuboid(work.scene, dvec3(-9, -1, 4.0 * i - 1), dvec3(-7, 1, 4.0 * i + 1));
    work.aim = [component](Dice& d) {
        const double column = 8.0 * (static_cast<double>(d.below(3)) - 1.0);
        const auto thin = [&] {
            return component == 0.0 ? (d.unit() < 0.5 ? 0.0 : -0.0) : d.between(-1, 1) * component;
        };
        const int axis = static_cast<int>(d.below(2));  // x or y: z meets them in a row, from below
        dvec3 origin(column, 0.0, 4.0 * static_cast<double>(d.below(16))), direction(thin(), thin(), thin());
        // On planes of boxes as often as not, where 0 times infinity lurks: x = column - 1, y = +-1 bound the bodies.
        if (d.unit() < 0.5) {
            origin = dvec3(column, 0.0, -8.0);
            direction.z = 1.0;
        } else {
            const double side = d.unit() < 0.5 ? 1.0 : -1.0;
            origin[axis] += 3.0 * side;
            direction[axis] = -side;
        }
        return JudgedRay{.ray = ray_along(origin, direction), .must = Must::hit};
    };
    return work;
}

// NaN and infinity, in every place of a ray that would hit.
RayWork poisoned(Dice&) {
    RayWork work;
    work.scene = empty_scene();
    add_mesh(work.scene, {{{-8, -8, 0}, {8, -8, 0}, {8, 8, 0}, {-8, 8, 0}}, {{0, 1, 2}, {0, 2, 3}}});
    add_sphere(work.scene, {0, 0, 0}, 2.0);
    add_cuboid(work.scene, {-3, -3, -3}, {3, 3, 3});
    for (int i = 0; i < 100; ++i)
        add_mesh(work.scene, {{{-8, -8, -9.0 - i}, {8, -8, -9.0 - i}, {8, 8, -9.0 - i}}, {{0, 1, 2}}});
    work.aim = [](Dice& d) {
        constexpr double poisons[] = {std::numeric_limits<double>::quiet_NaN(), infinity, -infinity};
        const double poison = poisons[d.below(3)];
        JudgedRay ray{.ray = ray_along({d.between(-2, 2), d.between(-2, 2), 5.0}, {0, 0, -1}), .must = Must::miss};
        const int axis = static_cast<int>(d.below(3));
        switch (d.below(4)) {
            case 0:
                ray.ray.origin[axis] = poison;
                break;
            case 1:
                ray.ray.direction[axis] = poison;
                break;
            case 2:
                ray.ray.t_max = std::numeric_limits<double>::quiet_NaN();
                break;
            default:
                ray.ray.direction = dvec3(0.0);
        }
        return ray;
    };
    return work;
}

// Directions of length 10^-20 ... 10^20: t is a world distance all the same.
RayWork lengths(double exponent, Dice&) {
    RayWork work;
    work.scene = empty_scene();
    add_mesh(work.scene, ball_mesh(dmat3(1.0), dvec3(0.0), 2.0, 1));
    work.aim = [exponent](Dice& d) {
        JudgedRay ray{.ray = ray_along(0.5 * d.direction(), d.direction()), .must = Must::hit};
        ray.ray.direction = d.direction() * std::pow(10.0, d.between(-exponent, exponent));
        return ray;
    };
    return work;
}

RayWork empty_world(Dice&) {
    RayWork work;
    work.scene = empty_scene();
    work.aim = [](Dice& d) { return JudgedRay{.ray = ray_along(d.direction(), d.direction()), .must = Must::miss}; };
    return work;
}

// Sheets at 2^(-k/2) of that size, k < 64: whatever halves a hierarchy by place or size grows it deep.
RayWork deep_hierarchy(int levels, Dice&) {
    RayWork work;
    work.scene = empty_scene();
    for (int k = 0; k < levels; ++k) {
        const double s = static_cast<float>(std::exp2(-0.5 * k));
        add_mesh(work.scene, {{{-s, -s, s}, {s, -s, s}, {0, s, s}}, {{0, 1, 2}}});
    }
    work.aim = [levels](Dice& d) {
        const auto k = static_cast<std::uint32_t>(d.below(static_cast<std::size_t>(levels)));
        const double s = static_cast<float>(std::exp2(-0.5 * static_cast<double>(k)));
        GivenRay ray = ray_along({s * d.between(-0.25, 0.25), -0.5 * s, s * 1.125}, {0, 0, -1});
        return JudgedRay{.ray = ray, .must = Must::hit, .primitive = k};
    };
    return work;
}

}  // namespace

std::vector<RayWork> make_triangle_work(const HardCase& c, Dice& dice) {
    const auto number = [&](const char* name) { return parameter(c, name); };
    const auto repeat = [&](auto make) {
        std::vector<RayWork> all;
        for (int i = 0; i < static_cast<int>(number("scenes")); ++i) all.push_back(make());
        return all;
    };
    if (c.generator == "shared-edges") return repeat([&] { return shared_edge(dice); });
    if (c.generator == "fans") {
        std::vector<RayWork> all;
        for (const int n : {3, 4, 5, 6, 7, 8, 11, 16, 23, 32, 45, 64}) all.push_back(fan(n, dice));
        return all;
    }
    if (c.generator == "closed-meshes")
        return repeat([&] {
            return closed_mesh(rounded(number("distance") * dice.direction()), number("radius"),
                static_cast<int>(number("cuts")), dice);
        });
    if (c.generator == "parity") return repeat([&] { return parity(static_cast<int>(number("cuts")), dice); });
    if (c.generator == "slivers") return repeat([&] { return slivers(number("aspect"), number("degrees"), dice); });
    if (c.generator == "degenerate") return {degenerate(false, dice), degenerate(true, dice)};
    if (c.generator == "in-plane") return {in_plane(dice)};
    if (c.generator == "tiny") return {tiny(number("size"), number("distance"), dice)};
    if (c.generator == "scaled-world") return {scaled_world(20, dice), scaled_world(-20, dice)};
    if (c.generator == "coplanar") return {coplanar(2, dice), coplanar(5, dice)};
    if (c.generator == "sheets") {
        std::vector<RayWork> all;
        for (const double k : {1.0, 2.0, 4.0, 16.0, 64.0}) all.push_back(sheets(k * 0x1p-23, false, dice));
        for (const double gap : {64.0 * 0x1p-23, 4e-5}) all.push_back(sheets(static_cast<float>(gap), true, dice));
        return all;
    }
    if (c.generator == "interval-ends") {
        std::vector<RayWork> all;
        for (int kind = 0; kind < 4; ++kind) all.push_back(interval_ends(kind, dice));
        return all;
    }
    if (c.generator == "thin-directions") return {thin_directions(number("component"), dice)};
    if (c.generator == "poisoned") return {poisoned(dice)};
    if (c.generator == "lengths") return {lengths(number("exponent"), dice)};
    if (c.generator == "hierarchies") return {empty_world(dice), tiny(1.0, 4.0, dice), deep_hierarchy(64, dice)};
    return {};
}

}  // namespace tandem::stability
