// Stretched spheres as sampled lights (MODEL.md section 9.2): the density over directions, the directions sampled by
// it.
#include <doctest/doctest.h>

#include <cmath>
#include <numbers>

#include "cpu_ref/path_tracer/geometry/accelerator.h"
#include "cpu_ref/path_tracer/light/distant_lights.h"
#include "tests/cpu_ref/statistics.h"
#include "tests/scene_builder.h"

using namespace tandem;
using namespace tandem::cpu;

namespace {

constexpr double pi = std::numbers::pi;

// A receiver of one ellipsoid's light.
struct View {
    glm::dmat4 map;  // of the unit sphere about (0, 0, 0)
    glm::dvec3 from;
    bool own = false, inside = false;  // on the ellipsoid itself, on its inner side
    [[nodiscard]] glm::dvec3 world(const glm::dvec3& p) const { return glm::dvec3(map * glm::dvec4(p, 1.0)); }
};

View outside(const glm::dmat4& map, const glm::dvec3& from) { return {map, from}; }
// At a point given among the coordinates of the unit sphere.
View at(const glm::dmat4& map, const glm::dvec3& place) {
    View view{map, {}};
    view.from = view.world(place);
    return view;
}
View on_its_inner_side(const glm::dmat4& map, const glm::dvec3& place) {
    View view = at(map, glm::normalize(place));
    view.own = view.inside = true;
    return view;
}

const glm::dmat4 egg = test::moved({0.3, 0.2, -0.1}) * test::rotated(35, {1, 2, 0.5}) * test::scaled({1, 2, 0.6});
const glm::dmat4 mirrored = egg * test::scaled({-1, 1, 1.4});
const glm::dmat4 saucer = test::rotated(70, {1, 0.3, 0}) * test::scaled({1, 0.05, 1.3});
const glm::dmat4 sheet = test::rotated(20, {1, 0.3, 0}) * test::scaled({1, 0.001, 1.3});

template <class Real>
class Stage {
public:
    using V = Lanes<Real>;
    using U = UnsignedOf<Real>;
    explicit Stage(const View& view, EmittingSides sides = EmittingSides::both)
        : view_(view),
          device_(rtcNewDevice(nullptr)),
          tables_(make_tables<Real>(scene_of(view, sides), {})),
          accelerator_(device_.get(), tables_) {
        const auto splat = [](double x) { return V(static_cast<Real>(x)); };
        const Mask<Real> in = view.inside ? Mask<Real>::from_bits(all_lanes<Real>) : Mask<Real>{};
        from_ = {{splat(view.from.x), splat(view.from.y), splat(view.from.z)}, {splat(0), splat(1), splat(0)},
            Ints<Real>(view.own ? U{0} : U{no_primitive}), in};
        // A cone around all of the ellipsoid, or all directions.
        double extent = 0.0;
        for (int i = 0; i < 3; ++i) extent = std::max(extent, glm::length(glm::dvec3(view.map[i])));
        const glm::dvec3 way = view.world({0, 0, 0}) - view.from;
        const double distance = glm::length(way);
        axis_ = distance > 0.0 ? way / distance : glm::dvec3(0, 0, 1);
        if (distance > extent) height_ = 1.0 - std::sqrt(1.0 - extent * extent / (distance * distance));
        across_ =
            glm::normalize(glm::cross(axis_, std::abs(axis_.x) < 0.7 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0)));
    }

    // Directions of the cone by two numbers, evenly over solid angle, and back.
    [[nodiscard]] glm::dvec3 direction(double a, double b) const {
        const double cosine = 1.0 - a * height_, sine = std::sqrt(std::max(0.0, 1.0 - cosine * cosine));
        return cosine * axis_ +
               sine * (std::cos(2 * pi * b) * across_ + std::sin(2 * pi * b) * glm::cross(axis_, across_));
    }
    [[nodiscard]] glm::dvec2 numbers(const glm::dvec3& w) const {
        const double turn = std::atan2(glm::dot(w, glm::cross(axis_, across_)), glm::dot(w, across_)) / (2 * pi);
        return {(1.0 - glm::dot(w, axis_)) / height_, turn < 0.0 ? turn + 1.0 : turn};
    }
    [[nodiscard]] double cone() const { return 2 * pi * height_; }

