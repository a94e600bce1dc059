// Exercises 24 to 30: lights, MIS, roulette, media.
#include "cpu_ref/exercises/draws.h"
#include "cpu_ref/exercises/exercises.h"
#include "cpu_ref/first_tracer/lights.h"
#include "cpu_ref/oracle/media.h"

namespace tandem {

namespace {

using oracle::two_pi;
using std::numbers::pi;

// A polygon's irradiance for radiance π: half the sum of its edges' angles about their normals [Lambert 1760].
glm::dvec3 irradiance_vector(const glm::dvec3& corner, const glm::dvec3& side, const glm::dvec3& other) {
    const glm::dvec3 corners[] = {corner, corner + side, corner + side + other, corner + other};
    glm::dvec3 sum(0.0);
    for (std::size_t i = 0; i < 4; ++i) {
        const glm::dvec3 a = glm::normalize(corners[i]), b = glm::normalize(corners[(i + 1) % 4]);
        const glm::dvec3 across = glm::cross(a, b);
        sum += 0.5 * std::atan2(glm::length(across), glm::dot(a, b)) * glm::normalize(across);
    }
    return sum;
}

// corner:3 side:3 other:3 n:3 radiance albedo a b, seen from the origin.
double reflected_light(const V& x) {
    return x[13] / pi * x[12] * std::abs(glm::dot(irradiance_vector(x.three(0), x.three(3), x.three(6)), x.three(9)));
}
void draw_lamp(const V& u, V& x) {
    // The lamp faces down to the origin, above the horizon of any normal that is drawn.
    const glm::dvec3 corner(between(u[0], -1.5, 0.5), between(u[1], -1.5, 0.5), between(u[2], 1.5, 3.0));
    x.set(0, corner), x.set(3, glm::dvec3(between(u[3], 0.3, 1.2), 0.0, between(u[4], -0.3, 0.3)));
    x.set(6, glm::dvec3(0.0, between(u[5], 0.3, 1.2), between(u[6], -0.3, 0.3)));
    const glm::dvec2 tilt = 0.2 * (2.0 * u.two(7) - 1.0);
    x.set(9, glm::normalize(glm::dvec3(tilt, 1.0)));
    x[12] = between(u[9], 0.5, 4.0), x[13] = between(u[10], 0.2, 0.95), numbers_at(u, x, 11, 2, 14);
}
double lamp_area(const V& x) { return glm::length(glm::cross(x.three(3), x.three(6))); }
glm::dvec3 on_lamp(const V& x) { return x.three(0) + x[14] * x.three(3) + x[15] * x.three(6); }
glm::dvec3 lamp_normal(const V& x) { return glm::normalize(glm::cross(x.three(3), x.three(6))); }
// What a sample is where some of its factors are left out.
double lamp_sample(const V& x, double power_of_distance, bool cosine_here, bool cosine_there) {
    const glm::dvec3 p = on_lamp(x), w = glm::normalize(p);
    const double here = cosine_here ? std::max(0.0, glm::dot(w, x.three(9))) : 1.0;
    const double there = cosine_there ? std::abs(glm::dot(w, lamp_normal(x))) : 1.0;
    return x[13] / pi * x[12] * here * there * lamp_area(x) / std::pow(glm::length(p), power_of_distance);
}

double survival(const V& x) { return std::min(1.0, std::max({x[0], x[1], x[2]})); }

glm::dvec2 in_steps(double share) { return {share, 16.0 * share - std::floor(16.0 * share)}; }

}  // namespace

std::vector<Exercise> exercises_of_light() {
    return {
        {.slug = "area-pdf",
            .title = "From density over area to density over solid angle",
            .lesson = "06",
            .task =
                "A point on a lamp is chosen uniformly: its density over area is 1 / area. It lies at `distance`.\n"
                "`cosine` is that of the angle between the lamp's normal there and the way to it. It is negative on\n"
                "the lamp's back, which shines too. Return the density of the direction over solid angle.",
            .prototype = "float area_pdf(float area, float distance, float cosine)",
            .call = "answer(0, area_pdf(given(0), given(1), given(2)));",
            .arguments = "area distance cosine",
            .results = "pdf",
            .kind = CheckKind::values,
            .draw =
                [](const V& u, V& x) {
                    x[0] = between(u[0], 0.1, 4.0), x[1] = between(u[1], 0.3, 5.0);
                    x[2] = between(u[2], 0.05, 1.0) * (u[3] < 0.5 ? -1.0 : 1.0);
                },
            .answer = [](const V& x, V& y) { y[0] = x[1] * x[1] / (x[0] * std::abs(x[2])); },
            .wrong = {{"the cosine is dropped", [](const V& x, V& y) { y[0] = x[1] * x[1] / x[0]; }},
                {"the cosine multiplies instead of dividing",
                    [](const V& x, V& y) { y[0] = x[1] * x[1] * std::abs(x[2]) / x[0]; }},
                {"the distance is not squared", [](const V& x, V& y) { y[0] = x[1] / (x[0] * std::abs(x[2])); }},
                {"the back of the lamp has a negative density",
                    [](const V& x, V& y) { y[0] = x[1] * x[1] / (x[0] * x[2]); }},
                {"the back of the lamp has no density",
                    [](const V& x, V& y) { y[0] = x[2] < 0.0 ? 0.0 : x[1] * x[1] / (x[0] * x[2]); }},
                {"it is one over the density", [](const V& x, V& y) { y[0] = x[0] * std::abs(x[2]) / (x[1] * x[1]); }},
                {"the area multiplies instead of dividing",
                    [](const V& x, V& y) { y[0] = x[0] * x[1] * x[1] / std::abs(x[2]); }}}},
        {.slug = "power-heuristic",
            .title = "The power heuristic",
            .lesson = "06",
            .task = "Two ways of choosing a direction have the densities `own` and `other` for it. Return the MIS "
                    "weight of a\n"
                    "sample that was chosen by the first way, by the power heuristic with the exponent 2. The "
                    "densities may\n"
                    "be as great as 1e25: their squares overflow. `other` may be 0.",
            .prototype = "float power_heuristic(float own, float other)",
            .call = "answer(0, power_heuristic(given(0), given(1)));",
            .arguments = "own other",
            .results = "weight",
            .kind = CheckKind::values,
            .draw =
                [](const V& u, V& x) {
                    const double size = u[2] < 0.8 ? 1.0 : between_logarithms(u[3], 1e19, 1e24);
                    x[0] = size * between_logarithms(u[0], 0.1, 10.0),
                    x[1] = u[4] < 0.05 ? 0.0 : size * between_logarithms(u[1], 0.1, 10.0);
                },
            .answer = [](const V& x, V& y) { y[0] = first::power_heuristic(x[0], x[1]); },
            .wrong = {{"it is the balance heuristic", [](const V& x, V& y) { y[0] = x[0] / (x[0] + x[1]); }},
                {"the two densities are exchanged",
                    [](const V& x, V& y) { y[0] = x[1] == 0.0 ? 0.0 : first::power_heuristic(x[1], x[0]); }},
                {"great densities overflow",
                    [](const V& x, V& y) {
                        const double own = static_cast<float>(x[0]) * static_cast<float>(x[0]),
                                     other = static_cast<float>(x[1]) * static_cast<float>(x[1]);
                        y[0] = own / (own + other);
                    }},
                {"only the numerator is squared", [](const V& x, V& y) { y[0] = x[0] * x[0] / (x[0] + x[1]); }},
                {"the weight is 1", [](const V&, V& y) { y[0] = 1.0; }}}},
        {.slug = "direct-light",
            .title = "Next-event estimation of a lamp",
            .lesson = "06",
            .task = "At the origin lies a diffuse surface with the unit normal `n`, which reflects the share `albedo`. "
                    "Above it is\n"
                    "a lamp: the parallelogram from `corner` along `side` and `other`, of radiance `radiance` on both "
                    "sides.\n"
                    "Nothing lies between. `a` and `b` are independent and uniform in [0, 1).\n"
                    "Choose a point on the lamp and return the estimate of the radiance that the surface sends to the "
                    "eye. Its\n"
                    "mean must be right; how you choose the point is up to you.",
            .prototype = "float direct_light(vec3 corner, vec3 side, vec3 other, vec3 n, float radiance, float albedo, "
                         "float a, float b)",
            .call = "answer(0, direct_light(given3(0), given3(3), given3(6), given3(9), given(12), given(13), "
                    "given(14), given(15)));",
            .arguments = "corner:3 side:3 other:3 n:3 radiance albedo a b",
            .results = "radiance",
            .kind = CheckKind::expectation,
            .draw = draw_lamp,
            .answer = [](const V& x, V& y) { y[0] = reflected_light(x); },
            .wrong = {{"the surface's cosine is dropped",
                          [](const V& x, V& y) { y[0] = lamp_sample(x, 2.0, false, true); }},
                {"the lamp's cosine is dropped", [](const V& x, V& y) { y[0] = lamp_sample(x, 2.0, true, false); }},
                {"both cosines are dropped", [](const V& x, V& y) { y[0] = lamp_sample(x, 2.0, false, false); }},
                {"the distance is not squared", [](const V& x, V& y) { y[0] = lamp_sample(x, 1.0, true, true); }},
                {"the lamp's area is left out", [](const V& x, V& y) { y[0] = reflected_light(x) / lamp_area(x); }},
                {"it is not divided by π", [](const V& x, V& y) { y[0] = pi * reflected_light(x); }},
                {"the albedo is left out", [](const V& x, V& y) { y[0] = reflected_light(x) / x[13]; }},
                {"the lamp is half as large: a triangle's area",
                    [](const V& x, V& y) { y[0] = 0.5 * reflected_light(x); }}},
            .fault = [](const V&, const V& y) { return y[0] < 0.0 ? 1e3 : 0.0; }},
        {.slug = "roulette",
            .title = "Russian roulette",
            .lesson = "07",
            .task =
                "A path of that `throughput` goes on with the probability of its greatest component, at most 1. `u` "
                "is\n"
                "uniform in [0, 1). Return the factor by which the throughput is to be multiplied: 0 ends the path.",
            .prototype = "float roulette(vec3 throughput, float u)",
            .call = "const float tandem_f = roulette(given3(0), given(3)); answer(0, tandem_f); answer(1, tandem_f != "
                    "0.0 ? 1.0 : 0.0);",
            .arguments = "throughput:3 u",
            .results = "factor survives",
            .kind = CheckKind::expectation,
            .draw =
                [](const V& u, V& x) {
                    x.set(0, glm::dvec3(between(u[0], 0.1, 1.3), u[1] * 0.5, u[2] * 0.5)), x[3] = u[3];
                    if (u[4] < 0.5) std::swap(x[0], x[u[4] < 0.25 ? 1 : 2]);
                },
            .answer = [](const V& x, V& y) { y[0] = 1.0, y[1] = survival(x); },
            .wrong = {{"survivors are not divided by their probability",
                          [](const V& x, V& y) { y[0] = y[1] = survival(x); }},
                {"the path never ends", [](const V&, V& y) { y[0] = y[1] = 1.0; }},
                {"the probability is not limited to 1",
                    [](const V& x, V& y) {
                        const double q = std::max({x[0], x[1], x[2]});
                        y[0] = q < 1.0 ? 1.0 : 1.0 / q, y[1] = survival(x);
                    }},
                {"the mean component is taken for the probability",
                    [](const V& x, V& y) { y[0] = 1.0, y[1] = std::min(1.0, (x[0] + x[1] + x[2]) / 3.0); }},
                {"the first component is taken for the probability",
                    [](const V& x, V& y) { y[0] = 1.0, y[1] = std::min(1.0, x[0]); }},
                {"the probabilities of going on and ending are exchanged",
                    [](const V& x, V& y) {
                        const double q = survival(x);
                        y[0] = (1.0 - q) / q, y[1] = 1.0 - q;
                    }}},
            .fault = [](const V&, const V& y) { return y[0] < 0.0 ? 1e3 : 0.0; }},
        {.slug = "free-flight",
            .title = "How far light flies in fog",
            .lesson = "08",
            .task = "In fog with the extinction `sigma`, light flies the distance t before it is scattered, with the "
                    "density\n"
                    "sigma exp(-sigma t). `u` is uniform in [0, 1), and may be 0. Return such a distance.",
            .prototype = "float free_flight(float sigma, float u)",
            .call = "answer(0, free_flight(given(1), given(0)));",
            .arguments = "u sigma",
            .results = "t",
            .kind = CheckKind::distribution,
            .draw = [](const V& u, V& x) { x[0] = u[2] < 0.001 ? 0.0 : u[0], x[1] = between(u[1], 0.2, 5.0); },
            .answer = [](const V& x, V& y) { y[0] = -std::log1p(-x[0]) / x[1]; },
            .wrong = {{"sigma multiplies instead of dividing",
                          [](const V& x, V& y) { y[0] = -std::log1p(-x[0]) * x[1]; }},
                {"sigma is left out", [](const V& x, V& y) { y[0] = -std::log1p(-x[0]); }},
                {"the distance is uniform up to twice the mean", [](const V& x, V& y) { y[0] = 2.0 * x[0] / x[1]; }},
                {"it is the transmittance, not the distance", [](const V& x, V& y) { y[0] = std::exp(-x[1] * x[0]); }}},
            .place = [](const V& x, const V& y) { return in_steps(-std::expm1(-x[1] * y[0])); },
            .fault = [](const V&, const V& y) { return y[0] < -0x1p-20 ? 1e3 : 0.0; }},
        {.slug = "phase-function",
            .title = "Henyey and Greenstein's phase function",
            .lesson = "08",
            .task = "Return the density over solid angle with which fog of the anisotropy `g` scatters light.\n"
                    "`cosine` is that of the angle between the old direction and the new one.\n"
                    "For g > 0 most light goes on forwards. g may be 0.",
            .prototype = "float phase_function(float g, float cosine)",
            .call = "answer(0, phase_function(given(0), given(1)));",
            .arguments = "g cosine",
            .results = "pdf",
            .kind = CheckKind::values,
            .draw = [](const V& u,
                        V& x) { x[0] = u[2] < 0.05 ? 0.0 : between(u[0], -0.9, 0.9), x[1] = between(u[1], -1.0, 1.0); },
            .answer = [](const V& x, V& y) { y[0] = oracle::phase_function(x[0], x[1]); },
            .wrong = {{"forwards and backwards are exchanged",
                          [](const V& x, V& y) { y[0] = oracle::phase_function(x[0], -x[1]); }},
                {"it is not divided by 4π",
                    [](const V& x, V& y) { y[0] = 4.0 * pi * oracle::phase_function(x[0], x[1]); }},
                {"it is divided by 2π, not by 4π",
                    [](const V& x, V& y) { y[0] = 2.0 * oracle::phase_function(x[0], x[1]); }},
                {"the power of the denominator is 1, not 3/2",
                    [](const V& x, V& y) {
                        y[0] = (1.0 - x[0] * x[0]) / (4.0 * pi * (1.0 + x[0] * x[0] - 2.0 * x[0] * x[1]));
                    }},
                {"g is left out: it is the same to all sides", [](const V&, V& y) { y[0] = 0.25 / pi; }},
                {"the power of the denominator is 1/2, not 3/2",
                    [](const V& x, V& y) {
                        y[0] = (1.0 - x[0] * x[0]) / (4.0 * pi * std::sqrt(1.0 + x[0] * x[0] - 2.0 * x[0] * x[1]));
                    }}}},
        {.slug = "phase-direction",
            .title = "A direction by the phase function",
            .lesson = "08",
            .task = "Light goes along +z and is scattered in fog of the anisotropy `g`. `a` and `b` are independent "
                    "and uniform\n"
                    "in [0, 1). Return the new direction, of unit length, by Henyey and Greenstein's phase function. g "
                    "may be 0.",
            .prototype = "vec3 phase_direction(float g, float a, float b)",
            .call = "answer3(0, phase_direction(given(2), given(0), given(1)));",
            .arguments = "a b g",
            .results = "direction:3",
            .kind = CheckKind::distribution,
            .draw =
                [](const V& u, V& x) {
                    const double g = between(u[2], -0.8, 0.8);
                    x.set(0, u.two(0)), x[2] = u[3] < 0.05 ? std::copysign(0.0, g) : g;
                },
            .answer =
                [](const V& x, V& y) {
                    y.set(0, oracle::phase_direction(x[2], {0.0, 0.0, 1.0}, x[0], x[1]));
                },
            .wrong = {{"forwards and backwards are exchanged",
                          [](const V& x, V& y) {
                              y.set(0, oracle::phase_direction(-x[2], {0.0, 0.0, 1.0}, x[0], x[1]));
                          }},
                {"g is left out: all directions are equally likely",
                    [](const V& x, V& y) { y.set(0, oracle::unit_sphere(x[0], x[1])); }},
                {"g is taken for half of itself",
                    [](const V& x, V& y) {
                        y.set(0, oracle::phase_direction(0.5 * x[2], {0.0, 0.0, 1.0}, x[0], x[1]));
                    }},
                {"the azimuth covers half a turn",
                    [](const V& x, V& y) {
                        y.set(0, oracle::phase_direction(x[2], {0.0, 0.0, 1.0}, x[0], x[1]));
                        y[1] = std::abs(y[1]);
                    }}},
            .place =
                [](const V& x, const V& y) {
                    const double g = x[2], mu = y[2];
                    const double below = std::abs(g) < 1e-6
                                             ? 0.5 * (1.0 + mu)
                                             : (1.0 - g * g) / (2.0 * g) *
                                                   (1.0 / std::sqrt(1.0 + g * g - 2.0 * g * mu) - 1.0 / (1.0 + g));
                    // Each sign of g has a half of its own: what is wrong with one must not hide what is wrong with the
                    // other.
                    return glm::dvec2(
                        0.5 * (below + (std::signbit(g) ? 1.0 : 0.0)), std::atan2(y[1], y[0]) / two_pi + 0.5);
                },
            .fault = [](const V&, const V& y) { return off_unit_length(y.three(0)); }},
    };
}

}  // namespace tandem
