// Closed forms of conductors and of rough glass: Fresnel's reflectance by complex numbers, white furnaces by quadrature
// over the distribution of normals.
#include <complex>
#include <numbers>

#include "tests/suite/effects.h"

using namespace tandem;
using namespace tandem::test;

namespace {

constexpr double pi = std::numbers::pi;
const dvec3 gold_eta(0.143, 0.375, 1.442), gold_k(3.983, 2.386, 1.603);

// Looks at the point `aim` of the plane y = 0 from `angle` off its normal.
SceneBuilder looking_down(double angle) {
    return SceneBuilder().camera(
        aim + 3.0 * dvec3(std::sin(angle), std::cos(angle), 0.0), aim, narrow_field, {0.0, 0.0, 1.0});
}

double conductor_reflectance(std::complex<double> n, double cosine) {
    const std::complex<double> inner = std::sqrt(n * n - (1.0 - cosine * cosine));  // n cos of the angle within
    return 0.5 * (std::norm((cosine - inner) / (cosine + inner)) +
                     std::norm((n * n * cosine - inner) / (n * n * cosine + inner)));
}

dvec3 gold_reflectance(double cosine) {
    dvec3 result;
    for (int i = 0; i < 3; ++i) result[i] = conductor_reflectance({gold_eta[i], gold_k[i]}, cosine);
    return result;
}

double lambda(double alpha, const dvec3& w) {  // y along the normal
    return 0.5 * (std::sqrt(1.0 + alpha * alpha * (1.0 - w.y * w.y) / (w.y * w.y)) - 1.0);
}

// The mean over visible normals h of what value(h) has, where `to_eye` looks at a surface of normal y. Midpoints in the
// cumulative distribution of D(h) cos h, of which the visible ones have the share G1 (i·h)/(i_y h_y).
dvec3 mean_over_visible_normals(double alpha, const dvec3& to_eye, const std::function<dvec3(const dvec3& h)>& value) {
    return mean_over_square(
        [&](double u, double v) {
            const double cosine = std::sqrt((1.0 - u) / (1.0 + u * (alpha * alpha - 1.0)));
            const double sine = std::sqrt(1.0 - cosine * cosine);
            const dvec3 h(sine * std::cos(2.0 * pi * v), cosine, sine * std::sin(2.0 * pi * v));
            const double facing = glm::dot(to_eye, h);
            if (facing <= 0.0) return black;
            return value(h) * (facing / (to_eye.y * cosine * (1.0 + lambda(alpha, to_eye))));
        },
        1000);
}

// G2/G1.
double shadowing(double alpha, const dvec3& i, const dvec3& o) {
    return (1.0 + lambda(alpha, i)) / (1.0 + lambda(alpha, i) + lambda(alpha, o));
}

dvec3 mix_of_sky(const dvec3& down, const dvec3& up, const dvec3& w) { return glm::mix(down, up, 0.5 * (w.y + 1.0)); }

}  // namespace

TEST_CASE("a smooth conductor reflects by Fresnel's equations for its complex index") {
    auto& all = tracers();
    const dvec3 sky(1.0, 2.0, 4.0);
    for (const double angle : {0.0, 0.7, 1.2, 1.5}) {
        CAPTURE(angle);
        const dvec3 expected = sky * gold_reflectance(std::cos(angle));
        const Material gold = conductor(gold_eta, gold_k);
        for (const Scene& scene : {looking_down(angle).background(sky).floor(gold, 0.0, 50.0).scene(),
                 looking_down(angle).background(sky).sphere(gold, aim - dvec3(0.0, 1.0, 0.0), 1.0).scene(),
                 looking_down(angle).background(sky).cuboid(gold, {-9.0, -1.0, -9.0}, {9.0, 0.0, 9.0}).scene()})
            check_every_pixel(all, scene, settings_of(4, 1), 64, expected, 512.0);
    }
}

