// The hard cases judge themselves first: what a generator promises is held to exact arithmetic, and the judge to
// planted faults.
#include <doctest/doctest.h>

#include <fstream>

#include "common/error.h"
#include "common/stability/catalogue.h"
#include "common/stability/ray_judge.h"
#include "common/stability/stability.h"
#include "common/stability/surface_distance.h"
#include "tests/common/exact_predicates.h"
#include "tests/temporary_folder.h"

using namespace tandem;
using namespace tandem::stability;
using tandem::test::exact_passage;
using tandem::test::Passage;

namespace {

const std::string catalogue = TANDEM_SOURCE_DIR "/scenes/hard/catalogue.json";

bool met_exactly(const Surfaces& surfaces, const GivenRay& ray) {
    for (std::uint32_t id = 0; id < surfaces.size(); ++id) {
        if (!surfaces.is_triangle(id)) continue;
        const Passage passage = exact_passage(ray.origin, ray.direction, surfaces.corners(id));
        if (passage != Passage::outside && passage != Passage::in_plane &&
            test::exact_side(ray.origin, ray.direction, surfaces.corners(id)) >= 0)
            return true;
    }
    return false;
}

// Hits everything at t = 1 but every n-th ray, or says what it is told to.
class Liar final : public Renderer {
public:
    explicit Liar(RayHit answer) : answer_(answer) {}
    RendererInfo info() const override { return {"liar", "", "", ""}; }
    std::unique_ptr<RenderJob> prepare(const Scene&, const RenderSettings&) override { throw UnsupportedError("no"); }
    std::unique_ptr<RayIntersector> intersector(const Scene&, const RenderSettings&) override {
        struct Answers final : RayIntersector {
            explicit Answers(RayHit a) : answer(a) {}
            RayHits intersect(std::span<const GivenRay> rays) override {
                return {std::vector<RayHit>(rays.size(), answer), 1.0, std::nullopt};
            }
            RayHit answer;
        };
        return std::make_unique<Answers>(answer_);
    }

private:
    RayHit answer_;
};

RayTally tally_of(const std::string& id, RayHit answer) {
    for (const HardCase& c : load_catalogue(catalogue))
        if (c.id == id) {
            Liar liar(answer);
            return shoot(make_ray_work(c), liar, {}, Precision::single_precision, 1, 100, 10.0, {});
        }
    FAIL("no case " << id);
    return {};
}

}  // namespace

TEST_CASE("exact predicates tell edges and vertices from what is one unit in the last place beside them") {
    const std::array<glm::dvec3, 3> t{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}};
    const glm::dvec3 down(0, 0, -1);
    CHECK(exact_passage({0.25, 0.25, 1}, down, t) == Passage::inside);
    CHECK(exact_passage({0.5, 0.5, 1}, down, t) == Passage::edge);
    CHECK(exact_passage({0.0, 0.0, 1}, down, t) == Passage::vertex);
    CHECK(exact_passage({0.5, 0.5 + 0x1p-53, 1}, down, t) == Passage::outside);
    CHECK(exact_passage({0.5, 0.0, 1}, {1, 0, 0}, t) == Passage::outside);
    CHECK(exact_passage({-1, 0.25, 0}, {1, 0, 0}, t) == Passage::in_plane);
    CHECK(test::exact_side({0.25, 0.25, 1}, down, t) == 1);
    CHECK(test::exact_side({0.25, 0.25, -1}, down, t) == -1);
    CHECK(test::exact_side({0.25, 0.25, 0}, down, t) == 0);
}

TEST_CASE("what triangle cases promise to hit or to miss is so in exact arithmetic") {
    for (const HardCase& c : load_catalogue(catalogue)) {
        if (c.subject != Subject::triangles || c.generator == "poisoned" || c.generator == "lengths" ||
            c.generator == "thin-directions" || c.generator == "interval-ends")
            continue;
        CAPTURE(c.id);
        const std::vector<RayWork> work = make_ray_work(c);
        for (std::size_t i = 0; i < std::min<std::size_t>(work.size(), 3); ++i) {
            const Surfaces surfaces(work[i].scene);
            Dice dice(c.seed + i);
            for (int ray = 0; ray < 20; ++ray) {
                const JudgedRay judged = work[i].aim(dice);
                if (judged.must == Must::either) continue;
                CHECK(met_exactly(surfaces, judged.ray) == (judged.must == Must::hit));
            }
        }
    }
}

TEST_CASE("the judge counts what is missed, found where nothing is, found beside the surface, and NaN") {
    CHECK(tally_of("1", {}).misses == 104);  // every ray: 8 scenes of 13
    const RayHit somewhere{1.0, 0, glm::dvec3(0.0), glm::dvec3(0, 0, 1), glm::dvec3(0.0), glm::dvec3(0.0)};
    const RayTally beside = tally_of("1", somewhere);
    CHECK(beside.misses == 0);
    CHECK(beside.worst_ulp > 1e5);
    const RayTally in_plane = tally_of("6", somewhere);
    CHECK(in_plane.false_hits == in_plane.rays);
    RayHit sick = somewhere;
    sick.normal.x = std::numeric_limits<double>::quiet_NaN();
    const RayTally nan = tally_of("1", sick);
    CHECK(nan.false_hits == nan.rays);
}

TEST_CASE("distances from surfaces: triangles, ellipsoids and sheared boxes") {
    Scene scene;
    scene.materials.emplace_back();
    scene.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {2, 2, 2}, {-1, -1, -1}, {1, 1, 1}};
    scene.primitives = {{PrimitiveKind::triangle, {0, 1, 2}, 0.0}, {PrimitiveKind::sphere, {3, 0, 0}, 0.5},
        {PrimitiveKind::cuboid, {4, 5, 0}, 0.0}};
    glm::dmat4 sheared(1.0);
    sheared[1][0] = 1.0;  // x += y
    scene.entities = {{"", 0, 0, 2, glm::dmat4(1.0), glm::dvec3(0.0)}, {"", 0, 2, 1, sheared, glm::dvec3(0.0)}};
    const Surfaces surfaces(scene);
    CHECK(surfaces.offset(0, {0.25, 0.25, 0.125}).along_normal == doctest::Approx(0.125));
    CHECK(surfaces.offset(0, {0.25, 0.25, 0.125}).sideways == doctest::Approx(0.0));
    CHECK(surfaces.offset(0, {-0.5, 0.5, 0.0}).sideways == doctest::Approx(0.5));
    CHECK(surfaces.offset(1, {2, 2, 2.75}).along_normal == doctest::Approx(0.25));
    // The face x = 1 of the box is the plane x - y = 1 of the world.
    CHECK(surfaces.offset(2, {1.01, 0, 0}).along_normal == doctest::Approx(0.01 / std::sqrt(2.0)));
}

TEST_CASE("a catalogue with a fault is refused by one line that names the place") {
    const TemporaryFolder folder;
    const std::string file = (folder / "c.json").string();
    for (const auto& [text, part] :
        {std::pair{"{", "is no JSON"}, {"{}", "/cases: is missing"}, {R"({"cases": [{"name": "x"}]})", "/cases/0/id"},
            {R"({"cases": [{"id": "a", "name": "x", "source": "s", "bound": "b", "bound_ulp": 1, "subject": "cats"}]})",
                "'cats' is no subject"}}) {
        std::ofstream(file) << text;
        CHECK_THROWS_WITH_AS(static_cast<void>(load_catalogue(file)), doctest::Contains(part), InputError);
    }
}
