// Hits of MODEL.md section 5 with known answers, through Embree as the tracer uses it: as one leaf, and ray by ray.
#include <doctest/doctest.h>

#include <cmath>
#include <limits>
#include <memory>
#include <random>

#include "cpu_ref/path_tracer/geometry/accelerator.h"
#include "tests/scene_builder.h"

using namespace tandem;
using namespace tandem::cpu;
using tandem::test::SceneBuilder;

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr std::size_t ray_by_ray = 0;  // no leaf, however small the scene

template <class Real>
struct Found {
    bool hit;
    double t;
    std::uint32_t primitive;
    Vec3<double> point, normal;
    double error_bound;
};

template <class Real>
class Tracer {
public:
    using V = Lanes<Real>;
    using U = UnsignedOf<Real>;
    explicit Tracer(const Scene& scene, std::size_t most_in_leaf, double t_min = 0.0, double t_max = infinity)
        : device_(rtcNewDevice(nullptr)),
          tables_(make_tables<Real>(scene, settings(t_min, t_max))),
          accelerator_(device_.get(), tables_, most_in_leaf) {}

    Found<Real> trace(const glm::dvec3& origin, const glm::dvec3& direction, std::uint32_t left = no_primitive,
        bool inside = false) const {
        const Ray<V> ray =
            make_ray(splat(origin), splat(glm::normalize(direction)), V(tables_.t_min), V(tables_.limit));
        const Mask<Real> one = Mask<Real>::from_bits(1), all_inside = Mask<Real>::from_bits(inside ? ~0u : 0u);
        const Hit<Real> hit = accelerator_.closest(ray, {Ints<Real>(U{left}), all_inside}, one);
        const Surface<Real> surface = surface_at(tables_, ray, hit);
        return {hit.found.to_bits() == 1, static_cast<double>(hit.t[0]),
            static_cast<std::uint32_t>(surface.primitive[0]), first(surface.point), first(surface.normal),
            static_cast<double>(surface.error_bound[0])};
    }
    bool blocked(const glm::dvec3& origin, const glm::dvec3& direction, double limit, std::uint32_t light) const {
        const Ray<V> ray =
            make_ray(splat(origin), splat(glm::normalize(direction)), V(Real(0)), V(static_cast<Real>(limit)));
        return accelerator_
                   .occluded(ray, {Ints<Real>(U{no_primitive}), {}}, Ints<Real>(U{light}), Mask<Real>::from_bits(1))
                   .to_bits() == 1;
    }

private:
    static RenderSettings settings(double t_min, double t_max) {
        RenderSettings s;
        s.ray_min = t_min;
        s.ray_max = t_max;
        return s;
    }
    static Vec3<V> splat(const glm::dvec3& a) {
        return {V(static_cast<Real>(a.x)), V(static_cast<Real>(a.y)), V(static_cast<Real>(a.z))};
    }
    static Vec3<double> first(const Vec3<V>& a) {
        return {static_cast<double>(a.x[0]), static_cast<double>(a.y[0]), static_cast<double>(a.z[0])};
    }
    embree::Device device_;
    Tables<Real> tables_;
    Accelerator<Real> accelerator_;
};

template <class Real>
constexpr double tolerance = sizeof(Real) == 4 ? 1e-6 : 1e-14;  // a few roundings at coordinates about 1

template <class Real>
bool near(const Vec3<double>& a, const glm::dvec3& b, double scale = 1.0) {
    const Vec3<double> d{a.x - b.x, a.y - b.y, a.z - b.z};
    return std::sqrt(dot(d, d)) <= scale * tolerance<Real>;
}

const Material grey = test::diffuse(glm::dvec3(0.5));

struct LeafFloat {
    using Real = float;
    static constexpr std::size_t most = 64;
};
struct LeafDouble {
    using Real = double;
    static constexpr std::size_t most = 64;
};
struct SingleFloat {
    using Real = float;
    static constexpr std::size_t most = ray_by_ray;
};
struct SingleDouble {
    using Real = double;
    static constexpr std::size_t most = ray_by_ray;
};

}  // namespace

#define EVERY_WAY LeafFloat, LeafDouble, SingleFloat, SingleDouble

