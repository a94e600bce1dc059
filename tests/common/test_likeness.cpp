// Which planted bugs a difference is like: what parts two paths, how near signatures are. Also how often the naming is
// right for bugs whose kind the record does not hold.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <sstream>

#include "common/validation/explanation/likeness.h"
#include "tests/scene_builder.h"

using namespace tandem;
using namespace tandem::test;

namespace {

// Camera, a diffuse surface under a lamp, the sky.
PathTrace path() {
    PathTrace trace;
    for (std::uint32_t k = 0; k < 2; ++k) {
        TracedVertex vertex;
        vertex.origin = {0.0, 1.0 + k, 3.0};
        vertex.position = {1.0 + k, 2.0, 3.0};
        vertex.t = 1.0;
        vertex.direction = vertex.next_direction = {0.0, 0.6, 0.8};
        vertex.normal = {0.0, 0.0, -1.0};
        vertex.primitive = vertex.material = 0;
        vertex.next_throughput = glm::dvec3(0.5);
        vertex.pdf = 0.25;
        vertex.shading_normal = vertex.normal;
        vertex.light = glm::dvec3(0.25);
        vertex.next_event = {.direction = {0.0, 1.0, 0.0},
            .radiance = glm::dvec3(1.0),
            .pdf = 0.5,
            .response = glm::dvec3(0.25),
            .transmittance = glm::dvec3(1.0),
            .weight = 0.5};
        vertex.found_weight = 0.5;
        vertex.survival = 0.5;
        vertex.radiance = glm::dvec3(0.25 * (k + 1));
        trace.vertices.push_back(vertex);
    }
    trace.vertices[1].end = PathEnd::bounces;
    trace.radiance = trace.vertices[1].radiance;
    return trace;
}

std::vector<PartsBy> parts_by(const PathTrace& other) {
    std::vector<PartsBy> found;
    const std::optional<Parting> parting = parting_of(path(), other);
    for (std::size_t i = 0; parting && i < parting->by.size(); ++i)
        if (parting->by[i]) found.push_back(static_cast<PartsBy>(i));
    return found;
}

Signature signature(std::initializer_list<std::pair<Figure, float>> figures) {
    Signature result;
    for (const auto& [figure, value] : figures) result[figure] = value;
    result[Figure::scene_light_sampling] = result[Figure::scene_textures] = 1.0F;
    return result;
}

std::size_t words(const std::string& text) {
    std::istringstream stream(text);
    std::size_t count = 0;
    for (std::string word; stream >> word;) ++count;
    return count;
}

}  // namespace

TEST_CASE("paths that differ by rounding alone do not part") {
    PathTrace other = path();
    other.vertices[0].next_direction.z += 0x1p-22;
    other.vertices[1].light *= 1.0 + 0x1p-20;
    other.radiance *= 1.0 + 0x1p-20;
    CHECK_FALSE(parting_of(path(), other).has_value());
}

TEST_CASE("what parts two paths is told by its cause, not by what follows from it") {
    const auto changed = [](auto change) {
        PathTrace other = path();
        change(other);
        return parts_by(other);
    };
    using Parts = std::vector<PartsBy>;
    CHECK(changed([](PathTrace& p) { p.vertices[0].direction = {0.6, 0.0, 0.8}; }) == Parts{PartsBy::camera});
    CHECK(changed([](PathTrace& p) { p.vertices[1].origin.x += 0.01; }) == Parts{PartsBy::spawned});
    CHECK(changed([](PathTrace& p) { p.vertices[1].primitive = 7; }) == Parts{PartsBy::met});
    CHECK(changed([](PathTrace& p) { p.vertices[0].normal = {0.0, 0.6, -0.8}; }) == Parts{PartsBy::normal});
    CHECK(changed([](PathTrace& p) { p.vertices[1].throughput *= 0.9; }) == Parts{PartsBy::throughput});
    CHECK(changed([](PathTrace& p) { p.vertices[0].next_throughput *= 0.9; }) == Parts{PartsBy::weight});
    CHECK(changed([](PathTrace& p) { p.vertices[0].end = PathEnd::roulette; }) == Parts{PartsBy::end});
    CHECK(changed([](PathTrace& p) { p.vertices[0].shading_normal.y = 0.1; }) == Parts{PartsBy::shading_normal});
    CHECK(changed([](PathTrace& p) { p.vertices[0].found_weight = 0.4; }) == Parts{PartsBy::found_weight});
    CHECK(changed([](PathTrace& p) {
        p.vertices[0].survival *= 0.5;
        p.vertices[0].next_throughput *= 2.0;
    }) == Parts{PartsBy::survival});
    CHECK(changed([](PathTrace& p) { p.radiance *= 0.5; }) == Parts{PartsBy::sum});
    // The light of a vertex is in the radiance gathered until there, and is taken out of what the ray itself found.
    CHECK(changed([](PathTrace& p) {
        p.vertices[0].light *= 0.5;
        for (TracedVertex& vertex : p.vertices) vertex.radiance -= 0.125;
    }) == Parts{PartsBy::light});
    CHECK(changed([](PathTrace& p) { p.vertices[1].radiance += 0.125; }) == Parts{PartsBy::emission});
    CHECK(changed([](PathTrace& p) {
        p.vertices[1].light = glm::dvec3(0.0);
        p.vertices[1].radiance -= 0.25;
    }) == Parts{PartsBy::shadow});
    // Another light is hidden, or none is aimed at: no shadow ray is at fault.
    CHECK(changed([](PathTrace& p) {
        p.vertices[1].light = glm::dvec3(0.0);
        p.vertices[1].next_event = {.direction = {0.0, 0.6, 0.8}};
        p.vertices[1].radiance -= 0.25;
    }) == Parts{PartsBy::light_direction});
    CHECK(changed([](PathTrace& p) {
        p.vertices[1].light = glm::dvec3(0.0);
        p.vertices[1].next_event = {};
        p.vertices[1].radiance -= 0.25;
    }) == Parts{PartsBy::light_direction});
}

