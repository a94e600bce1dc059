// Which faces are in contact, and by how much they are drawn apart (MODEL.md section 5.2).
#include <doctest/doctest.h>

#include <algorithm>

#include "common/render/contacts.h"
#include "common/scene/loader/scene_loader.h"
#include "tests/scene_builder.h"

using namespace tandem;
using namespace tandem::test;

namespace {

// The least of an entity's points along an axis of the world.
double lowest(const Scene& scene, std::size_t entity, const dvec3& axis = {0.0, 1.0, 0.0}) {
    const Entity& one = scene.entities[entity];
    double least = INFINITY;
    for (std::uint32_t i = 0; i < one.primitive_count; ++i) {
        const Primitive& primitive = scene.primitives[one.first_primitive + i];
        for (std::size_t k = 0; k < (primitive.kind == PrimitiveKind::triangle ? 3u : 2u); ++k)
            least = std::min(least,
                glm::dot(axis, dvec3(one.object_to_world * glm::dvec4(scene.vertices[primitive.index[k]], 1.0))));
    }
    return least;
}

Scene block_on_floor(const Material& block, bool as_mesh, double gap = 0.0, const dmat4& placed = dmat4(1.0)) {
    SceneBuilder builder;
    builder.quad(diffuse(white), {-4, 0, 4}, {4, 0, 4}, {4, 0, -4}, {-4, 0, -4}, placed);
    if (as_mesh)
        builder.triangle_box(block, {-1, gap, -1}, {1, 2, 1}, placed);
    else
        builder.cuboid(block, {-1, gap, -1}, {1, 2, 1}, placed);
    return builder.scene();
}

}  // namespace

TEST_CASE("glass on a floor is drawn back by a hair, however both are placed, and the floor stays") {
    for (const bool as_mesh : {false, true})
        for (int i = 0; i < 40; ++i) {
            const dmat4 placed = moved({0.3 * i, 0.1 * i, -0.7 * i}) * rotated(17.0 * i, {1.0, 0.1 * i, -0.5}) *
                                 scaled(dvec3(i % 2 == 0 ? 1.0 : 0.37 * i));
            const dvec3 up = glm::normalize(dvec3(placed * glm::dvec4(0.0, 1.0, 0.0, 0.0)));
            const Scene scene = block_on_floor(glass(1.5), as_mesh, 0.0, placed);
            const std::optional<Scene> apart = with_contacts_apart(scene);
            REQUIRE(apart.has_value());
            const double gap = lowest(*apart, 1, up) - lowest(*apart, 0, up);
            const double size = 50.0 * std::max(1.0, 0.37 * i);
            CHECK(gap > 1e-5);
            CHECK(gap < 0x1p-15 * 3.0 * size);
            CHECK(lowest(*apart, 0, up) == lowest(scene, 0, up));
            CHECK(lowest(*apart, 1, -up) == lowest(scene, 1, -up));  // the other faces too
            CHECK_FALSE(with_contacts_apart(*apart).has_value());
        }
}

// In seconds: faces of one body held against each other, or the body's thickness found anew for each, took minutes.
TEST_CASE("a glass slab of many triangles on a floor is drawn back as one of two is") {
    const auto slab = [](int n) {
        SceneBuilder builder;
        builder.quad(diffuse(white), {-4, 0, 4}, {4, 0, 4}, {4, 0, -4}, {-4, 0, -4});
        Scene scene = builder.scene();
        const auto material = static_cast<std::uint32_t>(scene.materials.size());
        scene.materials.push_back(glass(1.5));
        Entity entity;
        entity.material = material;
        entity.first_primitive = static_cast<std::uint32_t>(scene.primitives.size());
        for (const double y : {0.0, 0.25})
            for (int i = 0; i < n; ++i)
                for (int k = 0; k < n; ++k) {
                    const auto at = [&](int a, int b) { return dvec3(double(i + a) / n, y, double(k + b) / n); };
                    const auto face = [&](dvec3 p, dvec3 q, dvec3 r) {
                        if (y > 0.0) std::swap(q, r);  // looks up; the others down
                        const auto first = static_cast<std::uint32_t>(scene.vertices.size());
                        scene.vertices.insert(scene.vertices.end(), {p, q, r});
                        scene.primitives.push_back(
                            {.kind = PrimitiveKind::triangle, .index = {first, first + 1, first + 2}});
                    };
                    face(at(0, 0), at(1, 0), at(1, 1));
                    face(at(0, 0), at(1, 1), at(0, 1));
                }
        entity.primitive_count = static_cast<std::uint32_t>(scene.primitives.size()) - entity.first_primitive;
        scene.entities.push_back(entity);
        const std::optional<Scene> apart = with_contacts_apart(scene);
        REQUIRE(apart.has_value());
        return lowest(*apart, 1);
    };
    const double coarse = slab(1), fine = slab(200);
    CHECK(fine > 0.0);
    CHECK(fine <= coarse);
}

