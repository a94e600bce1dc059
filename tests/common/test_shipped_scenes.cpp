// Facts about the scene files that are shipped: what they hold, and that what must not coincide does not.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <glm/geometric.hpp>
#include <string>
#include <utility>
#include <vector>

#include "common/scene/loader/scene_loader.h"
#include "common/scene/scene.h"
#include "common/scene/sound_scene.h"

using namespace tandem;

namespace {

const std::filesystem::path scenes_folder = std::filesystem::path(TANDEM_SOURCE_DIR) / "scenes";

Scene shipped(const std::string& name) { return load_scene(scenes_folder / (name + ".json")); }

std::size_t count(const Scene& scene, PrimitiveKind kind) {
    std::size_t found = 0;
    for (const PlacedPrimitive placed : placed_primitives(scene))
        found += scene.primitives[placed.primitive].kind == kind ? 1 : 0;
    return found;
}

const Entity& entity(const Scene& scene, const std::string& name) {
    for (const Entity& candidate : scene.entities)
        if (candidate.name == name) return candidate;
    throw std::runtime_error("no entity " + name);
}

glm::dvec3 corner(const Scene& scene, const Entity& owner, std::uint32_t primitive, std::size_t index) {
    const Primitive& p = scene.primitives[owner.first_primitive + primitive];
    return glm::dvec3(owner.object_to_world * glm::dvec4(scene.vertices[p.index[index]], 1.0));
}

glm::dvec3 scaled_normal(const Scene& scene, const Entity& owner, std::uint32_t primitive) {
    const glm::dvec3 a = corner(scene, owner, primitive, 0);
    return glm::cross(corner(scene, owner, primitive, 1) - a, corner(scene, owner, primitive, 2) - a);
}

// Whether two axis-aligned cuboids have faces in one plane that overlap.
bool share_a_plane(std::array<glm::dvec3, 2> a, std::array<glm::dvec3, 2> b) {
    for (int axis = 0; axis < 3; ++axis) {
        const int second = (axis + 1) % 3, third = (axis + 2) % 3;
        const auto overlap = [&](int i) { return a[0][i] <= b[1][i] && b[0][i] <= a[1][i]; };
        if (!overlap(second) || !overlap(third)) continue;
        for (const glm::dvec3& one : a)
            for (const glm::dvec3& other : b)
                if (one[axis] == other[axis]) return true;
    }
    return false;
}

}  // namespace

TEST_CASE("every shipped scene loads, and keeps what scene.h promises") {
    std::size_t loaded = 0;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(scenes_folder)) {
        if (entry.path().extension() != ".json" || entry.path().stem().extension() == ".schema" ||
            entry.path().filename() == "catalogue.json")
            continue;
        CAPTURE(entry.path().string());
        CHECK(unsound_part(load_scene(entry.path())) == "");
        ++loaded;
    }
    CHECK(loaded >= 50);
}

TEST_CASE("the thesis's Cornell box has 7 cuboids, 1 sphere and 12 triangles") {
    const Scene scene = shipped("cornell-thesis");
    CHECK(count(scene, PrimitiveKind::cuboid) == 7);
    CHECK(count(scene, PrimitiveKind::sphere) == 1);
    CHECK(count(scene, PrimitiveKind::triangle) == 12);
    CHECK(placed_primitives(scene).size() == 20);
    CHECK(scene.film.width == 1920);
    CHECK(scene.film.height == 1080);
    CHECK(scene.defaults.bounces == 12);
    CHECK(scene.background.down != glm::dvec3(0.0));  // the second, ambient light
}

TEST_CASE("the thesis's materials are five diffuse walls, a clear cover, a lamp, fuzzy metal and blue glass") {
    const Scene scene = shipped("cornell-thesis");
    std::size_t walls = 0;
    for (const PlacedPrimitive placed : placed_primitives(scene)) {
        const Material& material = scene.materials[scene.entities[placed.entity].material];
        if (material.kind == MaterialKind::diffuse) ++walls;
    }
    CHECK(walls == 5);
    const Material& cover = scene.materials[entity(scene, "lamp cover").material];
    CHECK(cover.translucent);
    CHECK(cover.alpha == 0.0);
    CHECK(scene.materials[entity(scene, "lamp").material].kind == MaterialKind::emissive);
    CHECK(scene.materials[entity(scene, "sphere").material].fuzz > 0.0);
    const Material& glass = scene.materials[entity(scene, "cube").material];
    CHECK(glass.translucent);
    CHECK(glass.colour.z > glass.colour.x);
    CHECK(glass.fresnel == Fresnel::schlick);
}

