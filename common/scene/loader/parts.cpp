#include "common/scene/loader/parts.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/gtc/matrix_transform.hpp>
#include <limits>
#include <vector>

namespace tandem::scene_json {

namespace {

// A pixel's index must fit the random generator's 32 bits (MODEL.md section 3).
constexpr std::uint32_t greatest_film_side = 65536;
constexpr double greatest_pixel_count = 4294967295.0;
constexpr std::uint32_t greatest_bounces = 4096;

glm::dmat4 read_rotation(const Value& value) {
    value.only({"axis", "degrees"});
    const Value axis_value = value.required("axis");
    const glm::dvec3 axis = axis_value.vector(-greatest_length, greatest_length);
    if (glm::length(axis) < least_length) axis_value.refuse("the axis has no direction", "name a vector other than 0");
    const double degrees = value.required("degrees").number(-1e6, 1e6);  // beyond, its radians lose the direction
    return glm::rotate(glm::dmat4(1.0), glm::radians(degrees), glm::normalize(axis));
}

glm::dmat4 read_scale(const Value& value) {
    if (value.json().is_array()) return glm::scale(glm::dmat4(1.0), value.vector(-greatest_length, greatest_length));
    return glm::scale(glm::dmat4(1.0), glm::dvec3(value.number(-greatest_length, greatest_length)));
}

glm::dmat4 read_matrix(const Value& value) {
    if (value.array_size() != 16)
        value.refuse(fmt::format("has {} elements", value.array_size()), "write 16 numbers, row by row");
    glm::dmat4 matrix;
    for (int i = 0; i < 16; ++i)
        matrix[i % 4][i / 4] = value.element(static_cast<std::size_t>(i)).number(-greatest_length, greatest_length);
    if (matrix[0][3] != 0.0 || matrix[1][3] != 0.0 || matrix[2][3] != 0.0 || matrix[3][3] != 1.0)
        value.refuse("is not affine", "end it with the row 0, 0, 0, 1");
    return matrix;
}

glm::dmat4 read_step(const Value& step) {
    step.only({"translate", "rotate", "scale", "matrix"});
    if (step.json().size() != 1)
        step.refuse(fmt::format("a step holds one of translate, rotate, scale, matrix, not {}", step.json().size()),
            "write one step an object");
    if (step.has("translate")) return glm::translate(glm::dmat4(1.0), read_point(step.member("translate")));
    if (step.has("rotate")) return read_rotation(step.member("rotate"));
    if (step.has("scale")) return read_scale(step.member("scale"));
    return read_matrix(step.member("matrix"));
}

// The moments of [0, 1] at which a camera in motion may be at its worst. They are the ends, the least length of the
// view v + τ m, and its least angle to `up`. That angle's squared sine is N(τ)/D(τ). N and D are the squared lengths of
// (v + τ m) × up and v + τ m. N'D − ND' = A + Bτ + Cτ².
std::vector<double> worst_moments(const glm::dvec3& v, const glm::dvec3& m, const glm::dvec3& up) {
    std::vector<double> moments{0.0};
    if (m == glm::dvec3(0.0)) return moments;
    const glm::dvec3 v_up = glm::cross(v, up), m_up = glm::cross(m, up);
    const double n0 = glm::dot(v_up, v_up), n1 = 2.0 * glm::dot(v_up, m_up), n2 = glm::dot(m_up, m_up);
    const double d0 = glm::dot(v, v), d1 = 2.0 * glm::dot(v, m), d2 = glm::dot(m, m);
    const double a = n1 * d0 - n0 * d1, b = 2.0 * (n2 * d0 - n0 * d2), c = n2 * d1 - n1 * d2;
    const double q = -0.5 * (b + std::copysign(std::sqrt(std::max(0.0, b * b - 4.0 * a * c)), b));
    for (const double moment : {1.0, -0.5 * d1 / d2, q / c, a / q})
        if (moment > 0.0 && moment <= 1.0) moments.push_back(moment);
    return moments;
}

void check_view(const Value& value, const Camera& camera) {
    if (glm::length(camera.up) < least_length) value.refuse("the up vector has no direction", "write [0, 1, 0], say");
    const glm::dvec3 up = glm::normalize(camera.up);
    const glm::dvec3 still = camera.target - camera.position, motion = camera.target_motion - camera.position_motion;
    const std::vector<double> moments = worst_moments(still, motion, up);
    for (const double moment : moments) {
        const std::string when = moment == 0.0 ? "" : fmt::format(" at {} of the shutter's time", shown(moment));
        const glm::dvec3 position = camera.position + moment * camera.position_motion;
        const glm::dvec3 target = camera.target + moment * camera.target_motion, view = target - position;
        // 2^-40 of the coordinates: below, the difference has lost a quarter of its bits and its direction means
        // little.
        const double scale = std::max(glm::length(position), glm::length(target));
        if (!(glm::length(view) > 0x1p-40 * scale))
            value.refuse("the camera's target is its position" + when, "move one of the two");
        // The right vector is a difference of products good to about 2^-22 in single precision. At 2^-14 radians
        // between view and up it still holds eight bits.
        if (glm::length(glm::cross(glm::normalize(view), up)) < 0x1p-14)
            value.refuse("the up vector lies along the view" + when, "turn it away from the view");
    }
}

}  // namespace

Film read_film(const Value& value) {
    value.only({"width", "height"});
    const Film film{value.required("width").integer(1, greatest_film_side),
        value.required("height").integer(1, greatest_film_side)};
    if (double{1.0} * film.width * film.height > greatest_pixel_count)
        value.refuse("the image has more than 2^32 - 1 pixels", "make it smaller");
    return film;
}

Camera read_camera(const Value& value) {
    value.only({"position", "target", "up", "vertical_field_degrees", "lens_radius", "focus_distance", "motion"});
    Camera camera;
    camera.position = read_point(value.required("position"));
    camera.target = read_point(value.required("target"));
    if (value.has("up")) camera.up = read_point(value.member("up"));
    camera.vertical_field_degrees = value.required("vertical_field_degrees").number(0.0, 180.0);
    if (camera.vertical_field_degrees <= 0.0 || camera.vertical_field_degrees >= 180.0)
        value.member("vertical_field_degrees")
            .refuse(fmt::format("{} leaves no image plane", shown(camera.vertical_field_degrees)),
                "write an angle between 0 and 180, both excluded");
    if (value.has("lens_radius") != value.has("focus_distance"))
        value.refuse(
            "a thin lens has both a radius and a focus distance", "add the one missing, or remove both for a pinhole");
    if (value.has("lens_radius")) {
        camera.lens_radius = value.member("lens_radius").number(0.0, greatest_length);
        camera.focus_distance = value.member("focus_distance").number(least_length, greatest_length);
    }
    if (value.has("motion")) {
        const Value motion = value.member("motion");
        motion.only({"position", "target"});
        if (motion.has("position")) camera.position_motion = read_point(motion.member("position"));
        if (motion.has("target")) camera.target_motion = read_point(motion.member("target"));
    }
    check_view(value, camera);
    return camera;
}

SceneDefaults read_render(const Value& value) {
    value.only({"integrator", "bounces", "roulette_start", "ray_min", "ray_max"});
    SceneDefaults defaults;
    if (value.has("integrator"))
        defaults.integrator = static_cast<Integrator>(
            value.member("integrator").choice({"path", "next-event", "whitted", "bidirectional"}));
    if (value.has("bounces")) defaults.bounces = value.member("bounces").integer(0, greatest_bounces);
    if (value.has("roulette_start"))
        defaults.roulette_start = value.member("roulette_start").integer(1, greatest_bounces);
    defaults.ray_min = optional_number(value, "ray_min", 0.0, greatest_length, defaults.ray_min);
    defaults.ray_max = optional_number(value, "ray_max", 0.0, greatest_length, defaults.ray_max);
    if (defaults.ray_min > defaults.ray_max)
        value.refuse(fmt::format("ray_min {} exceeds ray_max {}", shown(defaults.ray_min), shown(defaults.ray_max)),
            "no ray could meet anything; exchange them");
    return defaults;
}

// The determinant d of three unit columns is a sum of six products of three elements. By Hadamard's inequality in the
// 1-norm the sum of their moduli is at most 3^(3/2) = 5.2. Each is rounded at most five times, so the computed d is off
// by 5 · 5.2 · 2^-53 < 2^-48 at most.
void check_transform(const Value& value, const glm::dmat4& matrix) {
    std::array<glm::dvec3, 3> columns;
    for (int i = 0; i < 3; ++i) {
        const glm::dvec3 column(matrix[i]);
        const double length = glm::length(column);
        if (!(length <= greatest_length && glm::length(glm::dvec3(matrix[3])) <= greatest_length))
            value.refuse("the transform is too large", fmt::format("keep lengths below {}", shown(greatest_length)));
        if (!(length >= least_length))
            value.refuse("the transform is singular: it flattens its object", "scale by other numbers than 0");
        columns[static_cast<std::size_t>(i)] = column / length;
    }
    const double determinant = glm::dot(glm::cross(columns[0], columns[1]), columns[2]);
    if (!(std::abs(determinant) > 0x1p-48))
        value.refuse("the transform is singular: it flattens its object", "make its three columns independent");
}

glm::dmat4 read_transform(const Value& value) {
    glm::dmat4 matrix(1.0);
    const std::size_t steps = value.array_size();
    for (std::size_t i = 0; i < steps; ++i) {
        const Value step = value.element(i);
        matrix = read_step(step) * matrix;
        check_transform(step, matrix);
    }
    return matrix;
}

Expectation read_expectation(const Value& value) {
    value.only({"radiance", "formula"});
    const Value formula = value.required("formula");
    return {read_radiance(value.required("radiance")), formula.text()};
}

}  // namespace tandem::scene_json
