// Next events as every tracer draws them: chi-square of directions, densities, choice among lights, and
// lights without a surface. Seen by `whitted`, whose next event brings C/pi cos L / (P p), which tells P p.
#include "tests/suite/samplers.h"

using namespace tandem;
using namespace tandem::test;
using namespace tandem::test::samplers;

namespace {

const dvec3 colour(0.9, 0.9, 0.9), radiance(2.0, 2.0, 2.0);

// The receiver: a small floor at the origin, seen from beneath all lights.
SceneBuilder receiver() {
    SceneBuilder b = looking_from({0.3, 0.5, -0.2});
    // One triangle: beside the diagonal of a square the other half blocks what leaves within rounding of it.
    b.triangle(diffuse(colour), {-0.01, 0.0, 0.02}, {0.02, 0.0, 0.0}, {-0.01, 0.0, -0.02});
    return b;
}

// P p of a next event at the receiver.
double density_of(const TracedVertex& vertex, double light = radiance.x) {
    return colour.x / pi * vertex.next_event.direction.y * light / vertex.light.x;
}

// Density of a direction as seen from a point.
using DensityFrom = std::function<double(const dvec3& d, const dvec3& p)>;

// Directions drawn, zero where nothing came, and how far their densities lie from `density`.
void check_light(const Scene& scene, const std::vector<double>& shares, const DensityFrom& density) {
    for (Tracer& tracer : tracers()) {
        CAPTURE(tracer.name);
        std::vector<dvec3> drawn;
        double worst = 0.0;
        std::string lost;  // where the last vertex was that no light reached
        for (const PathTrace& trace : traces_of(tracer, scene, settings_of(1, 1, Integrator::whitted))) {
            const TracedVertex& vertex = trace.vertices.front();
            REQUIRE(vertex.primitive != no_index);
            drawn.push_back(vertex.next_event.direction);
            if (vertex.next_event.direction == dvec3(0.0)) {
                std::ostringstream where;
                where.precision(12);
                where << vertex.position.x << " " << vertex.position.y << " " << vertex.position.z << " primitive "
                      << vertex.primitive;
                lost = where.str();
                continue;
            }
            worst = std::max(
                worst, relative_error(density_of(vertex), density(vertex.next_event.direction, vertex.position)));
        }
        CAPTURE(lost);
        check_directions(drawn, shares);
        CAPTURE(worst);
        CHECK(worst < tolerance(tracer));
    }
}

// Shares of cells from points of a surface that are drawn with equal chances, those that `counts` refuses left out.
std::vector<double> shares_of_points(
    const std::function<dvec3(double, double)>& point, double chance,
    const std::function<bool(const dvec3&)>& counts = [](const dvec3&) { return true; }) {
    constexpr int n = 1500;
    std::vector<double> shares(cells, 0.0);
    for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j) {
            const dvec3 y = point((i + 0.5) / n, (j + 0.5) / n);
            if (counts(y)) shares[cell_of(glm::normalize(y))] += chance / (static_cast<double>(n) * n);
        }
    return shares;
}
void add(std::vector<double>& sum, const std::vector<double>& other) {
    for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += other[i];
}

double area_of(const dvec3& a, const dvec3& b, const dvec3& c) { return 0.5 * glm::length(glm::cross(b - a, c - a)); }

// r^2/(area cos) where the ray from p meets the plane through `corner`.
double density_on_plane(const dvec3& d, const dvec3& p, const dvec3& corner, const dvec3& n, double area) {
    const double t = glm::dot(corner - p, n) / glm::dot(d, n);
    return t * t / (area * std::abs(glm::dot(glm::normalize(n), d)));
}

std::function<dvec3(double, double)> points_of(const dvec3& a, const dvec3& b, const dvec3& c) {
    return [=](double u, double v) {  // the square folded along its diagonal
        return u + v > 1.0 ? a + (1.0 - u) * (b - a) + (1.0 - v) * (c - a) : a + u * (b - a) + v * (c - a);
    };
}

}  // namespace

