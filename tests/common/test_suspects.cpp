// Which parts of a path tracer are suspected of a disagreement, and why: what paths, kernels and closed forms say.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <glm/gtc/matrix_transform.hpp>

#include "common/validation/explanation/pixel_pattern.h"
#include "common/validation/explanation/suspects.h"
#include "common/validation/verify/parting_patterns.h"
#include "tests/scene_builder.h"

using namespace tandem;
using namespace tandem::test;

namespace {

struct Evidence {
    Judgement judgement;
    Signature signature;
    PathPartings partings;
    FaultPlace place;

    Evidence() {
        // As if lights were sampled otherwise: the verdict on what paths show alone.
        signature[Figure::by_light] = signature[Figure::vertex_0] = signature[Figure::parted] = 1.0F;
        signature[Figure::scene_light_sampling] = 1.0F;
        partings.paths = partings.parted = 512;
    }
    void level(const char* name, bool significant) {
        LevelResult level;
        level.name = name;
        level.significant = significant;
        judgement.levels.push_back(level);
    }
    [[nodiscard]] std::vector<Suspect> suspects() const {
        return suspects_of_difference({judgement, signature, partings, place}).suspects;
    }
};

bool names(const std::vector<Suspect>& suspects, Subsystem part) {
    return std::ranges::any_of(suspects, [part](const Suspect& one) { return one.part == part; });
}

// Two samples of a pixel whose next events go in these directions; the numbers of the sides are the same or not.
std::vector<PathTrace> lit(std::initializer_list<double> angles) {
    std::vector<PathTrace> paths;
    for (const double angle : angles) {
        TracedVertex vertex;
        vertex.next_event.direction = {std::cos(angle), std::sin(angle), 0.0};
        vertex.light = glm::dvec3(1.0);
        vertex.end = PathEnd::bounces;
        paths.emplace_back().vertices.push_back(vertex);
    }
    return paths;
}

double independence(double offset, double factor) {
    Draws draws;
    for (int pixel = 0; pixel < 8; ++pixel) {
        const double first = 0.3 + 0.1 * pixel;
        const auto a = lit({first, first + 0.8, first + 1.9});
        const auto b = lit({factor * first + offset, factor * (first + 0.8) + offset, factor * (first + 1.9) + offset});
        std::vector<std::optional<Parting>> partings;
        for (std::size_t i = 0; i < a.size(); ++i) partings.push_back(parting_of(a[i], b[i]));
        draws.add(a, b, partings);
    }
    return draws.independence();
}

// Paths that scatter once at a sphere, to a direction of their own where `differs` of the normal.
std::string frames_where(const std::function<bool(const glm::dvec3& normal)>& differs, std::uint32_t materials = 1) {
    Frames frames;
    std::vector<PathTrace> a, b;
    std::vector<std::optional<Parting>> partings;
    for (int i = 0; i < 64; ++i) {
        const double z = (i - 31.5) / 32.0, r = std::sqrt(1.0 - z * z);
        TracedVertex vertex;
        vertex.position = vertex.normal = vertex.shading_normal = {r * std::cos(i), r * std::sin(i), z};
        vertex.primitive = 0;
        vertex.material = materials == 1 || z < 0.0 ? 0 : 1;
        vertex.next_direction = {0.0, 1.0, 0.0};
        vertex.pdf = 1.0;
        a.push_back({{vertex}, {}});
        if (differs(vertex.normal)) vertex.next_direction = {1.0, 0.0, 0.0};
        b.push_back({{vertex}, {}});
        partings.push_back(parting_of(a.back(), b.back()));
    }
    frames.add(a, partings);
    return frames.words();
}

// Paths that meet one of 100 spheres each, at another place where it is `from` or a later one.
std::string primitives_from(std::uint32_t from, std::uint32_t walls = 0) {
    SceneBuilder builder;
    for (std::uint32_t i = 0; i < 100 - walls; ++i) builder.sphere(diffuse(dvec3(0.5)), {i, 0.0, 0.0}, 0.4);
    for (std::uint32_t i = 0; i < walls; ++i) builder.cuboid(diffuse(dvec3(0.5)), {i, 1.0, 0.0}, {i + 0.5, 2.0, 1.0});
    PrimitiveEnd end(builder.scene());
    std::vector<PathTrace> a, b;
    std::vector<std::optional<Parting>> partings;
    for (std::uint32_t i = 0; i < 100; ++i) {
        TracedVertex vertex;
        vertex.primitive = i;
        vertex.material = 0;
        vertex.t = 1.0;
        vertex.position = {i, 0.4, 0.0};
        vertex.normal = vertex.shading_normal = {0.0, 1.0, 0.0};
        vertex.end = PathEnd::bounces;
        a.push_back({{vertex}, {}});
        if (i >= from) vertex.position = {0.0, 5.0, 0.0};
        b.push_back({{vertex}, {}});
        partings.push_back(parting_of(a.back(), b.back()));
    }
    end.add(a, b, partings);
    return end.words();
}

}  // namespace