TEST_CASE("paths part where they look for light in different places, though they see none") {
    PathTrace one = path(), other = path();
    for (PathTrace* const p : {&one, &other}) {
        p->vertices[1].light = glm::dvec3(0.0);
        p->vertices[1].next_event = {.direction = {0.0, 1.0, 0.0}};
    }
    CHECK_FALSE(parting_of(one, other).has_value());
    other.vertices[1].next_event.direction = {0.0, 0.6, 0.8};
    const std::optional<Parting> parting = parting_of(one, other);
    REQUIRE(parting.has_value());
    CHECK(parting->by[static_cast<std::size_t>(PartsBy::light_direction)]);
}

TEST_CASE("of what a next event brings the factor is told that differs") {
    const auto changed = [](auto change) {
        PathTrace other = path();
        change(other.vertices[0].next_event);
        return parts_by(other);
    };
    using Parts = std::vector<PartsBy>;
    CHECK(changed([](TracedLight& l) { l.radiance *= 2.0; }) == Parts{PartsBy::light_radiance});
    CHECK(changed([](TracedLight& l) { l.pdf *= 2.0; }) == Parts{PartsBy::light_density});
    CHECK(changed([](TracedLight& l) { l.response.x *= 2.0; }) == Parts{PartsBy::light_response});
    CHECK(changed([](TracedLight& l) { l.transmittance *= 0.5; }) == Parts{PartsBy::light_transmittance});
    CHECK(changed([](TracedLight& l) { l.weight = 0.25; }) == Parts{PartsBy::light_weight});
    // All else follows from where the light is looked for, and the oracle tells nothing else.
    CHECK(changed([](TracedLight& l) {
        l.direction = {0.0, 0.6, 0.8};
        l.pdf = 2.0;
    }) == Parts{PartsBy::light_direction});
    CHECK(changed([](TracedLight& l) { l = {.direction = l.direction}; }).empty());
}

TEST_CASE("partings are counted by cause, by what is met and by depth, with the size of what differs") {
    const Scene scene = SceneBuilder().sphere(diffuse({0.5, 0.5, 0.5}), {0.0, 0.0, 0.0}, 1.0).scene();
    PathTrace other = path();
    other.vertices[1].light *= 0.5;
    other.vertices[1].radiance -= 0.125;
    const PathPartings counts =
        counted(scene, 8, {parting_of(path(), other), parting_of(path(), other), parting_of(path(), path())});
    CHECK(counts.paths == 3);
    CHECK(counts.parted == 2);
    CHECK(counts.by[static_cast<std::size_t>(PartsBy::light)] == 1.0);
    CHECK(counts.at[static_cast<std::size_t>(Meeting::diffuse)] == 1.0);
    CHECK(counts.shape[static_cast<std::size_t>(PrimitiveKind::sphere)] == 1.0);
    CHECK(counts.depth[1] == 1.0);
    CHECK(counts.ratio == doctest::Approx(1.0));  // one octave
    CHECK(counts.ratio_spread == doctest::Approx(0.0));
}