TEST_CASE_TEMPLATE("a triangle is hit from both sides, with its counter-clockwise normal", Way, EVERY_WAY) {
    using Real = typename Way::Real;
    SceneBuilder b;
    b.triangle(grey, {0, 0, 0}, {1, 0, 0}, {0, 1, 0});
    const Tracer<Real> tracer(b.scene(), Way::most);
    const auto front = tracer.trace({0.25, 0.25, 2}, {0, 0, -1}), back = tracer.trace({0.25, 0.25, -2}, {0, 0, 1});
    CHECK(front.hit);
    CHECK(front.t == doctest::Approx(2.0).epsilon(tolerance<Real>));
    CHECK(near<Real>(front.normal, {0, 0, 1}));
    CHECK(back.hit);
    CHECK(near<Real>(back.normal, {0, 0, 1}));
    CHECK_FALSE(tracer.trace({0.75, 0.75, 2}, {0, 0, -1}).hit);     // beyond the hypotenuse
    CHECK_FALSE(tracer.trace({0.25, 0.25, 2}, {0, 0, 1}).hit);      // behind the origin
    CHECK_FALSE(tracer.trace({-1, 0.25, 0}, {1, 0, 0}).hit);        // in its plane
    CHECK_FALSE(tracer.trace({0.25, 0.25, 2}, {0, 0, -1}, 0).hit);  // left by the ray
}

TEST_CASE_TEMPLATE("no ray slips between triangles that share an edge", Way, EVERY_WAY) {
    using Real = typename Way::Real;
    SceneBuilder b;
    // A fan about an odd point: rays at the very edges and at the hub.
    const glm::dvec3 hub(0.1, 0.2, 0.3);
    constexpr int blades = 7;
    const auto rim = [&](int i) {
        const double angle = 2.0 * 3.14159265358979 * i / blades;
        return glm::dvec3(std::cos(angle), std::sin(angle), 0.05 * (i % blades));
    };
    for (int i = 0; i < blades; ++i) b.triangle(grey, hub, rim(i % blades), rim((i + 1) % blades));
    const Tracer<Real> tracer(b.scene(), Way::most);
    std::mt19937 engine(1);
    std::uniform_real_distribution<double> uniform(0.0, 1.0);
    int misses = 0;
    for (int k = 0; k < 2000; ++k) {
        const glm::dvec3 target = glm::mix(hub, rim(k % blades), 0.9 * uniform(engine));
        const glm::dvec3 origin(uniform(engine) - 0.5, uniform(engine) - 0.5, 3.0 + uniform(engine));
        if (!tracer.trace(origin, target - origin).hit) ++misses;
    }
    CHECK(misses == 0);
}

TEST_CASE_TEMPLATE("of two coincident triangles the lower id is hit", Way, EVERY_WAY) {
    using Real = typename Way::Real;
    SceneBuilder b;
    for (int i = 0; i < 3; ++i) b.triangle(grey, {0, 0, 0}, {1, 0, 0}, {0, 1, 0});
    const Tracer<Real> tracer(b.scene(), Way::most);
    CHECK(tracer.trace({0.25, 0.25, 2}, {0.01, 0.02, -1}).primitive == 0);
    CHECK(tracer.trace({0.25, 0.25, 2}, {0.01, 0.02, -1}, 0).primitive == 1);
}

TEST_CASE_TEMPLATE("the ray interval is closed", Way, EVERY_WAY) {
    using Real = typename Way::Real;
    SceneBuilder b;
    b.cuboid(grey, {-1, -1, 1}, {1, 1, 2});
    CHECK(Tracer<Real>(b.scene(), Way::most, 0.0, 1.0).trace({0, 0, 0}, {0, 0, 1}).hit);
    CHECK_FALSE(Tracer<Real>(b.scene(), Way::most, 0.0, std::nextafter(1.0f, 0.0f)).trace({0, 0, 0}, {0, 0, 1}).hit);
    CHECK(Tracer<Real>(b.scene(), Way::most, 2.0).trace({0, 0, 0}, {0, 0, 1}).t == doctest::Approx(2.0));
    CHECK(Tracer<Real>(b.scene(), Way::most, 0.0).trace({0, 0, 1}, {0, 0, 1}).t == 0.0);
    CHECK_FALSE(Tracer<Real>(b.scene(), Way::most, std::nextafter(2.0f, 3.0f)).trace({0, 0, 0}, {0, 0, 1}).hit);
}

