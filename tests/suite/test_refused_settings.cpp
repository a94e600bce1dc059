// Every renderer refuses what common/render/check_settings.h refuses, by the same words.
#include "common/error.h"
#include "common/render/check_settings.h"
#include "tests/suite/tracers.h"

using namespace tandem;
using namespace tandem::test;

namespace {

struct Refused {
    Scene scene;
    RenderSettings settings;
};

template <class Action>
std::string reason(const Action& refused) {
    try {
        refused();
    } catch (const UnsupportedError& error) {
        return error.what();
    }
    return "";
}

}  // namespace

TEST_CASE("every renderer refuses alike what no renderer can do") {
    const Scene ball = SceneBuilder().sphere(emitter(white), dvec3(0.0, 0.0, -3.0), 1.0).scene();
    std::vector<Refused> all(4, {ball, settings_of(4, 1)});
    all[0].settings.width = 0;
    all[1].settings.ray_min = -1.0;
    all[2].settings.bounces = 1u << 28;
    all[3].scene.camera.target = all[3].scene.camera.position;
    for (Tracer& tracer : tracers())
        for (const Refused& one : all) {
            CAPTURE(tracer.name);
            const std::string expected = reason([&] { check_settings(one.scene, one.settings); });
            CHECK(!expected.empty());
            CHECK(reason([&] { (void)tracer.renderer->prepare(one.scene, one.settings); }) == expected);
        }
}