    // The density of directions, 0 where they do not meet the light.
    [[nodiscard]] V density(const Vec3<V>& w) const {
        const Ray<V> ray = make_ray(from_.point, w, V(Real(0)), V(tables_.limit));
        const Mask<Real> all = Mask<Real>::from_bits(all_lanes<Real>);
        const Hit<Real> hit = accelerator_.closest(ray, {from_.primitive, from_.inside}, all);
        const Surface<Real> surface = surface_at(tables_, ray, hit);
        return select(hit.found, any_light_density(tables_, from_, hit, surface, w), V(Real(0)));
    }
    [[nodiscard]] LitSample<Real> sample(V v1, V v2) const {
        const V zero(Real(0));
        return sample_any_light(tables_, from_, from_.point, {zero, v1, v2, zero}, zero);
    }

    // Calls visit(samples, v1, v2) over an n x n grid.
    template <class Visit>
    void over_grid(int n, Visit visit) const {
        for (int row = 0; row < n; ++row)
            for (int first = 0; first < n; first += lane_count<Real>) {
                V a, b;
                for (int i = 0; i < lane_count<Real>; ++i) {
                    a.v[i] = (static_cast<Real>(row) + Real(0.5)) / static_cast<Real>(n);
                    b.v[i] = (static_cast<Real>(first + i) + Real(0.5)) / static_cast<Real>(n);
                }
                visit(a, b);
            }
    }
    // Densities over n x n cells of the cone.
    [[nodiscard]] std::vector<double> densities(int n) const {
        std::vector<double> result;
        over_grid(n, [&](V a, V b) {
            Vec3<V> w;
            for (int i = 0; i < lane_count<Real>; ++i) {
                const glm::dvec3 one = direction(static_cast<double>(a[i]), static_cast<double>(b[i]));
                w.x.v[i] = static_cast<Real>(one.x);
                w.y.v[i] = static_cast<Real>(one.y);
                w.z.v[i] = static_cast<Real>(one.z);
            }
            const V found = density(w);
            for (int i = 0; i < lane_count<Real>; ++i) result.push_back(static_cast<double>(found[i]));
        });
        return result;
    }

private:
    static Scene scene_of(const View& view, EmittingSides sides) {
        test::SceneBuilder builder;
        builder.sphere(test::emitter(glm::dvec3(1.0), sides), {0, 0, 0}, 1.0, view.map);
        return builder.scene();
    }

    View view_;
    embree::Device device_;
    Tables<Real> tables_;
    Accelerator<Real> accelerator_;
    Receiver<Real> from_;
    glm::dvec3 axis_{0, 0, 1}, across_{1, 0, 0};
    double height_ = 2.0;
};

std::vector<View> views() {
    return {outside(egg, {3, -1, 2}), outside(egg, {0, 40, 0}), at(egg, {0.8, -0.7, 0.3}), at(egg, {0, 1.001, 0}),
        at(egg, {0.3, 0.2, -0.4}), at(egg, {0, 0, 0}), on_its_inner_side(egg, {1, 2, 2}),
        outside(mirrored, {-2, 1, 1.5}), at(mirrored, {0.1, 0.7, 0.2}), outside(saucer, {0.5, 1, 2.5}),
        at(saucer, {0.2, 0.3, 0.4}), on_its_inner_side(saucer, {1, 0.1, 0.4}), outside(sheet, {0.3, 2, 0.5})};
}

// Coordinates of the unit sphere are known to some roundings times the ratio of the axes; a density is a cube of them.
template <class Real>
double tolerance(const View& view) {
    const auto scale = [&](int i) { return glm::length(glm::dvec3(view.map[i])); };
    const double ratio = std::max({scale(0), scale(1), scale(2)}) / std::min({scale(0), scale(1), scale(2)});
    return 100.0 * ratio * static_cast<double>(unit_roundoff<Real>);
}

}  // namespace

TEST_CASE_TEMPLATE("the density of an ellipsoid integrates to one over directions", Real, float, double) {
    for (const View& view : views()) {
        CAPTURE(view.from);
        const Stage<Real> stage(view);
        constexpr int n = 512;
        double sum = 0.0;
        for (const double density : stage.densities(n)) sum += density * stage.cone() / (n * n);
        CHECK(sum == doctest::Approx(1.0).epsilon(5e-3));  // midpoint rule, with a jump at the rim
    }
}

