// What kernels with unrolled loops are told of a scene's primitives.
#include <doctest/doctest.h>

#include <bit>
#include <filesystem>

#include "common/scene/loader/scene_loader.h"
#include "vulkan/renderer/kernels/unrolled_primitives.h"

namespace tandem {

TEST_CASE("The thesis's box has seven cuboids square to the axes, and twelve triangles of eight corners") {
    const Scene scene = load_scene(std::filesystem::path(TANDEM_SOURCE_DIR) / "scenes" / "cornell-thesis.json");
    const SceneData data = flatten(scene, default_settings(scene), Acceleration::automatic);
    REQUIRE(data.cuboid_count == 7);
    REQUIRE(data.triangle_count == 12);
    const UnrolledPrimitives told = describe_unrolled(data);
    CHECK(std::popcount(told.aligned_cuboids) == 7);
    int distinct = 0;
    for (std::uint32_t corner = 0; corner < 36; ++corner) {
        const std::uint32_t first = told.corners[corner / 3] >> 8 * (corner % 3) & 255u;
        REQUIRE(first <= corner);
        if (first == corner) ++distinct;
        const auto vertex = [&](std::uint32_t c) {
            const gpu::PrimitiveSource& source = data.sources[c / 3];
            return data.vertices[c % 3 == 0 ? source.index0 : c % 3 == 1 ? source.index1 : source.index2];
        };
        CHECK(vertex(first).x == vertex(corner).x);
        CHECK(vertex(first).y == vertex(corner).y);
        CHECK(vertex(first).z == vertex(corner).z);
    }
    CHECK(distinct == 8);
}

TEST_CASE("Scenes are unturned where no sphere or cuboid is rotated, however their triangles are") {
    const auto unturned = [](const char* name) {
        const Scene scene = load_scene(std::filesystem::path(TANDEM_SOURCE_DIR) / "scenes" / name);
        return is_unturned(flatten(scene, default_settings(scene), Acceleration::automatic));
    };
    CHECK(unturned("cornell-thesis.json"));
    CHECK(unturned("one-weekend.json"));
    CHECK_FALSE(unturned("cornell-classic.json"));
}

}  // namespace tandem
