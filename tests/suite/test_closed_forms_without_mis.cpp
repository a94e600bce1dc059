// Next events without MIS (MODEL.md section 9.2): what is sampled counts by next events alone, all else is still found.
// Closed forms are held in test_closed_forms_lights, _distant_lights and _files.
#include <filesystem>

#include "common/scene/loader/scene_loader.h"
#include "common/validation/verify/verify.h"
#include "tests/suite/samplers.h"
#include "tests/suite/tracers.h"

using namespace tandem;
using namespace tandem::test;
using namespace tandem::test::samplers;

namespace {

RenderSettings without_mis(RenderSettings settings) {
    settings.integrator = Integrator::next_event;
    settings.mis = false;
    return settings;
}

Scene shipped(const std::string& name) {
    return load_scene(std::filesystem::path(TANDEM_SOURCE_DIR) / "scenes" / (name + ".json"));
}

// A floor under a lamp near to it, seen from below the lamp: there MIS is worth most.
Scene floor_under_lamp() {
    return SceneBuilder()
        .camera({3.0, 0.2, 0.5}, {0.2, 0.0, 0.1}, 1.0)
        .floor(diffuse(dvec3(0.6)), 0.0, 20.0)
        .quad(emitter(white), {-1.5, 0.3, -1.5}, {1.5, 0.3, -1.5}, {1.5, 0.3, 1.5}, {-1.5, 0.3, 1.5})
        .scene();
}

}  // namespace

TEST_CASE("without MIS a path has of a sampled lamp what its next events bring, and of others what it meets") {
    const Material lamp = emitter(white);
    Material tracked = lamp;  // not sampled (section 9.4)
    tracked.translucent = true;
    tracked.priority = 1;
    for (const bool sampled : {true, false})
        for (Tracer& tracer : tracers()) {
            if (!tracer.samples_lights) continue;
            CAPTURE(tracer.name);
            CAPTURE(sampled);
            const Scene scene = looking_from({0.0, 1.0, 2.0})
                                    .floor(diffuse(dvec3(0.5)), 0.0, 20.0)
                                    .sphere(sampled ? lamp : tracked, {0.0, 3.0, 0.0}, 2.0)
                                    .scene();
            std::size_t met = 0;
            for (const PathTrace& path : traces_of(tracer, scene, without_mis(settings_of(1, 1)), 200)) {
                REQUIRE(path.vertices.size() == 2);
                const bool meets = path.vertices[1].end != PathEnd::left_scene;
                met += meets ? 1 : 0;
                const dvec3 found = sampled ? path.vertices[0].light : meets ? dvec3(0.5) : black;
                CHECK(glm::length(path.radiance - found) <= 1e-6);
            }
            CHECK(met >= 20);
        }
}

TEST_CASE("without MIS the shipped scenes keep their means" * doctest::test_suite("full")) {
    // Between them: all kinds of lights, mirrors, glass, rough metal, media, interiors, motion, emitters not sampled.
    for (const char* name : {"cornell-classic", "lights", "glass", "conductors", "environment", "fog", "nested-glass",
             "motion", "boundaries", "lamps"}) {
        CAPTURE(name);
        const Scene scene = shipped(name);
        RenderSettings settings = with_longer_side(default_settings(scene), 16);
        settings.integrator = Integrator::next_event;
        std::optional<Measured> expected;
        for (Tracer& tracer : tracers()) {
            if (!tracer.samples_lights || tracer.name == "cpu double") continue;
            CAPTURE(tracer.name);
            if (!expected) expected = pooled(render(tracer, scene, settings, 2048));
            const Measured measured = pooled(render(tracer, scene, without_mis(settings), 1024));
            CHECK(measured.invalid == 0);
            for (int channel = 0; channel < 3; ++channel) {
                CAPTURE(channel);
                const double error = std::hypot(measured.standard_error[channel], expected->standard_error[channel]);
                CAPTURE(error);
                CAPTURE(expected->mean[channel]);
                CHECK(std::abs(measured.mean[channel] - expected->mean[channel]) <= sigmas * error + 1e-5);
            }
        }
    }
}

TEST_CASE("without MIS the noise of a near lamp is greater, and alike on all tracers") {
    std::optional<double> first;
    for (Tracer& tracer : tracers()) {
        if (!tracer.samples_lights) continue;
        CAPTURE(tracer.name);
        const auto variance = [&](const RenderSettings& settings) {
            const Measured measured = pooled(render(tracer, floor_under_lamp(), settings, 2048));
            return measured.standard_error.x * measured.standard_error.x;
        };
        const RenderSettings settings = settings_of(16, 1, Integrator::next_event);
        const double alone = variance(without_mis(settings));
        CHECK(alone > 4.0 * variance(settings));
        if (!first) first = alone;
        CHECK(alone == doctest::Approx(*first).epsilon(0.05));
    }
}

TEST_CASE("without MIS both backends agree, sample by sample and in the mean") {
    const auto cpu = cpu_backend().create({}), vulkan = vulkan_backend().create({});
    for (const char* name : {"cornell-classic", "lights", "fog"}) {
        CAPTURE(name);
        const Scene scene = shipped(name);
        VerifyOptions options;
        options.settings = without_mis(with_longer_side(default_settings(scene), 24));
        options.max_samples = 512;
        options.budget_seconds = 60.0;
        const SceneVerdict verdict = verify_scene(scene, *cpu, *vulkan, options);
        CHECK(verdict.verdict != Verdict::disagree);
        CHECK(verdict.criteria.same_estimator);
        CHECK(verdict.reference.samples >= 256);
    }
}

TEST_CASE("leaving out MIS is refused of integrators that have none to leave out") {
    for (const Integrator integrator : {Integrator::path, Integrator::whitted, Integrator::bidirectional})
        for (Tracer& tracer : tracers()) {
            CAPTURE(tracer.name);
            RenderSettings settings = without_mis(settings_of(4, 1));
            settings.integrator = integrator;
            CHECK_THROWS_AS((void)tracer.renderer->prepare(floor_under_lamp(), settings), UnsupportedError);
        }
}