TEST_CASE("paths that part at the last primitives alone, from a workgroup's begin on, speak for indexing") {
    CHECK(primitives_from(64) == "paths part at the last 36 of 100 primitives alone");
    CHECK(primitives_from(60).empty());      // no workgroup begins there
    CHECK(primitives_from(0).empty());       // all
    CHECK(primitives_from(96).empty());      // too few paths
    CHECK(primitives_from(64, 36).empty());  // all of a shape
    CHECK_FALSE(primitives_from(64, 50).empty());
    Evidence evidence;
    evidence.level("image", true);
    evidence.partings.primitives = "paths part at the last 36 of 100 primitives alone";
    CHECK(evidence.suspects().front().part == Subsystem::indexing);
    CHECK(evidence.suspects().front().because == evidence.partings.primitives);
}

TEST_CASE("new directions that differ on one side of a coordinate plane alone speak for the frame") {
    CHECK(frames_where([](const glm::dvec3& n) { return n.z < 0.0; }) ==
          "new directions differ about normals with z below 0 alone");
    CHECK(frames_where([](const glm::dvec3& n) { return n.x > 0.0; }) ==
          "new directions differ about normals with x above 0 alone");
    CHECK(frames_where([](const glm::dvec3&) { return true; }).empty());
    CHECK(frames_where([](const glm::dvec3& n) { return n.z < -0.9; }).empty());       // too few paths
    CHECK(frames_where([](const glm::dvec3& n) { return n.x * n.y < 0.0; }).empty());  // on both sides
    // One material lies on one side of the plane, and may be what differs.
    CHECK(frames_where([](const glm::dvec3& n) { return n.z < 0.0; }, 2).empty());
    Evidence evidence;
    evidence.level("image", true);
    evidence.partings.frames = "new directions differ about normals with z below 0 alone";
    CHECK(evidence.suspects().front().part == Subsystem::arithmetic);
    CHECK(evidence.suspects().front().because == evidence.partings.frames);
}

TEST_CASE("what the traced paths show first is suspected first") {
    Evidence evidence;
    evidence.level("image", true);
    const std::vector<Suspect> suspects = evidence.suspects();
    REQUIRE_FALSE(suspects.empty());
    CHECK(suspects.size() <= most_suspects);
    CHECK(suspects.front().part == Subsystem::light_sampling);
    CHECK(suspects.front().because == "what a next event brings differs first in 100 % of the paths that part");
}

TEST_CASE("the ranking says what each part's place follows from") {
    Evidence evidence;
    evidence.level("image", true);
    const auto ranked = [&] {
        return suspects_of_difference({evidence.judgement, evidence.signature, evidence.partings, evidence.place});
    };
    const PartRanking plain = ranked().ranking;
    CHECK(plain.evidence.pattern == scores_of(evidence.signature, planted_signatures()));
    CHECK_FALSE(plain.evidence.needs);
    evidence.place.outside_paths = true;
    evidence.place.scaled = true;
    const auto accumulation = static_cast<std::size_t>(Subsystem::accumulation);
    const PartRanking outside = ranked().ranking;
    CHECK(outside.counted == plain.counted);
    CHECK(outside.all.at(accumulation) > outside.counted.at(accumulation) + 10.0);
}

