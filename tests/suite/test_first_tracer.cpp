// The path tracer to read (cpu_ref/first_tracer). It is held to closed forms, to the paths of the CPU path tracer, and
// to the verdict against the CPU and Vulkan path tracers.
#include <algorithm>
#include <filesystem>

#include "common/render/path_trace.h"
#include "common/scene/loader/scene_loader.h"
#include "common/validation/verify/verify.h"
#include "tests/refusal.h"
#include "tests/suite/tracers.h"
#include "tests/traced_paths.h"

using namespace tandem;
using namespace tandem::test;

namespace {

std::vector<Tracer> first_alone() {
    std::vector<Tracer> all;
    all.push_back({"first", first_backend().create({}), 0x1p-53, true});
    return all;
}

Scene shipped(const std::string& name) { return load_scene(TANDEM_SOURCE_DIR "/scenes/" + name + ".json"); }

std::string refusal(const Scene& scene, const RenderSettings& settings) {
    return tandem::refusal<UnsupportedError>([&] { (void)first_backend().create({})->prepare(scene, settings); });
}

}  // namespace

TEST_CASE("the tracer to read meets every shipped closed form that it can render") {
    auto first = first_alone();
    int met = 0;
    for (const auto& file : std::filesystem::directory_iterator(TANDEM_SOURCE_DIR "/scenes/closed-forms")) {
        if (file.path().extension() != ".json") continue;
        const Scene scene = load_scene(file.path());
        CAPTURE(scene.name);
        for (const Integrator integrator : {Integrator::path, Integrator::next_event})
            for (const bool mis : {true, false}) {
                RenderSettings settings = default_settings(scene);
                settings.integrator = integrator;
                settings.mis = mis;
                settings.width = std::min(settings.width, 12u);
                settings.height = std::min(settings.height, 12u);
                if ((!mis && integrator == Integrator::path) || !refusal(scene, settings).empty()) continue;
                const std::uint64_t samples = settings.width == 1 ? 4096 : 256;
                check_mean(first, scene, settings, samples, scene.expect->radiance, 8.0 * settings.bounces + 64.0);
                ++met;
            }
    }
    CHECK(met >= 40);
}

TEST_CASE("the tracer to read follows the same paths as the CPU path tracer") {
    BackendOptions in_double;
    in_double.precision = Precision::double_precision;
    const auto cpu = cpu_backend().create(in_double), first = first_backend().create({});
    int paths = 0, alike = 0;
    for (const char* name : {"cornell-classic", "cornell-thesis", "glass", "whitted", "furnace"})
        for (const Integrator integrator : {Integrator::path, Integrator::next_event}) {
            const Scene scene = shipped(name);
            RenderSettings settings = with_longer_side(default_settings(scene), 10);
            settings.integrator = integrator;
            settings.roulette_start = 3;
            if (!refusal(scene, settings).empty()) continue;
            CAPTURE(name);
            const auto a = cpu->prepare(scene, settings), b = first->prepare(scene, settings);
            for (std::uint32_t pixel = 0; pixel < settings.width * settings.height; ++pixel) {
                const std::uint32_t x = pixel % settings.width, y = pixel / settings.width;
                const PathTrace u = a->trace(x, y, {0, 1}).front(), v = b->trace(x, y, {0, 1}).front();
                ++paths;
                const double size = 1.0 + glm::length(u.radiance);
                alike += u.vertices.size() == v.vertices.size() && glm::distance(u.radiance, v.radiance) < 1e-9 * size;
            }
        }
    CHECK(paths >= 400);
    CHECK(alike >= 0.99 * paths);  // rounding parts few
}

TEST_CASE("the tracer to read renders the paths that it traces") {
    const auto first = first_backend().create({});
    for (const char* name : {"cornell-classic", "cornell-thesis"}) {
        const Scene scene = shipped(name);
        check_traces(*first, scene, default_settings(scene), 12, 0x1p-53);
    }
}

TEST_CASE("the verdict finds that the tracer to read agrees with the CPU and Vulkan path tracers") {
    const auto first = first_backend().create({}), cpu = cpu_backend().create({}), vulkan = vulkan_backend().create({});
    VerifyOptions options;
    options.budget_seconds = 300.0;  // samples end it much sooner
    options.criteria.margins = {.image = 0.05, .tile = 0.2};
    for (const char* name : {"closed-forms/polygon-light", "closed-forms/slab"}) {
        const Scene scene = shipped(name);
        CAPTURE(scene.name);
        options.settings = with_longer_side(default_settings(scene), 16);
        options.max_samples = 512;
        for (Renderer* other : {cpu.get(), vulkan.get()}) {
            const SceneVerdict verdict = verify_scene(scene, *other, *first, options);
            CAPTURE(verdict.sentence);
            CHECK(verdict.verdict == Verdict::agree);
        }
    }
}

TEST_CASE("samples of the tracer to read are the same by any split and number of threads") {
    const Scene scene = shipped("cornell-classic");
    const RenderSettings settings = with_longer_side(default_settings(scene), 8);
    BackendOptions one;
    one.threads = 1;
    const auto first = first_backend().create({}), alone = first_backend().create(one);
    Estimate parts = alone->prepare(scene, settings)->render({64, 130}).estimate;
    parts.merge(first->prepare(scene, settings)->render({0, 64}).estimate);
    const Estimate::Plane a = parts.totals(), b = first->prepare(scene, settings)->render({0, 130}).estimate.totals();
    CHECK(std::ranges::equal(a, b,
        [](const Moments& x, const Moments& y) { return x.sum == y.sum && x.sum_of_squares == y.sum_of_squares; }));
}

TEST_CASE("the tracer to read names what it does not simulate, and who does") {
    for (const auto& [name, effect] : {std::pair{"fog", "medium-scattering"}, {"textures", "checker"},
             {"motion", "entity-motion"}, {"conductors", "rough-conductor"}, {"lamps", "cuboid-lights"}}) {
        const Scene scene = shipped(name);
        const std::string told = refusal(scene, default_settings(scene));
        CAPTURE(told);
        CHECK(told.find(effect) != std::string::npos);
        CHECK(told.find("cpu, vulkan and oracle") != std::string::npos);
    }
    const Scene box = shipped("cornell-classic");
    RenderSettings settings = default_settings(box);
    settings.integrator = Integrator::bidirectional;
    CHECK(refusal(box, settings).find("backend cpu") != std::string::npos);
    settings = default_settings(box);
    settings.intersection.guard = SelfIntersectionGuard::ulp;
    CHECK(refusal(box, settings).find("--guard") != std::string::npos);
}