TEST_CASE("no two cuboids of the thesis's box have faces in one plane") {
    const Scene scene = shipped("cornell-thesis");
    std::vector<std::array<glm::dvec3, 2>> cuboids;
    for (const PlacedPrimitive placed : placed_primitives(scene)) {
        const Primitive& primitive = scene.primitives[placed.primitive];
        if (primitive.kind == PrimitiveKind::cuboid)
            cuboids.push_back({scene.vertices[primitive.index[0]], scene.vertices[primitive.index[1]]});
    }
    for (std::size_t i = 0; i < cuboids.size(); ++i)
        for (std::size_t j = 0; j < i; ++j) {
            CAPTURE(i);
            CAPTURE(j);
            CHECK_FALSE(share_a_plane(cuboids[i], cuboids[j]));
        }
}

TEST_CASE("the blue cube's triangles face outwards and close it") {
    const Scene scene = shipped("cornell-thesis");
    const Entity& cube = entity(scene, "cube");
    REQUIRE(cube.primitive_count == 12);
    glm::dvec3 total(0.0);
    double six_volumes = 0.0;  // of the cones from the origin, signed (divergence theorem)
    for (std::uint32_t i = 0; i < 12; ++i) {
        total += scaled_normal(scene, cube, i);
        six_volumes += glm::dot(corner(scene, cube, i, 0), scaled_normal(scene, cube, i));
    }
    CHECK(glm::length(total) < 1e-12);
    CHECK(six_volumes / 6.0 == doctest::Approx(0.95 * 0.95 * 0.95).epsilon(1e-12));
}

TEST_CASE("the classic Cornell box has the book's geometry") {
    const Scene scene = shipped("cornell-classic");
    CHECK(count(scene, PrimitiveKind::triangle) == 12);
    CHECK(count(scene, PrimitiveKind::cuboid) == 2);
    CHECK(placed_primitives(scene).size() == 14);
    CHECK(scene.film.width == 600);
    CHECK(scene.film.height == 600);
    CHECK(scene.defaults.bounces == 12);
    CHECK(scene.camera.position == glm::dvec3(278, 278, -800));
    CHECK(scene.camera.vertical_field_degrees == 40.0);
    CHECK(scene.camera.lens_radius == 0.0);
    CHECK(scene.materials[entity(scene, "wall at x = 0").material].colour == glm::dvec3(0.65, 0.05, 0.05));
    CHECK(scene.materials[entity(scene, "wall at x = 555").material].colour == glm::dvec3(0.12, 0.45, 0.15));
}

TEST_CASE("the classic lamp lies at y = 554 and emits downwards only") {
    const Scene scene = shipped("cornell-classic");
    const Entity& lamp = entity(scene, "ceiling lamp, front downwards");
    const Material& material = scene.materials[lamp.material];
    CHECK(material.kind == MaterialKind::emissive);
    CHECK(material.sides == EmittingSides::front);
    CHECK(material.radiance == glm::dvec3(15.0));
    for (std::uint32_t i = 0; i < 2; ++i) {
        CHECK(scaled_normal(scene, lamp, i) == glm::dvec3(0.0, -130.0 * 105.0, 0.0));
        for (std::size_t k = 0; k < 3; ++k) {
            const glm::dvec3 point = corner(scene, lamp, i, k);
            CHECK(point.y == 554.0);
            CHECK((point.x == 213.0 || point.x == 343.0));
            CHECK((point.z == 227.0 || point.z == 332.0));
        }
    }
}

TEST_CASE("the classic boxes are turned, then moved, as the book does") {
    const Scene scene = shipped("cornell-classic");
    const double c = std::cos(15.0 * 3.14159265358979323846 / 180.0),
                 s = std::sin(15.0 * 3.14159265358979323846 / 180.0);
    const glm::dvec3 tall = corner(scene, entity(scene, "tall box"), 0, 1);  // of (165, 330, 165)
    CHECK(tall.x == doctest::Approx(265.0 + 165.0 * c + 165.0 * s));
    CHECK(tall.y == doctest::Approx(330.0));
    CHECK(tall.z == doctest::Approx(295.0 - 165.0 * s + 165.0 * c));
    CHECK(corner(scene, entity(scene, "short box"), 0, 0) == glm::dvec3(130.0, 0.0, 65.0));
}

