// Closed forms of motion: the share of the shutter's time in which a pixel is covered, a floor shadowed, or the camera
// looks at something.
#include <numbers>

#include "tests/suite/effects.h"

using namespace tandem;
using namespace tandem::test;

namespace {

constexpr double pi = std::numbers::pi;
const dvec3 glow(1.0, 2.0, 4.0), colour(0.6, 0.3, 0.9);

// Looks along -z.
SceneBuilder ahead() { return SceneBuilder().camera(black, {0.0, 0.0, -1.0}, narrow_field); }

Scene moving(Scene scene, const dvec3& motion) {
    scene.entities.back().motion = motion;
    return scene;
}

void check(
    std::vector<Tracer>& all, const Scene& scene, const dvec3& expected, Integrator integrator = Integrator::path) {
    check_mean(all, scene, settings_of(16, 2, integrator), 512, expected, 64.0);
}

}  // namespace

TEST_CASE("what moves into the view covers it for the rest of the time, whatever it is made of") {
    auto& all = tracers();
    // The edges lie at x = -0.3 when the shutter opens and move by 1: the view is covered from 0.3 to the end.
    const dvec3 lo(-5.0, -1.0, -3.0), hi(-0.3, 1.0, -2.0);
    const dmat4 turned = rotated(180.0, {0.0, 0.0, 1.0});
    for (const Scene& scene :
        {ahead().cuboid(emitter(glow), lo, hi).scene(), ahead().triangle_box(emitter(glow), lo, hi).scene(),
            ahead().sphere(emitter(glow), {-2.3, 0.0, -4.0}, 2.0).scene(),
            ahead().cuboid(emitter(glow), {0.3, -1.0, -3.0}, {5.0, 1.0, -2.0}, turned).scene()})
        check(all, moving(scene, {1.0, 0.0, 0.0}), 0.7 * glow);
}

TEST_CASE("what moves through the view covers it for a while, what moves along with the camera always or never") {
    auto& all = tracers();
    const auto strip = [] { return ahead().cuboid(emitter(glow), {-0.6, -1.0, -3.0}, {-0.4, 1.0, -2.0}); };
    check(all, moving(strip().scene(), {2.0, 0.0, 0.0}), 0.1 * glow);
    Scene scene = moving(strip().scene(), {2.0, 0.0, 0.0});
    scene.camera.position_motion = scene.camera.target_motion = {2.0, 0.0, 0.0};
    check(all, scene, black);
    scene.camera.position_motion = scene.camera.target_motion = {1.0, 0.0, 0.0};
    check(all, scene, 0.2 * glow);
}

TEST_CASE("a camera that turns or moves sees an edge for its share of the time") {
    auto& all = tracers();
    const auto edge = [] { return ahead().cuboid(emitter(glow), {0.6, -5.0, -3.0}, {9.0, 5.0, -2.0}); };
    // Turning: the target moves from (0, 0, -1) to (1, 0, -1); it looks past the edge, x/z = 0.6/3, from 0.2 on.
    Scene turning = edge().scene();
    turning.camera.target_motion = {1.0, 0.0, 0.0};
    check(all, turning, 0.8 * glow);
    Scene moved_camera = edge().scene();
    moved_camera.camera.position_motion = moved_camera.camera.target_motion = {1.0, 0.0, 0.0};
    check(all, moved_camera, 0.4 * glow);
    moved_camera.camera.lens_radius = 1e-13;
    check(all, moved_camera, 0.4 * glow);
}

TEST_CASE("a moving body shadows a floor for its share of the time") {
    auto& all = tracers();
    // The sun shines straight down; the box's shadow covers `aim` from a quarter of the time on.
    const auto view = [] {
        return SceneBuilder()
            .camera(aim + dvec3(1.0, 2.0, 3.5), aim, narrow_field)
            .floor(diffuse(colour), 0.0, 50.0)
            .cuboid(diffuse(black), aim + dvec3(-3.0, 1.0, -0.3), aim + dvec3(-0.5, 1.2, 0.3));
    };
    const Scene scene = with_light(view().scene(), sun({0.0, -1.0, 0.0}, glow));
    check(all, moving(scene, {2.0, 0.0, 0.0}), 0.25 * colour / pi * glow, Integrator::next_event);
}

TEST_CASE("a floor under a moving lamp has one mean by scattering and by light sampling") {
    auto& all = tracers();
    // Found by scattering alone in either; the quadrature goes over time.
    const double radius = 0.4;
    const dvec3 start(-1.0, 1.0, 0.2), motion(1.5, 0.3, 0.0);
    double share = 0.0;
    constexpr int steps = 10000;
    for (int i = 0; i < steps; ++i) {
        const dvec3 at = start + (i + 0.5) / steps * motion;
        share += radius * radius * at.y / std::pow(glm::dot(at, at), 1.5) / steps;
    }
    const Scene scene = moving(SceneBuilder()
                                   .camera(aim + dvec3(1.0, 2.0, 3.5), aim, narrow_field)
                                   .floor(diffuse(colour), 0.0, 50.0)
                                   .sphere(emitter(glow), aim + start, radius)
                                   .scene(),
        motion);
    for (const Integrator integrator : {Integrator::path, Integrator::next_event})
        check(all, scene, share * colour * glow, integrator);
}

TEST_CASE("a moving body takes its texture with it") {
    auto& all = tracers();
    Texture board;
    board.name = "board";
    board.frequency = dvec3(2.0, 0.0, 0.0);
    board.first = {0.9, 0.1, 0.4};
    board.second = {0.2, 0.8, 0.6};
    // A wall that fills the view while cells of half a unit pass: x from 0.1 down to -0.8. It spends 0.1/0.9 in the
    // cell from 0, 0.5/0.9 in the next one, 0.3/0.9 in the one after it.
    Scene scene =
        moving(ahead()
                   .background(white)
                   .quad(diffuse(white), {-9.0, -8.0, -2.0}, {9.0, -8.0, -2.0}, {9.0, 9.0, -2.0}, {-9.0, 9.0, -2.0})
                   .scene(),
            {0.9, 0.0, 0.0});
    scene.camera.position.x = scene.camera.target.x = 0.1;
    check(all, textured(scene, board), (0.4 * board.first + 0.5 * board.second) / 0.9);
}
