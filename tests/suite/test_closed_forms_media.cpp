// Closed forms of participating media: transmittance, single scattering by quadrature, conservation of energy, grids.
#include <numbers>

#include "tests/suite/effects.h"

using namespace tandem;
using namespace tandem::test;

namespace {

constexpr double pi = std::numbers::pi;
const dvec3 red(1.0, 0.0, 0.0), green(0.0, 1.0, 0.0), sky(1.0, 2.0, 4.0);
const dvec3 absorbing(0.2, 0.7, 1.5);

// Looks at `aim` from `angle` off +y.
SceneBuilder looking_down(double angle, double distance) {
    return SceneBuilder().camera(
        aim + distance * dvec3(std::sin(angle), std::cos(angle), 0.0), aim, narrow_field, {0.0, 0.0, 1.0});
}

dvec3 transmitted(const dvec3& sigma, double length) { return glm::exp(-sigma * length); }

double phase(double g, double mu) { return (1.0 - g * g) / (4.0 * pi * std::pow(1.0 + g * g - 2.0 * g * mu, 1.5)); }

// A wall that reflects and emits nothing.
Material wall() { return emitter(black); }

// Cells whose densities all differ, and two that are empty.
Medium grid_medium(const dvec3& absorption, const dvec3& scattering) {
    DensityGrid grid{{3, 2, 4}, {-1.5, -0.5, -1.0}, {1.2, 0.4, 1.1}, {}};
    for (int i = 0; i < 24; ++i) grid.density.push_back(i % 11 == 5 ? 0.0F : static_cast<float>((i * 7) % 13) * 0.25F);
    Medium medium = medium_of(absorption, scattering);
    medium.grid = std::make_shared<const DensityGrid>(std::move(grid));
    return medium;
}

// Sum over all cells of density times the length of the line within, each cell clipped on its own.
double optical_length(const DensityGrid& grid, const dvec3& origin, const dvec3& direction) {
    double sum = 0.0;
    for (std::uint32_t cell = 0; cell < grid.density.size(); ++cell) {
        const glm::uvec3 index(cell % grid.cells[0], cell / grid.cells[0] % grid.cells[1],
            cell / (std::size_t{grid.cells[0]} * grid.cells[1]));
        double begin = 0.0, end = 1e9;
        for (int axis = 0; axis < 3; ++axis) {
            const double size = (grid.high[axis] - grid.low[axis]) / grid.cells[static_cast<std::size_t>(axis)];
            const double low = grid.low[axis] + index[axis] * size;
            const double a = (low - origin[axis]) / direction[axis], b = a + size / direction[axis];
            begin = std::max(begin, std::min(a, b));
            end = std::min(end, std::max(a, b));
        }
        sum += static_cast<double>(grid.density[cell]) * std::max(0.0, end - begin);
    }
    return sum;
}

}  // namespace

TEST_CASE("a slab of an absorbing medium transmits exp(-sigma d / cos)") {
    auto& all = tracers();
    const double angle = 0.6, depth = 0.8;
    const dvec3 lo(-4.0, -0.3 - depth, -4.0), hi(4.0, -0.3, 4.0);
    const auto view = [&] { return looking_down(angle, 3.0).background(sky); };
    const dvec3 expected = sky * transmitted(absorbing, depth / std::cos(angle));
    for (const Scene& scene :
        {view().cuboid(boundary(), lo, hi).scene(), view().triangle_box(boundary(), lo, hi).scene(),
            view().sphere(boundary(), aim, 0.5 * depth / std::cos(angle)).scene()})
        check_every_pixel(all, with_medium(scene, medium_of(absorbing, black)), settings_of(4, 4), 64, expected,
            512.0);  // 43 u of the corners' 4 moves an oracle's ray off a triangle: 313 u at 1.5 / cos(angle) a unit
}

TEST_CASE("a medium around everything attenuates what the camera sees, and lets no infinitely far light through") {
    auto& all = tracers();
    const Medium medium = medium_of({0.5, 1.0, 0.0}, black);
    const Scene lamp = looking_down(0.0, 2.0).floor(emitter(sky), 0.0, 5.0).scene();
    check_every_pixel(
        all, filled_with(lamp, medium), settings_of(4, 2), 64, sky * transmitted(medium.absorption, 2.0), 64.0);
    const Scene nothing = looking_down(0.0, 2.0).background(sky).scene();
    check_every_pixel(all, filled_with(nothing, medium), settings_of(4, 2), 64, {0.0, 0.0, sky.z}, 4.0);
}