TEST_CASE_TEMPLATE("a sphere is hit from outside, from inside and past a tangent not at all", Way, EVERY_WAY) {
    using Real = typename Way::Real;
    SceneBuilder b;
    b.sphere(grey, {0, 0, 0}, 2.0);
    const Tracer<Real> tracer(b.scene(), Way::most);
    const auto outside = tracer.trace({0, 0, 5}, {0, 0, -1}), within = tracer.trace({0, 0, 0}, {1, 0, 0});
    CHECK(outside.t == doctest::Approx(3.0).epsilon(tolerance<Real>));
    CHECK(near<Real>(outside.normal, {0, 0, 1}));
    CHECK(within.t == doctest::Approx(2.0).epsilon(tolerance<Real>));
    CHECK(near<Real>(within.normal, {1, 0, 0}));
    CHECK(tracer.trace({1.999, 0, 5}, {0, 0, -1}).hit);
    CHECK_FALSE(tracer.trace({2.001, 0, 5}, {0, 0, -1}).hit);
    CHECK_FALSE(tracer.trace({0, 0, 2}, {0.9, 0, 0.1}, 0, false).hit);  // leaves it outwards
    const auto exit = tracer.trace({0, 0, 2}, {1, 0, -1}, 0, true);     // leaves it inwards
    CHECK(exit.t == doctest::Approx(std::sqrt(8.0)).epsilon(tolerance<Real>));
    CHECK(near<Real>(exit.point, {2, 0, 0}, 4.0));
    const auto grazing = tracer.trace({0, 0, 2}, {1, 0, -1e-9}, 0, true);  // the exit is always ahead
    CHECK(grazing.hit);
    CHECK(grazing.t >= 0.0);
}

TEST_CASE_TEMPLATE("a cuboid is hit on each face, and left through the far one", Way, EVERY_WAY) {
    using Real = typename Way::Real;
    SceneBuilder b;
    b.cuboid(grey, {-1, -2, -3}, {1, 2, 3});
    const Tracer<Real> tracer(b.scene(), Way::most);
    for (int axis = 0; axis < 3; ++axis)
        for (const double side : {-1.0, 1.0}) {
            glm::dvec3 outward(0.0);
            outward[axis] = side;
            const auto hit = tracer.trace(outward * 10.0, -outward), exit = tracer.trace({0, 0, 0}, outward);
            CHECK(hit.t == doctest::Approx(9.0 - axis).epsilon(tolerance<Real>));
            CHECK(near<Real>(hit.normal, outward));
            CHECK(exit.t == doctest::Approx(1.0 + axis).epsilon(tolerance<Real>));
            CHECK(near<Real>(exit.normal, outward));
            CHECK_FALSE(tracer.trace(outward * (1.0 + axis), outward + glm::dvec3(0.3), 0, false).hit);
        }
    CHECK_FALSE(tracer.trace({1.5, 0, 10}, {0, 0, -1}).hit);  // parallel to a slab, outside it
    CHECK(tracer.trace({-1, 0, 0}, {1, 0, 0}, 0, true).t == doctest::Approx(2.0).epsilon(tolerance<Real>));
}

TEST_CASE_TEMPLATE("a flat cuboid is a rectangle", Way, EVERY_WAY) {
    using Real = typename Way::Real;
    SceneBuilder b;
    b.cuboid(grey, {-1, 5, -1}, {1, 5, 1});
    const Tracer<Real> tracer(b.scene(), Way::most);
    CHECK(tracer.trace({0.5, 7, 0.5}, {0, -1, 0}).t == doctest::Approx(2.0).epsilon(tolerance<Real>));
    CHECK(near<Real>(tracer.trace({0.5, 7, 0.5}, {0, -1, 0}).normal, {0, 1, 0}));
    CHECK(near<Real>(tracer.trace({0.5, 3, 0.5}, {0, 1, 0}).normal, {0, -1, 0}));
    CHECK_FALSE(tracer.trace({1.5, 7, 0.5}, {0, -1, 0}).hit);
    CHECK(tracer.trace({0.5, 5, 0.5}, {0, -1, 0}, 0, true).t == 0.0);  // through it: out on the other face at once
}

