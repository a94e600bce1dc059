// The renderer is clean under the validation layer, and the layer would have spoken. Where the layer is not installed
// these tests fail, as scripts/setup installs it.
#include <doctest/doctest.h>

#include "tests/vulkan/probe.h"
#include "tests/vulkan/scenes.h"

using namespace tandem;
using namespace tandem::testing;

namespace {

bool speaks_of(const std::vector<std::string>& messages, const std::string& what) {
    for (const std::string& message : messages)
        if (message.find(what) != std::string::npos) return true;
    return false;
}

}  // namespace

TEST_CASE("the layer sees a missing barrier between two dispatches") {
    CHECK(speaks_of(messages_about_copies(Ordering::none_in_one_submit), "READ_AFTER_WRITE"));
}

TEST_CASE("the layer sees a missing barrier across two submits") {
    CHECK(speaks_of(messages_about_copies(Ordering::none_across_submits), "READ_AFTER_WRITE"));
}

TEST_CASE("the layer has nothing to say about dispatches with a barrier") {
    CHECK(messages_about_copies(Ordering::barrier).empty());
}

namespace {

void check_silence(const std::string& kernel) {
    BackendOptions options;
    options.validation = true;
    options.kernel = kernel;
    const auto renderer = vulkan_backend().create(options);
    for (const Integrator integrator : {Integrator::path, Integrator::next_event})
        for (const Scene& scene : {full_scene(), outdoor_scene(integrator != Integrator::path), foggy_scene()}) {
            RenderSettings settings = settings_of(16, 6, integrator);
            settings.roulette_start = 3;
            const auto job = renderer->prepare(scene, settings);
            // Two blocks, the second ragged, and then another call.
            CHECK_NOTHROW(static_cast<void>(job->render({0, 70})));
            CHECK_NOTHROW(static_cast<void>(job->render({128, 130})));
        }
}

}  // namespace

TEST_CASE("the layer has nothing to say about six stages with every effect") { check_silence("stages"); }

TEST_CASE("the layer has nothing to say about the megakernel with every effect") { check_silence("megakernel"); }

TEST_CASE("the layer has nothing to say about dispatches over the whole image and fragments") {
    for (const char* kernel : {"image-stages", "fragment", "thesis"}) {
        BackendOptions options;
        options.validation = true;
        options.kernel = kernel;
        const auto renderer = vulkan_backend().create(options);
        const auto job = renderer->prepare(foggy_scene(), settings_of(16, 3, Integrator::next_event));
        CHECK_NOTHROW(static_cast<void>(job->render({0, 70})));
        CHECK_NOTHROW(static_cast<void>(job->render({128, 130})));
    }
}

TEST_CASE("the layer has nothing to say about general kernels") {
    BackendOptions options;
    options.validation = true;
    RenderSettings settings = settings_of(8, 3, Integrator::next_event);
    settings.effects = EffectSet::all();
    CHECK_NOTHROW(static_cast<void>(vulkan_backend().create(options)->prepare(full_scene(), settings)->render({0, 2})));
}
