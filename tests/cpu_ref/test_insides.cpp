// Motion, media and nested bodies of MODEL.md sections 6, 9.4 and 10, rendered: closed forms.
#include <doctest/doctest.h>

#include "cpu_ref/path_tracer/geometry/interiors.h"
#include "tests/cpu_ref/renders.h"

using namespace tandem;
using namespace tandem::test::renders;
using glm::dvec3;

TEST_CASE("rough glass in a white furnace loses only what single scattering loses, and none when all but smooth") {
    test::SceneBuilder b;
    Material rough = test::glass(1.5);
    rough.roughness = 0.03;
    b.camera({0, 0, 4}, {0, 0, 0}, 10).background(dvec3(1.0)).sphere(rough, {0, 0, 0}, 1.0);
    check_mean(render(b.scene(), settings(8, Integrator::path, 40), 256), 1.0, 0, 2e-3);
    Scene rougher = b.scene();
    rougher.materials[0].roughness = 0.6;
    const double mean = pooled(render(rougher, settings(8, Integrator::path, 40), 256)).mean;
    CHECK(mean < 1.0);
    CHECK(mean > 0.7);
}

TEST_CASE("a ball that moves across a pixel covers it for the share of the shutter that it is there") {
    // One pixel sees only the axis; the ball of radius 1 moves 8 units through it: there for 2/8 of the time.
    for (const std::size_t others : {std::size_t{0}, std::size_t{80}}) {
        test::SceneBuilder b;
        b.camera({0, 0, 20}, {0, 0, 0}, 0.01).background(dvec3(1.0));
        b.sphere(test::emitter(dvec3(3.0)), {-5, 0, 0}, 1.0);
        for (std::size_t i = 0; i < others; ++i)  // past one leaf: the hierarchy
            b.sphere(test::diffuse(dvec3(0.5)), {-40.0 + static_cast<double>(i), 30, 0}, 0.3);
        Scene scene = b.scene();
        scene.entities[0].motion = {8, 0, 0};
        for (const Precision precision : {Precision::single_precision, Precision::double_precision})
            check_mean(render(scene, settings(2, Integrator::path, 1), 4096, precision), 0.75 + 3.0 * 0.25);
        // The same seen by a camera that moves instead.
        scene.entities[0].motion = {};
        scene.camera.position_motion = scene.camera.target_motion = {-8, 0, 0};
        check_mean(render(scene, settings(2, Integrator::path, 1), 4096), 0.75 + 3.0 * 0.25);
    }
}

TEST_CASE("moving triangles and cuboids shade and shadow as their mean over time") {
    for (const int which : {0, 1, 2, 3}) {
        const bool cuboid = which % 2 == 1, crowded = which >= 2;  // crowded: past one leaf
        test::SceneBuilder b = floor_below(test::diffuse(dvec3(0.5)));
        if (cuboid)
            b.cuboid(test::diffuse(dvec3(0.5)), {-4, 5, -1}, {-2, 6, 1});
        else
            b.quad(test::diffuse(dvec3(0.5)), {-4, 5, 1}, {-2, 5, 1}, {-2, 5, -1}, {-4, 5, -1});
        if (crowded)
            for (int i = 0; i < 20; ++i) b.triangle_box(test::diffuse(dvec3(0.5)), {20 + i, 1, 0}, {20.5 + i, 2, 1});
        Scene scene = b.scene();
        scene.lights = {light(PunctualKind::sun, {}, {0, -1, 0}, dvec3(2))};
        scene.entities[1].motion = {8, 0, 0};  // over the point from tau = 1/4 to 1/2
        check_mean(render(scene, settings(2, Integrator::next_event, 1), 4096), 0.5 / pi * 2 * 0.75);
    }
}

TEST_CASE("Beer-Lambert: a slab of glass without a change of index, and the surroundings, thin the sky") {
    test::SceneBuilder b;
    b.camera({0, 0, 5}, {0, 0, 0}, 0.01).background(dvec3(1.0));
    b.cuboid(boundary(0), {-1, -1, -0.75}, {1, 1, 0.75});
    Scene scene = b.scene();
    scene.media = {medium({0.5, 1.0, 0.0}, dvec3(0.0))};
    const auto mean = mean_of(render(scene, settings(1, Integrator::path, 2), 4));
    CHECK(mean[0] == doctest::Approx(std::exp(-0.75)).epsilon(1e-5));
    CHECK(mean[1] == doctest::Approx(std::exp(-1.5)).epsilon(1e-5));
    CHECK(mean[2] == 1.0);
    // A lamp at a distance in fog all around.
    test::SceneBuilder lamp;
    lamp.camera({0, 0, 5}, {0, 0, 0}, 0.01).cuboid(test::emitter(dvec3(2.0)), {-1, -1, -1}, {1, 1, 0});
    Scene foggy = lamp.scene();
    foggy.media = scene.media;
    foggy.medium = 0;
    CHECK(mean_of(render(foggy, settings(1, Integrator::path, 0), 4))[0] ==
          doctest::Approx(2 * std::exp(-2.5)).epsilon(1e-5));
}

