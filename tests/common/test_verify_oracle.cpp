// Who says which side is outvoted: the closed form, to which each side is held, and the reference oracle.
#include <doctest/doctest.h>

#include <chrono>
#include <numbers>

#include "common/error.h"
#include "common/validation/report/verdict_json.h"
#include "common/validation/verdict/greatest_sample.h"
#include "common/validation/verify/verify.h"
#include "tests/common/synthetic_renderer.h"
#include "tests/refusal.h"
#include "tests/scene_builder.h"

using namespace tandem;
using test::dvec3;
using test::SceneBuilder;

namespace {

// Light of mean 1, 0.8 and 0.6 times `factor`, seen by every second sample.
Sampler light(double factor) {
    return [factor](std::uint32_t, std::uint32_t, SampleRandom& random) {
        const double value = random.uniform() < 0.5 ? 2.0 * factor : 0.0;
        return Radiance{value, 0.8 * value, 0.6 * value};
    };
}

// The same at every sample.
Sampler constant(double factor) {
    return [factor](std::uint32_t, std::uint32_t, SampleRandom&) {
        return Radiance{factor, 0.8 * factor, 0.6 * factor};
    };
}

Scene scene_with_closed_form() {
    Scene scene;
    scene.name = "synthetic";
    scene.film = {32, 32};
    scene.background.down = scene.background.up = glm::dvec3(2.0);
    scene.expect = Expectation{{1.0, 0.8, 0.6}, "L / 2"};
    return scene;
}

struct Cast {
    Sampler reference, candidate, oracle;
};

SceneVerdict verify(const Cast& cast, const Scene& scene, VerifyOptions options = {}) {
    SyntheticRenderer a(cast.reference, "cpu"), b(cast.candidate, "vulkan"), c(cast.oracle, "oracle");
    if (!options.settings) options.settings = verification_settings(scene);
    options.max_samples = 1024;
    if (cast.oracle) options.oracle = &c;
    return verify_scene(scene, a, b, options);
}

Scene without_closed_form() {
    Scene scene = scene_with_closed_form();
    scene.expect.reset();
    return scene;
}

// An image whose samples are `value` with probability `chance`, else black; figures as expected, without noise.
SampledImage rarely_lit(double value, double chance, double count) {
    SampledImage image;
    image.width = image.height = 8;
    for (std::size_t i = 0; i < 64 * channel_count; ++i)
        image.pixels.push_back({value * chance, value * value * chance * (1.0 - chance), count});
    return image;
}

}  // namespace

TEST_CASE("sides that meet the closed form agree, and its levels are part of the verdict") {
    const SceneVerdict verdict = verify({light(1.0), light(1.0), {}}, scene_with_closed_form());
    REQUIRE(verdict.verdict == Verdict::agree);
    CHECK(verdict.outvoted == Outvoted::nobody);
    CHECK(widest(verdict.judgement.level(closed_form_candidate_level)).bound() < verdict.criteria.margins.image);
    CHECK(to_json(verdict)["closed_form"]["applies"] == true);
}

TEST_CASE("a fault common to both sides is caught by the closed form") {
    for (const bool noisy : {true, false}) {
        const Sampler wrong = noisy ? light(1.02) : constant(1.02);
        const SceneVerdict verdict = verify({wrong, wrong, {}}, scene_with_closed_form());
        CHECK(verdict.verdict == Verdict::disagree);
        CHECK(verdict.outvoted == Outvoted::both);
        CHECK(contains(verdict.sentence, "the closed form L / 2 sides with neither"));
        CHECK(to_json(verdict)["outvoted"] == "both");
    }
}

TEST_CASE("the closed form names the side that it outvotes") {
    const SceneVerdict candidate = verify({light(1.0), light(1.03), {}}, scene_with_closed_form());
    CHECK(candidate.verdict == Verdict::disagree);
    CHECK(candidate.outvoted == Outvoted::candidate);
    CHECK(contains(candidate.sentence, "sides with CPU: Vulkan is off by +"));
    const SceneVerdict reference = verify({light(0.97), light(1.0), {}}, scene_with_closed_form());
    CHECK(reference.outvoted == Outvoted::reference);
    CHECK(contains(reference.sentence, "sides with Vulkan: CPU is off by -"));
}