TEST_CASE("the One Weekend scene has the book's camera, ground and three big spheres") {
    const Scene scene = shipped("one-weekend");
    CHECK(scene.film.width == 1200);
    CHECK(scene.film.height == 675);
    CHECK(scene.camera.position == glm::dvec3(13, 2, 3));
    CHECK(scene.camera.target == glm::dvec3(0, 0, 0));
    CHECK(scene.camera.vertical_field_degrees == 20.0);
    CHECK(scene.camera.focus_distance == 10.0);
    CHECK(scene.camera.lens_radius == doctest::Approx(10.0 * std::tan(0.3 * std::acos(-1.0) / 180.0)).epsilon(1e-9));
    CHECK(scene.defaults.bounces == 49);
    CHECK(scene.background.down == glm::dvec3(1.0));
    CHECK(scene.background.up == glm::dvec3(0.5, 0.7, 1.0));
    CHECK(scene.primitives[entity(scene, "ground").first_primitive].radius == 1000.0);
    CHECK(corner(scene, entity(scene, "big glass"), 0, 0) == glm::dvec3(0, 1, 0));
    CHECK(corner(scene, entity(scene, "big brown"), 0, 0) == glm::dvec3(-4, 1, 0));
    CHECK(corner(scene, entity(scene, "big mirror"), 0, 0) == glm::dvec3(4, 1, 0));
}

TEST_CASE("the One Weekend scene has at most 22 x 22 small spheres, clear of the big mirror") {
    const Scene scene = shipped("one-weekend");
    CHECK(count(scene, PrimitiveKind::sphere) == scene.primitives.size());
    std::size_t small = 0, diffuse = 0;
    for (const PlacedPrimitive placed : placed_primitives(scene)) {
        const Primitive& sphere = scene.primitives[placed.primitive];
        if (sphere.radius != 0.2) continue;
        const glm::dvec3 centre = scene.vertices[sphere.index[0]];
        CHECK(centre.y == 0.2);
        CHECK(glm::distance(centre, glm::dvec3(4, 0.2, 0)) > 0.9 - 1e-6);  // coordinates are rounded to 10^-6
        ++small;
        diffuse += scene.materials[scene.entities[placed.entity].material].kind == MaterialKind::diffuse ? 1 : 0;
    }
    CHECK(small == scene.primitives.size() - 4);
    CHECK(small <= 22 * 22);
    CHECK(small >= 22 * 22 - 9);  // the mirror's disc of radius 0.9 keeps few cells empty
    // 80 % are diffuse: a binomial count, within five standard deviations.
    const double expected = 0.8 * static_cast<double>(small), deviation = std::sqrt(expected * 0.2);
    CHECK(std::abs(static_cast<double>(diffuse) - expected) < 5.0 * deviation);
}

TEST_CASE("the furnace expects the partial sum of its geometric series") {
    const Scene scene = shipped("furnace");
    REQUIRE(scene.expect.has_value());
    const Material& wall = scene.materials.at(0);
    for (int c = 0; c < 3; ++c) {
        double sum = 0.0;
        for (std::uint32_t k = 0; k <= scene.defaults.bounces; ++k)
            sum += wall.radiance[c] * std::pow(wall.colour[c], static_cast<double>(k));
        CHECK(scene.expect->radiance[c] == doctest::Approx(sum).epsilon(1e-12));
    }
}

TEST_CASE("the mirror corridor expects ten reflections of its lamp") {
    const Scene scene = shipped("mirror-corridor");
    REQUIRE(scene.expect.has_value());
    const glm::dvec3 mirror = scene.materials[entity(scene, "mirrors").material].colour;
    const glm::dvec3 lamp = scene.materials[entity(scene, "lamp").material].radiance;
    for (int c = 0; c < 3; ++c)
        CHECK(scene.expect->radiance[c] == doctest::Approx(std::pow(mirror[c], 10.0) * lamp[c]).epsilon(1e-12));
}

TEST_CASE("the torus is closed and faces outwards") {
    const Scene scene = shipped("model");
    const Entity& torus = entity(scene, "lying torus");
    REQUIRE(torus.primitive_count == 576);
    glm::dvec3 total(0.0);
    double six_volumes = 0.0;
    for (std::uint32_t i = 0; i < torus.primitive_count; ++i) {
        total += scaled_normal(scene, torus, i);
        six_volumes += glm::dot(corner(scene, torus, i, 0), scaled_normal(scene, torus, i));
    }
    CHECK(glm::length(total) < 1e-12);
    // A little less than that of the smooth torus, 2 pi^2 R r^2.
    CHECK(six_volumes / 6.0 == doctest::Approx(2.0 * 9.8696 * 0.16).epsilon(0.08));
}