TEST_CASE("a floor through the origin counts as exactly known, however large it is") {
    SceneBuilder builder;
    builder.floor(diffuse(white), 0.0, 1e4);
    builder.cuboid(glass(1.5), {-1, 0, -1}, {1, 2, 1});
    const std::optional<Scene> apart = with_contacts_apart(builder.scene());
    REQUIRE(apart.has_value());
    CHECK(lowest(*apart, 1) > 0x1p-15);
    CHECK(lowest(*apart, 1) < 1e-3);
}

TEST_CASE("what does not touch, or is no dielectric, or is meant to overlap stays as it is") {
    const auto stays = [](const Scene& scene) { return !with_contacts_apart(scene).has_value(); };
    Material ranked = glass(1.5), fog;
    ranked.priority = 1;
    fog.kind = MaterialKind::boundary;
    for (const bool as_mesh : {false, true}) {
        CHECK(stays(block_on_floor(glass(1.5), as_mesh, 1e-3)));
        CHECK(stays(block_on_floor(mirror(white), as_mesh)));
        CHECK(stays(block_on_floor(fog, as_mesh)));
        CHECK_FALSE(stays(block_on_floor(ranked, as_mesh)));
        Scene moving = block_on_floor(glass(1.5), as_mesh);
        moving.entities[1].motion = {0.1, 0.0, 0.0};
        CHECK(stays(moving));
    }
    // Side by side: faces in one plane that share an edge alone.
    SceneBuilder beside;
    beside.quad(diffuse(white), {1, 0, 1}, {3, 0, 1}, {3, 0, -1}, {1, 0, -1});
    beside.cuboid(glass(1.5), {-1, 0, -1}, {1, 2, 1});
    CHECK(stays(beside.scene()));
    SceneBuilder overlapping;
    overlapping.cuboid(ranked, {-1, 0, -1}, {1, 2, 1});
    overlapping.cuboid(glass(1.33), {-1, 2, -1}, {1, 3, 1});
    CHECK(stays(overlapping.scene()));
    SceneBuilder ball;
    ball.floor(diffuse(white), 0.0, 4.0);
    ball.sphere(glass(1.5), {0, 1, 0}, 1.0);
    CHECK(stays(ball.scene()));
}

TEST_CASE("of two dielectrics the later one gives way, or the one within") {
    SceneBuilder stacked;
    stacked.cuboid(glass(1.5), {-1, 0, -1}, {1, 1, 1});
    stacked.cuboid(glass(1.33), {-1, 1, -1}, {1, 2, 1});
    const std::optional<Scene> apart = with_contacts_apart(stacked.scene());
    REQUIRE(apart.has_value());
    CHECK(lowest(*apart, 0, {0, -1, 0}) == -1.0);
    CHECK(lowest(*apart, 1) > 1.0 + 0x1p-16);

    SceneBuilder flush;  // the first lies within the second, flush with its lower face
    flush.cuboid(glass(1.33), {-0.5, 0, -0.5}, {0.5, 0.5, 0.5});
    flush.cuboid(glass(1.5), {-1, 0, -1}, {1, 1, 1});
    const std::optional<Scene> within = with_contacts_apart(flush.scene());
    REQUIRE(within.has_value());
    CHECK(lowest(*within, 0) > 0x1p-17);
    CHECK(lowest(*within, 1) == 0.0);
}