TEST_CASE("without variance the closed form is held to rounding alone") {
    // 12 bounces: 46 ulp of 2^-23 a side.
    const double ulp = 0x1p-23;
    CHECK(verify({constant(1.0), constant(1.0 + 40 * ulp), {}}, scene_with_closed_form()).verdict == Verdict::agree);
    const Sampler wrong = constant(1.0 + 60 * ulp);
    CHECK(verify({wrong, wrong, {}}, scene_with_closed_form()).outvoted == Outvoted::both);
}

TEST_CASE("a closed form is left out, with the reason, where it does not hold") {
    const Scene scene = scene_with_closed_form();
    RenderSettings settings = default_settings(scene);
    CHECK(closed_form_of(scene, settings).form);
    settings.width = settings.height = 8;
    settings.integrator = Integrator::next_event;
    settings.roulette_start = 1;
    CHECK(closed_form_of(scene, settings).form);  // the mean is the same
    settings.bounces = 4;
    CHECK(contains(closed_form_of(scene, settings).skipped, "12 bounces, not at 4"));
    settings = default_settings(scene);
    settings.height = 16;
    CHECK(contains(closed_form_of(scene, settings).skipped, "32x32, not for 32x16"));
    settings = default_settings(scene);
    settings.ray_max = 10.0;
    CHECK(contains(closed_form_of(scene, settings).skipped, "ray lengths"));
    settings = default_settings(scene);
    settings.clamp = 10.0;
    CHECK(contains(closed_form_of(scene, settings).skipped, "--clamp"));
    settings = default_settings(scene);
    settings.fresnel = Fresnel::schlick;
    CHECK(contains(closed_form_of(scene, settings).skipped, "--fresnel"));
    settings = default_settings(scene);
    settings.filter = PixelFilter::tent;
    CHECK(contains(closed_form_of(scene, settings).skipped, "--filter box"));
    settings = default_settings(scene);
    settings.integrator = Integrator::whitted;
    CHECK(contains(closed_form_of(scene, settings).skipped, "whitted"));

    VerifyOptions options;
    options.settings = settings;
    const SceneVerdict verdict = verify({light(1.02), light(1.02), {}}, scene, options);
    CHECK(verdict.verdict == Verdict::agree);
    CHECK(to_json(verdict)["closed_form"]["applies"] == false);
    CHECK(closed_form_of(without_closed_form(), settings).skipped.empty());
}

TEST_CASE("a black scene is held to black") {
    Scene scene = scene_with_closed_form();
    scene.expect = Expectation{{0.0, 0.0, 0.0}, "0"};
    CHECK(verify({constant(0.0), constant(0.0), {}}, scene).verdict == Verdict::agree);
    CHECK(verify({constant(1e-6), constant(1e-6), {}}, scene).outvoted == Outvoted::both);
}

TEST_CASE("sums of another program may drift by what is negligible, ours may not") {
    ClosedForm form;
    form.radiance = form.greatest = {1.0, 1.0, 1.0};
    form.rounding = 0.5 * float_transport_tolerance(2);
    Criteria criteria;
    criteria.negligible.image = 0x1p-10;
    const auto p_of = [&](double value, bool foreign) {
        SampledImage image = rarely_lit(value, 1.0, 64.0);
        image.foreign = foreign;
        return compare_closed_form("closed form", form, image, criteria, 0.025).p;
    };
    CHECK(p_of(1.0 + 3.5e-6, false) == 0.0);
    CHECK(p_of(1.0 + 3.5e-6, true) == 1.0);
    CHECK(p_of(1.0 + 2e-3, true) == 0.0);
}

TEST_CASE("light that is rarely met and was not yet seen is no miss of the closed form") {
    ClosedForm form;
    form.radiance = form.greatest = {1.0, 1.0, 1.0};
    // One path of 20000 brings 1000; 64 x 64 samples saw none of it, as happens in four of five.
    form.radiance = {0.05, 0.05, 0.05};
    form.greatest = {1000.0, 1000.0, 1000.0};
    SampledImage unlucky = rarely_lit(0.001, 0.5, 64.0);
    const LevelResult level = compare_closed_form("closed form", form, unlucky, Criteria{}, 0.025);
    CHECK(level.worst.statistic > 100.0);  // Student's t alone would be sure
    CHECK(level.p == 1.0);
}