TEST_CASE("a fault that no traced path shows and some kernels lack lies in indexing, whatever the paths look like") {
    Evidence evidence;
    evidence.level("image", true);
    evidence.place = {.outside_paths = true,
        .candidate_adds = false,
        .clamped_at = {},
        .kernels_with = {"stages"},
        .kernels_without = {"image-stages", "megakernel"},
        .pattern = ""};
    CHECK(evidence.suspects().front().part == Subsystem::indexing);
    CHECK(evidence.suspects().front().because ==
          "no traced path parts, and the kernels image-stages, megakernel are without the fault");
}

TEST_CASE("a film that is not the sum of its paths, with every kernel, is accumulation's") {
    Evidence evidence;
    evidence.level("image", true);
    evidence.place.outside_paths = true;
    evidence.place.candidate_adds = false;
    evidence.place.kernels_with = {"stages", "megakernel"};
    CHECK(evidence.suspects().front().part == Subsystem::accumulation);
    SUBCASE("and indexing's where the pixels lie in a pattern") {
        evidence.place.pattern = "rows 4 to 5";
        CHECK(evidence.suspects().front().part == Subsystem::indexing);
    }
    SUBCASE("and indexing's where few pixels differ, as sums are formed alike in all") {
        evidence.partings.touched = 0.04;
        CHECK(evidence.suspects().front().part == Subsystem::indexing);
        CHECK(names(evidence.suspects(), Subsystem::accumulation));
        evidence.partings.touched = 0.9;
        CHECK(evidence.suspects().front().part == Subsystem::accumulation);
    }
    SUBCASE("but not where its paths are cut, as on a lamp") {
        evidence.place.pattern = "rows 4 to 5";
        evidence.place.clamped_at = 10.0;
        CHECK(evidence.suspects().front().part == Subsystem::accumulation);
        CHECK(evidence.suspects().front().because == "a film is the sum of its paths, each cut at 10");
    }
}

TEST_CASE("light that lies in other pixels is indexing's, and a film that is darker alike everywhere accumulation's") {
    Evidence evidence;
    evidence.level("image", true);
    evidence.place.outside_paths = true;
    evidence.place.candidate_adds = false;
    evidence.place.moved = true;
    CHECK(evidence.suspects().front().part == Subsystem::indexing);
    CHECK(evidence.suspects().front().because == "no traced path parts, and the film's light lies in other pixels");
    CHECK(names(evidence.suspects(), Subsystem::accumulation));
    evidence.place.moved = false;
    evidence.place.scaled = true;
    evidence.place.pattern = "rows 4 to 5";
    CHECK(evidence.suspects().front().part == Subsystem::accumulation);
}

TEST_CASE("a pixel without variance that differs in long films, and not in one block of them, is accumulation's") {
    Evidence evidence;
    evidence.level("image", true);
    evidence.partings.parted = 0;
    CHECK(evidence.suspects().front().part != Subsystem::accumulation);
    evidence.judgement.fixed.mismatches = 1;
    CHECK(evidence.suspects().front().part == Subsystem::accumulation);
    evidence.partings.parted = 1;
    CHECK(evidence.suspects().front().part != Subsystem::accumulation);
}

TEST_CASE("a side that is right with intersections in double precision, by the same rays, may have wrong data") {
    Evidence evidence;
    evidence.level("image", true);
    PrecisionTrial trial{.side = VerifiedSide::candidate, .right_in_mixed = false, .parted = 400, .in_double = 3};
    const auto suspects = [&] {
        return suspects_of_difference(
            {evidence.judgement, evidence.signature, evidence.partings, evidence.place, nullptr, &trial})
            .suspects;
    };
    CHECK(suspects().front().part == Subsystem::arithmetic);
    trial.right_in_mixed.reset();
    CHECK(suspects().front().part == Subsystem::arithmetic);
    trial.right_in_mixed = true;
    CHECK(suspects().front().part != Subsystem::arithmetic);
    CHECK(names(suspects(), Subsystem::scene_data));
}