TEST_CASE("samplers: points of a triangle light are even over its area") {
    const dvec3 a(-1.0, 2.0, -1.0), b(2.0, 2.5, 0.0), c(0.0, 2.0, 1.5);
    SceneBuilder builder = receiver();
    builder.triangle(emitter(radiance), a, b, c);
    check_light(builder.scene(), shares_of_points(points_of(a, b, c), 1.0), [&](const dvec3& w, const dvec3& p) {
        return density_on_plane(w, p, a, glm::cross(b - a, c - a), area_of(a, b, c));
    });
}

TEST_CASE("samplers: the triangles of a quad light, and a triangle without area, share by area") {
    const dvec3 a(-1.0, 2.0, -1.0), b(-1.0, 2.0, 1.0), c(3.0, 2.0, 1.0), d(1.0, 2.0, -1.0);
    SceneBuilder builder = receiver();
    builder.quad(emitter(radiance), a, b, c, d).triangle(emitter(radiance), {9, 9, 9}, {8, 8, 8}, {7, 7, 7});
    const double first = area_of(a, b, c), second = area_of(a, c, d), all = first + second;
    std::vector<double> shares = shares_of_points(points_of(a, b, c), first / all);
    add(shares, shares_of_points(points_of(a, c, d), second / all));
    check_light(builder.scene(), shares, [&](const dvec3& w, const dvec3& p) {
        return density_on_plane(w, p, a, {0, 1, 0}, all);
    });
}

TEST_CASE("samplers: a sphere light is even over the cone in which it is seen, from inside over its area") {
    const dvec3 centre(1.0, 3.0, 0.5);
    constexpr double rho = 1.2;
    SceneBuilder outside = receiver();
    outside.sphere(emitter(radiance), centre, rho);
    const double distance = glm::length(centre);
    const auto cone_at = [](double d) { return 1.0 - std::sqrt(1.0 - rho * rho / (d * d)); };
    const double cone = cone_at(distance);
    const dvec3 axis = centre / distance, side = glm::normalize(glm::cross(axis, dvec3(0, 1, 0))),
                up = glm::cross(side, axis);
    check_light(outside.scene(),
        shares_of_points(
            [&](double u, double v) {
                const double cosine = 1.0 - cone * u, sine = std::sqrt(1.0 - cosine * cosine);
                return cosine * axis + sine * (std::cos(2.0 * pi * v) * side + std::sin(2.0 * pi * v) * up);
            },
            1.0),
        [&](const dvec3&, const dvec3& p) { return 1.0 / (2.0 * pi * cone_at(glm::distance(centre, p))); });

    const dvec3 around(0.3, 0.2, -0.1);
    constexpr double large = 8.0;  // around the camera too
    SceneBuilder inside = receiver();
    inside.sphere(emitter(radiance), around, large);
    check_light(inside.scene(),
        shares_of_points(
            [&](double u, double v) {
                const double z = 1.0 - 2.0 * u, r = std::sqrt(1.0 - z * z);
                return around + large * dvec3(r * std::cos(2.0 * pi * v), z, r * std::sin(2.0 * pi * v));
            },
            1.0, [](const dvec3& y) { return y.y > 0.0; }),
        [&](const dvec3& d, const dvec3& p) {
            const dvec3 c = around - p;
            const double b = glm::dot(d, c), t = b + std::sqrt(b * b - glm::dot(c, c) + large * large);
            return t * t / (4.0 * pi * large * large * std::abs(glm::dot(t * d - c, d)) / large);
        });
}