TEST_CASE("the greatest sample counts meetings and light samples") {
    Scene scene;
    scene.background.up = glm::dvec3(3.0);
    Material lamp;
    lamp.kind = MaterialKind::emissive;
    lamp.radiance = glm::dvec3(10.0, 0.0, 1.0);
    scene.materials.push_back(lamp);
    RenderSettings settings;
    settings.bounces = 4;
    CHECK(greatest_sample(scene, settings) == std::array{10.0, 3.0, 3.0});
    settings.integrator = Integrator::next_event;
    CHECK(greatest_sample(scene, settings) == std::array{30.0, 9.0, 9.0});
    scene.materials[0].kind = MaterialKind::diffuse;  // a lamp that goes on
    CHECK(greatest_sample(scene, settings) == std::array{70.0, 21.0, 21.0});
}

namespace {

// `colour` times what a quad of the x-z plane about the origin reflects, at `bounces` events.
Scene lit_floor(const dvec3& colour, double height) {
    return SceneBuilder().floor(test::diffuse(colour), height, 10.0).scene();
}

RenderSettings next_events(std::uint32_t bounces) {
    RenderSettings settings;
    settings.integrator = Integrator::next_event;
    settings.bounces = bounces;
    return settings;
}

void check_close(const std::array<double, channel_count>& found, const std::array<double, channel_count>& expected) {
    for (std::size_t c = 0; c < channel_count; ++c) CHECK(found[c] == doctest::Approx(expected[c]));
}

constexpr double infinite = std::numeric_limits<double>::infinity(), pi = std::numbers::pi;

}  // namespace

TEST_CASE("the greatest sample counts the sky's image by its brightest texel") {
    Scene scene = lit_floor(dvec3(0.5), 0.0);
    scene.background.up = dvec3(100.0);  // the image takes its place
    Pixels pixels{2, 1, {1.0f, 2.0f, 3.0f, 4.0f, 0.0f, 1.0f}};
    scene.background.image = std::make_shared<const Pixels>(pixels);
    scene.background.image_scale = 10.0;
    RenderSettings settings = next_events(2);
    check_close(greatest_sample(scene, settings), {80.0, 40.0, 60.0});  // met once, and half of it at two vertices
    settings.integrator = Integrator::path;
    check_close(greatest_sample(scene, settings), {40.0, 20.0, 30.0});
}

TEST_CASE("the greatest sample has no bound beyond a material that may gain") {
    Scene scene = lit_floor(dvec3(1.0, 0.5, 0.0), 0.0);
    scene.materials[0].kind = MaterialKind::rough_diffuse;
    scene.lights.push_back({"near", PunctualKind::point, {1.0, 2.0, -1.0}, {}, dvec3(pi)});
    check_close(greatest_sample(scene, next_events(3)), {0.75, 0.375, 0.0});  // of roughness 0 it gains nothing
    scene.materials[0].roughness = 0.5;
    check_close(greatest_sample(scene, next_events(1)), {0.25, 0.125, 0.0});  // lit before it scatters
    CHECK(greatest_sample(scene, next_events(2)) == std::array{infinite, infinite, 0.0});
    RenderSettings whitted = next_events(3);
    whitted.integrator = Integrator::whitted;  // ends there
    check_close(greatest_sample(scene, whitted), {0.75, 0.375, 0.0});
    scene.background.up = dvec3(0.0, 0.0, 1.0);
    CHECK(greatest_sample(scene, next_events(2))[2] == infinite);
    CHECK(greatest_sample(scene, next_events(1))[2] == 1.5);  // the camera's rays meet the floor away from grazing
    CHECK(greatest_sample(scene, next_events(0))[2] == 1.0);
}