TEST_CASE_TEMPLATE("transforms move points by M and normals by its inverse transpose", Way, EVERY_WAY) {
    using Real = typename Way::Real;
    glm::dmat4 shear(1.0);
    shear[1][0] = 1.0;  // x' = x + y
    const glm::dmat4 mirror = test::scaled({-1, 1, 1});
    SUBCASE("sheared cuboid: the +x face becomes a slope with normal (1, -1, 0)") {
        SceneBuilder b;
        b.cuboid(grey, {-1, -1, -1}, {1, 1, 1}, shear);
        const auto hit = Tracer<Real>(b.scene(), Way::most).trace({5, 0.5, 0}, {-1, 0, 0});
        CHECK(hit.t == doctest::Approx(3.5).epsilon(tolerance<Real>));
        CHECK(near<Real>(hit.normal, glm::normalize(glm::dvec3(1, -1, 0))));
    }
    SUBCASE("squashed sphere: an ellipsoid's gradient normal") {
        SceneBuilder b;
        b.sphere(grey, {0, 0, 0}, 1.0, test::scaled({2, 1, 1}));
        const auto hit = Tracer<Real>(b.scene(), Way::most).trace({std::sqrt(2.0), 5, 0}, {0, -1, 0});
        CHECK(near<Real>(hit.point, {std::sqrt(2.0), std::sqrt(0.5), 0}, 8.0));
        CHECK(near<Real>(hit.normal, glm::normalize(glm::dvec3(std::sqrt(2.0) / 4.0, std::sqrt(0.5), 0)), 8.0));
    }
    SUBCASE("a mirrored triangle keeps its front side") {
        SceneBuilder b;
        b.triangle(grey, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}, mirror);
        const auto hit = Tracer<Real>(b.scene(), Way::most).trace({-0.25, 0.25, 2}, {0, 0, -1});
        CHECK(hit.hit);
        CHECK(near<Real>(hit.normal, {0, 0, 1}));
    }
    SUBCASE("a turned and moved cuboid") {
        SceneBuilder b;
        b.cuboid(grey, {-1, -1, -1}, {1, 1, 1}, test::moved({10, 0, 0}) * test::rotated(45, {0, 1, 0}));
        const auto hit = Tracer<Real>(b.scene(), Way::most).trace({10.5, 0, 5}, {0, 0, -1});
        CHECK(hit.t == doctest::Approx(5.0 - (std::sqrt(2.0) - 0.5)).epsilon(10.0 * tolerance<Real>));
        CHECK(near<Real>(hit.normal, glm::normalize(glm::dvec3(1, 0, 1)), 2.0));
    }
}

TEST_CASE_TEMPLATE("occlusion sees everything but the light", Way, EVERY_WAY) {
    using Real = typename Way::Real;
    SceneBuilder b;
    b.triangle(grey, {-9, -9, 1}, {9, -9, 1}, {0, 9, 1}).sphere(grey, {0, 0, 4}, 1.0);
    const Tracer<Real> tracer(b.scene(), Way::most);
    CHECK(tracer.blocked({0, 0, 0}, {0, 0, 1}, 10.0, no_primitive));
    CHECK(tracer.blocked({0, 0, 0}, {0, 0, 1}, 10.0, 0));
    CHECK(tracer.blocked({0, 0, 0}, {0, 0, 1}, 2.0, 1));
    CHECK_FALSE(tracer.blocked({0, 0, 0}, {0, 0, 1}, 2.5, 0));
    CHECK_FALSE(tracer.blocked({0, 0, 0}, {0, 0, 1}, 0.5, no_primitive));
}