TEST_CASE("paths that roulette or the limit of bounces ends on one side alone are path length's") {
    Evidence evidence;
    evidence.level("image", true);
    evidence.partings.at_limit = 0.8;
    evidence.partings.by_roulette = 0.2;
    CHECK(evidence.suspects().front().part == Subsystem::light_sampling);
    SUBCASE("the limit") {
        evidence.partings.at_limit = 0.95;
        CHECK(evidence.suspects().front().because ==
              "one path ends at the limit of bounces where the other does not in 95 % of the paths that part");
    }
    SUBCASE("roulette") {
        evidence.partings.by_roulette = 1.0;
        CHECK(evidence.suspects().front().because == "roulette ends one path alone in 100 % of the paths that part");
    }
    if (evidence.partings.at_limit > 0.9 || evidence.partings.by_roulette > 0.9)
        CHECK(evidence.suspects().front().part == Subsystem::roulette);
}

TEST_CASE("without traced paths the place of the fault alone is told, or nothing") {
    Evidence evidence;
    evidence.signature = {};
    evidence.partings = {};
    evidence.level("image", true);
    const auto suspects = [&] {
        return suspects_of_difference(
            {evidence.judgement, evidence.signature, evidence.partings, evidence.place}, {.patterns = {}})
            .suspects;
    };
    CHECK(suspects().empty());
    evidence.place.outside_paths = true;
    evidence.place.candidate_adds = false;
    evidence.place.pattern = every_pixel;
    REQUIRE(suspects().size() == 2);
    CHECK(suspects()[0].part == Subsystem::accumulation);
    CHECK(suspects()[1].part == Subsystem::indexing);
}

TEST_CASE("paths that part while all means agree may draw other random numbers") {
    Evidence evidence;
    evidence.level("image", false);
    evidence.level(bounce_level, true);
    const std::vector<Suspect> suspects = evidence.suspects();
    const auto numbers = std::ranges::find(suspects, Subsystem::random_numbers, &Suspect::part);
    REQUIRE(numbers - suspects.begin() < 2);  // the traced paths speak for light sampling all the same
    CHECK(numbers->because == "paths part, and all means agree nevertheless");
    evidence.level("tiles 16x16", true);
    for (const Suspect& suspect : evidence.suspects())
        CHECK(suspect.because != "paths part, and all means agree nevertheless");
}

TEST_CASE("draws of other numbers are independent, those of a wrong formula are not") {
    CHECK(independence(0.0, 1.05) < 0.02);
    CHECK(independence(1.3, 1.0) > 0.4);
    CHECK(independence(0.0, 1.0) == 0.0);  // none differs
    Evidence evidence;
    evidence.level("image", true);
    evidence.partings.independence = independence(1.3, 1.0);
    // A light that is chosen otherwise looks so, too: two kinds of planted bugs in the record do it.
    CHECK(names(evidence.suspects(), Subsystem::random_numbers));
    evidence.partings.parted = 100;  // of 512: a choice that falls otherwise now and then
    CHECK_FALSE(names(evidence.suspects(), Subsystem::random_numbers));

    evidence.signature[Figure::by_light] = 0.0F;
    evidence.signature[Figure::by_direction] = 1.0F;
    evidence.partings.parted = 512;
    CHECK(evidence.suspects().front().part == Subsystem::random_numbers);
}

