// Closed forms of nested dielectrics and interiors (MODEL.md section 9.4): stacks of slabs, hidden surfaces, media in
// bodies within bodies.
#include "tests/suite/effects.h"

using namespace tandem;
using namespace tandem::test;

namespace {

const dvec3 red(1.0, 0.0, 0.0), green(0.0, 1.0, 0.0);

SceneBuilder looking_down(double angle) {
    return SceneBuilder()
        .camera(dvec3(0.0, 1.0, 0.0) + 3.0 * dvec3(std::sin(angle), std::cos(angle), 0.0), {0.0, 1.0, 0.0},
            narrow_field, {0.0, 0.0, 1.0})
        .background(red, green);
}

Material body(double index, std::int32_t priority) {
    Material material = glass(index);
    material.priority = priority;
    return material;
}

const dvec3 lo(-50.0, 0.0, -50.0), hi(50.0, 1.0, 50.0);
dvec3 at_height(const dvec3& corner, double y) { return {corner.x, y, corner.z}; }

SceneBuilder& layer(SceneBuilder& builder, const Material& material, double bottom, double top) {
    return builder.cuboid(material, at_height(lo, bottom), at_height(hi, top));
}

// Unpolarised reflectance between two indices at the angle whose sine in air is `sine`.
double reflectance(double n1, double n2, double sine) {
    const double c1 = std::sqrt(1.0 - sine * sine / (n1 * n1)), c2 = std::sqrt(1.0 - sine * sine / (n2 * n2));
    const double s = (n1 * c1 - n2 * c2) / (n1 * c1 + n2 * c2), p = (n2 * c1 - n1 * c2) / (n2 * c1 + n1 * c2);
    return 0.5 * (s * s + p * p);
}

// Radiance of the sky, seen at `angle` off the normal, through parallel surfaces.
dvec3 seen(double reflected, double transmitted, double angle) {
    const double a = 0.5 * (1.0 - std::cos(angle));
    return transmitted * glm::mix(red, green, a) + reflected * glm::mix(green, red, a);
}

// What a stack of interfaces reflects and transmits, all orders, made unpolarised at each.
dvec3 stack(const std::vector<double>& indices, double angle) {
    const double sine = std::sin(angle);
    double forward = 0.0, backward = 0.0, through = 1.0;  // reflectances from above and below of the stack so far
    for (std::size_t i = 0; i + 1 < indices.size(); ++i) {
        const double r = reflectance(indices[i], indices[i + 1], sine), loop = 1.0 - backward * r;
        forward += through * through * r / loop;
        backward = r + (1.0 - r) * (1.0 - r) * backward / loop;
        through *= (1.0 - r) / loop;
    }
    return seen(forward, through, angle);
}

void check_stack(std::vector<Tracer>& all, const Scene& scene, const dvec3& expected) {
    check_mean(all, scene, settings_of(16, 40), 256, expected, 128.0);
}

}  // namespace

TEST_CASE("overlapping slabs reflect as the stack that their priorities leave") {
    auto& all = tracers();
    for (const double angle : {0.0, 0.9}) {
        CAPTURE(angle);
        SceneBuilder glass_over_water = looking_down(angle);
        layer(glass_over_water, body(1.9, 2), 0.5, 1.0);
        layer(glass_over_water, body(1.33, 1), 0.0, 0.7);
        check_stack(all, glass_over_water.scene(), stack({1.0, 1.9, 1.33, 1.0}, angle));

        SceneBuilder water_over_glass = looking_down(angle);
        layer(water_over_glass, body(1.9, 1), 0.3, 1.0);
        layer(water_over_glass, body(1.33, 2), 0.0, 0.7);
        check_stack(all, water_over_glass.scene(), stack({1.0, 1.9, 1.33, 1.0}, angle));
    }
}

TEST_CASE("a body in a body is surrounded by the outer one's index, or hidden by an outer one of greater priority") {
    auto& all = tracers();
    for (const std::int32_t inner : {1, 3}) {
        CAPTURE(inner);
        SceneBuilder builder = looking_down(0.7);
        layer(builder, body(1.33, 1), 0.0, 1.0);
        layer(builder, body(2.4, inner), 0.3, 0.6);
        check_stack(all, builder.scene(), stack({1.0, 1.33, 2.4, 1.33, 1.0}, 0.7));
    }
    SceneBuilder hidden = looking_down(0.7);
    layer(hidden, body(1.33, 2), 0.0, 1.0);
    layer(hidden, body(2.4, 1), 0.3, 0.6);
    check_stack(all, hidden.scene(), stack({1.0, 1.33, 1.0}, 0.7));
}