TEST_CASE("single precision measures its ways from the surface, not from where rays start off it") {
    // On a floor of 200 units rays start 2e-4 off it, which would show in 1/r^2 and in exp(-sigma d).
    Scene scene = floor_below(test::diffuse(dvec3(0.5))).scene();
    for (dvec3& vertex : scene.vertices) vertex *= 2.0;
    scene.lights = {light(PunctualKind::point, {0, 1, 0}, {0, -1, 0}, dvec3(2))};
    scene.media = {medium(dvec3(0.5), dvec3(0.0))};
    scene.medium = 0;
    CHECK(mean_of(render(scene, settings(1, Integrator::next_event, 1), 16))[0] ==
          doctest::Approx(0.5 / pi * 2 * std::exp(-0.5 * 5)).epsilon(2e-6));
    test::SceneBuilder b;
    b.camera({0, 3, 0}, {0, 0, 0}, 1e-4, {0, 0, 1}).background(dvec3(1.0));
    b.cuboid(boundary(0), {-100, -1, -100}, {100, 0, 100});
    Scene slab = b.scene();
    slab.media = scene.media;
    CHECK(mean_of(render(slab, settings(1, Integrator::path, 4), 16))[0] ==
          doctest::Approx(std::exp(-0.5)).epsilon(2e-6));
}

TEST_CASE("fog thins next events over the way of their light") {
    Scene scene = floor_below(test::diffuse(dvec3(0.5))).scene();
    scene.media = {medium({0.25, 0.0, 0.0}, dvec3(0.0))};
    scene.medium = 0;
    scene.lights = {light(PunctualKind::point, {0, 2, 0}, {0, -1, 0}, dvec3(8))};
    const auto mean = mean_of(render(scene, settings(1, Integrator::next_event, 1), 16));
    CHECK(mean[0] == doctest::Approx(0.5 / pi * 2 * std::exp(-0.25 * (4 + 2))).epsilon(1e-4));
    CHECK(mean[1] == doctest::Approx(0.5 / pi * 2).epsilon(1e-4));
}

TEST_CASE("a medium that only scatters keeps all light of an even sky") {
    for (const double g : {0.0, 0.7, -0.3})
        for (const bool grid : {false, true}) {
            test::SceneBuilder b;
            b.camera({0, 0, 5}, {0, 0, 0}, 20).background(dvec3(1.0)).sphere(boundary(0), {0, 0, 0}, 1.0);
            Scene scene = b.scene();
            scene.media = {medium(dvec3(0.0), {1.0, 2.0, 0.5}, g)};
            if (grid) {
                auto density = std::make_shared<DensityGrid>();
                density->cells = {2, 2, 2};
                density->low = dvec3(-1.0);
                density->high = dvec3(1.0);
                density->density = {1, 0, 2, 0.5, 0, 3, 1, 1};
                scene.media[0].grid = density;
            }
            for (const std::size_t c : {std::size_t{0}, std::size_t{1}})
                check_mean(render(scene, settings(8, Integrator::path, 200), 256), 1.0, c, 1e-4);
            scene.background.sampled = true;  // every shadow ray ends at the boundary
            check_mean(render(scene, settings(8, Integrator::next_event, 200), 256), 1.0, 0, 1e-4);
        }
}

