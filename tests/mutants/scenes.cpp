// The trial scenes of tests/mutants.
#include "tests/mutants/scenes.h"

#include "tests/scene_builder.h"

namespace tandem::test {
namespace {

constexpr std::uint32_t image_size = 48;  // three tiles of 16 a side

TrialScene trial(const std::string& name, const SceneBuilder& builder, Integrator integrator, std::uint32_t bounces) {
    TrialScene trial{name, builder.scene(), {}};
    trial.scene.name = name;
    trial.settings.width = trial.settings.height = image_size;
    trial.settings.integrator = integrator;
    trial.settings.bounces = bounces;
    return trial;
}

SceneBuilder box_with_lamp() {
    return SceneBuilder()
        .camera({0.0, 0.1, 2.6}, {0.1, -0.1, 0.0}, 70.0)
        .cuboid(diffuse({0.8, 0.7, 0.6}, dvec3(0.05)), {-2.0, -1.5, -2.5}, {2.0, 1.5, 3.0})
        .sphere(emitter({3.0, 3.0, 3.0}), {0.6, 0.7, -0.8}, 0.7)
        .cuboid(diffuse({0.5, 0.8, 0.8}), {-1.0, -1.4, -1.0}, {0.0, 0.0, 0.0}, rotated(25.0, {0.0, 1.0, 0.0}));
}

}  // namespace

TrialScene lamps() {
    const Material grey = diffuse({0.6, 0.5, 0.4});
    return trial("lamps",
        SceneBuilder()
            .camera({0.5, 1.4, 6.0}, {0.0, 1.2, 0.0}, 45.0)
            .floor(grey, 0.0, 4.0)
            .quad(grey, {-4.0, -1.0, -2.0}, {4.0, -1.0, -2.0}, {4.0, 4.0, -2.0}, {-4.0, 4.0, -2.0})
            .quad(grey, {-4.0, 3.0, -4.0}, {4.0, 3.0, -4.0}, {4.0, 3.0, 4.0}, {-4.0, 3.0, 4.0})
            .quad(emitter({4.0, 4.0, 5.0}, EmittingSides::front), {-1.0, 2.2, -1.0}, {0.8, 2.2, -1.0}, {0.8, 2.2, 0.7},
                {-1.0, 2.2, 0.7})
            .sphere(emitter({30.0, 20.0, 10.0}), {1.6, 0.5, 0.4}, 0.12)
            .sphere(diffuse({0.7, 0.7, 0.7}), {-0.7, 0.6, 0.3}, 0.6),
        Integrator::next_event, 2);
}

TrialScene open_sky() {
    return trial("open sky",
        SceneBuilder()
            .camera({1.0, 2.5, 7.0}, {0.0, 0.6, 0.0}, 38.0)
            .background({0.3, 0.2, 0.1}, {0.6, 1.4, 3.0})
            .floor(diffuse({0.5, 0.5, 0.5}), 0.0, 6.0)
            .sphere(diffuse({0.8, 0.6, 0.6}), {-1.6, 0.9, 0.4}, 0.8)
            .sphere(diffuse({0.6, 0.8, 0.6}), black, 1.0,
                moved({0.3, 1.3, -0.6}) * rotated(35.0, {1.0, 0.2, 1.0}) * scaled({0.4, 1.4, 0.8}))
            .sphere(mirror({0.9, 0.9, 0.9}), black, 1.0,
                moved({2.0, 0.8, 0.8}) * rotated(-40.0, {0.3, 0.2, 1.0}) * scaled({0.3, 0.9, 0.6}))
            .cuboid(diffuse({0.6, 0.6, 0.8}), dvec3(-0.5), dvec3(0.5),
                moved({0.6, 0.7, 1.6}) * rotated(40.0, {1.0, 1.0, 0.3}) * scaled({1.3, 0.6, 0.9}))
            .triangle(diffuse({0.8, 0.8, 0.2}), {-0.6, 0.2, 2.0}, {-0.1, 0.3, 2.3}, {-0.5, 1.1, 1.8}),
        Integrator::path, 4);
}

TrialScene closed_box() { return trial("closed box", box_with_lamp(), Integrator::path, 2); }

TrialScene roulette_box() {
    TrialScene box = trial("roulette box", box_with_lamp(), Integrator::path, 6);
    box.settings.roulette_start = 1;
    return box;
}

TrialScene glass_bodies() {
    const Material tinted = glass(1.5, Fresnel::exact, 0.3, {0.2, 0.5, 0.9});
    return trial("glass bodies",
        SceneBuilder()
            .camera({0.0, 1.0, 6.0}, {0.0, 0.2, 0.0}, 32.0)
            .background({2.0, 0.5, 0.1}, {0.1, 0.8, 2.5})
            .sphere(tinted, {-0.9, 0.2, 0.0}, 0.9)
            .cuboid(glass(1.5, Fresnel::schlick, 0.2, {0.9, 0.4, 0.4}), dvec3(-0.6), dvec3(0.6),
                moved({0.9, 0.3, 0.2}) * rotated(50.0, {1.0, 0.7, 0.2})),
        Integrator::path, 10);
}

TrialScene wide_lens() {
    SceneBuilder builder;
    builder.camera({0.0, 0.0, 5.0}, black, 40.0).lens(0.4, 5.0).background({0.1, 0.1, 0.1});
    for (int i = -2; i <= 2; ++i) {
        const double x = i, z = 1.5 * i;
        builder.cuboid(emitter({1.0, 2.0, 0.5}), {x - 0.2, -1.5, z - 0.1}, {x + 0.2, 1.5, z});
    }
    return trial("wide lens", builder, Integrator::path, 1);
}

TrialScene narrow_gap() {
    return trial("narrow gap",
        SceneBuilder()
            .camera({0.0, 0.0, 0.2}, {0.0, 0.0, -1.0}, 20.0)
            .background(white)
            .cuboid(diffuse({0.7, 0.7, 0.7}), {0.04, -5.0, -10.0}, {0.041, 5.0, 0.0})
            .quad(diffuse({0.7, 0.7, 0.7}), {-0.04, -5.0, 0.0}, {-0.04, -5.0, -10.0}, {-0.04, 5.0, -10.0},
                {-0.04, 5.0, 0.0}),
        Integrator::path, 12);
}

}  // namespace tandem::test
