#include "common/scene_loader_parts.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/gtc/matrix_transform.hpp>
#include <limits>

namespace tandem::scene_json {

namespace {

// A pixel's index must fit the random generator's 32 bits (MODEL.md section 3).
constexpr std::uint32_t greatest_side = 65536;
constexpr double greatest_pixel_count = 4294967295.0;
constexpr std::uint32_t greatest_bounces = 4096;

glm::dvec3 position(const Value& value) { return value.vector(-greatest_length, greatest_length); }
glm::dvec3 colour(const Value& value) { return value.vector(0.0, 1.0); }
glm::dvec3 radiance(const Value& value) { return value.vector(0.0, greatest_length); }

double optional_number(const Value& object, std::string_view key, double least, double greatest, double otherwise) {
    return object.has(key) ? object.member(key).number(least, greatest) : otherwise;
}

// Refuses `key` in a material that would ignore it.
void without(const Value& material, std::string_view key, const std::string& reason) {
    if (material.has(key)) material.member(key).refuse(reason, "remove it");
}

void read_translucent_fields(const Value& value, Material& material) {
    material.translucent = value.has("translucent") && value.member("translucent").boolean();
    if (!material.translucent) {
        for (const std::string_view key : {"alpha", "refractive_index", "fresnel"})
            without(value, key, "an opaque material has none, and would ignore it");
        return;
    }
    material.alpha = optional_number(value, "alpha", 0.0, 1.0, material.alpha);
    // Beyond these no medium lies, and single precision loses the squared ratio.
    material.refractive_index = optional_number(value, "refractive_index", 1e-3, 1e3, material.refractive_index);
    if (value.has("fresnel"))
        material.fresnel =
            value.member("fresnel").choice({"exact", "schlick"}) == 0 ? Fresnel::exact : Fresnel::schlick;
}

void read_radiance(const Value& value, Material& material) {
    material.radiance = radiance(value.required("radiance"));
    if (value.has("sides"))
        material.sides =
            value.member("sides").choice({"both", "front"}) == 0 ? EmittingSides::both : EmittingSides::front;
}

void read_diffuse(const Value& value, Material& material) {
    without(value, "translucent", "a diffuse material is always opaque");
    without(value, "fuzz", "a diffuse material has no lobe to blur");
    for (const std::string_view key : {"alpha", "refractive_index", "fresnel"})
        without(value, key, "a diffuse material is opaque, and would ignore it");
    material.colour = colour(value.required("colour"));
    if (value.has("radiance"))
        read_radiance(value, material);
    else
        without(value, "sides", "without \"radiance\" there is nothing to emit to one side or both");
}

void read_specular(const Value& value, Material& material) {
    for (const std::string_view key : {"radiance", "sides"})
        without(value, key, "a specular material does not emit; an emissive translucent one does both");
    material.colour = colour(value.required("colour"));
    read_translucent_fields(value, material);
    material.fuzz = optional_number(value, "fuzz", 0.0, 1.0, material.fuzz);
}

void read_emissive(const Value& value, Material& material) {
    read_radiance(value, material);
    read_translucent_fields(value, material);
    if (!material.translucent)
        for (const std::string_view key : {"colour", "fuzz"})
            without(value, key, "an opaque emissive material reflects nothing, and would ignore it");
    else
        material.colour = colour(value.required("colour"));
    material.fuzz = optional_number(value, "fuzz", 0.0, 1.0, material.fuzz);
}

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
    if (step.has("translate")) return glm::translate(glm::dmat4(1.0), position(step.member("translate")));
    if (step.has("rotate")) return read_rotation(step.member("rotate"));
    if (step.has("scale")) return read_scale(step.member("scale"));
    return read_matrix(step.member("matrix"));
}

// Refuses a map that is singular to double precision (MODEL.md section 6). The determinant d of three unit columns is a
// sum of six products of three elements; by Hadamard's inequality in the 1-norm the sum of their moduli is at most
// 3^(3/2) = 5.2, and each is rounded at most five times, so the computed d is off by 5 · 5.2 · 2^-53 < 2^-48 at most.
void check_invertible(const Value& value, const glm::dmat4& matrix) {
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

}  // namespace

Film read_film(const Value& value) {
    value.only({"width", "height"});
    const Film film{
        value.required("width").integer(1, greatest_side), value.required("height").integer(1, greatest_side)};
    if (double{1.0} * film.width * film.height > greatest_pixel_count)
        value.refuse("the image has more than 2^32 - 1 pixels", "make it smaller");
    return film;
}

Camera read_camera(const Value& value) {
    value.only({"position", "target", "up", "vertical_field_degrees", "lens_radius", "focus_distance"});
    Camera camera;
    camera.position = position(value.required("position"));
    camera.target = position(value.required("target"));
    if (value.has("up")) camera.up = position(value.member("up"));
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
    const glm::dvec3 view = camera.target - camera.position;
    // 2^-40 of the coordinates: below, the difference has lost a quarter of its bits and its direction means little.
    const double scale = std::max(glm::length(camera.position), glm::length(camera.target));
    if (!(glm::length(view) > 0x1p-40 * scale))
        value.refuse("the camera's target is its position", "move one of the two");
    if (glm::length(camera.up) < least_length) value.refuse("the up vector has no direction", "write [0, 1, 0], say");
    // The right vector is a difference of products good to about 2^-22 in single precision; at 2^-14 radians between
    // view and up it still holds eight bits.
    if (glm::length(glm::cross(glm::normalize(view), glm::normalize(camera.up))) < 0x1p-14)
        value.refuse("the up vector lies along the view", "turn it away from the view");
    return camera;
}

Background read_background(const Value& value) {
    Background background;
    if (value.json().is_array()) {
        background.down = background.up = radiance(value);
        return background;
    }
    value.only({"down", "up"});
    background.down = radiance(value.required("down"));
    background.up = radiance(value.required("up"));
    return background;
}

SceneDefaults read_render(const Value& value) {
    value.only({"integrator", "bounces", "roulette_start", "ray_min", "ray_max"});
    SceneDefaults defaults;
    if (value.has("integrator") && value.member("integrator").choice({"path", "next-event"}) == 1)
        defaults.integrator = Integrator::next_event;
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

Material read_material(const Value& value, const std::string& name) {
    value.only({"kind", "colour", "radiance", "sides", "translucent", "alpha", "fuzz", "refractive_index", "fresnel"});
    Material material;
    material.name = name;
    switch (value.required("kind").choice({"diffuse", "specular", "emissive"})) {
        case 0:
            material.kind = MaterialKind::diffuse;
            read_diffuse(value, material);
            break;
        case 1:
            material.kind = MaterialKind::specular;
            read_specular(value, material);
            break;
        default:
            material.kind = MaterialKind::emissive;
            read_emissive(value, material);
    }
    return material;
}

glm::dmat4 read_transform(const Value& value) {
    glm::dmat4 matrix(1.0);
    const std::size_t steps = value.array_size();
    for (std::size_t i = 0; i < steps; ++i) {
        const Value step = value.element(i);
        matrix = read_step(step) * matrix;
        check_invertible(step, matrix);
    }
    return matrix;
}

Expectation read_expectation(const Value& value) {
    value.only({"radiance", "formula"});
    const Value formula = value.required("formula");
    return {radiance(value.required("radiance")), formula.text()};
}

}  // namespace tandem::scene_json
