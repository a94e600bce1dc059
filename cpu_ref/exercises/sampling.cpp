// Exercises 8 to 15: points and directions from numbers, and their densities.
#include <algorithm>

#include "cpu_ref/exercises/draws.h"
#include "cpu_ref/exercises/exercises.h"

namespace tandem {

namespace {

using oracle::two_pi;
using std::numbers::pi;

glm::dvec3 about_z(double z, double azimuth) {
    const double r = std::sqrt(std::max(0.0, 1.0 - z * z));
    return {r * std::cos(two_pi * azimuth), r * std::sin(two_pi * azimuth), z};
}
void two_numbers(const V& u, V& x) { x.set(0, u.two(0)); }
double off_direction(const V&, const V& y) { return off_unit_length(y.three(0)); }
double off_upper_direction(const V& x, const V& y) { return y[2] < -0x1p-20 ? 1e3 : off_direction(x, y); }
glm::dvec2 place_of_direction(const V&, const V& y) { return by_height_and_azimuth(y.three(0)); }
glm::dvec2 place_of_upper_direction(const V&, const V& y) {
    const glm::dvec2 place = by_height_and_azimuth(y.three(0));
    return {2.0 * place.x - 1.0, place.y};
}
// Within the disc: the area within the radius r grows as r².
glm::dvec2 place_on_disc(const V&, const V& y) {
    return {glm::dot(y.two(0), y.two(0)), std::atan2(y[1], y[0]) / two_pi + 0.5};
}

void cone(const V& x, V& y, double height) { y.set(0, about_z(1.0 - height * x[0], x[1])); }

}  // namespace

std::vector<Exercise> exercises_of_sampling() {
    return {
        {.slug = "uniform-disc",
            .title = "A uniform point on the disc",
            .lesson = "05",
            .task = "`a` and `b` are independent and uniform in [0, 1). Return a point within the unit circle, so that "
                    "equal\n"
                    "areas are equally likely. Any such map will do.",
            .prototype = "vec2 uniform_disc(float a, float b)",
            .call = "answer2(0, uniform_disc(given(0), given(1)));",
            .arguments = "a b",
            .results = "point:2",
            .kind = CheckKind::distribution,
            .draw = two_numbers,
            .answer = [](const V& x, V& y) { y.set(0, oracle::disc(x[0], x[1])); },
            .wrong = {{"the root of the radius is left out",
                          [](const V& x, V& y) { y.set(0, oracle::disc(x[0] * x[0], x[1])); }},
                {"it is a square, not a disc", [](const V& x, V& y) { y.set(0, 2.0 * x.two(0) - 1.0); }},
                {"only half of the disc", [](const V& x, V& y) { y.set(0, oracle::disc(x[0], 0.5 * x[1])); }},
                {"one number is used for both radius and angle",
                    [](const V& x, V& y) { y.set(0, oracle::disc(x[0], x[0])); }}},
            .place = place_on_disc,
            .fault = [](const V&, const V& y) { return (glm::length(y.two(0)) - 1.0) / 0x1p-14; }},
        {.slug = "uniform-sphere",
            .title = "A uniform direction",
            .lesson = "05",
            .task = "`a` and `b` are independent and uniform in [0, 1). Return a direction of unit length, all being "
                    "equally\n"
                    "likely.",
            .prototype = "vec3 uniform_sphere(float a, float b)",
            .call = "answer3(0, uniform_sphere(given(0), given(1)));",
            .arguments = "a b",
            .results = "direction:3",
            .kind = CheckKind::distribution,
            .draw = two_numbers,
            .answer = [](const V& x, V& y) { y.set(0, oracle::unit_sphere(x[0], x[1])); },
            .wrong = {{"the polar angle is uniform, which crowds the poles",
                          [](const V& x, V& y) { y.set(0, about_z(std::cos(pi * x[0]), x[1])); }},
                {"a point of the cube is normalised, which crowds its corners",
                    [](const V& x, V& y) {
                        // The third number comes of the first two, as students do without one.
                        const double c = x[0] * 64.0 - std::floor(x[0] * 64.0);
                        y.set(0, glm::normalize(2.0 * glm::dvec3(x[0], x[1], c) - 1.0));
                    }},
                {"only one half of the sphere", [](const V& x, V& y) { y.set(0, about_z(x[0], x[1])); }},
                {"the azimuth covers half a turn",
                    [](const V& x, V& y) { y.set(0, oracle::unit_sphere(x[0], 0.5 * x[1])); }}},
            .place = place_of_direction,
            .fault = off_direction},
        {.slug = "uniform-hemisphere",
            .title = "A uniform direction on the hemisphere",
            .lesson = "05",
            .task = "`a` and `b` are independent and uniform in [0, 1). Return a direction of unit length with z >= 0, "
                    "all being\n"
                    "equally likely.",
            .prototype = "vec3 uniform_hemisphere(float a, float b)",
            .call = "answer3(0, uniform_hemisphere(given(0), given(1)));",
            .arguments = "a b",
            .results = "direction:3",
            .kind = CheckKind::distribution,
            .draw = two_numbers,
            .answer = [](const V& x, V& y) { y.set(0, about_z(x[0], x[1])); },
            .wrong = {{"it is the cosine's density",
                          [](const V& x, V& y) {
                              y.set(0, oracle::cosine_hemisphere({0, 0, 1}, x[0], x[1]));
                          }},
                {"the polar angle is uniform, which crowds the pole",
                    [](const V& x, V& y) { y.set(0, about_z(std::cos(0.5 * pi * x[0]), x[1])); }},
                {"it is the whole sphere", [](const V& x, V& y) { y.set(0, oracle::unit_sphere(x[0], x[1])); }},
                {"the azimuth covers half a turn", [](const V& x, V& y) { y.set(0, about_z(x[0], 0.5 * x[1])); }}},
            .place = place_of_upper_direction,
            .fault = off_upper_direction},
        {.slug = "cosine-hemisphere",
            .title = "A direction by the cosine",
            .lesson = "05",
            .task = "`a` and `b` are independent and uniform in [0, 1). Return a direction of unit length with z >= 0, "
                    "whose\n"
                    "density over solid angle is z / pi.",
            .prototype = "vec3 cosine_hemisphere(float a, float b)",
            .call = "answer3(0, cosine_hemisphere(given(0), given(1)));",
            .arguments = "a b",
            .results = "direction:3",
            .kind = CheckKind::distribution,
            .draw = two_numbers,
            .answer =
                [](const V& x, V& y) {
                    y.set(0, oracle::cosine_hemisphere({0, 0, 1}, x[0], x[1]));
                },
            .wrong = {{"the cosine is dropped: the density is uniform",
                          [](const V& x, V& y) { y.set(0, about_z(x[0], x[1])); }},
                {"the root of the radius is left out",
                    [](const V& x, V& y) { y.set(0, about_z(std::sqrt(1.0 - x[0] * x[0]), x[1])); }},
                {"the density is that of the squared cosine",
                    [](const V& x, V& y) { y.set(0, about_z(std::cbrt(x[0]), x[1])); }},
                {"the polar angle is uniform, which crowds the pole",
                    [](const V& x, V& y) { y.set(0, about_z(std::cos(0.5 * pi * x[0]), x[1])); }}},
            .place = place_of_upper_direction,
            .fault = off_upper_direction},
        {.slug = "cosine-pdf",
            .title = "The density of a direction by the cosine",
            .lesson = "05",
            .task = "Return the density, over solid angle, with which a cosine-weighted sampler about the unit normal "
                    "`n` gives\n"
                    "the unit vector `direction`. Below the horizon it is 0.",
            .prototype = "float cosine_pdf(vec3 n, vec3 direction)",
            .call = "answer(0, cosine_pdf(given3(0), given3(3)));",
            .arguments = "n:3 direction:3",
            .results = "pdf",
            .kind = CheckKind::values,
            .draw = [](const V& u, V& x) { x.set(0, any_direction(u, 0)), x.set(3, any_direction(u, 2)); },
            .answer = [](const V& x, V& y) { y[0] = std::max(0.0, glm::dot(x.three(0), x.three(3))) / pi; },
            .wrong = {{"the cosine is dropped",
                          [](const V& x, V& y) { y[0] = glm::dot(x.three(0), x.three(3)) > 0.0 ? 1.0 / pi : 0.0; }},
                {"it is not divided by π",
                    [](const V& x, V& y) { y[0] = std::max(0.0, glm::dot(x.three(0), x.three(3))); }},
                {"it is divided by 2π",
                    [](const V& x, V& y) { y[0] = std::max(0.0, glm::dot(x.three(0), x.three(3))) / two_pi; }},
                {"it is negative below the horizon",
                    [](const V& x, V& y) { y[0] = glm::dot(x.three(0), x.three(3)) / pi; }},
                {"the lower half counts as the upper one",
                    [](const V& x, V& y) { y[0] = std::abs(glm::dot(x.three(0), x.three(3))) / pi; }},
                {"it is the uniform density",
                    [](const V& x, V& y) { y[0] = glm::dot(x.three(0), x.three(3)) > 0.0 ? 1.0 / two_pi : 0.0; }}}},
        {.slug = "uniform-triangle",
            .title = "A uniform point of a triangle",
            .lesson = "05",
            .task =
                "`a` and `b` are independent and uniform in [0, 1). Return the weights of the three corners: none is\n"
                "negative, their sum is 1, and points of equal areas are equally likely.",
            .prototype = "vec3 uniform_triangle(float a, float b)",
            .call = "answer3(0, uniform_triangle(given(0), given(1)));",
            .arguments = "a b",
            .results = "weights:3",
            .kind = CheckKind::distribution,
            .draw = two_numbers,
            .answer =
                [](const V& x, V& y) {
                    const double s = std::sqrt(x[0]);
                    y.set(0, glm::dvec3(1.0 - s, s * (1.0 - x[1]), s * x[1]));
                },
            .wrong = {{"the root is left out, which crowds the first corner",
                          [](const V& x, V& y) { y.set(0, glm::dvec3(1.0 - x[0], x[0] * (1.0 - x[1]), x[0] * x[1])); }},
                {"the square is not folded into the triangle",
                    [](const V& x, V& y) { y.set(0, glm::dvec3(1.0 - x[0] - x[1], x[0], x[1])); }},
                {"three numbers are divided by their sum, which crowds the middle",
                    [](const V& x, V& y) {
                        const double c = x[0] * 64.0 - std::floor(x[0] * 64.0), sum = x[0] + x[1] + c;
                        y.set(0, glm::dvec3(x[0], x[1], c) / sum);
                    }}},
            // Uniform in the square where the weights are uniform in the triangle.
            .place =
                [](const V&, const V& y) {
                    const double s = 1.0 - y[0];
                    return glm::dvec2(s * std::abs(s), y[2] / s);
                },
            .fault =
                [](const V&, const V& y) {
                    const double sum = y[0] + y[1] + y[2], least = std::min({y[0], y[1], y[2]});
                    return std::max(std::abs(sum - 1.0), -least) / 0x1p-18;
                }},
        {.slug = "uniform-cone",
            .title = "A uniform direction within a cone",
            .lesson = "06",
            .task =
                "A spherical lamp is seen within a cone about +z, whose half angle has the cosine `cosine`. `a` and "
                "`b` are\n"
                "independent and uniform in [0, 1). Return a direction of unit length in the cone, all being equally\n"
                "likely.",
            .prototype = "vec3 uniform_cone(float cosine, float a, float b)",
            .call = "answer3(0, uniform_cone(given(2), given(0), given(1)));",
            .arguments = "a b cosine",
            .results = "direction:3",
            .kind = CheckKind::distribution,
            .draw = [](const V& u, V& x) { x.set(0, u.two(0)), x[2] = between(u[2], 0.0, 0.95); },
            .answer = [](const V& x, V& y) { cone(x, y, 1.0 - x[2]); },
            .wrong = {{"the angle is uniform, which crowds the axis",
                          [](const V& x, V& y) { y.set(0, about_z(std::cos(std::acos(x[2]) * x[0]), x[1])); }},
                {"the cosine is taken for 1 minus itself", [](const V& x, V& y) { cone(x, y, x[2]); }},
                {"it is the whole hemisphere", [](const V& x, V& y) { cone(x, y, 1.0); }},
                {"the root of the height is taken, which crowds the rim",
                    [](const V& x, V& y) { y.set(0, about_z(1.0 - (1.0 - x[2]) * std::sqrt(x[0]), x[1])); }}},
            .place =
                [](const V& x, const V& y) {
                    return glm::dvec2((1.0 - y[2]) / (1.0 - x[2]), std::atan2(y[1], y[0]) / two_pi + 0.5);
                },
            .fault = [](const V& x, const V& y) { return std::max(off_direction(x, y), (x[2] - y[2]) / 0x1p-18); }},
        {.slug = "cone-pdf",
            .title = "The density within a cone",
            .lesson = "06",
            .task = "A sphere of `radius` is seen from the `distance` of its centre, from outside. Return the density "
                    "over solid\n"
                    "angle of a direction that is uniform within the cone in which the sphere is seen.",
            .prototype = "float cone_pdf(float radius, float distance)",
            .call = "answer(0, cone_pdf(given(0), given(1)));",
            .arguments = "radius distance",
            .results = "pdf",
            .kind = CheckKind::values,
            .draw = [](const V& u, V& x) { x[0] = between(u[0], 0.2, 3.0), x[1] = x[0] * between(u[1], 1.1, 6.0); },
            .answer =
                [](const V& x, V& y) {
                    const double s2 = x[0] * x[0] / (x[1] * x[1]);
                    y[0] = (1.0 + std::sqrt(1.0 - s2)) / (two_pi * s2);
                },
            .wrong = {{"the tangent is taken for the sine",
                          [](const V& x, V& y) {
                              y[0] = 1.0 / (two_pi * (1.0 - 1.0 / std::sqrt(1.0 + x[0] * x[0] / (x[1] * x[1]))));
                          }},
                {"the sine is taken for the cosine",
                    [](const V& x, V& y) { y[0] = 1.0 / (two_pi * (1.0 - x[0] / x[1])); }},
                {"it is divided by π, not by 2π",
                    [](const V& x, V& y) {
                        const double s2 = x[0] * x[0] / (x[1] * x[1]);
                        y[0] = (1.0 + std::sqrt(1.0 - s2)) / (pi * s2);
                    }},
                {"it is the solid angle, not one over it",
                    [](const V& x, V& y) {
                        const double s2 = x[0] * x[0] / (x[1] * x[1]);
                        y[0] = two_pi * s2 / (1.0 + std::sqrt(1.0 - s2));
                    }},
                {"it is the density over area", [](const V& x, V& y) { y[0] = 1.0 / (4.0 * pi * x[0] * x[0]); }}}},
    };
}

}  // namespace tandem
