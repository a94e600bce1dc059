// Which feature a planted bug needs: the Vulkan path tracer with the bug against the CPU's without, on small scenes.
#include <doctest/doctest.h>

#include <algorithm>
#include <vector>

#include "common/scene/loader/scene_loader.h"
#include "common/validation/verify/elimination.h"
#include "common/validation/verify/verify.h"
#include "cpu_ref/backend.h"
#include "tests/mutants/plant_data.h"
#include "tests/mutants/trial.h"
#include "tests/thorough.h"
#include "vulkan/backend.h"

using namespace tandem;
using namespace tandem::test;

namespace {

Elimination eliminated(const PlantedFault& fault, const char* name) {
    const Scene scene = load_scene(scene_file(name));
    BackendOptions single, precise;
    single.precision = Precision::single_precision;
    precise.precision = Precision::double_precision;
    const auto sound = renderer_with(cpu_backend(), {}, single), other = renderer_with(cpu_backend(), {}, precise);
    const auto faulty = renderer_with(vulkan_backend(), fault, single);
    const RenderSettings settings = verification_settings(scene, 48);
    Criteria criteria;
    criteria.fixed_tolerance = float_transport_tolerance(settings.bounces);
    return eliminate({.scene = scene,
        .settings = settings,
        .reference = *sound,
        .candidate = *faulty,
        .other_precision = other.get(),
        .criteria = criteria,
        .suspicion = {},
        .budget_seconds = 60.0,
        .expected_seconds = 0.0,
        .stop = {},
        .progress = {}});
}

// The first that is needed, of those that name their part.
std::string first_needed(const Elimination& elimination) {
    for (const FeatureTrial& trial : elimination.trials)
        if (trial.need == Need::needed && trial.feature.naming != Naming::nobody)
            return std::string(trial.feature.words);
    return "";
}

}  // namespace

TEST_CASE("the feature that a planted bug lies in is what the difference needs" * doctest::test_suite("full")) {
    struct Planted {
        PlantedFault fault;
        const char *scene, *feature;
    };
    for (const auto& [fault, of_scene, of_feature] : {Planted{{PlantedBug::lens_radius_scaled, 0.1}, "bokeh", "a lens"},
             Planted{PlantedBug::motion_halved, "motion", "a camera that moves"},
             Planted{PlantedBug::noise_seed_ignored, "textures", "a noise texture"},
             Planted{PlantedBug::ggx_masking_dropped, "conductors", "a rough conductor"},
             Planted{PlantedBug::outside_index_ignored, "nested-glass", "bodies of glass with priorities"},
             Planted{PlantedBug::phase_sign, "fog", "a medium that scatters more to one side"},
             Planted{PlantedBug::mixture_ignored, "many-lamps", "weights of two ways to a light"}}) {
        const std::string scene = of_scene, feature = of_feature;
        CAPTURE(scene);
        const Elimination elimination = eliminated(fault, of_scene);
        CAPTURE(told(elimination));
        CHECK(first_needed(elimination) == feature);
    }
}

TEST_CASE("where no bug is planted no feature is needed") {
    std::vector<const char*> scenes{"bokeh"};
    if (thorough()) scenes.insert(scenes.end(), {"conductors", "nested-glass"});
    for (const char* scene : scenes) {
        const Elimination elimination = eliminated({}, scene);
        CAPTURE(scene);
        CHECK(first_needed(elimination).empty());
        CHECK(elimination.left_out.starts_with("undecided"));
    }
}
