// Exercises 16 to 23: mirrors, glass, diffuse and rough surfaces.
#include "cpu_ref/exercises/draws.h"
#include "cpu_ref/exercises/exercises.h"
#include "cpu_ref/exercises/paths.h"
#include "cpu_ref/oracle/dielectric.h"
#include "cpu_ref/oracle/microfacets.h"

namespace tandem {

namespace {

using oracle::two_pi;
using std::numbers::pi;

oracle::Interface glass(Fresnel fresnel, const glm::dvec3& d, const glm::dvec3& n, double eta) {
    return oracle::interface_of(fresnel, eta, d, n, -glm::dot(d, n));
}
// In the plane of incidence: the direction comes from above with that cosine.
oracle::Interface glass(Fresnel fresnel, double cosine, double eta) {
    return glass(fresnel, {std::sqrt(std::max(0.0, 1.0 - cosine * cosine)), 0.0, -cosine}, {0.0, 0.0, 1.0}, eta);
}

// direction:3 normal:3, the direction towards the front of the surface.
void draw_incidence(const V& u, V& x) {
    const glm::dvec3 n = any_direction(u, 0);
    x.set(3, n), x.set(0, -oracle::Frame(n).to_world(upper_direction(u, 2)));
}
double draw_eta(double u) { return u < 0.5 ? between(u, 0.45, 0.95) : between(u, 1.0, 1.8); }

void refract(const V& x, V& y, double eta, double sign_of_normal = 1.0) {
    const oracle::Interface through = glass(Fresnel::exact, x.three(0), x.three(3), eta);
    if (through.reflectance == 1.0) return y.set(0, glm::dvec3(0.0));
    const glm::dvec3 n = x.three(3);
    const double along = glm::dot(through.refracted, n);
    y.set(0, through.refracted + (sign_of_normal - 1.0) * along * n);
}

// normal:3 albedo a b, and what an even and two uneven skies send back.
void furnace(const V& x, V& y, double of_one, double of_cosine, double of_squared_tangent) {
    y.set(0, x[3] * glm::dvec3(of_one, of_cosine, of_squared_tangent)), y[3] = 1.0;
}

void microfacet_normal(double alpha, V& y, double tangent_squared, double azimuth) {
    const double z = 1.0 / std::sqrt(1.0 + alpha * tangent_squared), r = std::sqrt(std::max(0.0, 1.0 - z * z));
    y.set(0, glm::dvec3(r * std::cos(two_pi * azimuth), r * std::sin(two_pi * azimuth), z));
}

}  // namespace

std::vector<Exercise> exercises_of_scattering() {
    return {
        {.slug = "mirror",
            .title = "The direction that a mirror sends back",
            .lesson = "08",
            .task =
                "A ray of the unit direction `d` meets a mirror with the unit normal `n`, on either side. Return the\n"
                "direction in which it goes on.",
            .prototype = "vec3 mirrored(vec3 d, vec3 n)",
            .call = "answer3(0, mirrored(given3(0), given3(3)));",
            .arguments = "d:3 n:3",
            .results = "direction:3",
            .kind = CheckKind::values,
            .draw = [](const V& u, V& x) { x.set(0, any_direction(u, 0)), x.set(3, any_direction(u, 2)); },
            .answer = [](const V& x,
                          V& y) { y.set(0, x.three(0) - 2.0 * glm::dot(x.three(0), x.three(3)) * x.three(3)); },
            .wrong = {{"the sign is the other one",
                          [](const V& x, V& y) {
                              y.set(0, 2.0 * glm::dot(x.three(0), x.three(3)) * x.three(3) - x.three(0));
                          }},
                {"the factor 2 is left out",
                    [](const V& x, V& y) { y.set(0, x.three(0) - glm::dot(x.three(0), x.three(3)) * x.three(3)); }},
                {"the ray is sent back where it came from", [](const V& x, V& y) { y.set(0, -x.three(0)); }},
                {"only the front of the mirror reflects",
                    [](const V& x, V& y) {
                        y.set(0, x.three(0) - 2.0 * std::min(0.0, glm::dot(x.three(0), x.three(3))) * x.three(3));
                    }},
                {"the normal is added, not taken off",
                    [](const V& x, V& y) {
                        y.set(0, x.three(0) + 2.0 * glm::dot(x.three(0), x.three(3)) * x.three(3));
                    }}},
            .path = [](const V& x,
                        const V& y) { return path_that_goes_on(x.three(0), x.three(3), y.three(0), "mirror"); }},
        {.slug = "refraction",
            .title = "Snell's law",
            .lesson = "08",
            .task = "A ray of the unit direction `d` meets glass on the side of its unit normal `n`. `eta` is the "
                    "refractive\n"
                    "index on that side over the index beyond. Return the direction of the ray that is refracted, or "
                    "vec3(0)\n"
                    "where all light is reflected.",
            .prototype = "vec3 refracted(vec3 d, vec3 n, float eta)",
            .call = "answer3(0, refracted(given3(0), given3(3), given(6)));",
            .arguments = "d:3 n:3 eta",
            .results = "direction:3",
            .kind = CheckKind::values,
            .draw = [](const V& u, V& x) { draw_incidence(u, x), x[6] = draw_eta(u[4]); },
            .answer = [](const V& x, V& y) { refract(x, y, x[6]); },
            .wrong = {{"eta is the wrong way up", [](const V& x, V& y) { refract(x, y, 1.0 / x[6]); }},
                {"the ray comes back on the side of the normal", [](const V& x, V& y) { refract(x, y, x[6], -1.0); }},
                {"the ray goes straight on",
                    [](const V& x, V& y) {
                        refract(x, y, x[6]);
                        if (y.three(0) != glm::dvec3(0.0)) y.set(0, x.three(0));
                    }},
                {"total reflection gives the mirrored ray",
                    [](const V& x, V& y) {
                        refract(x, y, x[6]);
                        if (y.three(0) == glm::dvec3(0.0))
                            y.set(0, x.three(0) - 2.0 * glm::dot(x.three(0), x.three(3)) * x.three(3));
                    }}},
            .path = [](const V& x,
                        const V& y) { return path_that_goes_on(x.three(0), x.three(3), y.three(0), "glass"); }},
        {.slug = "fresnel",
            .title = "Fresnel's equations",
            .lesson = "08",
            .task = "Return the share of unpolarised light that glass reflects. `cosine` > 0 is that of the angle "
                    "between the\n"
                    "ray and the normal. `eta` is the refractive index on the ray's side over the index beyond. Where "
                    "all is\n"
                    "reflected, it is 1.",
            .prototype = "float fresnel(float cosine, float eta)",
            .call = "answer(0, fresnel(given(0), given(1)));",
            .arguments = "cosine eta",
            .results = "share",
            .kind = CheckKind::values,
            .draw = [](const V& u, V& x) { x[0] = between(u[0], 0.02, 1.0), x[1] = draw_eta(u[1]); },
            .answer = [](const V& x, V& y) { y[0] = glass(Fresnel::exact, x[0], x[1]).reflectance; },
            .wrong = {{"it is Schlick's approximation",
                          [](const V& x, V& y) { y[0] = glass(Fresnel::schlick, x[0], x[1]).reflectance; }},
                {"eta is the wrong way up",
                    [](const V& x, V& y) { y[0] = glass(Fresnel::exact, x[0], 1.0 / x[1]).reflectance; }},
                {"it is the share that goes through",
                    [](const V& x, V& y) { y[0] = 1.0 - glass(Fresnel::exact, x[0], x[1]).reflectance; }},
                {"only one polarisation is taken",
                    [](const V& x, V& y) {
                        const double ct = std::sqrt(1.0 - x[1] * x[1] * (1.0 - x[0] * x[0]));
                        const double r = (x[1] * x[0] - ct) / (x[1] * x[0] + ct);
                        y[0] = std::isnan(ct) ? 1.0 : r * r;
                    }},
                {"total reflection is left out",
                    [](const V& x, V& y) {
                        const double share = glass(Fresnel::exact, x[0], x[1]).reflectance;
                        y[0] = share == 1.0 ? 0.0 : share;
                    }},
                {"the polarisations are not averaged but added",
                    [](const V& x, V& y) {
                        const double share = glass(Fresnel::exact, x[0], x[1]).reflectance;
                        y[0] = share == 1.0 ? 1.0 : 2.0 * share;
                    }}}},
        {.slug = "schlick",
            .title = "Schlick's approximation",
            .lesson = "08",
            .task = "Return Schlick's approximation of the share that a surface reflects: `r0` along the normal, and 1 "
                    "at the\n"
                    "horizon. `cosine` is that of the angle between the ray and the normal.",
            .prototype = "float schlick(float cosine, float r0)",
            .call = "answer(0, schlick(given(0), given(1)));",
            .arguments = "cosine r0",
            .results = "share",
            .kind = CheckKind::values,
            .draw = [](const V& u, V& x) { x.set(0, u.two(0)); },
            .answer = [](const V& x, V& y) { y[0] = x[1] + (1.0 - x[1]) * std::pow(1.0 - x[0], 5.0); },
            .wrong = {{"the power is 4",
                          [](const V& x, V& y) { y[0] = x[1] + (1.0 - x[1]) * std::pow(1.0 - x[0], 4.0); }},
                {"the cosine is not taken from 1",
                    [](const V& x, V& y) { y[0] = x[1] + (1.0 - x[1]) * std::pow(x[0], 5.0); }},
                {"1 is not lessened by r0", [](const V& x, V& y) { y[0] = x[1] + std::pow(1.0 - x[0], 5.0); }},
                {"r0 and 1 - r0 are exchanged",
                    [](const V& x, V& y) { y[0] = 1.0 - x[1] + x[1] * std::pow(1.0 - x[0], 5.0); }},
                {"it is r0 alone", [](const V& x, V& y) { y[0] = x[1]; }}}},
        {.slug = "diffuse",
            .title = "A diffuse surface",
            .lesson = "03",
            .task =
                "Light of radiance `light` arrives from the unit direction `w` at a diffuse surface with the unit "
                "normal `n`\n"
                "and the colour `colour`. Return what its BSDF makes of it, times the cosine: the integrand of the\n"
                "rendering equation. From below the surface no light arrives.",
            .prototype = "vec3 diffuse(vec3 colour, vec3 light, vec3 n, vec3 w)",
            .call = "answer3(0, diffuse(given3(0), given3(3), given3(6), given3(9)));",
            .arguments = "colour:3 light:3 n:3 w:3",
            .results = "radiance:3",
            .kind = CheckKind::values,
            .draw =
                [](const V& u, V& x) {
                    x.set(0, u.three(0)), x.set(3, 4.0 * u.three(3)), x.set(6, any_direction(u, 6)),
                        x.set(9, any_direction(u, 8));
                },
            .answer =
                [](const V& x, V& y) {
                    y.set(0, x.three(0) * x.three(3) * std::max(0.0, glm::dot(x.three(6), x.three(9))) / pi);
                },
            .wrong = {{"the cosine is dropped",
                          [](const V& x, V& y) {
                              y.set(0,
                                  x.three(0) * x.three(3) * (glm::dot(x.three(6), x.three(9)) > 0.0 ? 1.0 / pi : 0.0));
                          }},
                {"it is not divided by π",
                    [](const V& x, V& y) {
                        y.set(0, x.three(0) * x.three(3) * std::max(0.0, glm::dot(x.three(6), x.three(9))));
                    }},
                {"light from below counts",
                    [](const V& x, V& y) {
                        y.set(0, x.three(0) * x.three(3) * std::abs(glm::dot(x.three(6), x.three(9))) / pi);
                    }},
                {"light from below counts as negative",
                    [](const V& x, V& y) {
                        y.set(0, x.three(0) * x.three(3) * glm::dot(x.three(6), x.three(9)) / pi);
                    }},
                {"the colour is left out",
                    [](const V& x, V& y) {
                        y.set(0, x.three(3) * std::max(0.0, glm::dot(x.three(6), x.three(9))) / pi);
                    }},
                {"the colour counts twice",
                    [](const V& x, V& y) {
                        y.set(0, x.three(0) * x.three(0) * x.three(3) *
                                     std::max(0.0, glm::dot(x.three(6), x.three(9))) / pi);
                    }}}},
        {.slug = "ggx",
            .title = "The GGX distribution of normals",
            .lesson = "05",
            .task =
                "Return the density D of the normals of microfacets after Trowbridge and Reitz (GGX) with the width\n"
                "`alpha`. `cosine` is that of the angle between the microfacet's normal and the surface's.",
            .prototype = "float ggx(float alpha, float cosine)",
            .call = "answer(0, ggx(given(0), given(1)));",
            .arguments = "alpha cosine",
            .results = "D",
            .kind = CheckKind::values,
            .draw = [](const V& u, V& x) { x[0] = between(u[0], 0.1, 1.0), x[1] = between(u[1], 0.05, 1.0); },
            .answer =
                [](const V& x, V& y) {
                    y[0] = oracle::Microfacets{x[0]}.density({0.0, 0.0, x[1]});
                },
            .wrong = {{"alpha is not squared",
                          [](const V& x, V& y) {
                              y[0] = oracle::Microfacets{std::sqrt(x[0])}.density({0.0, 0.0, x[1]});
                          }},
                {"alpha is squared twice",
                    [](const V& x, V& y) {
                        y[0] = oracle::Microfacets{x[0] * x[0]}.density({0.0, 0.0, x[1]});
                    }},
                {"it is not divided by π",
                    [](const V& x, V& y) {
                        y[0] = pi * oracle::Microfacets{x[0]}.density({0.0, 0.0, x[1]});
                    }},
                {"the denominator is not squared",
                    [](const V& x, V& y) { y[0] = x[0] * x[0] / (pi * (1.0 + x[1] * x[1] * (x[0] * x[0] - 1.0))); }},
                {"it is the density of the normals over solid angle, D times the cosine",
                    [](const V& x, V& y) {
                        y[0] = x[1] * oracle::Microfacets{x[0]}.density({0.0, 0.0, x[1]});
                    }}}},
        {.slug = "ggx-normal",
            .title = "A normal by the GGX distribution",
            .lesson = "05",
            .task =
                "`a` and `b` are independent and uniform in [0, 1). Return the unit normal of a microfacet, about "
                "+z.\n"
                "Its density over solid angle is D times the cosine to +z, D being that of GGX with the width `alpha`.",
            .prototype = "vec3 ggx_normal(float alpha, float a, float b)",
            .call = "answer3(0, ggx_normal(given(2), given(0), given(1)));",
            .arguments = "a b alpha",
            .results = "normal:3",
            .kind = CheckKind::distribution,
            .draw = [](const V& u, V& x) { x.set(0, u.two(0)), x[2] = between(u[2], 0.1, 0.9); },
            .answer = [](const V& x, V& y) { microfacet_normal(x[2] * x[2], y, x[0] / (1.0 - x[0]), x[1]); },
            .wrong = {{"alpha is not squared",
                          [](const V& x, V& y) { microfacet_normal(x[2], y, x[0] / (1.0 - x[0]), x[1]); }},
                {"alpha is squared twice",
                    [](const V& x, V& y) { microfacet_normal(std::pow(x[2], 4.0), y, x[0] / (1.0 - x[0]), x[1]); }},
                {"it is Beckmann's distribution",
                    [](const V& x, V& y) { microfacet_normal(x[2] * x[2], y, -std::log1p(-x[0]), x[1]); }},
                {"it is the cosine's density",
                    [](const V& x, V& y) { microfacet_normal(1.0, y, x[0] / (1.0 - x[0]), x[1]); }},
                {"the root of the tangent is left out",
                    [](const V& x, V& y) {
                        const double t = x[2] * x[0] / (1.0 - x[0]);
                        microfacet_normal(1.0, y, t * t, x[1]);
                    }}},
            .place =
                [](const V& x, const V& y) {
                    const double a2 = x[2] * x[2], c2 = y[2] * y[2];
                    return glm::dvec2((1.0 - c2) / (1.0 + (a2 - 1.0) * c2), std::atan2(y[1], y[0]) / two_pi + 0.5);
                },
            .fault = [](const V&, const V& y) { return y[2] < 0.0 ? 1e3 : off_unit_length(y.three(0)); }},
        {.slug = "furnace",
            .title = "A diffuse bounce in the furnace",
            .lesson = "05",
            .task = "A path bounces at a diffuse surface with the unit normal `n` that reflects the share `albedo`. "
                    "`a` and `b`\n"
                    "are independent and uniform in [0, 1). Choose a direction, by any density that you like, and give "
                    "the\n"
                    "weight f cos/p by which the path's throughput is multiplied.\n"
                    "The mark: under an even sky the mean of the weight is the albedo (the furnace). Under two uneven "
                    "skies\n"
                    "the mean is what the rendering equation says.",
            .prototype = "void bounce(vec3 n, float albedo, float a, float b, out vec3 direction, out float weight)",
            .call = "vec3 tandem_d = vec3(0); float tandem_w = 0; bounce(given3(0), given(3), given(4), given(5), "
                    "tandem_d, tandem_w);\n"
                    "    const vec3 tandem_t = abs(given(0)) < 0.6 ? vec3(1, 0, 0) : vec3(0, 1, 0);\n"
                    "    const float tandem_s = dot(tandem_d, normalize(cross(given3(0), tandem_t)));\n"
                    "    answer(0, tandem_w); answer(1, tandem_w * dot(tandem_d, given3(0)));\n"
                    "    answer(2, tandem_w * tandem_s * tandem_s); answer(3, dot(tandem_d, tandem_d));",
            .arguments = "n:3 albedo a b",
            .results = "even-sky sky-by-cosine sky-by-squared-tangent length",
            .kind = CheckKind::expectation,
            .draw =
                [](const V& u, V& x) {
                    x.set(0, any_direction(u, 0)), x[3] = between(u[2], 0.2, 0.95), numbers_at(u, x, 4, 2, 4);
                },
            .answer = [](const V& x, V& y) { furnace(x, y, 1.0, 2.0 / 3.0, 0.25); },
            .wrong = {{"the cosine is dropped", [](const V& x, V& y) { furnace(x, y, 2.0, 1.0, 2.0 / 3.0); }},
                {"the direction is uniform, the weight that of the cosine's density",
                    [](const V& x, V& y) { furnace(x, y, 1.0, 0.5, 1.0 / 3.0); }},
                {"the direction is by the cosine, the weight that of the uniform density",
                    [](const V& x, V& y) { furnace(x, y, 4.0 / 3.0, 1.0, 4.0 / 15.0); }},
                {"the weight is not multiplied by π",
                    [](const V& x, V& y) { furnace(x, y, 1.0 / pi, 2.0 / (3.0 * pi), 0.25 / pi); }},
                {"the weight is multiplied by π",
                    [](const V& x, V& y) { furnace(x, y, pi, 2.0 * pi / 3.0, 0.25 * pi); }},
                {"the albedo is left out",
                    [](const V& x, V& y) { y.set(0, glm::dvec3(1.0, 2.0 / 3.0, 0.25)), y[3] = 1.0, (void)x; }},
                {"the cosine counts twice", [](const V& x, V& y) { furnace(x, y, 2.0 / 3.0, 0.5, 2.0 / 15.0); }}},
            .fault = [](const V&, const V& y) { return y[0] < 0.0 ? 1e3 : std::abs(y[3] - 1.0) / 0x1p-13; }},
    };
}

}  // namespace tandem
