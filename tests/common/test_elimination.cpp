// Which features a disagreement needs, on renderers whose fault is known: it is in what a scene or settings have.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>

#include "common/error.h"
#include "common/scene/sound_scene.h"
#include "common/validation/explanation/suspects.h"
#include "common/validation/report/verdict_json.h"
#include "common/validation/verify/verify.h"
#include "tests/common/synthetic_renderer.h"
#include "tests/scene_builder.h"

using namespace tandem;
using namespace tandem::test;

namespace {

// How a renderer errs in a scene: all that it brings is multiplied, or a share of its samples has other numbers.
struct Wrong {
    double factor = 1.0, strays = 0.0;
};
using Fault = std::function<Wrong(const Scene& scene, const RenderSettings& settings)>;

Wrong right(const Scene&, const RenderSettings&) { return {}; }

class Faulty : public Renderer {
public:
    explicit Faulty(Fault fault) : fault_(std::move(fault)) {}
    RendererInfo info() const override { return {"faulty", "", "", "", true}; }
    std::unique_ptr<RenderJob> prepare(const Scene& scene, const RenderSettings& settings) override {
        now += prepare_seconds;
        if (refuses && refuses(settings)) throw UnsupportedError("not here");
        const Wrong error = fault_(scene, settings);
        const Sampler sampler = [error](std::uint32_t x, std::uint32_t y, SampleRandom& random) {
            const double value = error.factor * (0.5 + 0.01 * (x + y)) * random.exponential();
            return Radiance{value, 0.8 * value, 0.6 * value};
        };
        return std::make_unique<SyntheticJob>(settings, sampler, Strays{error.strays});
    }
    double prepare_seconds = 0.0, now = 0.0;  // all the time that passes is for that
    std::function<bool(const RenderSettings&)> refuses;

private:
    Fault fault_;
};

bool has_rough_conductor(const Scene& scene) {
    return std::ranges::any_of(
        scene.materials, [](const Material& m) { return m.kind == MaterialKind::conductor && m.roughness > 0.0; });
}
bool has_texture(const Scene& scene) {
    return std::ranges::any_of(scene.materials, [](const Material& m) { return m.colour_texture != no_index; });
}

// A lens, a lamp, a rough conductor, a checker, glass and a mirror.
Scene rich_scene() {
    Material metal;
    metal.kind = MaterialKind::conductor;
    metal.roughness = 0.3;
    SceneBuilder builder;
    builder.camera({0.0, 1.0, 4.0}, {0.0, 0.0, 0.0}).lens(0.1, 4.0);
    builder.quad(emitter(dvec3(4.0)), {-1.0, 3.0, -1.0}, {1.0, 3.0, -1.0}, {1.0, 3.0, 1.0}, {-1.0, 3.0, 1.0});
    builder.floor(diffuse(dvec3(0.5)), -1.0, 3.0);
    builder.sphere(metal, {-1.0, 0.0, 0.0}, 0.5).sphere(glass(1.5), {0.0, 0.0, 0.0}, 0.5);
    builder.cuboid(mirror(dvec3(0.9)), {1.0, -0.5, -0.5}, {2.0, 0.5, 0.5});
    Texture checker;
    checker.first = dvec3(0.2);
    checker.second = dvec3(0.8);
    builder.scene().textures.push_back(checker);
    builder.scene().materials[1].colour_texture = 0;
    return builder.scene();
}

struct Trial {
    Scene scene = rich_scene();
    RenderSettings settings = settings_of(32, 6, Integrator::next_event);
    Faulty reference{right}, candidate;
    double budget_seconds = 30.0;
    Renderer* other_precision = nullptr;
    Trial(Fault fault) : candidate(std::move(fault)) {}

    [[nodiscard]] Elimination run() {
        Criteria criteria;
        criteria.fixed_tolerance = 1e-5;
        return eliminate({.scene = scene,
            .settings = settings,
            .reference = reference,
            .candidate = candidate,
            .other_precision = other_precision,
            .criteria = criteria,
            .suspicion = {},
            .budget_seconds = budget_seconds,
            .expected_seconds = candidate.prepare_seconds,
            .stop = {},
            .progress = {},
            .now = [&] { return reference.now + candidate.now; }});
    }
};

std::vector<std::string> with_need(const Elimination& elimination, Need need) {
    std::vector<std::string> words;
    for (const FeatureTrial& trial : elimination.trials)
        if (trial.need == need) words.emplace_back(trial.feature.words);
    return words;
}
using Words = std::vector<std::string>;

std::vector<Suspect> suspects_of(const Elimination& elimination) {
    const Judgement judgement;
    const PathPartings partings;
    const FaultPlace place;
    Signature signature{};  // as if next events differed
    signature[Figure::by_light] = 1.0F;
    return suspects_of_difference({judgement, signature, partings, place, &elimination}, {.patterns = {}}).suspects;
}

}  // namespace