TEST_CASE("a factor of a light that alone differs names its part, unless others differ as well") {
    Evidence evidence;
    evidence.level("image", true);
    evidence.signature[Figure::scene_volumes] = 1.0F;
    const auto first = [&](std::initializer_list<PartsBy> parts) {
        evidence.partings.by = {};
        for (std::size_t i = 0; i < evidence.partings.by.size(); ++i) evidence.signature.figures[i] = 0.0F;
        for (const PartsBy what : parts) {  // as in `by`, so in the first figures
            evidence.partings.by[static_cast<std::size_t>(what)] = 1.0;
            evidence.signature.figures[static_cast<std::size_t>(what)] = 1.0F;
        }
        return evidence.suspects().front();
    };
    CHECK(first({PartsBy::light_transmittance, PartsBy::light}).part == Subsystem::volumes);
    CHECK(first({PartsBy::light_weight, PartsBy::light}).part == Subsystem::mis_weights);
    CHECK(first({PartsBy::found_weight, PartsBy::emission}).because ==
          "MIS weights alone differ in 100 % of the paths that part");
    CHECK(first({PartsBy::light_density, PartsBy::light_weight, PartsBy::light}).part == Subsystem::light_sampling);
    CHECK(first({PartsBy::density, PartsBy::found_weight, PartsBy::emission}).part == Subsystem::mis_weights);
    CHECK_FALSE(first({PartsBy::density, PartsBy::weight}).because.starts_with("the density of scattering differs"));
    CHECK(first({PartsBy::light_radiance, PartsBy::light}).part == Subsystem::emission);
    evidence.partings.punctual_lights = true;
    CHECK(first({PartsBy::light_radiance, PartsBy::light}).part == Subsystem::light_sampling);
    const Suspect several = first({PartsBy::light_weight, PartsBy::light, PartsBy::direction});
    CHECK_FALSE(several.because.starts_with("MIS weights alone"));
}

TEST_CASE("shadow rays to one point that end differently are light sampling's, or of what they met") {
    Evidence evidence;
    evidence.level("image", true);
    evidence.signature.figures = {};
    evidence.signature[Figure::scene_light_sampling] = evidence.signature[Figure::parted] = 1.0F;
    evidence.signature[Figure::by_shadow] = 1.0F;
    CHECK(evidence.suspects().front().part == Subsystem::light_sampling);
    CHECK(names(evidence.suspects(), Subsystem::geometry));
}

TEST_CASE("a number that decides on one side what it is not for names random numbers") {
    Evidence evidence;
    evidence.level("image", true);
    evidence.partings.numbers = {
        NumberUse::foreign, "roulette's number decides the point of the light of the candidate"};
    CHECK(evidence.suspects().front().part == Subsystem::random_numbers);
    CHECK(evidence.suspects().front().because == evidence.partings.numbers.words);
    evidence.partings.numbers.use = NumberUse::own;
    CHECK(names(evidence.suspects(), Subsystem::random_numbers));
}

TEST_CASE("of a closed form that both sides miss the scene's most particular feature is suspected") {
    SceneBuilder builder;
    builder.camera({0.0, 1.0, 4.0}, {0.0, 0.0, 0.0}).floor(diffuse(dvec3(0.5)), 0.0, 2.0).background(dvec3(1.0));
    Scene scene = builder.scene();
    const RenderSettings settings = default_settings(scene);
    const std::vector<SceneFeature> plain = features_of(scene, settings);
    CHECK_FALSE(names(suspects_of_miss({.features = plain}), Subsystem::camera));
    scene.camera.lens_radius = 0.1;
    scene.entities[0].object_to_world = glm::rotate(glm::dmat4(1.0), 0.5, glm::dvec3(0.0, 1.0, 0.0));
    const std::vector<SceneFeature> features = features_of(scene, settings);
    const std::vector<Suspect> suspects = suspects_of_miss({.features = features});
    REQUIRE(suspects.size() == most_suspects);
    CHECK(suspects[0].part == Subsystem::camera);
    CHECK(suspects[0].because == "the scene has a lens, MODEL.md 4");
    CHECK(suspects[1].part == Subsystem::scene_data);

    // A scene with a lens meets its closed form.
    scene.entities[0].object_to_world = glm::dmat4(1.0);
    const std::vector<SceneFeature> met = features_of(scene, settings);
    const std::vector<Suspect> others = suspects_of_miss({.features = features, .met = met});
    CHECK(others[0].part == Subsystem::scene_data);
    CHECK(
        others[0].because == "no scene that meets its closed form has an entity that is turned or scaled, MODEL.md 6");
}