TEST_CASE("the greatest sample counts points by their distance from what scatters, and by their chance") {
    Scene scene = lit_floor(dvec3(1.0, 0.5, 0.0), 0.0);
    scene.lights.push_back({"near", PunctualKind::point, {1.0, 2.0, -1.0}, {}, dvec3(pi)});
    check_close(greatest_sample(scene, next_events(3)), {0.75, 0.375, 0.0});
    // Another is chosen thrice as often, so a sample of the first counts four times.
    scene.lights.push_back({"far", PunctualKind::point, {0.0, -4.0, 0.0}, {}, dvec3(3.0 * pi)});
    check_close(greatest_sample(scene, next_events(3)), {3.0, 1.5, 0.0});
    scene.lights.pop_back();

    Scene moving = scene;
    moving.entities[0].motion = dvec3(0.0, 1.0, 0.0);
    check_close(greatest_sample(moving, next_events(3)), {3.0, 1.5, 0.0});
    Scene beside = scene;  // 3 beyond the floor's border, and 4 above
    beside.lights[0].position = dvec3(13.0, 4.0, 0.0);
    check_close(greatest_sample(beside, next_events(1)), {1.0 / 25.0, 0.5 / 25.0, 0.0});
    CHECK(greatest_sample(scene, [] {
        RenderSettings settings = next_events(3);
        settings.integrator = Integrator::path;  // does not find it
        return settings;
    }()) == std::array{0.0, 0.0, 0.0});
}

TEST_CASE("the greatest sample takes distances from spheres and cuboids") {
    const auto with = [](SceneBuilder builder) {
        Scene scene = builder.scene();
        scene.lights.push_back({"lamp", PunctualKind::point, {0.0, 5.0, 0.0}, {}, dvec3(pi)});
        return greatest_sample(scene, next_events(1))[0];
    };
    const Material white = test::diffuse(dvec3(1.0));
    CHECK(with(SceneBuilder().cuboid(white, dvec3(-1.0), dvec3(1.0))) == doctest::Approx(1.0 / 16.0));
    CHECK(with(SceneBuilder().cuboid(white, dvec3(-9.0), dvec3(9.0))) == doctest::Approx(1.0 / 16.0));  // from within
    // 4 away; the bound on the distance is never more and, for a sphere that stays one, no less than two thirds.
    const double sphere = with(SceneBuilder().sphere(white, dvec3(0.0), 1.0));
    CHECK(sphere >= 1.0 / 16.0);
    CHECK(sphere <= 2.26 / 16.0);
    CHECK(with(SceneBuilder().sphere(test::mirror(dvec3(1.0)), dvec3(0.0), 1.0)) == 0.0);  // samples no light
}

TEST_CASE("the greatest sample counts spots by the cone they share by, and suns by their irradiance") {
    Scene scene = lit_floor(dvec3(1.0), 0.0);
    scene.lights.push_back({"sun", PunctualKind::sun, {}, {0.0, -1.0, 0.0}, dvec3(pi)});
    check_close(greatest_sample(scene, next_events(2)), {2.0, 2.0, 2.0});
    // A near group beside it: each has half of the choices.
    scene.lights.push_back(
        {"spot", PunctualKind::spot, {0.0, 1.0, 0.0}, {0.0, -1.0, 0.0}, dvec3(0.1 * pi), 20.0, 60.0});
    check_close(greatest_sample(scene, next_events(2)), {4.0, 4.0, 4.0});
    scene.lights.push_back({"point", PunctualKind::point, {0.0, 100.0, 0.0}, {}, dvec3(0.1 * pi)});
    // 2 (1 - cos 60) against 4: the spot is chosen in a tenth of all samples.
    check_close(greatest_sample(scene, next_events(1)), {2.0, 2.0, 2.0});
    scene.lights[1].intensity = dvec3(pi);  // 2 pi I : 4 pi I/10, so 5 of 14 samples
    check_close(greatest_sample(scene, next_events(1)), {2.8, 2.8, 2.8});
}

TEST_CASE("one event on flat rough diffuse surfaces is bounded by how the camera's rays come upon them") {
    Scene scene = lit_floor(dvec3(1.0), 0.0);
    scene.film = {4, 4};
    scene.background.down = scene.background.up = dvec3(2.0);
    scene.camera.position = {0.0, 1.0, 1.0};
    scene.camera.target = {0.0, 0.0, 0.0};
    scene.camera.vertical_field_degrees = 1e-6;
    for (Material& material : scene.materials) {
        material.kind = MaterialKind::rough_diffuse;
        material.roughness = 0.3;
    }
    RenderSettings settings = default_settings(scene);
    settings.integrator = Integrator::path;
    settings.bounces = 1;
    // a = 1 - 0.09/0.84, b = 0.0405/0.18, at 45 degrees
    CHECK(greatest_sample(scene, settings)[0] == doctest::Approx(2.0 * (1.0 - 0.09 / 0.84 + 0.225)));
    settings.bounces = 2;
    CHECK(greatest_sample(scene, settings)[0] == infinite);
    settings.bounces = 1;
    scene.camera.vertical_field_degrees = 91.0;  // some rays run along the floor
    CHECK(greatest_sample(scene, settings)[0] == infinite);
    scene.camera.vertical_field_degrees = 1e-6;
    scene.camera.lens_radius = 0.1;
    CHECK(greatest_sample(scene, settings)[0] == infinite);
}

