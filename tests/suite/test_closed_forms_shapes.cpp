// Closed forms of primitives and transforms: normals through the inverse transpose, boxes against their triangles,
// ties.
#include "tests/suite/tracers.h"

using namespace tandem;
using namespace tandem::test;

namespace {

const dvec3 down(0.2, 3.0, 1.0), up(2.0, 0.5, 1.0), colour(0.3, 0.6, 0.9);

dvec3 sky(const dvec3& direction) { return glm::mix(down, up, 0.5 * (direction.y + 1.0)); }

// A sky linear in height lights a Lambertian surface as its value two thirds along the normal would.
dvec3 lit_by_sky(const dvec3& normal) { return colour * (0.5 * (down + up) + (up - down) / 3.0 * normal.y); }

const dmat4 placements[] = {moved({5.0, -2.0, 1.0}), rotated(40.0, {1.0, 2.0, -1.0}) * scaled({1.0, 3.0, 0.5}),
    rotated(-70.0, {0.0, 1.0, 1.0}) * scaled({-1.0, 2.0, 1.0}) * rotated(30.0, {1.0, 0.0, 0.0})};

struct Spot {
    dvec3 object_point, object_normal;
};
const Spot on_sphere[] = {{{0.6, 0.8, 0.0}, {0.6, 0.8, 0.0}}, {{0.48, -0.36, 0.8}, {0.48, -0.36, 0.8}}};
const Spot on_cuboid[] = {
    {{1.0, 0.2, -0.3}, {1.0, 0.0, 0.0}}, {{0.1, -1.0, 0.4}, {0.0, -1.0, 0.0}}, {{0.1, 0.4, 1.0}, {0.0, 0.0, 1.0}}};

// Looks from outside at a spot of a placed body, off its normal, through a field so small that the spot is one point.
// Returns the world normal and the direction of view.
std::pair<dvec3, dvec3> look_at(SceneBuilder& builder, const dmat4& placed, const Spot& spot) {
    const dvec3 point(placed * glm::dvec4(spot.object_point, 1.0));
    const dvec3 normal = glm::normalize(glm::transpose(glm::inverse(glm::dmat3(placed))) * spot.object_normal);
    const dvec3 aside = glm::normalize(glm::cross(normal, dvec3(0.31, 0.52, 0.79)));
    const dvec3 direction = -glm::normalize(normal + 0.6 * aside);
    builder.camera(point - 4.0 * direction, point, 1e-4, {0.1, 0.99, 0.2}).background(down, up);
    return {normal, direction};
}

void check_spots(
    const std::function<void(SceneBuilder&, const dmat4&)>& add_body, std::span<const Spot> spots, bool reflecting) {
    auto& all = tracers();
    for (const dmat4& placed : placements) {
        for (const Spot& spot : spots) {
            CAPTURE(&placed - placements);
            CAPTURE(spot.object_point.x);
            SceneBuilder builder;
            const auto [normal, direction] = look_at(builder, placed, spot);
            add_body(builder, placed);
            if (reflecting) {
                // Noise is that of the tiny field. The hit lies some 16 roundings of coordinates up to 8 off. That
                // moves the normal by a relative 6 (the widest ratio of axes) times that on a unit sphere.
                const dvec3 expected = colour * sky(glm::reflect(direction, normal));
                check_mean(all, builder.scene(), settings_of(8, 1), 64, expected, 16.0 * 8.0 * 6.0);
            } else {
                check_mean(all, builder.scene(), settings_of(16, 1), 256, lit_by_sky(normal), 1000.0);
            }
        }
    }
}

}  // namespace

TEST_CASE("a diffuse body under any transform has the normals of the inverse transpose") {
    check_spots(
        [](SceneBuilder& b, const dmat4& placed) { b.sphere(diffuse(colour), black, 1.0, placed); }, on_sphere, false);
    check_spots(
        [](SceneBuilder& b, const dmat4& placed) { b.cuboid(diffuse(colour), dvec3(-1.0), dvec3(1.0), placed); },
        on_cuboid, false);
}

TEST_CASE("a mirror under any transform reflects about the normals of the inverse transpose") {
    check_spots(
        [](SceneBuilder& b, const dmat4& placed) { b.sphere(mirror(colour), black, 1.0, placed); }, on_sphere, true);
    check_spots([](SceneBuilder& b, const dmat4& placed) { b.cuboid(mirror(colour), dvec3(-1.0), dvec3(1.0), placed); },
        on_cuboid, true);
    check_spots(
        [](SceneBuilder& b, const dmat4& placed) { b.triangle_box(mirror(colour), dvec3(-1.0), dvec3(1.0), placed); },
        on_cuboid, true);
}

