// The kernel shape whose hits a ray-tracing pipeline finds: the bits of the six stages where the device has such
// pipelines, and a reason where it has none, or the scene is beyond them.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <glm/ext/matrix_transform.hpp>

#include "common/error.h"
#include "common/scene/loader/scene_loader.h"
#include "tests/vulkan/machine.h"
#include "vulkan/renderer/scene/traced_world.h"
#include "vulkan/renderer/scene/world_boxes.h"

using namespace tandem;
using namespace tandem::testing;

namespace {

JobPatterns traced() {
    JobPatterns patterns;
    patterns.tracer.kernel = KernelShape::ray_tracing;
    return patterns;
}

// Checks both shapes, or the refusal.
void check_shape(Machine& machine, const Scene& scene, const RenderSettings& settings, SampleRange range) {
    CAPTURE(scene.name);
    const std::string reason = untraceable(scene, settings);
    if (!machine.device.features().ray_tracing || !reason.empty()) {
        CHECK_THROWS_AS(static_cast<void>(machine.job(traced(), scene, settings)), UnsupportedError);
        return;
    }
    JobPatterns megakernel;
    megakernel.tracer.kernel = KernelShape::megakernel;
    const Estimate expected = machine.job(megakernel, scene, settings).render(range, {}).estimate;
    const Estimate found = machine.job(traced(), scene, settings).render(range, {}).estimate;
    const EffectSet needed = needed_effects(scene, settings);
    if (!needed.has(Effect::light_sampling) || !needed.has(Effect::medium_absorption)) {
        CHECK(same_bits(found, expected));
        return;
    }
    // How far it is to a sampled light is a root, which Vulkan lets a driver round as it likes, and NVIDIA's 580 does
    // so otherwise in this kind of shader. Only absorption on the way there lets it be seen: in single ulps.
    for (int channel = 0; channel < 3; ++channel)
        CHECK(image_mean(found, channel) == doctest::Approx(image_mean(expected, channel)).epsilon(1e-5));
}

// Equal distances everywhere: bodies that share faces, triangles twice, and more than two of a kind.
Scene ties() {
    SceneBuilder builder;
    builder.camera({0.1, 0.2, 3.0}, {0.0, 0.0, 0.0}, 60.0).background(glm::dvec3(1.0), glm::dvec3(1.0));
    for (const double colour : {0.2, 0.4, 0.6, 0.8}) {
        const std::uint32_t material = builder.material(diffuse(glm::dvec3(colour, 1.0 - colour, 0.5)));
        builder.quad(material, {{{-1, -1, 0}, {0.5, -1, 0}, {0.5, 0.5, 0}, {-1, 0.5, 0}}});
        builder.cuboid(material, {0.0, -0.5, -1.0}, {1.0, 0.5, 0.0});
        builder.sphere(material, {-0.5, 0.5, 0.25}, 0.5);
    }
    return builder.scene();
}

}  // namespace

TEST_CASE("a ray-tracing pipeline gives the bits of the megakernel, or its refusal a reason") {
    Machine machine(false);
    check_shape(machine, ties(), settings_of(33, 4), {0, 5});
    for (const Integrator integrator : {Integrator::path, Integrator::next_event, Integrator::whitted})
        for (const Scene& scene : {full_scene(), outdoor_scene(integrator != Integrator::path), foggy_scene()})
            check_shape(machine, scene, settings_of(13, 5, integrator), {64, 133});
    for (const auto& entry : std::filesystem::directory_iterator(std::filesystem::path(TANDEM_SOURCE_DIR) / "scenes")) {
        if (entry.path().extension() != ".json") continue;
        const Scene scene = load_scene(entry.path());
        RenderSettings settings = with_longer_side(default_settings(scene), 21);
        settings.bounces = std::min(settings.bounces, 6u);
        check_shape(machine, scene, settings, {0, 7});
    }
}

TEST_CASE("a device without ray-tracing pipelines says so") {
    Machine machine(false);
    if (machine.device.features().ray_tracing) return;
    CHECK_THROWS_WITH_AS(static_cast<void>(machine.job(traced(), ties(), settings_of(4, 1))),
        doctest::Contains("has no VK_KHR_ray_tracing_pipeline"), UnsupportedError);
}

TEST_CASE("scenes are refused of which intersection shaders know too little") {
    const auto reason = [](const Scene& scene) {
        return untraceable(scene, settings_of(4, 3, Integrator::next_event));
    };
    CHECK(reason(full_scene()) == "");
    CHECK(reason(ties()) == "");
    CHECK(reason(outdoor_scene(true)).find("entity-motion") != std::string::npos);
    CHECK(reason(foggy_scene()).find("fog around everything") != std::string::npos);
}

TEST_CASE("the pipeline's boxes hold those of the trees, and more the farther rays begin") {
    for (const double far : {1.0, 1e6}) {
        Scene scene = full_scene();
        scene.camera.position = {far, 0.0, 4.0};
        const SceneData data = flatten(scene, settings_of(4, 1), Acceleration::loops);
        const KindBoxes boxes = traced_boxes(scene, data);
        CHECK(boxes[0].size() == data.triangle_count);
        CHECK(boxes[1].size() == data.sphere_count);
        CHECK(boxes[2].size() == data.cuboid_count);
        const std::vector<PlacedPrimitive> all = placed_primitives(scene);
        std::size_t slot = 0;
        for (const std::vector<vk::AabbPositionsKHR>& kind : boxes)
            for (const vk::AabbPositionsKHR& box : kind) {
                const Box tree = world_box(scene, all[data.placed[slot++].id]);
                const double padding = 16.0 * 0x1p-24 * far;  // gamma(16) is larger yet
                CHECK(box.minX <= tree.low.x - padding);
                CHECK(box.minY <= tree.low.y - padding);
                CHECK(box.minZ <= tree.low.z - padding);
                CHECK(box.maxX >= tree.high.x + padding);
                CHECK(box.maxY >= tree.high.y + padding);
                CHECK(box.maxZ >= tree.high.z + padding);
            }
        CHECK(slot == data.placed.size());
    }
}