// Indices that are floats, so that all precisions have the same. r_s is (1 - N^2)/(c + q)^2, which subtracts no near
// numbers.
TEST_CASE("a conductor of index near 1 reflects next to nothing, by Fresnel's equations") {
    auto& all = tracers();
    const dvec3 eta(1.0, 1.0 + 0x1p-20, 1.0 - 0x1p-13);
    for (const double k : {0.0, 0x1p-13})
        for (const double angle : {0.0, 0.7, 1.2, 1.5}) {
            CAPTURE(k);
            CAPTURE(angle);
            const double c = std::cos(angle), s2 = std::sin(angle) * std::sin(angle);
            dvec3 expected;
            for (int i = 0; i < 3; ++i) {
                const std::complex<double> n(eta[i], k), beyond = (n - 1.0) * (n + 1.0), q = std::sqrt(beyond + c * c);
                expected[i] =
                    0.5 * std::norm(beyond / ((c + q) * (c + q))) * (1.0 + std::norm((c * q - s2) / (c * q + s2)));
            }
            check_every_pixel(all,
                looking_down(angle).background(dvec3(1.0)).floor(conductor(eta, dvec3(k)), 0.0, 50.0).scene(),
                settings_of(4, 1), 64, expected, 512.0);
        }
}

// t of section 7.6 is then within 15 u of 0 at these three indices, and exactly 0 at some of these angles. A t above 0
// transmits at most 4 sqrt(t) (1/c + c/(2 s^2)), at most 1.1 % here in single precision.
TEST_CASE("a conductor without extinction reflects all at its critical angle") {
    auto& all = tracers();
    for (int step = 0; step < 12; ++step) {
        const double angle = 0.6 + 0.05 * step;
        const auto index = static_cast<float>(std::sin(angle));
        const dvec3 eta(std::nextafter(index, 0.0F), index, std::nextafter(index, 1.0F));
        const Scene floor =
            looking_down(angle).background(dvec3(1.0)).floor(conductor(eta, dvec3(0.0)), 0.0, 50.0).scene();
        for (Tracer& tracer : all) {
            CAPTURE(tracer.name);
            CAPTURE(angle);
            const std::optional<Estimate> estimate = try_render(tracer, floor, settings_of(4, 1), 4);
            if (!estimate) continue;
            for (const double mean : mean_of(*estimate)) {
                CHECK(mean > 0.98);
                CHECK(mean < 1.0 + 1e-6);
            }
        }
    }
}

TEST_CASE("a rough conductor keeps of an uneven sky what its normals, masked and shadowed, reflect") {
    auto& all = tracers();
    const dvec3 down(2.0, 0.0, 1.0), up(0.5, 1.0, 2.0);
    const std::pair<double, double> cases[] = {{0.1, 1.2}, {0.5, 0.3}, {0.5, 1.2}, {1.0, 0.3}};
    for (const auto& [roughness, angle] : cases) {
        CAPTURE(roughness);
        CAPTURE(angle);
        const double alpha = roughness * roughness;
        const dvec3 to_eye(std::sin(angle), std::cos(angle), 0.0);
        const dvec3 expected = mean_over_visible_normals(alpha, to_eye, [&](const dvec3& h) {
            const dvec3 o = 2.0 * glm::dot(to_eye, h) * h - to_eye;
            if (o.y <= 0.0) return black;
            return gold_reflectance(glm::dot(to_eye, h)) * shadowing(alpha, to_eye, o) * mix_of_sky(down, up, o);
        });
        Scene scene =
            looking_down(angle).background(down, up).floor(conductor(gold_eta, gold_k, roughness), 0.0, 50.0).scene();
        check_mean(all, scene, settings_of(8, 1), 512, expected, 128.0);
        scene.background.sampled = true;
        check_mean(all, scene, settings_of(8, 1, Integrator::next_event), 512, expected, 128.0);
    }
}

TEST_CASE("a rough conductor lit by a point light shows F D G2/(4 cos) there") {
    auto& all = tracers();
    const dvec3 lamp(-0.6, 1.1, 0.3), intensity(1.0, 2.0, 3.0);
    const double angle = 0.5;
    const dvec3 i(std::sin(angle), std::cos(angle), 0.0), o = glm::normalize(lamp), h = glm::normalize(i + o);
    for (const double roughness : {0.4, 0.9}) {
        CAPTURE(roughness);
        const double alpha = roughness * roughness, a2 = alpha * alpha;
        const double density = a2 / (pi * std::pow(1.0 + h.y * h.y * (a2 - 1.0), 2.0));
        const double together = 1.0 / (1.0 + lambda(alpha, i) + lambda(alpha, o));
        const dvec3 expected =
            intensity / glm::dot(lamp, lamp) * gold_reflectance(glm::dot(i, h)) * (density * together / (4.0 * i.y));
        const Scene scene =
            with_light(looking_down(angle).floor(conductor(gold_eta, gold_k, roughness), 0.0, 50.0).scene(),
                point_light(aim + lamp, intensity));
        check_every_pixel(all, scene, settings_of(4, 1, Integrator::next_event), 64, expected, 512.0);
    }
}

