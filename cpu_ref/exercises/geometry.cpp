// Exercises 1 to 7: cameras, intersections, frames, offsets.
#include "cpu_ref/exercises/draws.h"
#include "cpu_ref/exercises/exercises.h"
#include "cpu_ref/exercises/paths.h"
#include "cpu_ref/first_tracer/shapes.h"

namespace tandem {

namespace {

using first::Ray;
using first::Shape;
constexpr double infinity = std::numeric_limits<double>::infinity();

double distance_or_miss(const std::optional<first::Hit>& hit) { return hit ? hit->t : -1.0; }

// origin:3 direction:3 centre:3 radius
double sphere_at(const V& x, double least = 0.0) {
    const Shape s{.kind = PrimitiveKind::sphere,
        .material = 0,
        .to_world = glm::dmat4(1.0),
        .to_object = glm::dmat4(1.0),
        .normal_to_world = glm::dmat3(1.0),
        .a = x.three(6),
        .radius = x[9]};
    return distance_or_miss(first::meet_sphere(s, Ray{x.three(0), x.three(3)}, false, least, infinity));
}

void draw_sphere(const V& u, V& x) {
    const glm::dvec3 centre = any_point(u, 0, 2.0);
    const double radius = between(u[3], 0.3, 1.5);
    // A third of the rays begins within.
    const glm::dvec3 origin =
        centre + any_direction(u, 4) * radius * (u[6] < 0.33 ? 0.9 * u[7] : 1.0 + between_logarithms(u[7], 1e-3, 4.0));
    const glm::dvec3 aim = centre + 1.2 * radius * any_direction(u, 8);
    x.set(0, origin), x.set(3, u[10] < 0.2 ? any_direction(u, 11) : glm::normalize(aim - origin)), x.set(6, centre);
    x[9] = radius;
}

// origin:3 direction:3 a:3 b:3 c:3
Shape triangle_of(const V& x) {
    Shape s{.kind = PrimitiveKind::triangle,
        .material = 0,
        .to_world = glm::dmat4(1.0),
        .to_object = glm::dmat4(1.0),
        .normal_to_world = glm::dmat3(1.0),
        .a = x.three(6),
        .b = x.three(9),
        .c = x.three(12)};
    s.normal = glm::normalize(glm::cross(s.b - s.a, s.c - s.a));
    return s;
}
double triangle_at(const V& x, double least = 0.0) {
    return distance_or_miss(first::meet_triangle(triangle_of(x), Ray{x.three(0), x.three(3)}, least, infinity));
}

void draw_triangle(const V& u, V& x) {
    const glm::dvec3 a = any_point(u, 0, 1.0), b = a + 1.5 * any_direction(u, 3), n = any_direction(u, 5);
    const glm::dvec3 c = a + 1.5 * glm::normalize(glm::cross(n, b - a));  // a right angle: no needles
    const glm::dvec3 aim = a + 1.3 * (u[7] - 0.1) * (b - a) + 1.3 * (u[8] - 0.1) * (c - a);
    const glm::dvec3 way = any_direction(u, 9) + 1.01 * glm::normalize(glm::cross(b - a, c - a));
    x.set(0, aim - glm::normalize(way) * between(u[11], -1.0, 3.0)), x.set(3, glm::normalize(way));
    x.set(6, a), x.set(9, b), x.set(12, c);
    if (u[12] < 0.5) x.set(9, c), x.set(12, b);  // both sides
}

// origin:3 direction:3 low:3 high:3
double box_at(const V& x, double least = 0.0) {
    const Shape s{.kind = PrimitiveKind::cuboid,
        .material = 0,
        .to_world = glm::dmat4(1.0),
        .to_object = glm::dmat4(1.0),
        .normal_to_world = glm::dmat3(1.0),
        .a = x.three(6),
        .b = x.three(9)};
    return distance_or_miss(first::meet_cuboid(s, Ray{x.three(0), x.three(3)}, false, least, infinity));
}

void draw_box(const V& u, V& x) {
    const glm::dvec3 low = any_point(u, 0, 1.0), size = 0.3 + 1.5 * u.three(3);
    const glm::dvec3 within = low + size * u.three(6);
    const glm::dvec3 way = any_direction(u, 9);
    x.set(0, within - way * (u[11] < 0.3 ? 0.0 : between(u[12], -4.0, 4.0)));
    x.set(3, u[13] < 0.7 ? way : any_direction(u, 14)), x.set(6, low), x.set(9, low + size);
}

// film:2 field aspect; the camera looks along -z.
void camera(const V& x, V& y, double squeeze, double flip, bool whole_angle, bool unit = true) {
    const double h = std::tan((whole_angle ? 1.0 : 0.5) * x[2]);
    const glm::dvec3 q(h * squeeze * (2.0 * x[0] - 1.0), flip * h * (1.0 - 2.0 * x[1]), -1.0);
    y.set(0, unit ? glm::normalize(q) : q);
}

// The film, two before the camera, is what its ray meets.
ExercisePath path_to_film(const V& x, const V& y) {
    constexpr double distance = 2.0;
    const glm::dvec3 d = y.three(0);
    // Along the other half of the axis there is no film.
    ExercisePath made = path_that_meets({}, d, d.z < 0.0 ? -distance / d.z : -1.0, "film");
    if (std::isnan(d.x + d.y + d.z)) made.path.vertices.front().t = std::numeric_limits<double>::quiet_NaN();
    made.scene.film = {static_cast<std::uint32_t>(std::lround(128.0 * x[3])), 128};
    made.scene.camera = {.target = {0.0, 0.0, -1.0}, .vertical_field_degrees = glm::degrees(x[2])};
    made.pixel = {static_cast<std::uint32_t>(x[0] * made.scene.film.width), static_cast<std::uint32_t>(x[1] * 128.0)};
    const double high = distance * std::tan(0.5 * x[2]), wide = high * x[3];
    const glm::dvec3 corners[] = {
        {-wide, -high, -distance}, {wide, -high, -distance}, {wide, high, -distance}, {-wide, high, -distance}};
    add_triangle(made.scene, corners[0], corners[1], corners[2]);
    add_triangle(made.scene, corners[0], corners[2], corners[3]);
    return made;
}
ExercisePath path_to_plane(const V& x, const V& y) {
    ExercisePath made = path_that_meets(x.three(0), x.three(3), y[0], "plane");
    // A part of it, about the foot of the origin.
    const glm::dvec3 n = x.three(9), foot = x.three(0) - glm::dot(x.three(0) - x.three(6), n) * n;
    add_square(made.scene, foot, n, 1.5 * glm::distance(foot, x.three(0)) + 1.0);
    return made;
}
ExercisePath path_to_sphere(const V& x, const V& y) {
    ExercisePath made = path_that_meets(x.three(0), x.three(3), y[0], "sphere");
    add_sphere(made.scene, x.three(6), x[9]);
    return made;
}
ExercisePath path_to_triangle(const V& x, const V& y) {
    ExercisePath made = path_that_meets(x.three(0), x.three(3), y[0], "triangle");
    add_triangle(made.scene, x.three(6), x.three(9), x.three(12));
    return made;
}
ExercisePath path_to_box(const V& x, const V& y) {
    ExercisePath made = path_that_meets(x.three(0), x.three(3), y[0], "box");
    add_cuboid(made.scene, x.three(6), x.three(9));
    return made;
}

// normal:3, and results: tangent:3 bitangent:3
double fault_of_frame(const V& x, const V& y) {
    const glm::dvec3 n = x.three(0), t = y.three(0), b = y.three(3);
    double off = std::max(off_unit_length(t), off_unit_length(b));
    for (const double dot : {glm::dot(t, b), glm::dot(t, n), glm::dot(b, n)})
        off = std::max(off, std::abs(dot) / 0x1p-14);
    return std::max(off, glm::length(glm::cross(t, b) - n) / 0x1p-13);
}

// point:3 normal:3 error: a point that is known up to `error` a coordinate, moved off the surface.
// It must be beyond the error, by rounding too, and not much beyond: 4 times the error and 8 ulp of the point.
double fault_of_offset(const V& x, const V& y) {
    const glm::dvec3 n = x.three(3), moved = y.three(0) - x.three(0);
    const glm::dvec3 size = glm::abs(x.three(0)), weights = glm::abs(n);
    const double bound = x[6] * (weights.x + weights.y + weights.z);
    const double ulps = 0x1p-23 * (glm::dot(weights, size) + 0x1p-100);
    const double along = glm::dot(moved, n);
    if (!(along >= bound)) return 2.0 + (bound - along) / (bound + 1e-300);
    return along / (4.0 * bound + 8.0 * ulps);
}
double float_sum(double a, double b) { return static_cast<double>(static_cast<float>(a) + static_cast<float>(b)); }
void offset_by(const V& x, V& y, double distance, bool next_float) {
    for (std::size_t k = 0; k < 3; ++k) {
        const double by = distance * x[3 + k];
        y[k] = float_sum(x[k], by);
        if (!next_float || by == 0.0) continue;
        y[k] = static_cast<double>(std::nextafter(static_cast<float>(y[k]), by > 0.0 ? INFINITY : -INFINITY));
    }
}
double error_along(const V& x) { return x[6] * (std::abs(x[3]) + std::abs(x[4]) + std::abs(x[5])); }

}  // namespace

std::vector<Exercise> exercises_of_geometry() {
    return {
        {.slug = "camera-ray",
            .title = "The direction of a camera's ray",
            .lesson = "01",
            .task =
                "A pinhole camera looks along -z, x to the right, y up. `film` is a place on the film: (0, 0) is its\n"
                "upper left corner and (1, 1) its lower right one. `field` is the vertical angle of the whole view, "
                "in\n"
                "radians, and `aspect` the width of the film over its height.\n"
                "Return the direction of the ray through that place, of unit length.",
            .prototype = "vec3 camera_ray(vec2 film, float field, float aspect)",
            .call = "answer3(0, camera_ray(given2(0), given(2), given(3)));",
            .arguments = "film:2 field aspect",
            .results = "direction:3",
            .kind = CheckKind::values,
            .draw = [](const V& u,
                        V& x) { x.set(0, u.two(0)), x[2] = between(u[2], 0.3, 1.4), x[3] = between(u[3], 0.5, 2.0); },
            .answer = [](const V& x, V& y) { camera(x, y, x[3], 1.0, false); },
            .wrong = {{"the image is upside down", [](const V& x, V& y) { camera(x, y, x[3], -1.0, false); }},
                {"the field's angle is not halved", [](const V& x, V& y) { camera(x, y, x[3], 1.0, true); }},
                {"the aspect is left out", [](const V& x, V& y) { camera(x, y, 1.0, 1.0, false); }},
                {"the aspect is the wrong way up", [](const V& x, V& y) { camera(x, y, 1.0 / x[3], 1.0, false); }},
                {"the direction is not of unit length",
                    [](const V& x, V& y) { camera(x, y, x[3], 1.0, false, false); }}},
            .path = path_to_film},
        {.slug = "ray-plane",
            .title = "A ray and a plane",
            .lesson = "02",
            .task = "The plane holds the point `p` and has the normal `n` of unit length. Return the distance at which "
                    "the\n"
                    "ray meets it, or -1 where that lies behind the ray's origin. `direction` is of unit length, and "
                    "never\n"
                    "parallel to the plane.",
            .prototype = "float ray_plane(vec3 origin, vec3 direction, vec3 p, vec3 n)",
            .call = "answer(0, ray_plane(given3(0), given3(3), given3(6), given3(9)));",
            .arguments = "origin:3 direction:3 p:3 n:3",
            .results = "t",
            .kind = CheckKind::values,
            .draw =
                [](const V& u, V& x) {
                    const glm::dvec3 n = any_direction(u, 0), d = any_direction(u, 2);
                    x.set(0, any_point(u, 4, 3.0)), x.set(6, any_point(u, 7, 3.0)), x.set(9, n);
                    x.set(3, glm::normalize(d + (glm::dot(d, n) < 0.0 ? -0.3 : 0.3) * n));
                },
            .answer =
                [](const V& x, V& y) {
                    const double t = glm::dot(x.three(6) - x.three(0), x.three(9)) / glm::dot(x.three(3), x.three(9));
                    y[0] = t < 0.0 ? -1.0 : t;
                },
            .wrong = {{"planes behind the origin are hit",
                          [](const V& x, V& y) {
                              y[0] = glm::dot(x.three(6) - x.three(0), x.three(9)) / glm::dot(x.three(3), x.three(9));
                          }},
                {"the sign is the other one",
                    [](const V& x, V& y) {
                        const double t =
                            glm::dot(x.three(0) - x.three(6), x.three(9)) / glm::dot(x.three(3), x.three(9));
                        y[0] = t < 0.0 ? -1.0 : t;
                    }},
                {"the distance of the point from the plane, not along the ray",
                    [](const V& x, V& y) {
                        const double t =
                            glm::dot(x.three(6) - x.three(0), x.three(9)) / glm::dot(x.three(3), x.three(9));
                        y[0] = t < 0.0 ? -1.0 : std::abs(glm::dot(x.three(6) - x.three(0), x.three(9)));
                    }},
                {"only the front of the plane is hit",
                    [](const V& x, V& y) {
                        const double cosine = glm::dot(x.three(3), x.three(9));
                        const double t = glm::dot(x.three(6) - x.three(0), x.three(9)) / cosine;
                        y[0] = t < 0.0 || cosine > 0.0 ? -1.0 : t;
                    }}},
            .path = path_to_plane},
        {.slug = "ray-sphere",
            .title = "A ray and a sphere",
            .lesson = "02",
            .task = "Return the least distance t >= 0 at which the ray meets the sphere, or -1 where it does not. The "
                    "ray may\n"
                    "begin within the sphere. `direction` is of unit length.",
            .prototype = "float ray_sphere(vec3 origin, vec3 direction, vec3 centre, float radius)",
            .call = "answer(0, ray_sphere(given3(0), given3(3), given3(6), given(9)));",
            .arguments = "origin:3 direction:3 centre:3 radius",
            .results = "t",
            .kind = CheckKind::values,
            .draw = draw_sphere,
            .answer = [](const V& x, V& y) { y[0] = sphere_at(x); },
            .wrong = {{"a ray from within meets nothing",
                          [](const V& x, V& y) {
                              const double t = sphere_at(x);
                              y[0] = glm::distance(x.three(0), x.three(6)) < x[9] ? -1.0 : t;
                          }},
                {"spheres behind the origin are hit", [](const V& x, V& y) { y[0] = sphere_at(x, -infinity); }},
                {"the far root is taken",
                    [](const V& x, V& y) {
                        const double t = sphere_at(x);
                        const bool within = glm::distance(x.three(0), x.three(6)) < x[9];
                        y[0] = t < 0.0 || within ? t : sphere_at(x, std::nextafter(t, infinity) + 1e-6);
                    }},
                {"the centre is taken for the origin",
                    [](const V& x, V& y) {
                        V moved = x;
                        moved.set(6, glm::dvec3(0.0));
                        y[0] = sphere_at(moved);
                    }},
                {"the radius is not squared",
                    [](const V& x, V& y) {
                        V other = x;
                        other[9] = std::sqrt(x[9]);
                        y[0] = sphere_at(other);
                    }}},
            .path = path_to_sphere},
        {.slug = "ray-triangle",
            .title = "A ray and a triangle",
            .lesson = "02",
            .task = "Return the distance t >= 0 at which the ray meets the triangle a, b, c, or -1 where it does not. "
                    "Both\n"
                    "sides are hit. `direction` is of unit length.",
            .prototype = "float ray_triangle(vec3 origin, vec3 direction, vec3 a, vec3 b, vec3 c)",
            .call = "answer(0, ray_triangle(given3(0), given3(3), given3(6), given3(9), given3(12)));",
            .arguments = "origin:3 direction:3 a:3 b:3 c:3",
            .results = "t",
            .kind = CheckKind::values,
            .draw = draw_triangle,
            .answer = [](const V& x, V& y) { y[0] = triangle_at(x); },
            .wrong = {{"only one side is hit",
                          [](const V& x, V& y) {
                              y[0] = glm::dot(x.three(3), triangle_of(x).normal) > 0.0 ? -1.0 : triangle_at(x);
                          }},
                {"only the other side is hit",
                    [](const V& x, V& y) {
                        y[0] = glm::dot(x.three(3), triangle_of(x).normal) < 0.0 ? -1.0 : triangle_at(x);
                    }},
                {"triangles behind the origin are hit", [](const V& x, V& y) { y[0] = triangle_at(x, -infinity); }},
                {"the parallelogram is hit, not the triangle alone",
                    [](const V& x, V& y) {
                        V other = x;
                        other.set(6, x.three(9) + x.three(12) - x.three(6));
                        y[0] = std::max(triangle_at(x), triangle_at(other));
                    }},
                {"the whole plane is hit",
                    [](const V& x, V& y) {
                        const Shape s = triangle_of(x);
                        const double t = glm::dot(s.normal, s.a - x.three(0)) / glm::dot(s.normal, x.three(3));
                        y[0] = t < 0.0 ? -1.0 : t;
                    }}},
            .path = path_to_triangle},
        {.slug = "ray-box",
            .title = "A ray and a box",
            .lesson = "02",
            .task =
                "The box has its edges along the axes, from the corner `low` to the corner `high`. Return the least\n"
                "distance t >= 0 at which the ray meets its surface, or -1 where it does not. The ray may begin "
                "within.",
            .prototype = "float ray_box(vec3 origin, vec3 direction, vec3 low, vec3 high)",
            .call = "answer(0, ray_box(given3(0), given3(3), given3(6), given3(9)));",
            .arguments = "origin:3 direction:3 low:3 high:3",
            .results = "t",
            .kind = CheckKind::values,
            .draw = draw_box,
            .answer = [](const V& x, V& y) { y[0] = box_at(x); },
            .wrong = {{"boxes behind the origin are hit", [](const V& x, V& y) { y[0] = box_at(x, -infinity); }},
                {"a ray from within meets nothing",
                    [](const V& x, V& y) {
                        const bool within = glm::all(glm::greaterThan(x.three(0), x.three(6))) &&
                                            glm::all(glm::lessThan(x.three(0), x.three(9)));
                        y[0] = within ? -1.0 : box_at(x);
                    }},
                {"a ray from within gets distance 0",
                    [](const V& x, V& y) {
                        const bool within = glm::all(glm::greaterThan(x.three(0), x.three(6))) &&
                                            glm::all(glm::lessThan(x.three(0), x.three(9)));
                        y[0] = within ? 0.0 : box_at(x);
                    }},
                {"the far side is taken",
                    [](const V& x, V& y) {
                        const double t = box_at(x);
                        const double far = t < 0.0 ? -1.0 : box_at(x, t + 1e-6);
                        y[0] = far < 0.0 ? t : far;
                    }}},
            .path = path_to_box},
        {.slug = "frame",
            .title = "A frame about a normal",
            .lesson = "05",
            .task = "`n` is of unit length. Find two vectors `t` and `b` of unit length, at right angles to `n` and to "
                    "each\n"
                    "other, so that cross(t, b) is `n`. Any such pair will do, also where `n` is an axis.",
            .prototype = "void frame(vec3 n, out vec3 t, out vec3 b)",
            .call = "vec3 tandem_t = vec3(0), tandem_b = vec3(0); frame(given3(0), tandem_t, tandem_b); answer3(0, "
                    "tandem_t); answer3(3, tandem_b);",
            .arguments = "n:3",
            .results = "t:3 b:3",
            .kind = CheckKind::property,
            .draw =
                [](const V& u, V& x) {
                    x.set(0, any_direction(u, 0));
                    if (u[2] > 0.1) return;
                    glm::dvec3 axis(0.0);
                    axis[static_cast<int>(3.0 * u[3])] = u[4] < 0.5 ? -1.0 : 1.0;
                    x.set(0, axis);
                },
            .answer =
                [](const V& x, V& y) {
                    const oracle::Frame frame(x.three(0));
                    y.set(0, frame.tangent), y.set(3, frame.bitangent);
                },
            .wrong = {{"the frame is left-handed",
                          [](const V& x, V& y) {
                              const oracle::Frame frame(x.three(0));
                              y.set(0, frame.bitangent), y.set(3, frame.tangent);
                          }},
                {"the tangent is not normalised",
                    [](const V& x, V& y) {
                        const glm::dvec3 t = glm::cross(glm::dvec3(0.0, 1.0, 0.0), x.three(0));
                        y.set(0, t), y.set(3, glm::cross(x.three(0), t));
                    }}},
            .fault = fault_of_frame},
        {.slug = "offset",
            .title = "An offset without a magic epsilon",
            .lesson = "10",
            .task =
                "`p` is a hit on a surface with the unit normal `n`. Rounding puts each of its coordinates off by up "
                "to\n"
                "`error`. Return the point from which a ray on the side of `n` may start: off the surface by at least\n"
                "error * (|n.x| + |n.y| + |n.z|) measured along `n`, whatever the result is rounded to, but not by "
                "more\n"
                "than four times that and eight units in the last place of `p`.",
            .prototype = "vec3 offset_origin(vec3 p, vec3 n, float error)",
            .call = "answer3(0, offset_origin(given3(0), given3(3), given(6)));",
            .arguments = "p:3 n:3 error",
            .results = "origin:3",
            .kind = CheckKind::property,
            .draw =
                [](const V& u, V& x) {
                    const double size = between_logarithms(u[0], 1e-3, 1e5);
                    x.set(0, any_point(u, 1, size)), x.set(3, any_direction(u, 4));
                    x[6] = 0x1p-24 * size * between_logarithms(u[6], 1.0, 32.0);
                },
            .answer = [](const V& x, V& y) { offset_by(x, y, 1.5 * error_along(x), true); },
            .wrong = {{"a fixed epsilon of 0.001", [](const V& x, V& y) { offset_by(x, y, 1e-3, false); }},
                {"a fixed epsilon of 0.0001", [](const V& x, V& y) { offset_by(x, y, 1e-4, false); }},
                {"no offset", [](const V& x, V& y) { y.set(0, x.three(0)); }},
                {"the offset goes to the other side", [](const V& x, V& y) { offset_by(x, y, -error_along(x), true); }},
                {"the sum's own rounding is forgotten",
                    [](const V& x, V& y) { offset_by(x, y, error_along(x), false); }}},
            .fault = fault_of_offset},
    };
}

}  // namespace tandem