TEST_CASE_TEMPLATE("directions sampled of an ellipsoid are distributed by its density", Real, float, double) {
    for (const View& view : views()) {
        CAPTURE(view.from);
        const Stage<Real> stage(view);
        constexpr int bins = 32, sub = 16, n = 256;
        const std::vector<double> densities = stage.densities(bins * sub);
        std::vector<double> expected(bins * bins), counts(bins * bins);
        for (int row = 0; row < bins * sub; ++row)
            for (int column = 0; column < bins * sub; ++column)
                expected[static_cast<std::size_t>(row / sub * bins + column / sub)] +=
                    densities[static_cast<std::size_t>(row * bins * sub + column)] * stage.cone() * n * n /
                    (bins * sub * bins * sub);
        stage.over_grid(n, [&](Lanes<Real> v1, Lanes<Real> v2) {
            const LitSample<Real> sample = stage.sample(v1, v2);
            for (int i = 0; i < lane_count<Real>; ++i) {
                const glm::dvec2 place = stage.numbers({static_cast<double>(sample.direction.x[i]),
                    static_cast<double>(sample.direction.y[i]), static_cast<double>(sample.direction.z[i])});
                const auto bin = [](double x) { return std::clamp(static_cast<int>(x * bins), 0, bins - 1); };
                counts[static_cast<std::size_t>(bin(place.x) * bins + bin(place.y))] += 1.0;
            }
        });
        CHECK(test::chi_squared_excess(counts, expected) < 5.0);
    }
}

TEST_CASE_TEMPLATE("what is sampled of an ellipsoid is found by its ray, at its density", Real, float, double) {
    std::vector<View> all = views();
    for (const View& view : {outside(sheet, {5, 0.1, 0.2}), at(sheet, {0.3, 0.2, 0.5}), at(sheet, {0.1, 1.5, 0.1}),
             on_its_inner_side(sheet, {0.5, 0.5, 0.5}), outside(sheet, {400, 300, 500})})
        all.push_back(view);
    for (const View& view : all) {
        CAPTURE(view.from);
        const Stage<Real> stage(view);
        constexpr int n = 128;
        int usable = 0, missed = 0, off = 0;
        stage.over_grid(n, [&](Lanes<Real> v1, Lanes<Real> v2) {
            const LitSample<Real> sample = stage.sample(v1, v2);
            const Lanes<Real> density = stage.density(sample.direction);
            for (int i = 0; i < lane_count<Real>; ++i) {
                if (((sample.usable.to_bits() >> i) & 1u) == 0) continue;
                ++usable;
                const auto found = static_cast<double>(density[i]), sampled = static_cast<double>(sample.density[i]);
                CHECK(sampled > 0.0);
                if (found == 0.0)
                    ++missed;
                else if (std::abs(found / sampled - 1.0) > tolerance<Real>(view))
                    ++off;
            }
        });
        CHECK(usable > 0.999 * n * n);
        CHECK(missed <= 0.01 * usable);  // at the rim
        CHECK(off == 0);
    }
}

TEST_CASE_TEMPLATE(
    "an ellipsoid does not light its own outside, nor from a side that does not emit", Real, float, double) {
    const auto usable = [](const View& view, EmittingSides sides) {
        const Stage<Real> stage(view, sides);
        int count = 0;
        stage.over_grid(
            32, [&](Lanes<Real> v1, Lanes<Real> v2) { count += std::popcount(stage.sample(v1, v2).usable.to_bits()); });
        return count;
    };
    View own = on_its_inner_side(egg, {1, 1, 1});
    CHECK(usable(own, EmittingSides::both) > 0);
    CHECK(usable(own, EmittingSides::front) == 0);
    own.inside = false;
    CHECK(usable(own, EmittingSides::both) == 0);
    CHECK(usable(at(egg, {0.1, 0.1, 0.1}), EmittingSides::front) == 0);
    CHECK(usable(outside(egg, {4, 0, 0}), EmittingSides::front) == 32 * 32);
}