TEST_CASE("what a scattering medium lets pass unscattered is exp(-sigma_t d)") {
    auto& all = tracers();
    const Medium medium = medium_of({0.1, 0.0, 0.3}, {0.4, 0.9, 0.0}, 0.5);
    const dvec3 extinction = medium.absorption + medium.scattering;
    const Scene lamp = looking_down(0.3, 1.7).floor(emitter(sky), 0.0, 5.0).scene();
    check_mean(all, filled_with(lamp, medium), settings_of(8, 0), 512, sky * transmitted(extinction, 1.7), 64.0);
}

TEST_CASE("a ball of a medium under the sky shows the integral of its single scattering") {
    // Through the middle of the ball, from above; the sky is red below and green above, linear in height.
    auto& all = tracers();
    const double radius = 0.9;
    for (const double g : {0.0, 0.7, -0.4}) {
        CAPTURE(g);
        const dvec3 absorption(0.05, 0.2, 0.4), scattering(0.3, 0.6, 0.1), extinction = absorption + scattering;
        const dvec3 scattered = mean_over_square(
            [&](double u, double v) {
                const double t = 2.0 * radius * u, x = t - radius, mu = 2.0 * v - 1.0;  // mu to the direction -y
                const double out = -x * mu + std::sqrt(radius * radius - x * x * (1.0 - mu * mu));
                const dvec3 light = 0.5 * (1.0 + mu) * red + 0.5 * (1.0 - mu) * green;
                return 2.0 * radius * 2.0 * 2.0 * pi * phase(g, mu) * light * scattering *
                       transmitted(extinction, t + out);
            },
            1000);
        const dvec3 expected = red * transmitted(extinction, 2.0 * radius) + scattered;
        const Scene scene = looking_down(0.0, 3.0).background(red, green).sphere(boundary(), aim, radius).scene();
        check_mean(
            all, with_medium(scene, medium_of(absorption, scattering, g)), settings_of(16, 3), 512, expected, 64.0);
    }
}

TEST_CASE("a medium that absorbs nothing is invisible under an even sky") {
    auto& all = tracers();
    for (const double g : {0.0, 0.8, -0.5}) {
        CAPTURE(g);
        const Medium medium = medium_of(black, dvec3(1.0), g);
        const auto view = [] { return SceneBuilder().camera({0.0, 0.5, 3.0}, black, 40.0).background(white); };
        check_every_pixel(all, with_medium(view().sphere(boundary(), black, 0.6).scene(), medium), settings_of(8, 120),
            64, white, 512.0);
        const Scene turned = view().cuboid(boundary(), dvec3(-0.5), dvec3(0.5), rotated(40.0, {1.0, 2.0, 3.0})).scene();
        check_every_pixel(all, with_medium(turned, medium), settings_of(8, 120), 64, white, 512.0);
    }
}

TEST_CASE("a medium that absorbs nothing and scatters each colour apart keeps the mean of an even sky") {
    auto& all = tracers();
    const Scene scene =
        SceneBuilder().camera({0.0, 0.5, 3.0}, black, 30.0).background(white).sphere(boundary(), black, 0.7).scene();
    check_mean(all, with_medium(scene, medium_of(black, {0.4, 0.9, 1.3}, 0.6)), settings_of(8, 100), 256, white, 512.0);
}

TEST_CASE("a grid of densities transmits by its optical length, absorbing and scattering") {
    auto& all = tracers();
    for (const dvec3& scattering : {black, dvec3(0.2, 0.1, 0.4)}) {
        CAPTURE(scattering.x);
        const Medium medium = grid_medium({0.3, 0.8, 0.1}, scattering);
        const dvec3 extinction = medium.absorption + medium.scattering;
        const dvec3 views[][2] = {{{2.5, 0.9, -2.1}, {-0.1, 0.05, 0.1}}, {{0.3, 3.0, 0.2}, {0.31, 0.0, 0.23}},
            {{-0.2, 0.1, 0.2}, {1.0, 0.2, 1.4}}};  // the last begins within
        for (const auto& [position, target] : views) {
            CAPTURE(position.x);
            const Scene scene =
                SceneBuilder().camera(position, target, narrow_field, {0.1, 1.0, 0.3}).background(sky).scene();
            const double length = optical_length(*medium.grid, position, glm::normalize(target - position));
            REQUIRE(length > 0.1);
            check_mean(
                all, filled_with(scene, medium), settings_of(8, 0), 256, sky * transmitted(extinction, length), 256.0);
        }
    }
}

TEST_CASE("a grid that absorbs nothing is invisible under an even sky") {
    auto& all = tracers();
    const Scene scene = SceneBuilder().camera({0.0, 0.5, 3.0}, black, 40.0).background(white).scene();
    check_every_pixel(all, filled_with(scene, grid_medium(black, dvec3(1.0))), settings_of(8, 100), 64, white, 512.0);
    const Scene body =
        SceneBuilder().camera({0.0, 0.5, 3.0}, black, 40.0).background(white).sphere(boundary(), black, 1.0).scene();
    check_every_pixel(all, with_medium(body, grid_medium(black, dvec3(1.0))), settings_of(8, 100), 64, white, 512.0);
}