TEST_CASE("samplers: a cuboid light is even over its area and counts where it is seen") {
    const dvec3 low(-1.0, 2.0, -0.5), high(1.5, 3.0, 1.0), size = high - low;
    SceneBuilder builder = receiver();
    builder.cuboid(emitter(radiance), low, high);
    const double all = 2.0 * (size.x * size.y + size.y * size.z + size.z * size.x);
    // Seen from the origin: the lower face alone, the others being behind it or edge on.
    const auto below = shares_of_points(
        [&](double u, double v) { return low + dvec3(u * size.x, 0.0, v * size.z); }, size.x * size.z / all);
    check_light(builder.scene(), below, [&](const dvec3& w, const dvec3& p) {
        return density_on_plane(w, p, low, {0, 1, 0}, all);
    });
}

TEST_CASE("samplers: an ellipsoid light is even over the cone of the sphere that it is the image of") {
    const dvec3 centre(0.5, 3.0, 0.0), scale(1.0, 1.8, 0.6);
    SceneBuilder builder = receiver();
    builder.sphere(emitter(radiance), black, 1.0, moved(centre) * scaled(scale));
    const auto cone_from = [&](const dvec3& x) { return 1.0 - std::sqrt(1.0 - 1.0 / glm::dot(x, x)); };
    const dvec3 x = -centre / scale, axis = glm::normalize(-x);
    const dvec3 side = glm::normalize(glm::cross(axis, dvec3(1, 0, 0))), up = glm::cross(side, axis);
    check_light(builder.scene(),
        shares_of_points(
            [&](double u, double v) {
                const double cosine = 1.0 - cone_from(x) * u, sine = std::sqrt(1.0 - cosine * cosine);
                const dvec3 w = cosine * axis + sine * (std::cos(2.0 * pi * v) * side + std::sin(2.0 * pi * v) * up);
                return scale * w;
            },
            1.0),
        [&](const dvec3& d, const dvec3& p) {
            const double stretch = glm::length(scale * glm::normalize(d / scale));
            const double determinant = scale.x * scale.y * scale.z;
            return stretch * stretch * stretch / determinant / (2.0 * pi * cone_from((p - centre) / scale));
        });
}

TEST_CASE("samplers: a one-sided light seen from behind is no next event") {
    SceneBuilder behind = receiver();
    behind.triangle(emitter(radiance, EmittingSides::front), {-1, 2, 1}, {1, 2, 1}, {0, 2, -1});  // its front is up
    for (Tracer& tracer : tracers()) {
        CAPTURE(tracer.name);
        for (const Integrator integrator : {Integrator::next_event, Integrator::whitted})
            for (const PathTrace& trace : traces_of(tracer, behind.scene(), settings_of(1, 1, integrator), 500))
                CHECK(trace.vertices[0].light == black);
    }
}

TEST_CASE("samplers: a sky that is a mix of two colours is drawn in proportion to its brightness") {
    for (const auto& [down, up] : {std::pair{0.2, 3.0}, {2.0, 0.5}, {1.0, 1.0}, {0.0, 2.0}}) {
        CAPTURE(down);
        SceneBuilder builder = receiver();
        Scene scene = builder.background(dvec3(down), dvec3(up)).scene();
        scene.background.sampled = true;
        const auto brightness = [down = down, up = up](
                                    const dvec3& d) { return down + (up - down) * 0.5 * (d.y + 1.0); };
        const Density density = [&](const dvec3& d) { return brightness(d) / (2.0 * pi * (down + up)); };
        const auto shares = shares_of([&](const dvec3& d) { return d.y > 0.0 ? density(d) : 0.0; });
        // Its radiance varies, so that the density is told by (P p) / L.
        for (Tracer& tracer : tracers()) {
            CAPTURE(tracer.name);
            std::vector<dvec3> drawn;
            double worst = 0.0;
            for (const PathTrace& trace : traces_of(tracer, scene, settings_of(1, 1, Integrator::whitted))) {
                const TracedVertex& vertex = trace.vertices.front();
                drawn.push_back(vertex.next_event.direction);
                if (vertex.next_event.direction != dvec3(0.0))
                    worst = std::max(worst, relative_error(density_of(vertex, brightness(vertex.next_event.direction)),
                                                density(vertex.next_event.direction)));
            }
            check_directions(drawn, shares);
            CHECK(worst < tolerance(tracer));
        }
    }
}

