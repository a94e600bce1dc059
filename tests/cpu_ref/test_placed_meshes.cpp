// Meshes kept once for all that place them, against the same scenes with every triangle in the world: the same bits.
#include <doctest/doctest.h>

#include "common/render/path_trace.h"
#include "cpu_ref/path_tracer/geometry/accelerator.h"
#include "cpu_ref/path_tracer/memory.h"
#include "tests/cpu_ref/renders.h"
#include "tests/placed_mesh.h"

using namespace tandem;
using namespace tandem::cpu;
using namespace tandem::test;

namespace {

// Every ray against every triangle in the world, unless `instancing` says otherwise.
template <class Real>
std::vector<RayHit> hits_of(const Scene& scene, const std::vector<GivenRay>& rays, Instancing instancing) {
    using V = Lanes<Real>;
    using U = UnsignedOf<Real>;
    const embree::Device device(rtcNewDevice(nullptr));
    const Tables<Real> tables = make_tables<Real>(scene, with_instancing({}, instancing));
    const Accelerator<Real> accelerator(device.get(), tables, std::size_t{1} << 20);
    const auto lanes = [](const dvec3& a) {
        return Vec3<V>{V(static_cast<Real>(a.x)), V(static_cast<Real>(a.y)), V(static_cast<Real>(a.z))};
    };
    const auto first = [](const Vec3<V>& a) {
        return dvec3(static_cast<double>(a.x[0]), static_cast<double>(a.y[0]), static_cast<double>(a.z[0]));
    };
    std::vector<RayHit> hits;
    for (const GivenRay& given : rays) {
        const Ray<V> ray = make_ray(lanes(given.origin), lanes(given.direction), V(Real(0)), V(tables.limit));
        const std::uint32_t left = tables.meshes ? tables.meshes->slot_of(given.left_primitive) : given.left_primitive;
        const Hit<Real> hit = accelerator.closest(
            ray, {Ints<Real>(U{left}), Mask<Real>::from_bits(given.inside ? 1u : 0u)}, Mask<Real>::from_bits(1u));
        const bool blocked =
            any(accelerator.occluded(ray, {Ints<Real>(U{left}), Mask<Real>::from_bits(given.inside ? 1u : 0u)},
                Ints<Real>(U{no_primitive}), Mask<Real>::from_bits(1u)));
        CHECK(blocked == any(hit.found));
        RayHit& found = hits.emplace_back();
        if (none(hit.found)) continue;
        const Surface<Real> surface = surface_at(tables, ray, hit);
        found = {static_cast<double>(hit.t[0]), id_of(tables, static_cast<std::uint32_t>(surface.primitive[0])),
            first(surface.point), first(surface.normal), first(leaving_origin(tables, surface, surface.normal)),
            first(leaving_origin(tables, surface, -surface.normal))};
    }
    return hits;
}

template <class Real>
void check_same_hits(const Scene& scene, const std::vector<GivenRay>& rays) {
    const std::vector<RayHit> kept = hits_of<Real>(scene, rays, Instancing::always);
    CHECK(count_different(kept, hits_of<Real>(scene, rays, Instancing::never)) == 0);
    CHECK(std::ranges::count(kept, no_index, &RayHit::primitive) < static_cast<std::ptrdiff_t>(rays.size()) / 2);
    const std::vector<GivenRay> next = leaving(kept);
    CHECK(count_different(
              hits_of<Real>(scene, next, Instancing::always), hits_of<Real>(scene, next, Instancing::never)) == 0);
}

void check_same_renders(const Scene& scene, const RenderSettings& settings, std::uint64_t samples = 16) {
    for (const Precision precision : {Precision::single_precision, Precision::double_precision, Precision::mixed}) {
        CAPTURE(static_cast<int>(precision));
        const Estimate kept = renders::render(scene, with_instancing(settings, Instancing::always), samples, precision),
                       placed =
                           renders::render(scene, with_instancing(settings, Instancing::never), samples, precision);
        CHECK(renders::same_bits(kept, placed));
        CHECK(renders::pooled(kept).mean > 0.05);
    }
}

}  // namespace