TEST_CASE("a point light in a medium shows the integral of its single scattering") {
    // Along the camera's ray to a black wall, 2 away; the light stands beside it.
    auto& all = tracers();
    const dvec3 lamp(0.5, 0.8, 0.1), intensity(3.0, 2.0, 1.0);
    for (const double g : {0.0, 0.6}) {
        CAPTURE(g);
        const Medium medium = medium_of({0.1, 0.3, 0.2}, {0.4, 0.2, 0.7}, g);
        const dvec3 extinction = medium.absorption + medium.scattering;
        dvec3 expected(0.0);
        constexpr int steps = 20000;
        for (int i = 0; i < steps; ++i) {
            const double t = 2.0 * (i + 0.5) / steps;
            const dvec3 way = lamp - dvec3(0.0, 2.0 - t, 0.0);
            const double r = glm::length(way);
            expected += (2.0 / steps) * phase(g, -way.y / r) * medium.scattering * intensity / (r * r) *
                        transmitted(extinction, t + r);
        }
        const Scene scene = with_light(filled_with(looking_down(0.0, 2.0).floor(wall(), 0.0, 5.0).scene(), medium),
            point_light(aim + lamp, intensity));
        check_mean(all, scene, settings_of(16, 1, Integrator::next_event), 256, expected, 64.0);
    }
}

TEST_CASE("a floor in an absorbing medium sees a point light through it") {
    auto& all = tracers();
    const dvec3 lamp(0.5, 0.8, 0.1), intensity(3.0, 2.0, 1.0), colour(0.6, 0.3, 0.9);
    const double r = glm::length(lamp);
    const Scene scene = with_light(
        filled_with(looking_down(0.4, 2.0).floor(diffuse(colour), 0.0, 5.0).scene(), medium_of(absorbing, black)),
        point_light(aim + lamp, intensity));
    check_every_pixel(all, scene, settings_of(4, 1, Integrator::next_event), 64,
        colour / pi * intensity * (lamp.y / (r * r * r)) * transmitted(absorbing, 2.0 + r), 64.0);
}

TEST_CASE("light sampling keeps the mean of a medium lit by a lamp") {
    // A lamp in fog above a floor: path and next_event have one mean, which the oracle's path gives.
    const Scene scene = filled_with(SceneBuilder()
                                        .camera({0.0, 1.0, 3.0}, {0.0, 0.5, 0.0}, 40.0)
                                        .floor(diffuse({0.6, 0.4, 0.2}), 0.0, 3.0)
                                        .sphere(emitter(dvec3(4.0)), {0.0, 1.3, 0.0}, 0.4)
                                        .scene(),
        medium_of({0.1, 0.05, 0.0}, {0.3, 0.2, 0.4}, 0.4));
    Tracer oracle{"oracle", oracle_backend().create({}), 0x1p-53, false};
    const Measured reference = pooled(render(oracle, scene, settings_of(16, 3, Integrator::path, 77), 2048));
    auto& all = tracers();
    for (Tracer& tracer : all) {
        if (!tracer.samples_lights) continue;
        CAPTURE(tracer.name);
        const auto estimate = try_render(tracer, scene, settings_of(16, 3, Integrator::next_event), 512);
        if (!estimate) continue;
        const Measured measured = pooled(*estimate);
        for (int i = 0; i < 3; ++i) {
            CAPTURE(measured.mean[i]);
            CAPTURE(reference.mean[i]);
            CHECK(std::abs(measured.mean[i] - reference.mean[i]) <=
                  sigmas * std::hypot(measured.standard_error[i], reference.standard_error[i]));
        }
    }
}

TEST_CASE("a slab of absorbing glass obeys Beer and Lambert between its surfaces") {
    auto& all = tracers();
    const double r = 0.04, depth = 0.7;
    Material body = glass(1.5);
    body.interior = 0;
    const dvec3 inner = transmitted(absorbing, depth);
    const dvec3 through = (1.0 - r) * (1.0 - r) * inner / (1.0 - r * r * inner * inner);
    const dvec3 back = r + (1.0 - r) * (1.0 - r) * r * inner * inner / (1.0 - r * r * inner * inner);
    const Scene slab = looking_down(0.0, 3.0)
                           .background({1.0, 1.0, 1.0}, {3.0, 3.0, 3.0})
                           .cuboid(body, {-20.0, -depth, -20.0}, {20.0, 0.0, 20.0})
                           .scene();
    check_mean(
        all, with_medium(slab, medium_of(absorbing, black)), settings_of(16, 40), 256, through + 3.0 * back, 64.0);
}