TEST_CASE("ends are counted where roulette ends one path alone, and at the limit of bounces") {
    const Scene scene = SceneBuilder().sphere(diffuse({0.5, 0.5, 0.5}), {0.0, 0.0, 0.0}, 1.0).scene();
    const auto ended = [&](PathEnd end, std::uint32_t bounces) {
        PathTrace other = path();
        other.vertices[0].end = end;
        return counted(scene, bounces, {parting_of(path(), other)});
    };
    CHECK(ended(PathEnd::roulette, 8).by_roulette == 1.0);
    CHECK(ended(PathEnd::roulette, 8).at_limit == 0.0);
    CHECK(ended(PathEnd::absorbed, 1).at_limit == 1.0);  // event 0 is the last, and one path ends at it
    CHECK(ended(PathEnd::absorbed, 0).at_limit == 1.0);  // one path goes on beyond the limit
    CHECK(ended(PathEnd::absorbed, 2).at_limit == 0.0);
    CHECK(ended(PathEnd::absorbed, 1).by_roulette == 0.0);
}

TEST_CASE("the nearest kinds are named, of subsystems that have work in the scene, and what is far is not") {
    std::vector<PlantedSignature> rows;
    for (const auto& [bug, share] : {std::pair{"a", 1.0F}, {"b", 0.9F}, {"c", 0.8F}})
        rows.push_back({bug, "vulkan", Subsystem::light_sampling, signature({{Figure::by_light, share}})});
    for (const auto& [bug, share] : {std::pair{"d", 1.0F}, {"e", 0.9F}, {"f", 0.8F}})
        rows.push_back(
            {bug, "vulkan", Subsystem::textures, signature({{Figure::by_weight, share}, {Figure::on_texture, 1.0F}})});
    const Signature query = signature({{Figure::by_light, 0.99F}});
    const std::optional<Likeness> likeness = likeness_of(query, rows);
    REQUIRE(likeness.has_value());
    CHECK(likeness->subsystems.front() == Subsystem::light_sampling);
    CHECK(likeness->bugs == std::vector<std::string_view>{"a", "b"});
    CHECK(likeness->of > 0);
    CHECK(vote(query, rows, "a")->bugs.front() == "b");
    Signature dark = query;
    dark[Figure::scene_light_sampling] = 0.0F;
    CHECK(vote(dark, rows)->subsystems == std::vector{Subsystem::textures});
    Signature far = query;
    for (float& figure : far.figures) figure += 5.0F;
    CHECK_FALSE(likeness_of(far, rows).has_value());
    CHECK_FALSE(likeness_of(query, {}).has_value());
}

TEST_CASE("likeness is told in at most 25 words, whatever is named") {
    for (const Subsystem first : {Subsystem::roulette, Subsystem::camera, Subsystem::geometry}) {
        const Likeness likeness{{"shading-normal-transform-wrong", "medium-shadow-ignored"},
            {first, Subsystem::roulette, Subsystem::camera}, 0.5, 40, 45};
        CAPTURE(told(likeness));
        CHECK(words(told(likeness)) <= 25);
    }
    CHECK(told({{"index-scaled"}, {Subsystem::dielectric}, 1.0, 8, 9}) ==
          "errs like index-scaled (dielectrics and refraction): right for 8 of 9 planted bugs");
}

TEST_CASE("bugs of kinds that the record does not hold are named as often as the room's page says") {
    std::ifstream file(TANDEM_SOURCE_DIR "/common/validation/README.md");
    const std::string page{std::istreambuf_iterator<char>(file), {}};
    for (const char* planting : {"cpu", "vulkan"}) {
        std::size_t first = 0, among_three = 0, of = 0;
        for (const PlantedSignature& row : planted_signatures()) {
            if (row.planting != planting) continue;
            const std::optional<Likeness> likeness = vote(row.signature, planted_signatures(), row.bug);
            REQUIRE(likeness.has_value());
            const auto place = std::ranges::find(likeness->subsystems, row.subsystem);
            first += place == likeness->subsystems.begin() ? 1 : 0;
            among_three += place != likeness->subsystems.end() ? 1 : 0;
            ++of;
        }
        const std::string line = fmt::format("| {} | {} of {} | {} of {} |", planting, first, of, among_three, of);
        CAPTURE(line);
        CHECK(of > 0);
        CHECK(page.find(line) != std::string::npos);
    }
}