TEST_CASE("where nothing bounds a sample there is no closed form to hold a renderer to") {
    Scene scene = lit_floor(dvec3(1.0), 0.0);
    scene.film = {4, 4};
    scene.defaults.integrator = Integrator::next_event;
    scene.lights.push_back({"lamp", PunctualKind::point, {0.0, 1.0, 0.0}, {}, dvec3(1.0)});
    scene.expect = Expectation{dvec3(1.0), "1"};
    CHECK(closed_form_of(scene, default_settings(scene)).form);
    Scene touching = scene;
    touching.lights[0].position.y = 0.0;
    CHECK(greatest_sample(touching, default_settings(scene))[0] == infinite);
    CHECK(contains(closed_form_of(touching, default_settings(scene)).skipped, "bounds"));
    Scene foggy = scene;
    Medium fog;
    fog.scattering = dvec3(0.1);
    foggy.media.push_back(fog);
    CHECK(greatest_sample(foggy, default_settings(scene))[0] == infinite);

    // Without the weight of both techniques a surface may be sampled from as near as one likes.
    Scene lamps = SceneBuilder().floor(test::emitter(dvec3(1.0)), 1.0, 1.0).scene();
    RenderSettings settings = next_events(2);
    CHECK(greatest_sample(lamps, settings)[0] == doctest::Approx(2.0));
    settings.mis = false;
    CHECK(greatest_sample(lamps, settings)[0] == infinite);
    settings.mis = true;
    settings.integrator = Integrator::whitted;
    CHECK(greatest_sample(lamps, settings)[0] == infinite);
    settings.integrator = Integrator::bidirectional;
    CHECK(greatest_sample(lamps, settings)[0] == doctest::Approx(9.0));
    CHECK(greatest_sample(scene, settings)[0] == infinite);
}

TEST_CASE("samples within the empirical Bernstein bound are no surprise, those far beyond are") {
    // n = 10^4 coins of 0 and 1: at p = 4 exp(-l), l = 9: 0.5 sqrt(2 * 9 / 10^4) + 7 * 9 / (3 * 9999).
    const double excess = 0.5 * std::sqrt(18.0 / 1e4) + 63.0 / (3.0 * 9999.0);
    CHECK(empirical_bernstein_p_value(excess, {0.25, 1e4, 1.0}) == doctest::Approx(4.0 * std::exp(-9.0)));
    CHECK(empirical_bernstein_p_value(0.0, {0.25, 1e4, 1.0}) == 1.0);
    CHECK(empirical_bernstein_p_value(0.1, {0.0, 1e4, 0.0}) == 0.0);
    // Two such coins may be twice as far apart, with twice as many tails.
    const BoundedSample coin{0.25, 1e4, 1.0};
    CHECK(empirical_bernstein_p_value(2.0 * excess, coin, coin) == doctest::Approx(8.0 * std::exp(-9.0)));
}

TEST_CASE("the oracle names the side that it outvotes, either one") {
    const SceneVerdict candidate = verify({light(1.0), light(1.02), light(1.0)}, without_closed_form());
    REQUIRE(candidate.oracle);
    CHECK(candidate.outvoted == Outvoted::candidate);
    CHECK(contains(candidate.sentence, "the oracle sides with CPU: Vulkan is off by +2 %"));
    const SceneVerdict reference = verify({light(1.02), light(1.0), light(1.0)}, without_closed_form());
    CHECK(reference.outvoted == Outvoted::reference);
    CHECK(contains(reference.sentence, "the oracle sides with Vulkan: CPU is off by +2 %"));
    const nlohmann::json json = to_json(candidate);
    CHECK(json["outvoted"] == "candidate");
    CHECK(json["referee"]["candidate"]["contradicted"] == true);
    CHECK(json["referee"]["reference"]["contradicted"] == false);
    CHECK(json["referee"]["samples"].get<int>() >= 128);
}