TEST_CASE("rays find the same bits on meshes under turns, mirrors, shears and scales as on triangles in the world") {
    const Scene scene = scene_of_places(diffuse(dvec3(0.5)));
    REQUIRE(placed_meshes(scene, with_instancing({}, Instancing::always)).any());
    const std::vector<GivenRay> rays = rays_at_places(scene, 200);
    check_same_hits<float>(scene, rays);
    check_same_hits<double>(scene, rays);
}

TEST_CASE("images of placed meshes have the bits of the same triangles in the world, with shadows and mirrors") {
    check_same_renders(scene_of_places(diffuse(dvec3(0.5))), renders::settings(24, Integrator::next_event, 4));
    check_same_renders(scene_of_places(mirror(dvec3(0.9))), renders::settings(24, Integrator::path, 6));
}

TEST_CASE("images of placed meshes have the same bits whatever the quality of hierarchies") {
    const Scene scene = scene_of_places(diffuse(dvec3(0.5)));
    RenderSettings settings = with_instancing(renders::settings(24, Integrator::next_event, 4), Instancing::always);
    for (const Precision precision : {Precision::single_precision, Precision::double_precision}) {
        settings.hierarchy = HierarchyQuality::high;
        const Estimate high = renders::render(scene, settings, 16, precision);
        for (const HierarchyQuality quality : {HierarchyQuality::medium, HierarchyQuality::low}) {
            settings.hierarchy = quality;
            CHECK(renders::same_bits(high, renders::render(scene, settings, 16, precision)));
        }
    }
}

TEST_CASE("textures and vertex normals on placed meshes have the bits of the same triangles in the world") {
    Scene scene = scene_of_places(diffuse(dvec3(0.5)));
    for (const TextureSpace space : {TextureSpace::object, TextureSpace::coordinates}) {
        Texture& texture = scene.textures.emplace_back();
        texture.name = "checks";
        texture.space = space;
        texture.frequency = dvec3(3.1, 4.3, space == TextureSpace::object ? 2.7 : 0.0);
    }
    for (std::uint32_t e = 2; e + 1 < scene.entities.size(); ++e) {
        Material& material = scene.materials[scene.entities[e].material];
        if (material.radiance == dvec3(0.0)) material.colour_texture = e % 2;
    }
    check_same_renders(scene, renders::settings(24, Integrator::next_event, 3));
}

TEST_CASE("places stand still among entities that move") {
    Scene scene = scene_of_places(diffuse(dvec3(0.5)));
    scene.entities[1].motion = {0.5, 0.1, 0.0};
    scene.entities[3].motion = {0.0, 0.4, 0.0};  // one that would else place the mesh
    check_same_renders(scene, renders::settings(24, Integrator::next_event, 3));
}

TEST_CASE("paths are told by primitive ids, whatever keeps their triangles") {
    const Scene scene = scene_of_places(diffuse(dvec3(0.5)));
    const auto traced = [&](Instancing instancing) {
        const auto job = cpu_backend().create({})->prepare(
            scene, with_instancing(renders::settings(8, Integrator::next_event, 3), instancing));
        std::vector<std::uint32_t> primitives;
        for (std::uint32_t y = 0; y < 8; ++y)
            for (const PathTrace& path : job->trace(y, y, {0, 8}))
                for (const TracedVertex& vertex : path.vertices) primitives.push_back(vertex.primitive);
        return primitives;
    };
    CHECK(traced(Instancing::always) == traced(Instancing::never));
}

TEST_CASE("the forecast counts a mesh once, and a hundred million placed triangles stay below a gibibyte") {
    Scene scene = scene_of_places(diffuse(dvec3(0.5)), 160);  // 101 760 triangles
    const Entity place = scene.entities[2];
    for (int i = 0; i < 1000; ++i) scene.entities.push_back(place);
    const auto total = [&](Instancing instancing) {
        const MemoryForecast forecast =
            cpu::memory_forecast(scene, with_instancing({}, instancing), Precision::single_precision, 1);
        return forecast.tables + forecast.trees + forecast.building;
    };
    REQUIRE(placed_primitives(scene).size() > 100'000'000);
    CHECK(total(Instancing::automatic) < std::uint64_t{1} << 30);
    CHECK(total(Instancing::never) > std::uint64_t{30} << 30);
}