TEST_CASE("samplers: an image of the sky is drawn by its cells, turned or not") {
    // MODEL.md section 8.2, each cell's share by the greatest of the 3 x 3 texels around it.
    constexpr int width = 8, height = 4;
    auto image = std::make_shared<Pixels>(Pixels{width, height, {}});
    for (int i = 0; i < width * height; ++i)
        image->rgb.insert(image->rgb.end(), 3, i == 11 ? 9.0f : i % 5 == 0 ? 0.0f : 0.25f * static_cast<float>(i % 4));
    const auto texel = [&](int column, int row) {
        column = (column + width) % width;
        row = std::clamp(row, 0, height - 1);
        return double{image->rgb[static_cast<std::size_t>(3 * (row * width + column))]};
    };
    std::array<double, width * height> share{};
    double all = 0.0;
    const auto solid_angle = [&](int row) {
        return 2.0 * pi / width * (std::cos(pi * row / height) - std::cos(pi * (row + 1) / height));
    };
    for (int row = 0; row < height; ++row)
        for (int column = 0; column < width; ++column) {
            double greatest = 0.0;
            for (const int r : {-1, 0, 1})
                for (const int c : {-1, 0, 1}) greatest = std::max(greatest, texel(column + c, row + r));
            all += share[static_cast<std::size_t>(row * width + column)] = solid_angle(row) * greatest;
        }
    for (const double degrees : {0.0, 77.0}) {
        CAPTURE(degrees);
        const double turn = glm::radians(degrees);
        const Density density = [&](const dvec3& d) {
            const dvec3 e(
                std::cos(turn) * d.x - std::sin(turn) * d.z, d.y, std::sin(turn) * d.x + std::cos(turn) * d.z);
            const double u = 0.5 + std::atan2(-e.z, e.x) / (2.0 * pi), v = std::acos(-e.y) / pi;
            const int column = std::clamp(static_cast<int>(u * width), 0, width - 1);
            const int row = std::clamp(static_cast<int>((1.0 - v) * height), 0, height - 1);
            return share[static_cast<std::size_t>(row * width + column)] / all / solid_angle(row);
        };
        Scene scene = receiver().scene();
        scene.background.image = image;
        scene.background.rotation_degrees = degrees;
        scene.background.sampled = true;
        const auto shares = shares_of([&](const dvec3& d) { return d.y > 0.0 ? density(d) : 0.0; });
        for (Tracer& tracer : tracers()) {
            CAPTURE(tracer.name);
            std::vector<dvec3> drawn;
            for (const PathTrace& trace : traces_of(tracer, scene, settings_of(1, 1, Integrator::whitted)))
                drawn.push_back(trace.vertices.front().next_event.direction);
            check_directions(drawn, shares);
        }
    }
}