TEST_CASE("an oracle that contradicts both says so") {
    const SceneVerdict verdict = verify({light(1.0), light(1.05), light(1.2)}, without_closed_form());
    CHECK(verdict.outvoted == Outvoted::both);
    CHECK(contains(verdict.sentence, "the oracle sides with neither"));
}

TEST_CASE("the oracle is not asked where the sides agree, or where none is given") {
    CHECK_FALSE(verify({light(1.0), light(1.0), light(1.0)}, without_closed_form()).oracle);
    CHECK_FALSE(verify({light(1.0), light(1.1), {}}, without_closed_form()).oracle);
}

TEST_CASE("an oracle that is one of the two is asked nothing") {
    SyntheticRenderer a(light(1.0), "oracle"), b(light(1.1), "cpu"), c(light(1.0), "oracle");
    VerifyOptions options;
    options.settings = verification_settings(without_closed_form());
    options.max_samples = 256;
    options.oracle = &c;
    const SceneVerdict verdict = verify_scene(without_closed_form(), a, b, options);
    CHECK(verdict.outvoted == Outvoted::nobody);
    CHECK(contains(verdict.sentence, "the oracle is one of the two"));
}

TEST_CASE("an oracle that cannot tell says so, with what it knows") {
    // The sides differ by 0.5 %, as paired seeds show; the oracle draws numbers of its own and 128 samples are few.
    const auto own = [](std::uint32_t x, std::uint32_t y, SampleRandom& random) {
        SampleRandom other(static_cast<std::uint64_t>(1e15 * random.uniform()), y, x);
        return light(1.0)(x, y, other);
    };
    SyntheticRenderer a(light(1.0), "cpu"), b(light(1.005), "vulkan"), c(own, "oracle");
    VerifyOptions options;
    options.settings = verification_settings(without_closed_form());
    options.max_samples = 128;
    options.oracle = &c;
    const SceneVerdict verdict = verify_scene(without_closed_form(), a, b, options);
    REQUIRE(verdict.verdict == Verdict::disagree);
    CHECK(verdict.outvoted == Outvoted::nobody);
    CHECK(contains(verdict.sentence, "the oracle cannot tell within"));
    CHECK(contains(verdict.sentence, "which is right: CPU is within ±"));
}

namespace {

// As the oracle: without next-event estimation, or without anything.
class Picky : public SyntheticRenderer {
public:
    Picky(Sampler sampler, bool path) : SyntheticRenderer(std::move(sampler), "oracle"), path_(path) {}
    std::unique_ptr<RenderJob> prepare(const Scene& scene, const RenderSettings& settings) override {
        if (!path_ || settings.integrator == Integrator::next_event) throw UnsupportedError("scattering alone");
        return SyntheticRenderer::prepare(scene, settings);
    }

private:
    bool path_;
};

SceneVerdict verify_next_event(Picky& oracle, const Sampler& candidate, const Scene& scene) {
    SyntheticRenderer a(light(1.0), "cpu"), b(candidate, "vulkan");
    VerifyOptions options;
    options.settings = verification_settings(scene);
    options.settings->integrator = Integrator::next_event;
    options.max_samples = 512;
    options.oracle = &oracle;
    return verify_scene(scene, a, b, options);
}

}  // namespace

TEST_CASE("an oracle without next-event estimation scatters, and says so where it can do nothing") {
    Picky scattering(light(1.0), true), refusing(light(1.0), false);
    const Scene scene = without_closed_form();
    const SceneVerdict verdict = verify_next_event(scattering, light(1.05), scene);
    CHECK(verdict.outvoted == Outvoted::candidate);
    CHECK(to_json(verdict)["referee"]["integrator"] == "path");
    CHECK(contains(verify_next_event(refusing, light(1.05), scene).sentence, "was not asked: scattering alone"));
}