TEST_CASE("the one feature that a difference needs is found, and is named before what paths show") {
    Trial trial([](const Scene& scene, const RenderSettings&) {
        return Wrong{.factor = scene.camera.lens_radius > 0.0 ? 1.02 : 1.0};
    });
    const Elimination elimination = trial.run();
    CHECK(with_need(elimination, Need::needed) == Words{"a lens"});
    CHECK(elimination.left_out.empty());
    CHECK(elimination.whole.relative == doctest::Approx(0.02).epsilon(1e-3));
    CHECK(elimination.scenes < elimination.trials.size());  // halves first
    const std::vector<Suspect> suspects = suspects_of(elimination);
    REQUIRE(!suspects.empty());
    CHECK(suspects[0].part == Subsystem::camera);
    CHECK(suspects[0].because ==
          "the sides agree without a lens: 16 pairs a pixel, difference below 0.00010 %; with it 2.0 %");
    const PartNeeds needs = needs_by_part(elimination);
    CHECK(needs.at(static_cast<std::size_t>(Subsystem::light_sampling)) == PartNeed::cleared);  // it does without
    CHECK(told(elimination).find("; needed: a lens; not needed: a checker, glass, a rough conductor, ") !=
          std::string::npos);
}

TEST_CASE("of two features that a difference needs both are found, and the more particular one is named first") {
    Trial trial([](const Scene& scene, const RenderSettings& settings) {
        const bool both = has_rough_conductor(scene) && settings.integrator == Integrator::next_event;
        return Wrong{.factor = both ? 1.02 : 1.0};
    });
    const Elimination elimination = trial.run();
    CHECK(with_need(elimination, Need::needed) == Words{"a rough conductor", "lights that are sampled"});
    const std::vector<Suspect> suspects = suspects_of(elimination);
    REQUIRE(suspects.size() >= 2);
    CHECK(suspects[0].part == Subsystem::bsdf);
    CHECK(suspects[1].part == Subsystem::light_sampling);
}

TEST_CASE("weights of two ways to a light are told from light sampling") {
    Trial trial([](const Scene&, const RenderSettings& settings) {
        return Wrong{.factor = settings.integrator == Integrator::next_event && settings.mis ? 1.02 : 1.0};
    });
    const std::vector<Suspect> suspects = suspects_of(trial.run());
    REQUIRE(!suspects.empty());
    CHECK(suspects[0].part == Subsystem::mis_weights);
}

TEST_CASE("samples that part tell as means do") {
    Trial trial(
        [](const Scene& scene, const RenderSettings&) { return Wrong{.strays = has_texture(scene) ? 0.3 : 0.0}; });
    const Elimination elimination = trial.run();
    CHECK(elimination.by_samples);
    CHECK(with_need(elimination, Need::needed) == Words{"a checker"});
    const std::vector<Suspect> suspects = suspects_of(elimination);
    REQUIRE(!suspects.empty());
    CHECK(suspects[0].because.starts_with(
        "the sides agree without a checker: 16 pairs a pixel, 0.0 % of the sums of 4 samples part; with it "));
}

TEST_CASE("a difference that stays in the plainest scene needs nothing, and clears what is out of it") {
    Trial trial([](const Scene&, const RenderSettings&) { return Wrong{.factor = 1.02}; });
    const Elimination elimination = trial.run();
    CHECK(with_need(elimination, Need::needed).empty());
    CHECK(elimination.scenes <= 12);
    const std::vector<Subsystem> cleared = cleared_parts(elimination);
    for (const Subsystem part : {Subsystem::textures, Subsystem::dielectric, Subsystem::mis_weights})
        CHECK(std::ranges::find(cleared, part) != cleared.end());
    for (const Subsystem part : {Subsystem::camera, Subsystem::bsdf, Subsystem::geometry, Subsystem::random_numbers})
        CHECK(std::ranges::find(cleared, part) == cleared.end());
}

