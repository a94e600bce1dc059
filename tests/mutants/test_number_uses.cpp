// Which random number decides what: on sound tracers as MODEL.md section 3 says, and told where a planted bug uses one
// twice.
#include <doctest/doctest.h>

#include <array>
#include <map>
#include <string>
#include <vector>

#include "common/render/path_trace.h"
#include "common/scene/loader/scene_loader.h"
#include "common/validation/verify/number_uses.h"
#include "common/validation/verify/verify.h"
#include "cpu_ref/backend.h"
#include "tests/mutants/plant_data.h"
#include "tests/mutants/trial.h"
#include "vulkan/backend.h"

using namespace tandem;
using namespace tandem::test;

namespace {

NumberUses uses_in(const char* name, PlantedBug bug, std::size_t vertex, bool planted_in_vulkan = true) {
    const Scene scene = load_scene(scene_file(name));
    const RenderSettings settings = verification_settings(scene, 16);
    const PlantedFault fault{bug};
    const auto cpu = renderer_with(cpu_backend(), planted_in_vulkan ? PlantedFault{} : fault, {}),
               vulkan = renderer_with(vulkan_backend(), planted_in_vulkan ? fault : PlantedFault{}, {});
    const auto reference = cpu->prepare(scene, settings), candidate = vulkan->prepare(scene, settings);
    const std::uint32_t w = settings.width, h = settings.height;
    const std::array pixels{glm::uvec2(w / 2, 3 * h / 4), glm::uvec2(w / 4, h / 2), glm::uvec2(2 * w / 3, h / 2)};
    return number_uses({*reference, *candidate, pixels, vertex});
}

}  // namespace

TEST_CASE("sound path tracers take every random number for the same") {
    for (const char* name :
        {"cornell-classic", "fog", "bokeh", "motion", "glass", "conductors", "many-lamps", "cloud", "next-week"})
        for (const std::size_t vertex : {0, 1, 2}) {
            CAPTURE(name);
            CAPTURE(vertex);
            const NumberUses found = uses_in(name, PlantedBug::none, vertex);
            CHECK(found.words == "");
            CHECK(found.use == NumberUse::same);
        }
}

TEST_CASE("a number that is used twice is told, with the one that is left over") {
    for (const bool vulkan : {true, false}) {
        const NumberUses found = uses_in("cornell-classic", PlantedBug::dimension_reused, 0, vulkan);
        CHECK(found.use == NumberUse::own);
        CHECK(found.words == "scattering's second number does not decide the direction of scattering of the " +
                                 std::string(vulkan ? "candidate" : "reference"));
    }
}
