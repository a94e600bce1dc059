// Paths that part as one side has the scene's data otherwise, and as its formula is another one.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cmath>
#include <set>

#include "common/scene/sound_scene.h"
#include "common/validation/explanation/suspects.h"
#include "tests/common/traced_renderer.h"
#include "tests/scene_builder.h"

namespace tandem::test {
namespace {

// One entry of each table, at least two of some, all with figures of their own.
Scene full_scene() {
    Material metal;
    metal.kind = MaterialKind::conductor;
    metal.eta = dvec3(0.2, 0.9, 1.1);
    metal.k = dvec3(3.9, 2.4, 2.2);
    metal.roughness = 0.3;
    Material inside = glass(1.3), outside = glass(1.5), fuzzy = mirror(dvec3(0.9, 0.8, 0.7));
    inside.priority = 2;
    outside.priority = 1;
    inside.interior = 0;
    inside.alpha = 0.8;
    fuzzy.fuzz = 0.2;
    fuzzy.colour_texture = 0;
    SceneBuilder builder;
    builder.floor(diffuse(dvec3(0.5, 0.3, 0.1)), -1.0, 3.0).sphere(metal, {-1.0, 0.0, 0.0}, 0.5);
    builder.sphere(outside, {0.0, 0.0, 0.0}, 0.5).sphere(inside, {0.0, 0.0, 0.0}, 0.3);
    builder.sphere(fuzzy, {1.0, 0.0, 0.0}, 0.5);
    Scene& scene = builder.scene();
    scene.textures.emplace_back();
    Medium thin, cloud;
    thin.absorption = dvec3(0.1, 0.2, 0.3);
    thin.scattering = dvec3(0.4);
    thin.anisotropy = 0.5;
    cloud.scattering = dvec3(0.7);
    cloud.anisotropy = -0.3;
    DensityGrid grid;
    grid.density = {1.0F};
    cloud.grid = std::make_shared<const DensityGrid>(grid);
    scene.media = {thin, cloud};
    scene.medium = 1;
    PunctualLight lamp, sun;
    lamp.intensity = dvec3(1.0);
    sun.kind = PunctualKind::sun;
    sun.direction = dvec3(1.0, 0.0, 0.0);
    sun.intensity = dvec3(2.0);
    scene.lights = {lamp, sun};
    scene.entities[1].motion = dvec3(0.0, 0.1, 0.0);
    scene.entities[2].object_to_world = glm::rotate(dmat4(1.0), 0.3, dvec3(0.0, 1.0, 0.0));
    return scene;
}

using Figure = std::function<double(const Scene&)>;
std::optional<DataTrial> trial_of(const Scene& scene, const Figure& reference, const Figure& candidate) {
    const auto traced = [](const Figure& figure) {
        return std::make_unique<TracedRenderer>([figure](const Scene& seen, std::uint64_t) {
            return scattered_once({0.0, 0.0, 1.0}, dvec3(figure(seen)));
        });
    };
    const auto a = traced(reference), b = traced(candidate);
    const std::vector<glm::uvec2> pixels{{0, 0}, {1, 0}};
    const RetracedPaths paths({scene, {}, *a, *b, pixels});
    return try_data_faults(
        {.paths = paths, .scene = scene, .settings = {}, .reference = *a, .candidate = *b, .in_time = [] {
             return true;
         }});
}

}  // namespace

TEST_CASE("data of one side that went wrong are told by the other's paths in the scene that is wrong alike") {
    const Scene scene = full_scene();
    // What paths weigh follows from every figure of the scene.
    const auto weight_of_all = [](const Scene& seen) {
        double sum = 0.0, place = 1.0;
        const auto add = [&](double value) { sum += value * (place += 0.37); };
        for (const Material& m : seen.materials) {
            for (const dvec3& v : {m.colour, m.radiance, m.eta, m.k})
                for (int c = 0; c < 3; ++c) add(v[c]);
            for (const double v : {m.alpha, m.fuzz, m.roughness, m.refractive_index}) add(v);
            add(static_cast<double>(m.fresnel));
            add(static_cast<double>(m.sides));
            add(m.colour_texture == no_index ? -1.0 : m.colour_texture);
            add(m.interior == no_index ? -1.0 : m.interior);
            add(m.priority ? *m.priority : 99.0);
        }
        for (const Medium& m : seen.media) {
            for (const dvec3& v : {m.absorption, m.scattering})
                for (int c = 0; c < 3; ++c) add(v[c]);
            add(m.anisotropy);
            add(m.grid ? 1.0 : 0.0);
        }
        for (const PunctualLight& l : seen.lights)
            for (int c = 0; c < 3; ++c) add(l.intensity[c] + 7.0 * l.direction[c]);
        for (const Entity& e : seen.entities) {
            add(e.material);
            add(e.motion.y);
            add(e.object_to_world[0][2]);
            add(e.primitive_count);
        }
        return 2.0 + std::sin(1e3 * sum);  // so that slight changes tell
    };
    std::size_t planted = 0;
    for (const DataFault& fault : data_faults()) {
        CAPTURE(fault.words);
        Scene wrong = scene;
        if (!fault.plant(wrong)) continue;
        ++planted;
        CHECK(unsound_part(wrong).empty());
        const Figure of_wrong = [&](const Scene& seen) {
            Scene changed = seen;
            fault.plant(changed);
            return weight_of_all(changed);
        };
        const std::optional<DataTrial> in_candidate = trial_of(scene, weight_of_all, of_wrong);
        REQUIRE(in_candidate);
        CHECK(in_candidate->faulty == VerifiedSide::candidate);
        CHECK(in_candidate->left == 0);
        Scene as_told = scene;
        REQUIRE(in_candidate->fault.plant(as_told));
        CHECK(weight_of_all(as_told) == doctest::Approx(weight_of_all(wrong)).epsilon(1e-12));
        const std::optional<DataTrial> in_reference = trial_of(scene, of_wrong, weight_of_all);
        REQUIRE(in_reference);
        // What is exchanged is right again where it is so on both sides.
        CHECK((in_reference->faulty == VerifiedSide::reference) == (of_wrong(wrong) != weight_of_all(scene)));
    }
    CHECK(planted >= 40);
}

TEST_CASE("a formula that no scene stands for is no fault of data, and the data's is named first") {
    const Scene scene = full_scene();
    const auto k = [](const Scene& seen) { return 0.1 * seen.materials[1].k.x; };
    CHECK_FALSE(trial_of(scene, k, [&](const Scene& seen) { return 1.1 * k(seen); }));
    const std::optional<DataTrial> trial =
        trial_of(scene, k, [](const Scene& seen) { return 0.1 * seen.materials[1].eta.x; });
    REQUIRE(trial);
    CHECK(told(*trial) == "the reference draws the candidate's samples where the k of conductors is their eta");
    const Judgement judgement;
    const Signature signature{};
    const PathPartings partings;
    const FaultPlace place;
    const std::vector<Suspect> suspects = suspects_of_difference(
        {.judgement = judgement, .signature = signature, .partings = partings, .place = place, .data_trial = &*trial},
        {.patterns = {}}).suspects;
    REQUIRE(suspects.size() == 1);
    CHECK(suspects[0].part == Subsystem::scene_data);
    CHECK(suspects[0].because == told(*trial));
}

TEST_CASE("faults of data have names of their own") {
    std::set<std::string> names;
    for (const DataFault& fault : data_faults()) CHECK(names.insert(fault.words).second);
}

}  // namespace tandem::test