TEST_CASE("a limit of bounces that is one off is told by the samples, which are the same again") {
    for (const int off : {-1, 1}) {
        CAPTURE(off);
        // What a bounce adds: so many samples have other numbers.
        Trial trial([off](const Scene&, const RenderSettings& settings) {
            return Wrong{.strays = settings.bounces + static_cast<std::uint32_t>(off) == 6 ? 0.0 : 0.3};
        });
        const Elimination elimination = trial.run();
        REQUIRE(elimination.bounces_off);
        CHECK(*elimination.bounces_off == -off);
        const std::vector<Suspect> suspects = suspects_of(elimination);
        REQUIRE(!suspects.empty());
        CHECK(suspects[0].part == Subsystem::roulette);
        CHECK(suspects[0].because == fmt::format("with one bounce {} the candidate has the samples of the reference",
                                         off < 0 ? "more" : "fewer"));
    }
    Trial other([](const Scene&, const RenderSettings&) { return Wrong{.strays = 0.3}; });
    CHECK_FALSE(other.run().bounces_off);
}

TEST_CASE("two sides that are right have no feature taken out, which is told") {
    Trial trial(right);
    const Elimination elimination = trial.run();
    CHECK(elimination.scenes == 1);
    CHECK(with_need(elimination, Need::unknown).size() == elimination.trials.size());
    CHECK(told(elimination) == "no feature was taken out: undecided, as 1024 pairs a pixel do not show the difference");
    Trial straying([](const Scene&, const RenderSettings&) { return Wrong{.strays = 0.01}; });  // as rounding does
    CHECK(with_need(straying.run(), Need::needed).empty());
}

TEST_CASE("scenes that a side refuses decide nothing") {
    Trial trial([](const Scene&, const RenderSettings& settings) {
        return Wrong{.factor = settings.integrator == Integrator::next_event && settings.mis ? 1.02 : 1.0};
    });
    trial.candidate.refuses = [](const RenderSettings& settings) { return !settings.mis; };
    const Elimination elimination = trial.run();
    const Words unknown = with_need(elimination, Need::unknown);
    CHECK(std::ranges::find(unknown, "weights of two ways to a light") != unknown.end());
}

TEST_CASE("the time is kept, and what was not tried is told") {
    Trial trial([](const Scene& scene, const RenderSettings&) {
        return Wrong{.factor = scene.camera.lens_radius > 0.0 ? 1.02 : 1.0};
    });
    trial.reference.prepare_seconds = trial.candidate.prepare_seconds = 0.1;
    trial.budget_seconds = 1.0;
    const Elimination elimination = trial.run();
    CHECK(elimination.seconds > 0.5 * trial.budget_seconds);
    CHECK(elimination.seconds <= 1.1 * trial.budget_seconds);
    CHECK(elimination.left_out == "no time was left for the rest");
    CHECK(!with_need(elimination, Need::unknown).empty());
    trial.budget_seconds = 0.05;
    CHECK(told(trial.run()) == "no feature was taken out: no time was left");
}

TEST_CASE("a disagreement of sides that draw other numbers says that no feature was taken out") {
    SyntheticRenderer a(mixed, "cpu"), b(
                                           [](std::uint32_t x, std::uint32_t y, SampleRandom&random) {
                                               Radiance radiance = mixed(x, y, random);
                                               for (double& value : radiance) value *= 1.5;
                                               return radiance;
                                           },
                                           "foreign");
    VerifyOptions options;
    options.settings = settings_of(32, 4);
    options.max_samples = 512;
    const SceneVerdict verdict = verify_scene(rich_scene(), a, b, options);
    REQUIRE(verdict.verdict == Verdict::disagree);
    REQUIRE(verdict.elimination);
    const std::string text = "no feature was taken out: the sides do not draw the same random numbers";
    CHECK(told(*verdict.elimination) == text);
    CHECK(to_json(verdict)["elimination"]["text"] == text);
}

TEST_CASE("verify takes features out where two sides disagree, and where they agree it does not") {
    Faulty reference(right), candidate([](const Scene&scene, const RenderSettings&) {
        return Wrong{.factor = scene.camera.lens_radius > 0.0 ? 1.2 : 1.0};
    });
    VerifyOptions options;
    options.settings = settings_of(32, 4, Integrator::next_event);
    options.max_samples = 512;
    const SceneVerdict verdict = verify_scene(rich_scene(), reference, candidate, options);
    REQUIRE(verdict.verdict == Verdict::disagree);
    REQUIRE(!verdict.suspects.empty());
    CHECK(verdict.suspects[0].part == Subsystem::camera);
    const nlohmann::json told_of = to_json(verdict)["elimination"];
    CHECK(told_of["features"][0]["feature"] == "a lens");
    CHECK(told_of["features"][0]["need"] == "needed");
    CHECK(told_of["features"][0]["subsystem"] == "camera, lens and time");
    CHECK_FALSE(verify_scene(rich_scene(), reference, reference, options).elimination);
}