namespace {

// Six times the signed volume, and the sum of the scaled normals, of an entity's triangles (divergence theorem).
std::pair<double, glm::dvec3> closure(const Scene& scene, const Entity& owner) {
    double six_volumes = 0.0;
    glm::dvec3 total(0.0);
    for (std::uint32_t i = 0; i < owner.primitive_count; ++i) {
        total += scaled_normal(scene, owner, i);
        six_volumes += glm::dot(corner(scene, owner, i, 0), scaled_normal(scene, owner, i));
    }
    return {six_volumes, total};
}

}  // namespace

TEST_CASE("the large mesh is a closed knot of 100 000 triangles that faces outwards, and its copies share them") {
    const Scene scene = shipped("large-mesh");
    const Entity& knot = entity(scene, "knot");
    REQUIRE(knot.primitive_count == 100'000);
    const auto [six_volumes, total] = closure(scene, knot);
    CHECK(glm::length(total) < 1e-3);  // of about 1e2, from coordinates in single precision
    // A tube of radius 0.48 about a trefoil knot of length 28.6, less what flat faces cut off and what the ridges move.
    CHECK(six_volumes / 6.0 == doctest::Approx(3.14159 * 0.48 * 0.48 * 28.6).epsilon(0.05));
    CHECK(count(scene, PrimitiveKind::triangle) == 7 * 100'000 + 4);
    CHECK(scene.primitives.size() == 2 * 100'000 + 4);
    CHECK(scene.texture_coordinates.size() == scene.vertices.size());
}

TEST_CASE("The Next Week's scene has its 400 boxes, 1000 small spheres and the book's figures") {
    const Scene scene = shipped("next-week");
    CHECK(count(scene, PrimitiveKind::cuboid) == 400);
    CHECK(entity(scene, "sphere of the thousand").primitive_count == 1000);
    CHECK(count(scene, PrimitiveKind::sphere) == 1006);
    CHECK(entity(scene, "moving sphere").motion == glm::dvec3(30, 0, 0));
    const Material& blue = scene.materials[entity(scene, "blue sphere").material];
    REQUIRE(blue.interior != no_index);
    const Medium& inside = scene.media[blue.interior];
    for (int c = 0; c < 3; ++c)
        CHECK(inside.absorption[c] + inside.scattering[c] == doctest::Approx(0.2).epsilon(1e-12));
    REQUIRE(scene.medium != no_index);
    CHECK(scene.media[scene.medium].scattering == glm::dvec3(0.0001));
}

TEST_CASE("no two boxes of The Next Week's floor touch") {
    const Scene scene = shipped("next-week");
    const Entity& floor = entity(scene, "floor");
    std::vector<std::array<glm::dvec3, 2>> boxes;
    for (std::uint32_t i = 0; i < floor.primitive_count; ++i) {
        const Primitive& box = scene.primitives[floor.first_primitive + i];
        boxes.push_back({scene.vertices[box.index[0]], scene.vertices[box.index[1]]});
    }
    for (std::size_t i = 0; i < boxes.size(); ++i)
        for (std::size_t j = 0; j < i; ++j) CHECK_FALSE(share_a_plane(boxes[i], boxes[j]));
}

TEST_CASE("each body in the tank outranks the one that it reaches into") {
    const Scene scene = shipped("nested-glass");
    int last = 0;
    for (const char* name : {"tank", "its hollow", "water", "ice", "rod"}) {
        const Material& material = scene.materials[entity(scene, name).material];
        REQUIRE(material.priority.has_value());
        CHECK(*material.priority > last);
        last = *material.priority;
    }
}

TEST_CASE("the sky's image has a sun much brighter than the rest, and dark ground") {
    const Scene scene = shipped("environment");
    REQUIRE(scene.background.image);
    CHECK(scene.background.sampled);
    const Pixels& sky = *scene.background.image;
    const auto mean_of_row = [&](std::uint32_t row) {
        double sum = 0.0;
        for (std::uint32_t x = 0; x < sky.width; ++x) sum += sky.rgb[(row * sky.width + x) * 3 + 1];
        return sum / sky.width;
    };
    CHECK(*std::max_element(sky.rgb.begin(), sky.rgb.end()) == 64.0F);
    CHECK(mean_of_row(sky.height / 4) > 2.0 * mean_of_row(3 * sky.height / 4));  // row 0 is up
}
