// What a miss of a closed form tells that both sides share, on renderers whose image's mean is known for each setting.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

#include "common/error.h"
#include "common/scene/sound_scene.h"
#include "common/validation/report/verdict_json.h"
#include "common/validation/verify/missed_form.h"
#include "common/validation/verify/verify.h"
#include "tests/common/synthetic_renderer.h"
#include "tests/scene_builder.h"

using namespace tandem;
using namespace tandem::test;

namespace {

constexpr std::uint32_t bounces = 6;

// The image's mean, relative to the closed form.
using Mean = std::function<double(const RenderSettings& settings)>;

class Lit : public Renderer {
public:
    explicit Lit(Mean mean, std::string name = "lit") : mean_(std::move(mean)), name_(std::move(name)) {}
    RendererInfo info() const override { return {name_, "", "", "", true}; }
    std::unique_ptr<RenderJob> prepare(const Scene&, const RenderSettings& settings) override {
        if (refuses_path && settings.integrator == Integrator::path) throw UnsupportedError("not here");
        const Sampler sampler = [mean = mean_(settings)](std::uint32_t, std::uint32_t, SampleRandom& random) {
            const double value = 2.0 * mean * random.uniform();
            return Radiance{value, 0.8 * value, 0.6 * value};
        };
        return std::make_unique<SyntheticJob>(settings, sampler);
    }
    bool refuses_path = false;

private:
    Mean mean_;
    std::string name_;
};

// A lamp over a floor, which calls for roulette and two ways to the lamp.
Scene lit_scene() {
    SceneBuilder builder;
    builder.camera({0.0, 1.0, 4.0}, {0.0, 0.0, 0.0}).floor(diffuse(dvec3(0.5)), -1.0, 3.0);
    builder.quad(emitter(dvec3(4.0)), {-1.0, 3.0, -1.0}, {1.0, 3.0, -1.0}, {1.0, 3.0, 1.0}, {-1.0, 3.0, 1.0});
    Scene& scene = builder.scene();
    scene.film = {16, 16};
    scene.defaults.bounces = bounces;
    scene.defaults.integrator = Integrator::next_event;
    scene.defaults.roulette_start = 3;
    scene.expect = Expectation{{1.0, 0.8, 0.6}, "1"};
    return scene;
}

MissedForm missed(Lit side, const Scene& scene = lit_scene()) {
    const RenderSettings settings = default_settings(scene);
    const ClosedFormUse use = closed_form_of(scene, settings);
    REQUIRE(use.form);
    return look_into_miss({.scene = scene,
        .settings = settings,
        .renderer = side,
        .form = *use.form,
        .criteria = {},
        .most_samples = 4096,
        .budget_seconds = 30.0,
        .stop = {},
        .progress = {}});
}

std::vector<std::string> with_outcome(const MissedForm& form, FormOutcome outcome) {
    std::vector<std::string> changes;
    for (const FormTrial& trial : form.trials)
        if (trial.outcome == outcome) changes.push_back(trial.change);
    return changes;
}
using Changes = std::vector<std::string>;

bool samples_lights(const RenderSettings& settings) { return settings.integrator == Integrator::next_event; }

}  // namespace

TEST_CASE("a limit of bounces that both sides have one off is found by the closed form") {
    for (const int off : {-1, 1}) {
        CAPTURE(off);
        const MissedForm form = missed(Lit([off](const RenderSettings& settings) {
            return std::pow(1.03, static_cast<double>(settings.bounces) + off - bounces);
        }));
        CHECK(with_outcome(form, FormOutcome::met) ==
              Changes{off < 0 ? "with one bounce more" : "with one bounce fewer"});
        CHECK(form.left_out.empty());
        CHECK(form.whole.relative == doctest::Approx(0.03 * off).epsilon(0.1));
        const std::vector<Suspect> suspects = suspects_of_miss({.features = {}, .tried = &form});
        REQUIRE(!suspects.empty());
        CHECK(suspects[0].part == Subsystem::roulette);
    }
}

