// Generators of the cases about leaving a surface (scenes/hard/README.md): a ray finds a point, and another leaves it.
#include <cmath>
#include <numbers>

#include "common/stability/generators.h"
#include "common/stability/hard_scenes.h"

namespace tandem::stability {

namespace {

using glm::dmat3;
using glm::dmat4;
using glm::dvec3;

// A direction at `degrees` from the normal, on its side.
dvec3 slanted(const dvec3& normal, double degrees, Dice& dice) {
    dvec3 side(0.0);
    do side = glm::cross(normal, dice.direction());
    while (glm::dot(side, side) < 0.01);
    const double angle = glm::radians(degrees);
    return std::cos(angle) * normal + std::sin(angle) * glm::normalize(side);
}

// The ray that leaves a hit to the side of the normal that `inside` says.
JudgedRay leaving(const RayHit& hit, const dvec3& direction, bool inside, Must must) {
    JudgedRay next{.ray = {}, .must = must, .leaves = true};
    next.ray.origin = inside ? hit.leaving_back : hit.leaving_front;
    next.ray.direction = rounded(direction);
    next.ray.left_primitive = hit.primitive;
    next.ray.inside = inside;
    return next;
}

using Follow = std::function<std::optional<JudgedRay>(const JudgedRay&, const RayHit&, Dice&)>;

// Off to the front of a convex body: nothing more is met. `steepest` and `flattest`: degrees from the normal.
Follow leaves_for_good(double steepest, double flattest) {
    return [=](const JudgedRay&, const RayHit& hit, Dice& d) -> std::optional<JudgedRay> {
        return leaving(hit, slanted(hit.normal, d.between(steepest, flattest), d), false, Must::miss);
    };
}

// Back into a closed body: its other side is met, through seams and all.
Follow stays_inside(double flattest) {
    return [=](const JudgedRay&, const RayHit& hit, Dice& d) -> std::optional<JudgedRay> {
        return leaving(hit, slanted(-hit.normal, d.between(0.0, flattest), d), true, Must::hit);
    };
}

enum class Body { sheet, ball_of_triangles, sphere, cuboid };

// A body about `centre`, met from outside; placed by `placed`, which maps the unit body.
RayWork around(Body body, const dmat4& placed, const dmat3& turned, Follow follow) {
    RayWork work;
    work.scene = empty_scene();
    Mesh mesh;
    if (body == Body::sheet) {
        // Coplanar triangles: a ray that leaves one must not find its neighbour.
        for (int y = 0; y <= 4; ++y)
            for (int x = 0; x <= 4; ++x) mesh.vertices.push_back(turned * dvec3(0.5 * x - 1.0, 0.5 * y - 1.0, 0.0));
        for (std::uint32_t y = 0; y < 4; ++y)
            for (std::uint32_t x = 0; x < 4; ++x) {
                const std::uint32_t a = 5 * y + x;
                mesh.triangles.push_back({a, a + 1, a + 6});
                mesh.triangles.push_back({a, a + 6, a + 5});
            }
    } else if (body == Body::ball_of_triangles) {
        mesh = ball_mesh(turned, dvec3(0.0), 1.0, 1);
    }
    if (!mesh.triangles.empty())
        add_mesh(work.scene, mesh, placed);
    else if (body == Body::sphere)
        add_sphere(work.scene, dvec3(0.0), 1.0, placed);
    else
        add_cuboid(work.scene, dvec3(-1.0), dvec3(1.0), placed * dmat4(turned));
    const auto world = [placed](const dvec3& p) { return dvec3(placed * glm::dvec4(p, 1.0)); };
    work.aim = [=](Dice& d) {
        const dvec3 out = body == Body::sheet ? turned * dvec3(0, 0, 1) : d.direction();
        dvec3 target = 0.5 * d.unit() * d.direction();
        if (body == Body::sheet) target = turned * dvec3(d.between(-0.9, 0.9), d.between(-0.9, 0.9), 0.0);
        if (!mesh.triangles.empty() && d.unit() < 0.5) target = seam_point(mesh, d) * 0.96;
        const dvec3 origin = target + 3.0 * glm::normalize(out + 0.8 * d.unit() * d.direction());
        // Rounding far from 0 may lead beside the body.
        return JudgedRay{.ray = ray_towards(world(origin), world(target)), .leads_on = true};
    };
    work.follow = std::move(follow);
    return work;
}

// A cuboid's inside as twelve triangles, or as a cuboid; from its hits, rays go on inside and towards the corner: none
// leaks.
RayWork concave_corner(bool triangles, Dice& dice) {
    RayWork work;
    work.scene = empty_scene();
    const dmat3 turned = dice.rotation();
    if (triangles) {
        Mesh box;
        for (int i = 0; i < 8; ++i)
            box.vertices.push_back(rounded(turned * dvec3(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1)));
        constexpr std::uint32_t faces[6][4] = {
            {0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
        for (const auto& f : faces) {
            box.triangles.push_back({f[0], f[1], f[2]});
            box.triangles.push_back({f[0], f[2], f[3]});
        }
        add_mesh(work.scene, box);
    } else {
        add_cuboid(work.scene, dvec3(-1.0), dvec3(1.0), dmat4(turned));
    }
    work.aim = [turned](Dice& d) {
        // Close to an edge or a corner.
        dvec3 target(d.between(-1, 1), 0.0, 0.0);
        for (int axis = 1; axis < 3; ++axis)
            target[axis] = (d.unit() < 0.5 ? 1.0 : -1.0) * (1.0 - std::exp2(-d.between(4.0, 26.0)));
        if (d.unit() < 0.3) target.x = (target.x < 0.0 ? -1.0 : 1.0) * (1.0 - std::exp2(-d.between(4.0, 26.0)));
        return JudgedRay{
            .ray = ray_towards(turned * (0.5 * d.direction()), turned * target), .must = Must::hit, .leads_on = true};
    };
    work.follow = stays_inside(89.0);
    return work;
}

// A sphere that rests on a floor, a gap apart: rays from the floor under it find it, rays from its underside the floor.
RayWork resting_sphere(double gap, Dice& dice) {
    RayWork work;
    work.scene = empty_scene();
    add_mesh(work.scene, {{{-4, 0, -4}, {-4, 0, 4}, {4, 0, 4}, {4, 0, -4}}, {{0, 1, 2}, {0, 2, 3}}});
    add_sphere(work.scene, {0.0, 1.0 + gap, 0.0}, 1.0);
    work.aim = [](Dice& d) {
        // Under the sphere, near where they touch, from the side.
        const double r = std::exp2(-d.between(1.0, 8.0)), angle = 2.0 * std::numbers::pi * d.unit();
        const dvec3 target(r * std::cos(angle), 0.0, r * std::sin(angle));
        const double height = 0.25 * r * r;  // half of what the sphere leaves
        return JudgedRay{
            .ray = ray_along(target + dvec3(0, height, 0), {0, -1, 0}), .must = Must::hit, .leads_on = true};
    };
    work.follow = [](const JudgedRay&, const RayHit& hit, Dice& d) -> std::optional<JudgedRay> {
        JudgedRay next = leaving(hit, slanted(hit.normal, d.between(0.0, 30.0), d), false, Must::hit);
        next.primitive = 2;
        return next;
    };
    static_cast<void>(dice);
    return work;
}

dmat4 sheared(double amount) {
    dmat4 m(1.0);
    m[1][0] = amount;
    m[2][1] = -0.5 * amount;
    return m;
}

std::vector<RayWork> instances(const HardCase& c, Dice& dice) {
    std::vector<RayWork> all;
    const double scale = parameter(c, "scale");
    const dmat4 similar = glm::scale(dmat4(1.0), dvec3(scale)),
                mirrored = glm::scale(dmat4(1.0), dvec3(-scale, scale, scale));
    for (const dmat4& m : {similar, mirrored, similar * sheared(0.75)})
        for (const Body body : {Body::ball_of_triangles, Body::sphere, Body::cuboid}) {
            const dmat4 placed = glm::translate(dmat4(1.0), 4.0 * scale * dice.direction()) * m;
            all.push_back(around(body, placed, dice.rotation(), leaves_for_good(0.0, 89.9)));
            all.push_back(around(body, placed, dice.rotation(), stays_inside(80.0)));
        }
    return all;
}

}  // namespace

std::vector<RayWork> make_leaving_work(const HardCase& c, Dice& dice) {
    if (c.generator == "grazing-departures") {
        const double degrees = parameter(c, "degrees");
        std::vector<RayWork> all;
        for (const Body body : {Body::sheet, Body::ball_of_triangles, Body::sphere, Body::cuboid}) {
            const dvec3 place = parameter(c, "distance") * dice.direction();
            const dmat4 placed =
                glm::translate(dmat4(1.0), rounded(place)) * glm::scale(dmat4(1.0), dvec3(parameter(c, "size")));
            // Far from 0 a sheet is plane only along the axes: its corners are rounded.
            const bool straight = body == Body::sheet && parameter(c, "distance") > 1e3;
            const dmat3 turned = straight ? dmat3(1.0) : dice.rotation();
            all.push_back(around(body, placed, turned, leaves_for_good(degrees, degrees)));
            all.push_back(around(body, placed, turned, leaves_for_good(0.0, degrees)));
        }
        return all;
    }
    if (c.generator == "small-coordinates") {
        // Faces at 0, at 2^-5 and just beside: where relative steps become tiny, and an integer offset changes its
        // rule.
        std::vector<RayWork> all;
        for (const double shift : {0.0, 0x1p-5, 0x1p-5 * (1 - 0x1p-20), 1e-30})
            for (const Body body : {Body::sheet, Body::cuboid, Body::sphere}) {
                const dmat4 placed = glm::translate(dmat4(1.0), dvec3(shift)) * glm::scale(dmat4(1.0), dvec3(0x1p-6));
                all.push_back(around(
                    body, placed, body == Body::sheet ? dmat3(1.0) : dice.rotation(), leaves_for_good(0.0, 89.99)));
            }
        return all;
    }
    if (c.generator == "concave-corners") return {concave_corner(true, dice), concave_corner(false, dice)};
    if (c.generator == "resting-spheres") return {resting_sphere(parameter(c, "gap"), dice)};
    if (c.generator == "instances") return instances(c, dice);
    return {};
}

}  // namespace tandem::stability
