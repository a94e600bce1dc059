// Every family of the pattern benchmarks. Its arms compute what its baseline computes or say why they cannot run here.
// The claims speak of arms that there are. Nothing is timed.
#include <doctest/doctest.h>

#include <algorithm>
#include <cstdlib>

#include "common/error.h"
#include "common/experiment/runner.h"
#include "tests/vulkan/scenes.h"
#include "vulkan/bench/bench.h"
#include "vulkan/bench/families.h"
#include "vulkan/bench/frame_image.h"
#include "vulkan/resources/show_place.h"

using namespace tandem;
using namespace tandem::testing;

namespace {

Scene small_room() {
    SceneBuilder builder;
    builder.camera({0.1, 0.2, 0.3}, {1.0, 0.4, -0.3}, 70.0);
    Material material = diffuse(glm::dvec3(0.7, 0.5, 0.3));
    material.radiance = glm::dvec3(0.25);
    const std::uint32_t walls = builder.material(material);
    builder.cuboid(walls, {-1.0, -1.0, -1.0}, {1.0, 1.5, 2.0});
    builder.triangle(walls, {{{0.9, -0.9, -0.9}, {0.9, -0.9, 0.9}, {0.9, 0.9, 0.0}}});
    return builder.scene();
}

SharedDevice device_of(bool validation) {
    ::setenv("TANDEM_VALIDATION", validation ? "1" : "0", 1);
    const auto device = std::make_shared<BenchDevice>(BenchRequest{"", small_room(), {{16, 9}}});
    ::unsetenv("TANDEM_VALIDATION");
    return device;
}

// Runs each arm once after its gate; says of how many it was not applicable.
std::size_t check_arms(const Family& family) {
    std::size_t refused = 0;
    const std::vector<Arm> arms = family.arms(family.workloads.front());
    std::optional<ArmOutput> baseline;
    for (const Arm& arm : arms) {
        CAPTURE(family.name);
        CAPTURE(arm.name);
        CHECK(!arm.text.empty());
        try {
            const std::unique_ptr<ArmRun> run = arm.make();
            const std::optional<ArmOutput> output = run->output();
            if (&arm == arms.data()) baseline = output;
            CHECK(output.has_value() == baseline.has_value());
            // Vulkan does not define the result of `execution`: an H100 has other bits there, lavapipe the same.
            const bool defined = family.name != "barriers" || arm.name != "execution";
            if (output && baseline && arm.same_bits && defined) CHECK(output->digest == baseline->digest);
            CHECK(run->run().at(family.clock) > 0.0);
        } catch (const UnsupportedError& refusal) {
            if (!family.everywhere && &arm == arms.data()) return arms.size();
            CHECK(&arm != arms.data());  // the baseline runs everywhere
            CHECK(std::string(refusal.what()).size() > 10);
            ++refused;
        }
    }
    CHECK(refused < arms.size() - 1);
    return refused;
}

}  // namespace

TEST_CASE("every arm of every family computes what its baseline computes") {
    const SharedDevice device = device_of(false);
    for (const Family& family : all_families(device)) (void)check_arms(family);
}

TEST_CASE("the layer has nothing to say about several queues, frames in flight, transfers and pipelines") {
    const SharedDevice device = device_of(true);
    for (const Family& family : {queues_family(device), frames_family(device), transfers_family(device),
             transfers_beside_family(device), readback_family(device), pipelines_family(device), images_family(device)})
        (void)check_arms(family);
    const std::vector<std::string> messages = device->log().take();
    CHECK(messages.empty());
    for (const std::string& message : messages) MESSAGE(message);
}

TEST_CASE("frames end in the pixels that the host makes of their estimate") {
    const SharedDevice device = device_of(false);
    const Family family = images_family(device);
    const RenderWork work = work_of(family.workloads.front());
    const Estimate estimate =
        device->job(work.size, work.bounces, {}, summed_in_pairs)->render({0, work.samples}, {}).estimate;
    const std::vector<std::uint8_t> pixels = shown_pixels(estimate);
    CHECK(pixels.size() == 4 * 16 * 9);
    CHECK(std::ranges::count(pixels, pixels.front()) < 400);  // a picture
    const std::unique_ptr<ArmRun> baseline = family.arms(family.workloads.front()).front().make();
    CHECK(baseline->output().value().digest == digest_of(pixels));
    (void)baseline->run();
    CHECK(baseline->output().value().digest == digest_of(pixels));
}

TEST_CASE("where nothing can be shown, the family of presentation is not applicable, with the reason") {
    const SharedDevice device = device_of(false);
    const MakeShowPlace nowhere = [](std::uint32_t, std::uint32_t) -> std::shared_ptr<ShowPlace> {
        throw DeviceError("there is no screen");
    };
    Family family = presentation_family(device, nowhere);
    const bool headless = [&] {
        try {
            return family.arms(family.workloads.front()).front().make() != nullptr;
        } catch (const UnsupportedError&) {
            return false;
        }
    }();
    if (headless) return;  // Vulkan has a surface without a display here
    const ExperimentSamples samples = run_experiment(family, family.workloads.front(), {});
    CHECK(samples.arms.size() == family.arms(family.workloads.front()).size());
    for (const ArmSamples& arm : samples.arms) {
        CHECK(arm.identity == Identity::not_applicable);
        CHECK(arm.reason.find("there is no screen") != std::string::npos);
        CHECK(arm.seconds.empty());
    }
}

TEST_CASE("every claim speaks of arms that there are") {
    const SharedDevice device = device_of(false);
    const std::vector<Family> families = all_families(device);
    const auto exists = [&](const Contrast& contrast, const std::string& name) {
        const auto family = std::ranges::find(families, contrast.family, &Family::name);
        REQUIRE(family != families.end());
        const std::vector<Arm> arms = family->arms(family->workloads.front());
        return name.empty() || std::ranges::find(arms, name, &Arm::name) != arms.end();
    };
    for (const Claim& claim : pattern_claims()) {
        CAPTURE(claim.id);
        CHECK(exists(claim.contrast, claim.contrast.arm));
        CHECK(exists(claim.contrast, claim.contrast.against));
        if (claim.over) CHECK(exists(*claim.over, claim.over->arm));
        CHECK(!claim.rule.empty());
    }
}
