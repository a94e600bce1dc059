// verify where the two sides have one mean but not one estimator: the oracle has no light sampling.
#include <doctest/doctest.h>

#include <filesystem>

#include "common/scene/loader/scene_loader.h"
#include "common/validation/verify/verify.h"
#include "cpu_ref/backend.h"

namespace tandem {

TEST_CASE("next events and the oracle's paths differ in noise alone, which is no disagreement") {
    Scene scene = load_scene(std::filesystem::path(TANDEM_SOURCE_DIR) / "scenes" / "cornell-classic.json");
    VerifyOptions options;
    options.settings = with_longer_side(default_settings(scene), 16);
    options.settings->integrator = Integrator::next_event;
    options.settings->bounces = 3;
    options.max_samples = 512;
    options.budget_seconds = 60.0;
    const auto oracle = oracle_backend().create({}), cpu = cpu_backend().create({});
    const SceneVerdict verdict = verify_scene(scene, *oracle, *cpu, options);
    CHECK(verdict.verdict != Verdict::disagree);
    CHECK(!verdict.criteria.same_estimator);
    const SceneVerdict same = verify_scene(scene, *cpu, *cpu, options);
    CHECK(same.criteria.same_estimator);
}

}  // namespace tandem