TEST_CASE("samplers: points, spots and suns bring what their closed forms say") {
    const dvec3 place = 2.0 * glm::normalize(dvec3(0.3, 0.9, -0.2));
    for (const PunctualKind kind : {PunctualKind::point, PunctualKind::spot, PunctualKind::sun})
        for (const double tilt : {0.0, 20.0, 29.0, 40.0}) {
            CAPTURE(tilt);
            PunctualLight light;
            light.kind = kind;
            light.position = place;
            light.direction = dvec3(glm::rotate(dmat4(1.0), glm::radians(tilt), glm::normalize(dvec3(1, 0, 1))) *
                                    glm::dvec4(-glm::normalize(place), 0.0));
            light.intensity = dvec3(3.0);
            light.inner_degrees = 10.0;
            light.outer_degrees = 30.0;
            Scene scene = receiver().scene();
            scene.lights.push_back(light);
            const dvec3 towards = kind == PunctualKind::sun ? -light.direction : glm::normalize(place);
            const double cosine = glm::dot(light.direction, -glm::normalize(place));
            const double outer = std::cos(glm::radians(30.0)), inner = std::cos(glm::radians(10.0));
            const double t = std::clamp((cosine - outer) / (inner - outer), 0.0, 1.0);
            double answer = 0.9 / pi * towards.y * 3.0;
            if (kind != PunctualKind::sun) answer /= glm::dot(place, place);
            if (kind == PunctualKind::spot) answer *= t * t * (3.0 - 2.0 * t);
            for (Tracer& tracer : tracers()) {
                CAPTURE(tracer.name);
                const Integrator integrator = tracer.samples_lights ? Integrator::next_event : Integrator::whitted;
                for (const PathTrace& trace : traces_of(tracer, scene, settings_of(1, 1, integrator), 20)) {
                    const TracedVertex& vertex = trace.vertices.front();
                    // The field of the camera moves the receiver by 2^-14; near the rim of the spot t^2 amplifies that.
                    CHECK(std::abs(vertex.light.x - answer) < 3e-3 * answer + 1e-6);
                    if (answer > 0.0) CHECK(glm::distance(vertex.next_event.direction, towards) < 1e-3);
                }
            }
        }
}

TEST_CASE("samplers: lights are chosen as their areas, intensities and distances ask") {
    SceneBuilder builder = receiver();
    // Areas 1 and 3 (weights 3 Y each: Y is r + g + b = 6), and a point of 4 Y = 24. A sun and a sky share the rest.
    builder.triangle(emitter(radiance), {1, 2, 0}, {3, 2, 0}, {1, 2, 1})
        .triangle(emitter(radiance), {-1, 2, 0}, {-1, 2, 1}, {-7, 2, 0});
    Scene scene = builder.background(dvec3(0.5)).scene();
    scene.background.sampled = true;
    PunctualLight point, sun;
    point.kind = PunctualKind::point;
    point.position = {0.0, 3.0, -3.0};
    point.intensity = dvec3(2.0);
    sun.kind = PunctualKind::sun;
    sun.direction = -glm::normalize(dvec3(0.1, 1.0, 0.6));
    sun.intensity = dvec3(1.0);
    scene.lights = {point, sun};
    const double near = 1.0 * 6.0 + 3.0 * 6.0 + 24.0;
    // The sky's lower half is below the receiver's horizon and brings nothing.
    const std::vector<double> chances{0.5 * 6.0 / near, 0.5 * 18.0 / near, 0.5 * 24.0 / near, 0.25, 0.125, 0.125};
    for (Tracer& tracer : tracers()) {
        CAPTURE(tracer.name);
        std::vector<double> counts(6, 0.0), expected;
        for (const double chance : chances) expected.push_back(chance * static_cast<double>(samples));
        for (const PathTrace& trace : traces_of(tracer, scene, settings_of(1, 1, Integrator::whitted))) {
            const TracedVertex& vertex = trace.vertices.front();
            const dvec3 d = vertex.next_event.direction;
            if (vertex.light == black) {
                counts[5] += 1.0;
                continue;
            }
            // Deltas by their direction; surfaces and sky by what they bring, C/pi cos L/(P p).
            const double share = vertex.light.x / (0.9 / pi * d.y);
            if (glm::distance(d, glm::normalize(point.position)) < 1e-4)
                counts[2] += 1.0;
            else if (glm::distance(d, -sun.direction) < 1e-4)
                counts[3] += 1.0;
            else if (relative_error(share, 0.5 / (0.25 / (4.0 * pi))) < 1e-4)
                counts[4] += 1.0;
            else
                counts[d.x > 0.0 ? 0 : 1] += 1.0;
        }
        const GoodnessOfFit fit = goodness_of_fit(counts, expected);
        CHECK(fit.cells == 6);
        CHECK(fit.p > least_p);
    }
}