TEST_CASE("what was tried on a closed form that both sides miss comes before the scene's features, or clears them") {
    const std::vector<SceneFeature> features{{Subsystem::camera, "a lens", "4"},
        {Subsystem::light_sampling, "lights that are sampled", "9.2"}, {Subsystem::bsdf, "a diffuse surface", "7.2"}};
    MissedForm tried;
    tried.whole = {256, -0.02, 0.001};
    FormTrial trial;
    trial.part = Subsystem::mis_weights;
    trial.change = "without weights of two ways to a light";
    trial.outcome = FormOutcome::met;
    trial.look = {256, 1e-4, 1e-4};
    tried.trials.push_back(trial);
    const auto suspects = [&] { return suspects_of_miss({.features = features, .tried = &tried}); };
    CHECK(suspects()[0].part == Subsystem::mis_weights);
    CHECK(suspects()[0].because ==
          "the closed form is met without weights of two ways to a light: off by +0.01 % ± 0.020 %, else by -2 %");
    CHECK(suspects()[1].part == Subsystem::camera);

    trial.part = Subsystem::light_sampling;
    trial.change = "without lights that are sampled";
    trial.whole = true;
    trial.outcome = FormOutcome::missed;
    tried.trials = {trial};
    CHECK(cleared_parts(tried) == std::vector{Subsystem::light_sampling});
    REQUIRE(suspects().size() == 3);
    CHECK(suspects()[1].part == Subsystem::bsdf);
    CHECK(suspects()[2].part == Subsystem::light_sampling);
    tried.trials.push_back(trial);
    tried.trials.back().outcome = FormOutcome::unknown;  // a background may be what is sampled wrongly
    CHECK(cleared_parts(tried).empty());

    tried.data = "lights";
    CHECK(suspects()[0].part == Subsystem::scene_data);
    tried.film = "the film has 2 in red at (0, 0), and its traced paths have the mean 1";
    CHECK(suspects()[0].part == Subsystem::accumulation);
    CHECK(suspects()[1].part == Subsystem::scene_data);
}

TEST_CASE("a closed form that few pixels miss is the film's") {
    ClosedForm form;
    form.radiance = {1.0, 2.0, 4.0};
    form.rounding = 1e-5;
    SampledImage side;
    side.width = side.height = 8;
    for (int pixel = 0; pixel < 64; ++pixel)
        for (const double value : form.radiance) side.pixels.push_back({value, 0.0, 64.0});
    CHECK_FALSE(film_misses(form, side).has_value());
    side.pixels.back().mean = 2.0;
    const std::optional<Suspect> suspect = film_misses(form, side);
    REQUIRE(suspect.has_value());
    CHECK(suspect->part == Subsystem::accumulation);
    CHECK(suspect->because == "1 of 64 pixels are off, and all others have the closed form's value");
    for (PixelStatistics& pixel : side.pixels) pixel.mean *= 1.1;
    CHECK_FALSE(film_misses(form, side).has_value());
}

TEST_CASE("a closed form that all pixels miss by one sample's share is the film's") {
    ClosedForm form;
    form.radiance = {1.0, 2.0, 4.0};
    form.rounding = 1e-5;
    SampledImage side;
    side.width = side.height = 8;
    side.samples = 256;
    for (const auto& [divisor, found] : {std::pair{255.0, true}, {257.0, true}, {254.0, false}}) {
        CAPTURE(divisor);
        side.pixels.clear();
        for (int pixel = 0; pixel < 64; ++pixel)
            for (const double value : form.radiance) side.pixels.push_back({value * 256.0 / divisor, 0.0, 256.0});
        const std::optional<Suspect> suspect = film_misses(form, side);
        REQUIRE(suspect.has_value() == found);
        if (!found) continue;
        CHECK(suspect->part == Subsystem::accumulation);
        CHECK(suspect->because ==
              fmt::format("all pixels have the closed form's value times 256 / {}, with 256 samples", divisor));
    }
    side.samples = 100'000;  // a sample's share is within rounding
    for (PixelStatistics& pixel : side.pixels) pixel.mean *= 254.0 / 256.0 * (1.0 + 3e-5);
    CHECK_FALSE(film_misses(form, side).has_value());
}
