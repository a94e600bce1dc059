// The verifier is verified, on scenes made for it. A bug planted in one backend must bring the verdict "disagree"
// against the sound other one. Two sound backends must never get it. The sound side is the reference. The whole
// catalogue, on the shipped scenes, is scripts/measure/mutants' and test_mutants.cpp's.
#include <doctest/doctest.h>

#include "common/validation/verify/verify.h"
#include "cpu_ref/backend.h"
#include "tests/mutants/catalogue.h"
#include "tests/mutants/plant_data.h"
#include "tests/mutants/scenes.h"
#include "vulkan/backend.h"

using namespace tandem;
using namespace tandem::test;

namespace {

std::unique_ptr<Renderer> single_with(const Backend& backend, const PlantedFault& bug) {
    BackendOptions options;
    options.precision = Precision::single_precision;
    return renderer_with(backend, bug, options);
}

// With the settings that show `bug`.
SceneVerdict verdict_of(const TrialScene& trial, Renderer& reference, Renderer& candidate, PlantedBug bug) {
    VerifyOptions options;
    options.settings = trial.settings;
    make_visible(bug, *options.settings);
    options.max_samples = 256;  // a pixel: the looks depend on this alone, the budget in seconds is out of reach
    options.max_looks = 2;
    options.budget_seconds = 3600.0;
    options.seed = 20190701;
    options.explain = false;              // the verdict alone is tested
    options.criteria.false_alarm = 1e-3;  // a scene; seven controls then cry wolf once in 140 runs of other seeds
    return verify_scene(trial.scene, reference, candidate, options);
}

void check_noticed(const Backend& mutant, const Backend& sound, const PlantedFault& bug, const TrialScene& trial) {
    const auto reference = single_with(sound, PlantedBug::none), candidate = single_with(mutant, bug);
    const SceneVerdict verdict = verdict_of(trial, *reference, *candidate, bug.bug);
    CAPTURE(trial.name);
    CAPTURE(verdict.sentence);
    CHECK(verdict.verdict == Verdict::disagree);
}

void check_sound(const TrialScene& trial, PlantedBug shown = PlantedBug::none) {
    const auto reference = single_with(cpu_backend(), PlantedBug::none);
    const auto candidate = single_with(vulkan_backend(), PlantedBug::none);
    const SceneVerdict verdict = verdict_of(trial, *reference, *candidate, shown);
    CAPTURE(verdict.sentence);
    CHECK(verdict.verdict != Verdict::disagree);
}

// Under whitted the sides' samples have no bound, so that an oracle of another technique could never contradict one.
void check_blamed_under_whitted(const Backend& mutant, const Backend& sound, const PlantedFault& bug) {
    TrialScene trial = lamps();
    trial.settings = with_longer_side(trial.settings, 24);
    trial.settings.integrator = Integrator::whitted;
    const auto reference = single_with(sound, PlantedBug::none), candidate = single_with(mutant, bug);
    const auto oracle = oracle_backend().create({});
    VerifyOptions options;
    options.settings = trial.settings;
    options.max_samples = 256;
    options.max_looks = 2;
    options.budget_seconds = 60.0;
    options.seed = 20190701;
    options.explain = false;
    for (const bool mutant_is_candidate : {true, false}) {
        options.oracle = oracle.get();
        const SceneVerdict verdict = mutant_is_candidate ? verify_scene(trial.scene, *reference, *candidate, options)
                                                         : verify_scene(trial.scene, *candidate, *reference, options);
        CAPTURE(verdict.sentence);
        CHECK(verdict.verdict == Verdict::disagree);
        CHECK(verdict.outvoted == (mutant_is_candidate ? Outvoted::candidate : Outvoted::reference));
    }
}

}  // namespace

TEST_CASE("under whitted the oracle says which side is wrong") {
    SUBCASE("the CPU") { check_blamed_under_whitted(cpu_backend(), vulkan_backend(), {PlantedBug::jacobian_missing}); }
    SUBCASE("Vulkan") {
        check_blamed_under_whitted(vulkan_backend(), cpu_backend(), {PlantedBug::sphere_light_cone_scaled, 0.03});
    }
}

// One test a bug and backend, so that each failure stands by itself.
#define TANDEM_MUTANT(bug, trial, ...)                                                                         \
    TEST_CASE("cpu: " #bug " " #__VA_ARGS__ " shows in " #trial) {                                             \
        check_noticed(cpu_backend(), vulkan_backend(), {PlantedBug::bug __VA_OPT__(, ) __VA_ARGS__}, trial()); \
    }                                                                                                          \
    TEST_CASE("vulkan: " #bug " " #__VA_ARGS__ " shows in " #trial) {                                          \
        check_noticed(vulkan_backend(), cpu_backend(), {PlantedBug::bug __VA_OPT__(, ) __VA_ARGS__}, trial()); \
    }

TANDEM_MUTANT(cosine_dropped, lamps)
TANDEM_MUTANT(inverse_pi_dropped, lamps)
TANDEM_MUTANT(roulette_not_divided, roulette_box)
TANDEM_MUTANT(one_bounce_more, closed_box)
TANDEM_MUTANT(one_bounce_fewer, closed_box)
TANDEM_MUTANT(relative_index_inverted, glass_bodies)
TANDEM_MUTANT(pdf_not_of_sampler, open_sky)
TANDEM_MUTANT(mis_weights_unequal, lamps)
TANDEM_MUTANT(jacobian_missing, lamps)
TANDEM_MUTANT(light_tree_parents_forgotten, lamps)
TANDEM_MUTANT(light_tree_number_reused, lamps)
TANDEM_MUTANT(light_tree_normal_forgotten, lamps)
TANDEM_MUTANT(light_from_behind, lamps)
TANDEM_MUTANT(dimension_reused, open_sky)
TANDEM_MUTANT(film_shifted, open_sky, 0.5)
TANDEM_MUTANT(filter_width_scaled, open_sky, 0.3)
TANDEM_MUTANT(filter_off_centre, open_sky)
TANDEM_MUTANT(filter_even, open_sky)
TANDEM_MUTANT(albedo_scaled, open_sky, 0.03)
TANDEM_MUTANT(albedo_scaled, open_sky, 0.01)
TANDEM_MUTANT(self_hit_not_excluded, open_sky)
TANDEM_MUTANT(epsilon_too_large, narrow_gap, 0.01)
TANDEM_MUTANT(total_reflection_lost, glass_bodies)
TANDEM_MUTANT(normal_transform_wrong, open_sky)
TANDEM_MUTANT(radiance_clamped, lamps)
TANDEM_MUTANT(lens_radius_scaled, wide_lens, 1.0)
TANDEM_MUTANT(alpha_ignored, glass_bodies)

#define TANDEM_SOUND(trial) \
    TEST_CASE("two sound backends do not disagree about " #trial) { check_sound(trial()); }

TANDEM_SOUND(lamps)
TEST_CASE("two sound backends do not disagree about lamps that a tree chooses") {
    check_sound(lamps(), PlantedBug::light_tree_number_reused);
}
TEST_CASE("two sound backends do not disagree about bodies that a Gaussian filter shows") {
    check_sound(open_sky(), PlantedBug::filter_even);
}
TANDEM_SOUND(open_sky)
TANDEM_SOUND(closed_box)
TANDEM_SOUND(roulette_box)
TANDEM_SOUND(glass_bodies)
TANDEM_SOUND(wide_lens)
TANDEM_SOUND(narrow_gap)