TEST_CASE("an oracle that may have met no path to a small bright light outvotes nobody") {
    // What both sides sample, the oracle meets once in 10^9 paths.
    const auto rare = [](std::uint32_t, std::uint32_t, SampleRandom& random) {
        const double value = random.uniform() < 1e-9 ? 1e9 : 0.0;
        return Radiance{value, 0.8 * value, 0.6 * value};
    };
    Scene scene = without_closed_form();
    scene.materials.push_back(test::emitter(dvec3(1e9)));
    for (const Sampler& candidate : {light(0.5), constant(0.5)}) {
        Picky oracle(rare, true);
        const SceneVerdict verdict = verify_next_event(oracle, candidate, scene);
        REQUIRE(verdict.verdict == Verdict::disagree);
        CHECK(verdict.outvoted == Outvoted::nobody);
        CHECK(contains(verdict.sentence, "bright paths may be so rare that it has met none"));
    }
}

namespace {

// An oracle that renders single pixels, as the real one does without being asked for adaptive sampling.
class ByPixel : public SyntheticRenderer {
public:
    explicit ByPixel(Sampler sampler) : SyntheticRenderer(std::move(sampler), "oracle") {}
    std::unique_ptr<RenderJob> prepare(const Scene& scene, const RenderSettings& settings) override {
        RenderSettings adaptive = settings;
        adaptive.sampling = Sampling::adaptive;
        return SyntheticRenderer::prepare(scene, adaptive);
    }
};

}  // namespace

TEST_CASE("the oracle is asked about the worst tile first, and that is enough where it is sure") {
    const auto local = [](std::uint32_t x, std::uint32_t y, SampleRandom& random) {
        return light(x >= 16 && x < 32 && y < 16 ? 1.5 : 1.0)(x, y, random);
    };
    Scene scene = without_closed_form();
    scene.film = {64, 64};
    SyntheticRenderer a(light(1.0), "cpu"), b(local, "vulkan");
    ByPixel oracle(light(1.0));
    VerifyOptions options;
    options.settings = verification_settings(scene);
    options.max_samples = 1024;
    options.oracle = &oracle;
    const SceneVerdict candidate = verify_scene(scene, a, b, options);
    REQUIRE(candidate.oracle);
    CHECK(candidate.outvoted == Outvoted::candidate);
    CHECK(candidate.oracle->settings.width == 64);
    CHECK(candidate.oracle->samples <= 256);
    CHECK(candidate.oracle->candidate->pixel_p.size() == 16 * 16 * channel_count);  // of the tile alone
    CHECK(contains(candidate.sentence, "the oracle sides with CPU: Vulkan is off by +"));
    CHECK(contains(candidate.sentence, "within x 16 to 31, y 0 to 15"));
    CHECK(verify_scene(scene, b, a, options).outvoted == Outvoted::reference);
}

TEST_CASE("where the oracle misses the closed form with both sides, the scene's reading or the formula is suspected") {
    const SceneVerdict verdict = verify({light(1.02), light(1.02), light(1.02)}, scene_with_closed_form());
    REQUIRE(verdict.oracle);
    CHECK(verdict.outvoted == Outvoted::both);
    CHECK(contains(verdict.sentence, "misses the closed form too, by +"));
    CHECK(contains(verdict.sentence, "suspect the loader, MODEL.md or the formula"));
    CHECK(verdict.oracle->samples < 1024);  // it stops there
    // One that meets it suspects the sides.
    CHECK(!contains(verify({light(1.02), light(1.02), light(1.0)}, scene_with_closed_form()).sentence, "suspect"));
}

TEST_CASE("a slow oracle gets a smaller film and stays near its budget") {
    // 10 microseconds a sample by the clock, on whatever machine: 21 s for the 512 samples that a film of 64x64 must
    // allow for.
    const auto slow = [](std::uint32_t x, std::uint32_t y, SampleRandom& random) {
        const auto end = std::chrono::steady_clock::now() + std::chrono::microseconds(10);
        while (std::chrono::steady_clock::now() < end) {
        }
        return light(1.0)(x, y, random);
    };
    Scene scene = without_closed_form();
    scene.film = {64, 64};
    VerifyOptions options;
    options.budget_seconds = 1.0;
    double seconds = 1e9;
    for (int attempt = 0; attempt < 3 && !(seconds < 2.0); ++attempt) {  // the machine may be away during one
        const SceneVerdict verdict = verify({light(1.0), light(1.2), slow}, scene, options);
        REQUIRE(verdict.oracle);
        CHECK(verdict.oracle->settings.width < 64);
        CHECK(verdict.oracle->settings.width >= 8);
        seconds = verdict.oracle->seconds;
    }
    CHECK(seconds < 2.0);
}