TEST_CASE("bodies without interior or priority do not know of each other") {
    SceneBuilder builder = looking_down(0.7);
    layer(builder, glass(1.33), 0.0, 1.0);
    layer(builder, glass(2.4), 0.3, 0.6);
    // The inner one refracts as from air: at the sine that the ray has in the outer one.
    const double sine = std::sin(0.7) / 1.33;
    const double r1 = reflectance(1.0, 1.33, std::sin(0.7)), r2 = reflectance(1.0, 2.4, sine);
    auto& all = tracers();
    // First orders alone: four events, all transmitted or one reflected.
    const double t1 = 1.0 - r1, t2 = 1.0 - r2;
    const double through = t1 * t2 * t2 * t1;
    const double back = r1 + t1 * r2 * t1;
    check_mean(all, builder.scene(), settings_of(16, 4), 256, seen(back, through, 0.7), 128.0);
}

TEST_CASE("a hidden surface counts as an event") {
    SceneBuilder builder = looking_down(0.0).background(white);
    layer(builder, body(1.0, 2), 0.0, 1.0);
    layer(builder, body(2.4, 1), 0.3, 0.6);
    auto& all = tracers();
    check_every_pixel(all, builder.scene(), settings_of(4, 3), 64, black, 0.0);
    check_every_pixel(all, builder.scene(), settings_of(4, 4), 64, white, 8.0);
}

TEST_CASE("the uppermost body's medium is the one that absorbs") {
    const dvec3 outer(0.3, 1.0, 0.2), inner(1.5, 0.1, 0.6);
    for (const std::int32_t priority : {1, 2, 3}) {
        CAPTURE(priority);
        Material bowl = boundary(), ball = boundary();
        bowl.priority = 2;
        ball.priority = priority;
        ball.interior = 1;
        SceneBuilder builder = looking_down(0.0);
        layer(builder.background({1.0, 2.0, 4.0}), bowl, 0.0, 1.0);
        layer(builder, ball, 0.3, 0.7);
        Scene scene = with_medium(with_medium(builder.scene(), medium_of(outer, black)), medium_of(inner, black));
        const dvec3 depth = priority == 1 ? outer : 0.6 * outer + 0.4 * inner;
        auto& all = tracers();
        check_every_pixel(all, scene, settings_of(4, 4), 64, dvec3(1.0, 2.0, 4.0) * glm::exp(-depth), 128.0);
    }
}

TEST_CASE("a body of priority without interior is empty within fog") {
    auto& all = tracers();
    Material bubble = body(1.0, 1);
    SceneBuilder builder = looking_down(0.0);
    layer(builder, bubble, 0.0, 1.0);
    layer(builder, emitter(dvec3(2.0)), -1.0, -0.5);
    const Scene scene = filled_with(builder.scene(), medium_of({0.2, 0.4, 0.8}, black));
    // 3 above the bubble, 0.5 below it.
    check_every_pixel(all, scene, settings_of(4, 4), 64, 2.0 * glm::exp(-3.5 * dvec3(0.2, 0.4, 0.8)), 128.0);
}

TEST_CASE("a ninth body inside each other makes a sample invalid, an eighth does not") {
    auto& all = tracers();
    SceneBuilder builder = looking_down(0.0).background(white);
    for (int i = 0; i < 8; ++i) layer(builder, body(1.0, 1), 0.1 * i, 2.0 - 0.1 * i);
    check_every_pixel(all, builder.scene(), settings_of(4, 20), 64, white, 64.0);
    layer(builder, body(1.0, 1), 0.8, 1.2);
    for (Tracer& tracer : all) {
        CAPTURE(tracer.name);
        const auto estimate = try_render(tracer, builder.scene(), settings_of(4, 20), 64);
        if (estimate) CHECK(estimate->invalid() == 16 * 64);
    }
}