TEST_CASE("single scattering of a point light in fog is its integral") {
    // Fog around everything with a black wall at distance 3, and a point light in it. The camera sees, per length,
    // sigma_s p I/r^2 T(s + r) over the way s of sight.
    const double sigma_s = 0.3, sigma_a = 0.2, g = 0.6, sigma = sigma_s + sigma_a;
    test::SceneBuilder b;
    b.camera({0, 0, 0}, {0, 0, -1}, 0.001)
        .quad(test::diffuse(dvec3(0.0)), {-9, -9, -3}, {9, -9, -3}, {9, 9, -3}, {-9, 9, -3});
    Scene scene = b.scene();
    scene.media = {medium(dvec3(sigma_a), dvec3(sigma_s), g)};
    scene.medium = 0;
    const dvec3 position(0.5, 0, -1.5);
    scene.lights = {light(PunctualKind::point, position, {0, -1, 0}, dvec3(5.0))};
    double expected = 0.0;
    constexpr int n = 20000;
    for (int i = 0; i < n; ++i) {
        const double s = 3.0 * (i + 0.5) / n;
        const dvec3 to_light = position - dvec3(0, 0, -s);
        const double r = glm::length(to_light), mu = -to_light.z / r;
        const double phase = (1 - g * g) / (4 * pi * std::pow(1 + g * g - 2 * g * mu, 1.5));
        expected += 3.0 / n * sigma_s * std::exp(-sigma * (s + r)) * phase * 5.0 / (r * r);
    }
    for (const Integrator integrator : {Integrator::next_event, Integrator::whitted})
        check_mean(render(scene, settings(8, integrator, 1), 4096), expected, 0, 1e-4);
}

TEST_CASE("nested slabs: a ray through glass with water inside meets index against index") {
    // A slab of glass (priority 2) that overlaps one of water (priority 1): air, glass, water, air. The overlap is
    // glass, and the water's face within it is not there.
    Material glass = test::glass(1.5), water = test::glass(1.33);
    glass.priority = 2;
    water.priority = 1;
    const auto reflectance = [](double n) { return (n - 1) * (n - 1) / ((n + 1) * (n + 1)); };
    // Only the straight way comes to the lamp behind within four events: three transmissions and one skipped face.
    test::SceneBuilder with_lamp;
    with_lamp.camera({0, 0, 10}, {0, 0, 0}, 0.01);
    with_lamp.cuboid(glass, {-9, -9, 0}, {9, 9, 2}).cuboid(water, {-9, -9, -2}, {9, 9, 1});
    with_lamp.quad(test::emitter(dvec3(1.0)), {-9, -9, -5}, {9, -9, -5}, {9, 9, -5}, {-9, 9, -5});
    const double expected = (1 - reflectance(1.5)) * (1 - reflectance(1.33 / 1.5)) * (1 - reflectance(1.33));
    check_mean(render(with_lamp.scene(), settings(16, Integrator::path, 4), 1024), expected, 0, 1e-5);
    // Fewer events do not come through, as the skipped face counts.
    CHECK(pooled(render(with_lamp.scene(), settings(8, Integrator::path, 3), 64)).mean == 0.0);
}

TEST_CASE("a medium in a body of higher priority rules where two overlap") {
    Material inner = boundary(0), outer = boundary(1);
    inner.priority = 5;
    test::SceneBuilder b;
    b.camera({0, 0, 10}, {0, 0, 0}, 0.01).background(dvec3(1.0));
    b.cuboid(inner, {-1, -1, -1}, {1, 1, 1}).cuboid(outer, {-2, -2, 0}, {2, 2, 3});
    Scene scene = b.scene();
    scene.media = {medium(dvec3(0.5), dvec3(0.0)), medium(dvec3(0.25), dvec3(0.0))};
    // outer from 3 to 1, inner from 1 to -1.
    CHECK(mean_of(render(scene, settings(1, Integrator::path, 6), 4))[0] ==
          doctest::Approx(std::exp(-0.25 * 2 - 0.5 * 2)).epsilon(1e-5));
}

TEST_CASE("a ninth body around a path makes its samples invalid") {
    test::SceneBuilder b;
    b.camera({0, 0, 20}, {0, 0, 0}, 0.01).background(dvec3(1.0));
    for (int i = 0; i < 9; ++i) b.sphere(boundary(0), {0, 0, 0}, 10.0 - i);
    Scene scene = b.scene();
    scene.media = {medium(dvec3(0.0), dvec3(0.0))};
    CHECK(render(scene, settings(2, Integrator::path, 20), 16).invalid() == 4u * 16u);
}

TEST_CASE("a body that is entered again without having been left is in the list once, unless there are two") {
    for (const std::uint32_t existing : {1u, 2u, no_index}) {
        CAPTURE(existing);
        cpu::InteriorList list;
        CHECK(list.append(7));
        CHECK(list.append(5));
        list.remove_left_unseen(7, existing);
        CHECK(list.append(7));
        CHECK(list.count == (existing == 1 ? 2u : 3u));
        CHECK(list.material[0] == (existing == 1 ? 5u : 7u));
        list.remove_left_unseen(7, existing);
        CHECK(list.count == (existing == no_index ? 3u : existing));
    }
}
