// The arms of the family `presentation` on a virtual display: what they present is right, and the layer silent.
#include <doctest/doctest.h>

#include <cstdlib>

#include "common/error.h"
#include "common/scene/loader/scene_loader.h"
#include "tests/refusal.h"
#include "tests/vulkan/few_buffers.h"
#include "tests/window/virtual_display.h"
#include "vulkan/bench/families.h"
#include "vulkan/bench/frame_image.h"
#include "vulkan/window/window_place.h"

using namespace tandem;
using namespace tandem::testing;

TEST_CASE("frames wait until the one before is shown, where the driver can tell") {
    const VirtualDisplay display;
    if (!display.there()) {
        MESSAGE("skipped: Xvfb is not installed; run scripts/setup");
        return;
    }
    const Scene scene = load_scene(TANDEM_SOURCE_DIR "/scenes/cornell-thesis.json");
    const auto run = [&] {
        const auto device = std::make_shared<BenchDevice>(BenchRequest{"", scene, {{64, 36}}});
        const Family family = presentation_family(device, make_window_place);
        const std::vector<Arm> arms = family.arms(family.workloads.front());
        const auto waiting = std::ranges::find(arms, "present-wait", &Arm::name);
        REQUIRE(waiting != arms.end());
        const std::unique_ptr<ArmRun> made = waiting->make();
        const std::uint64_t right = arms.front().make()->output().value().digest;
        CHECK(made->output().value().digest == right);
        const ClockReadings readings = made->run();
        CHECK(readings.at("wait-until-shown") >= 0.0);
        CHECK(readings.at("wait-until-shown") <= readings.at("total"));
    };
    ScopedVariables variables;
    variables.set("VK_ADD_LAYER_PATH", TANDEM_BINARY_DIR "/fault_layer");
    variables.set("VK_INSTANCE_LAYERS", "VK_LAYER_TANDEM_faults");
    CHECK(contains(refusal<UnsupportedError>(run), "has no VK_KHR_present_wait"));
    variables.set("TANDEM_PRESENT_WAIT", "1");
    run();
}

TEST_CASE("presented images have the pixels that the host makes of the frame's estimate, and the layer is silent") {
    const VirtualDisplay display;
    if (!display.there()) {
        MESSAGE("skipped: Xvfb is not installed; run scripts/setup");
        return;
    }
    ::setenv("TANDEM_VALIDATION", "1", 1);  // jobs throw what the layer says
    const Scene scene = load_scene(TANDEM_SOURCE_DIR "/scenes/cornell-thesis.json");
    const auto device = std::make_shared<BenchDevice>(BenchRequest{"", scene, {{64, 36}}});
    const Family family = presentation_family(device, make_window_place);
    const RenderWork work = work_of(family.workloads.front());
    const Estimate estimate =
        device->job(work.size, work.bounces, {}, summed_in_pairs)->render({0, work.samples}, {}).estimate;
    const std::uint64_t right = digest_of(shown_pixels(estimate));
    std::size_t shown = 0;
    // All at once, as they are while they are timed: they take turns with the surface.
    std::vector<std::pair<std::string, std::unique_ptr<ArmRun>>> runs;
    for (const Arm& arm : family.arms(family.workloads.front())) {
        CAPTURE(arm.name);
        try {
            std::unique_ptr<ArmRun> run = arm.make();
            CHECK(run->output().value().digest == right);
            ++shown;
            runs.emplace_back(arm.name, std::move(run));
        } catch (const UnsupportedError& refusal) {
            const std::string why = refusal.what();
            MESSAGE(arm.name << ": " << why);
            CHECK(arm.name != "base");
        }
    }
    for (int round = 0; round < 2; ++round)
        for (const auto& [name, run] : runs) {
            CAPTURE(name);
            const ClockReadings readings = run->run();
            CHECK(readings.at("total") > 0.0);
            CHECK(readings.at("submit-to-released") > 0.0);
            CHECK(readings.at("longest-interval") <= readings.at("total"));
        }
    for (const auto& [name, run] : runs) CHECK(run->output().value().digest == right);
    runs.clear();
    CHECK(shown >= 10);
    ::unsetenv("TANDEM_VALIDATION");
}