TEST_CASE("a rough conductor under a lamp has one mean by scattering and by light sampling") {
    auto& all = tracers();
    const double alpha = 0.25, angle = 0.6;
    const dvec3 centre(-0.9, 1.0, 0.2), radiance(3.0, 2.0, 1.0), to_eye(std::sin(angle), std::cos(angle), 0.0);
    const double radius = 0.5;
    const dvec3 expected = mean_over_visible_normals(alpha, to_eye, [&](const dvec3& h) {
        const dvec3 o = 2.0 * glm::dot(to_eye, h) * h - to_eye;
        const double along = glm::dot(centre, o), apart = glm::dot(centre, centre) - along * along;
        if (o.y <= 0.0 || along <= 0.0 || apart > radius * radius) return black;
        return radiance * gold_reflectance(glm::dot(to_eye, h)) * shadowing(alpha, to_eye, o);
    });
    const Scene scene = looking_down(angle)
                            .floor(conductor(gold_eta, gold_k, 0.5), 0.0, 50.0)
                            .sphere(emitter(radiance), aim + centre, radius)
                            .scene();
    for (const Integrator integrator : {Integrator::path, Integrator::next_event})
        check_mean(all, scene, settings_of(16, 1, integrator), 512, expected, 16.0);
}

TEST_CASE("a rough interface reflects and refracts what its normals, masked and shadowed, do") {
    auto& all = tracers();
    const dvec3 down(2.0, 0.0, 1.0), up(0.5, 1.0, 2.0);
    const dvec3 cases[] = {{1.5, 0.2, 1.1}, {1.5, 0.7, 0.3}, {0.75, 0.2, 0.3}, {0.75, 0.7, 1.1}};
    for (const dvec3& one : cases) {
        const double index = one.x, roughness = one.y, angle = one.z;
        CAPTURE(index);
        CAPTURE(roughness);
        CAPTURE(angle);
        const double alpha = roughness * roughness;
        const dvec3 i(std::sin(angle), std::cos(angle), 0.0);
        const dvec3 expected = mean_over_visible_normals(alpha, i, [&](const dvec3& h) {
            const double c = glm::dot(i, h), within = 1.0 - (1.0 - c * c) / (index * index);
            double reflectance = 1.0;
            dvec3 light(0.0);
            if (within > 0.0) {
                const double ct = std::sqrt(within);
                const double across = (c - index * ct) / (c + index * ct);
                const double along = (index * c - ct) / (index * c + ct);
                reflectance = 0.5 * (across * across + along * along);
                const dvec3 o = -i / index + (c / index - ct) * h;
                if (o.y < 0.0) light = (1.0 - reflectance) * shadowing(alpha, i, o) * mix_of_sky(down, up, o);
            }
            const dvec3 o = 2.0 * c * h - i;
            if (o.y > 0.0) light += reflectance * shadowing(alpha, i, o) * mix_of_sky(down, up, o);
            return light;
        });
        const Scene scene =
            looking_down(angle).background(down, up).floor(rough_glass(index, roughness), 0.0, 50.0).scene();
        check_mean(all, scene, settings_of(8, 1), 512, expected, 128.0);
    }
}

TEST_CASE("a rough body absorbs by its colour at every surface") {
    auto& all = tracers();
    const dvec3 colour(0.2, 0.5, 1.0);
    Material clear = rough_glass(1.4, 0.6), stained = clear;
    stained.colour = colour;
    stained.alpha = 0.5;
    // One event: the stained floor shows the clear one's image times the absorption, with the same random numbers.
    const auto scene_of = [](const Material& material) {
        return looking_down(0.8).background(dvec3(1.0, 2.0, 3.0)).floor(material, 0.0, 50.0).scene();
    };
    for (Tracer& tracer : all) {
        CAPTURE(tracer.name);
        const auto plain = try_render(tracer, scene_of(clear), settings_of(8, 1), 64);
        const auto dyed = try_render(tracer, scene_of(stained), settings_of(8, 1), 64);
        if (!plain || !dyed) continue;
        const Measured bare = pooled(*plain), tinted = pooled(*dyed);
        for (int i = 0; i < 3; ++i)
            CHECK(tinted.mean[i] == doctest::Approx(bare.mean[i] * (0.5 + 0.5 * colour[i])).epsilon(1e-5));
    }
}