TEST_CASE("a mirror is one on both sides") {
    auto& all = tracers();
    const Spot spot{{0.1, 0.2, 0.0}, {0.0, 0.0, 1.0}};
    for (const bool reversed : {false, true}) {
        CAPTURE(reversed);
        SceneBuilder builder;
        const auto [normal, direction] = look_at(builder, dmat4(1.0), spot);
        const dvec3 a(-9.0, -9.0, 0.0), b(9.0, -9.0, 0.0), c(0.0, 9.0, 0.0);
        builder.triangle(mirror(colour), a, reversed ? c : b, reversed ? b : c);
        check_mean(all, builder.scene(), settings_of(8, 1), 64, colour * sky(glm::reflect(direction, normal)), 64.0);
    }
}

TEST_CASE("an oriented box looks like its twelve triangles") {
    auto& all = tracers();
    const auto view = [] { return SceneBuilder().camera({3.0, 4.0, 6.0}, black, 40.0).background(down, up); };
    const Material materials[] = {diffuse(colour), mirror(colour, 0.4), glass(1.5, Fresnel::exact, 0.6, colour)};
    for (const Material& material : materials) {
        const Scene box = view().cuboid(material, {-1.0, -0.5, -0.8}, {0.7, 0.9, 1.0}, placements[1]).scene();
        const Scene triangles =
            view().triangle_box(material, {-1.0, -0.5, -0.8}, {0.7, 0.9, 1.0}, placements[1]).scene();
        for (Tracer& tracer : all) {
            CAPTURE(&material - materials);
            CAPTURE(tracer.name);
            constexpr std::uint64_t samples = 128;
            const Estimate one = render(tracer, box, settings_of(16, 8, Integrator::path, 1), samples);
            const Estimate other = render(tracer, triangles, settings_of(16, 8, Integrator::path, 2), samples);
            const std::vector<double> mean1 = mean_of(one), mean2 = mean_of(other);
            const std::vector<double> variance1 = variance_of(one), variance2 = variance_of(other);
            for (std::size_t quarter = 0; quarter < 4; ++quarter) {
                double difference = 0.0, variance = 0.0;
                for (std::size_t i = 0; i < 64; ++i) {
                    const std::size_t x = 8 * (quarter % 2) + i % 8, y = 8 * (quarter / 2) + i / 8,
                                      at = 3 * (16 * y + x);
                    difference += mean1[at] - mean2[at];
                    variance += (variance1[at] + variance2[at]) / static_cast<double>(samples);
                }
                CAPTURE(quarter);
                CHECK(variance > 0.0);
                CHECK(std::abs(difference) <= sigmas * std::sqrt(variance));
            }
        }
    }
}

TEST_CASE("of coincident primitives of one kind the lower id is hit") {
    auto& all = tracers();
    const dvec3 first(1.0, 2.0, 3.0), second(7.0, 7.0, 7.0);
    const dvec3 a(-9.0, -9.0, -1.0), b(9.0, -9.0, -1.0), c(0.0, 9.0, -1.0);
    const auto view = [] { return SceneBuilder().camera({0.1, 0.2, 3.0}, black, 5.0); };
    const Scene scenes[] = {view().triangle(emitter(first), a, b, c).triangle(emitter(second), a, b, c).scene(),
        view().sphere(emitter(first), black, 1.0).sphere(emitter(second), black, 1.0).scene(),
        view()
            .cuboid(emitter(first), dvec3(-1.0), dvec3(1.0))
            .cuboid(emitter(second), dvec3(-1.0), dvec3(1.0))
            .scene()};
    for (const Scene& scene : scenes) {
        CAPTURE(&scene - scenes);
        check_every_pixel(all, scene, settings_of(16, 1), 64, first, 2.0);
    }
}

TEST_CASE("a triangle without area and the plane seen edge on are not hit") {
    auto& all = tracers();
    const Scene scene = SceneBuilder()
                            .camera({0.0, 0.0, 3.0}, black, 30.0)
                            .background(white)
                            .triangle(emitter(up), {-1.0, 0.0, 0.0}, {1.0, 0.0, 0.0}, {0.0, 0.0, 0.0})
                            .triangle(emitter(up), {0.3, 0.2, 0.0}, {0.3, 0.2, 0.0}, {0.3, 0.2, 0.0})
                            .scene();
    check_every_pixel(all, scene, settings_of(16, 1), 64, white, 0.0);
}