TEST_CASE_TEMPLATE("rays that are not finite, or have no direction, miss", Way, EVERY_WAY) {
    using Real = typename Way::Real;
    SceneBuilder b;
    b.sphere(grey, {0, 0, 0}, 100.0)
        .cuboid(grey, {-1, -1, -1}, {1, 1, 1})
        .triangle(grey, {-9, -9, 1}, {9, -9, 1}, {0, 9, 1});
    const Tracer<Real> tracer(b.scene(), Way::most);
    CHECK_FALSE(tracer.trace({0, 0, 0}, {0, 0, 0}).hit);
    CHECK_FALSE(tracer.trace({infinity, 0, 0}, {-1, 0, 0}).hit);
    CHECK_FALSE(tracer.trace({0, std::nan(""), 0}, {1, 0, 0}).hit);
}

TEST_CASE_TEMPLATE("a triangle of no area and a sphere far away are not in the way", Way, EVERY_WAY) {
    using Real = typename Way::Real;
    SceneBuilder b;
    b.triangle(grey, {0, 0, 1}, {1, 0, 1}, {2, 0, 1}).triangle(grey, {0, 0, 1}, {0, 0, 1}, {0, 0, 1});
    b.triangle(grey, {-9, -9, 5}, {9, -9, 5}, {0, 9, 5});
    CHECK(Tracer<Real>(b.scene(), Way::most).trace({0, 0, 0}, {0, 0, 1}).primitive == 2);
}

TEST_CASE_TEMPLATE("one leaf and the hierarchy find the same hits", Real, float, double) {
    std::mt19937 engine(7);
    std::uniform_real_distribution<double> uniform(-1.0, 1.0);
    const auto point = [&] { return glm::dvec3(uniform(engine), uniform(engine), uniform(engine)); };
    SceneBuilder b;
    for (int i = 0; i < 20; ++i) {
        const glm::dmat4 placed = test::moved(point() * 3.0) * test::rotated(180.0 * uniform(engine), point());
        b.triangle(grey, point(), point(), point(), placed)
            .sphere(grey, point(), 0.3, placed * test::scaled({1, 2, 0.5}));
        b.cuboid(grey, {-0.4, -0.2, -0.1}, {0.1, 0.3, 0.5}, placed);
    }
    const Tracer<Real> leaf(b.scene(), 64), single(b.scene(), ray_by_ray);
    int hits = 0, differing = 0;
    for (int k = 0; k < 5000; ++k) {
        const glm::dvec3 origin = point() * 5.0, direction = point() * 3.0 - origin;
        const auto a = leaf.trace(origin, direction), c = single.trace(origin, direction);
        if (a.hit != c.hit || (a.hit && (a.primitive != c.primitive || a.t != c.t))) ++differing;
        if (a.hit) ++hits;
    }
    CHECK(hits > 500);  // else this shows nothing
    CHECK(differing == 0);
}

// A ball a hundredth above a floor of 4000 units had lost a third of its caustic to an offset of 7 thousandths.
TEST_CASE("a wide floor is known as exactly as its height, and a tilted one within its bound") {
    std::mt19937_64 random(5);
    std::uniform_real_distribution<double> unit(-1.0, 1.0);
    for (const double tilt : {0.0, 1e-3, 0.3, 1.2}) {
        const glm::dvec3 e(4000.0 * std::cos(tilt), 4000.0 * std::sin(tilt), 0.0), f(0.0, 0.0, -4000.0);
        const glm::dvec3 corner = -0.5 * (e + f), n = glm::normalize(glm::cross(f, e));
        SceneBuilder builder;
        builder.triangle(grey, corner, corner + e, corner + e + f);
        builder.triangle(grey, corner, corner + e + f, corner + f);
        const Tracer<float> tracer(builder.scene(), 64);
        for (int i = 0; i < 1000; ++i) {
            const double size = i % 2 == 0 ? 3.0 : 900.0;
            const glm::dvec3 aim = 0.5 * (unit(random) * e + unit(random) * f) * (size / 2000.0);
            const glm::dvec3 origin = aim + size * (n * (unit(random) < 0.0 ? -1.0 : 1.0) +
                                                       0.5 * glm::dvec3(unit(random), 0.0, unit(random)));
            const Found<float> found = tracer.trace(origin, aim - origin);
            REQUIRE(found.hit);
            const double off = std::abs(glm::dot(n, glm::dvec3(found.point.x, found.point.y, found.point.z)));
            CHECK(off <= found.error_bound);
            if (tilt == 0.0) CHECK(found.error_bound <= 2e-7 * size);
        }
    }
}