TEST_CASE("weights of two ways are told from the sampling of lights, by the closed form alone") {
    const MissedForm weights =
        missed(Lit([](const RenderSettings& s) { return samples_lights(s) && s.mis ? 1.1 : 1.0; }));
    CHECK(with_outcome(weights, FormOutcome::met) ==
          Changes{"without weights of two ways to a light", "without lights that are sampled"});
    CHECK(suspects_of_miss({.features = {}, .tried = &weights}).front().part == Subsystem::mis_weights);

    const MissedForm lights = missed(Lit([](const RenderSettings& s) { return samples_lights(s) ? 1.1 : 1.0; }));
    CHECK(with_outcome(lights, FormOutcome::met) == Changes{"without lights that are sampled"});
    CHECK(suspects_of_miss({.features = {}, .tried = &lights}).front().part == Subsystem::light_sampling);
}

TEST_CASE("a miss that no change ends clears the parts that the changes take out") {
    const MissedForm form = missed(Lit([](const RenderSettings&) { return 1.1; }));
    CHECK(with_outcome(form, FormOutcome::met).empty());
    const std::vector<Subsystem> cleared = cleared_parts(form);
    for (const Subsystem part : {Subsystem::light_sampling, Subsystem::roulette})
        CHECK(std::ranges::find(cleared, part) != cleared.end());
    for (const Subsystem part : {Subsystem::random_numbers, Subsystem::bsdf})
        CHECK(std::ranges::find(cleared, part) == cleared.end());
}

TEST_CASE("a change that leaves a part of the miss does not meet the closed form") {
    const MissedForm form = missed(Lit([](const RenderSettings& s) { return samples_lights(s) ? 1.1 : 1.03; }));
    CHECK(with_outcome(form, FormOutcome::met).empty());
}

TEST_CASE("a change that a side refuses decides nothing") {
    Lit side([](const RenderSettings&) { return 1.1; });
    side.refuses_path = true;
    const Changes unknown = with_outcome(missed(side), FormOutcome::unknown);
    CHECK(std::ranges::find(unknown, "without lights that are sampled") != unknown.end());
}

TEST_CASE("a side that meets its closed form has no change tried") {
    const MissedForm form = missed(Lit([](const RenderSettings&) { return 1.0; }));
    CHECK(with_outcome(form, FormOutcome::met).empty());
    CHECK(told(form).find("met: ") == std::string::npos);
}

TEST_CASE("data that are not what the loader promises are told") {
    Scene scene = lit_scene();
    CHECK(unsound_part(scene).empty());
    PunctualLight light;
    light.direction = {0.0, -2.0, 0.0};
    scene.lights.push_back(light);
    CHECK(unsound_part(scene) == "lights");
    scene.lights.clear();
    scene.materials[0].colour = dvec3(1.5);
    CHECK(unsound_part(scene) == "materials");
    const MissedForm form = missed(Lit([](const RenderSettings&) { return 1.1; }), scene);
    const std::vector<Suspect> suspects = suspects_of_miss({.features = {}, .tried = &form});
    REQUIRE(!suspects.empty());
    CHECK(suspects[0].part == Subsystem::scene_data);
    CHECK(suspects[0].because == "materials that were read are not what common/scene/scene.h promises");
}

TEST_CASE("verify looks into a miss that both sides share, and into no other") {
    const Scene scene = lit_scene();
    const auto early = [](const RenderSettings& settings) { return std::pow(1.3, settings.bounces - 7.0); };
    Lit a(early, "cpu"), b(early, "vulkan"), right([](const RenderSettings&) { return 1.0; }, "vulkan");
    VerifyOptions options;
    options.settings = default_settings(scene);
    options.max_samples = 1024;
    const SceneVerdict verdict = verify_scene(scene, a, b, options);
    REQUIRE(misses_on_both_sides(verdict));
    REQUIRE(verdict.missed_form);
    CHECK(verdict.suspects.front().part == Subsystem::roulette);
    const nlohmann::json json = to_json(verdict)["missed_form"];
    CHECK(json["text"] == told(*verdict.missed_form));
    bool found = false;
    for (const nlohmann::json& one : json["changes"]) {
        if (one["change"] != "with one bounce more") continue;
        found = true;
        CHECK(one["outcome"] == "met");
        CHECK(one["subsystem"] == "roulette and path length");
    }
    CHECK(found);
    CHECK_FALSE(verify_scene(scene, a, right, options).missed_form);
    CHECK_FALSE(verify_scene(scene, right, right, options).missed_form);
}