TEST_CASE("a block that fits between two walls is drawn back from both, and a thin pane keeps half its thickness") {
    SceneBuilder fit;
    fit.cuboid(diffuse(white), {-2, -1, -2}, {2, 0, 2});
    fit.cuboid(diffuse(white), {-2, 1, -2}, {2, 2, 2});
    fit.triangle_box(glass(1.5), {-1, 0, -1}, {1, 1, 1});
    const std::optional<Scene> apart = with_contacts_apart(fit.scene());
    REQUIRE(apart.has_value());
    CHECK(lowest(*apart, 2) > 0.0);
    CHECK(lowest(*apart, 2, {0, -1, 0}) > -1.0);

    SceneBuilder pane;
    pane.cuboid(diffuse(white), {-2, -1, -2}, {2, 0, 2});
    pane.cuboid(diffuse(white), {-2, 1e-6, -2}, {2, 2, 2});
    pane.cuboid(glass(1.5), {-1, 0, -1}, {1, 1e-6, 1});
    const std::optional<Scene> thin = with_contacts_apart(pane.scene());
    REQUIRE(thin.has_value());
    CHECK(lowest(*thin, 2) == doctest::Approx(0.25e-6));
    CHECK(lowest(*thin, 2, {0, -1, 0}) == doctest::Approx(-0.75e-6));
}

TEST_CASE("instances that share primitives are drawn apart each by itself") {
    SceneBuilder builder;
    builder.floor(diffuse(white), 0.0, 9.0);
    builder.cuboid(glass(1.5), {-1, 0, -1}, {1, 2, 1});
    Scene scene = builder.scene();
    Entity copy = scene.entities[1];
    copy.object_to_world = moved({5.0, 0.5, 0.0});  // above the floor
    scene.entities.push_back(copy);
    const std::optional<Scene> apart = with_contacts_apart(scene);
    REQUIRE(apart.has_value());
    CHECK(lowest(*apart, 1) > 0.0);
    CHECK(lowest(*apart, 2) == 0.5);
}

TEST_CASE("meshes that are drawn apart keep their vertex normals") {
    Scene scene = block_on_floor(glass(1.5), true);
    for (const dvec3& vertex : scene.vertices) scene.normals.push_back(glm::normalize(vertex + dvec3(0.0, 9.0, 0.0)));
    const std::optional<Scene> apart = with_contacts_apart(scene);
    REQUIRE(apart.has_value());
    REQUIRE(apart->normals.size() == apart->vertices.size());
    for (std::uint32_t i = 0; i < scene.entities[1].primitive_count; ++i)
        for (std::size_t k = 0; k < 3; ++k) {
            const Primitive& before = scene.primitives[scene.entities[1].first_primitive + i];
            const Primitive& after = apart->primitives[apart->entities[1].first_primitive + i];
            CHECK(apart->normals[after.index[k]] == scene.normals[before.index[k]]);
        }
}

TEST_CASE("no shipped scene has contacts, but for hard cases of them") {
    for (const char* name : {"cornell-classic.json", "cornell-thesis.json", "glass.json", "nested-glass.json",
             "one-weekend.json", "next-week.json", "caustics.json", "boundaries.json", "whitted.json", "lights.json"}) {
        CAPTURE(name);
        const Scene scene = load_scene(std::filesystem::path(TANDEM_SOURCE_DIR) / "scenes" / name);
        CHECK_FALSE(with_contacts_apart(scene).has_value());
    }
    const Scene touching =
        load_scene(std::filesystem::path(TANDEM_SOURCE_DIR) / "scenes/hard/glass-touching-cuboids.json");
    CHECK(with_contacts_apart(touching).has_value());
}
