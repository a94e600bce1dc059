// Every precision of every backend against the processor's double: the numbers are the same, so are the paths, but for
// those that rounding parts. And what becomes of scenes far from the origin, and on a planet.
#include <glm/gtc/matrix_transform.hpp>
#include <set>

#include "common/scene/loader/scene_loader.h"
#include "tests/suite/tracers.h"

using namespace tandem;
using namespace tandem::test;

namespace {

std::unique_ptr<Renderer> make(const Backend& backend, Precision precision, const std::string& kernel = {}) {
    BackendOptions options;
    options.precision = precision;
    if (!kernel.empty()) options.kernel = kernel;
    return backend.create(options);
}

std::vector<double> image(Renderer& renderer, const Scene& scene, const RenderSettings& settings) {
    const Estimate estimate = renderer.prepare(scene, settings)->render({0, 16}).estimate;
    CHECK(estimate.invalid() == 0);
    return mean_of(estimate);
}

// The part of pixels and channels that are further apart than `tolerance` of the reference or, in the dark, of its
// mean.
double apart(const std::vector<double>& a, const std::vector<double>& reference, double tolerance) {
    double mean = 0.0;
    for (const double x : reference) mean += x / static_cast<double>(reference.size());
    std::size_t count = 0;
    for (std::size_t i = 0; i < a.size(); ++i)
        if (!(std::abs(a[i] - reference[i]) <= tolerance * std::max(reference[i], mean))) ++count;
    return static_cast<double>(count) / static_cast<double>(a.size());
}

// The root of the mean squared difference, as a part of the mean.
double root_mean_square(const std::vector<double>& a, const std::vector<double>& reference) {
    double sum = 0.0, squares = 0.0;
    for (std::size_t i = 0; i < a.size(); ++i) {
        sum += reference[i];
        squares += (a[i] - reference[i]) * (a[i] - reference[i]);
    }
    const auto count = static_cast<double>(a.size());
    return std::sqrt(squares / count) / (sum / count);
}

Scene shipped(const std::string& name) {
    return load_scene(std::filesystem::path(TANDEM_SOURCE_DIR "/scenes") / (name + ".json"));
}

RenderSettings small(const Scene& scene) {
    RenderSettings settings = with_longer_side(default_settings(scene), 16);
    settings.bounces = 6;
    return settings;
}

Scene moved(Scene scene, const dvec3& way) {
    for (Entity& entity : scene.entities)
        entity.object_to_world = glm::translate(glm::dmat4(1.0), way) * entity.object_to_world;
    for (PunctualLight& light : scene.lights) light.position += way;
    scene.camera.position += way;
    scene.camera.target += way;
    return scene;
}

// The same by the entities' own coordinates; their places stay as they are. No vertex is of two entities.
Scene moved_within(const Scene& scene, const dvec3& way) {
    Scene far = moved(scene, way);
    for (std::size_t e = 0; e < scene.entities.size(); ++e) {
        const Entity& entity = far.entities[e] = scene.entities[e];
        const dvec3 own = glm::inverse(glm::dmat3(entity.object_to_world)) * way;
        std::set<std::uint32_t> vertices;
        for (std::uint32_t i = 0; i < entity.primitive_count; ++i) {
            const Primitive& primitive = scene.primitives[entity.first_primitive + i];
            const int corners = primitive.kind == PrimitiveKind::triangle ? 3
                                : primitive.kind == PrimitiveKind::cuboid ? 2
                                                                          : 1;
            vertices.insert(primitive.index.begin(), primitive.index.begin() + corners);
        }
        for (const std::uint32_t vertex : vertices) far.vertices[vertex] += own;
    }
    return far;
}

struct Arm {
    std::string name;
    std::unique_ptr<Renderer> renderer;
};

}  // namespace

TEST_CASE("in double both backends see the same light, in mixed precision but for few pixels") {
    const auto reference = make(cpu_backend(), Precision::double_precision);
    const auto in_double = make(vulkan_backend(), Precision::double_precision);
    std::vector<Arm> mixed;
    mixed.push_back({"cpu mixed", make(cpu_backend(), Precision::mixed)});
    mixed.push_back({"vulkan mixed", make(vulkan_backend(), Precision::mixed)});
    for (const std::string name : {"cornell-classic", "nested-glass", "textures", "cloud"}) {
        CAPTURE(name);
        const Scene scene = shipped(name);
        const std::vector<double> expected = image(*reference, scene, small(scene));
        const std::vector<double> found = image(*in_double, scene, small(scene));
        MESSAGE(name, ": in double ", apart(found, expected, 1e-9), " of all values are more than 1e-9 apart, ",
            apart(found, expected, 1e-6), " more than 1e-6");
        CHECK(apart(found, expected, 1e-9) <= 0.01);
        for (Arm& arm : mixed) {
            CAPTURE(arm.name);
            const std::vector<double> other = image(*arm.renderer, scene, small(scene));
            MESSAGE(
                name, ": ", arm.name, ": ", apart(other, expected, 1e-4), " of all values are more than 1e-4 apart");
            CHECK(apart(other, expected, 1e-4) <= 0.05);
        }
    }
}

TEST_CASE("a room far from the origin keeps its image, and geometry in double what float loses on a planet") {
    std::vector<Arm> single, mixed;
    single.push_back({"cpu single", make(cpu_backend(), Precision::single_precision)});
    single.push_back({"vulkan single", make(vulkan_backend(), Precision::single_precision)});
    mixed.push_back({"cpu mixed", make(cpu_backend(), Precision::mixed)});
    mixed.push_back({"vulkan mixed", make(vulkan_backend(), Precision::mixed)});
    const auto reference = make(cpu_backend(), Precision::double_precision);

    const Scene box = shipped("cornell-classic");
    const double size = glm::length(box.camera.target - box.camera.position);
    // A pebble and its shadow on a ball as large as the earth.
    constexpr double earth = 6.371e6;
    SceneBuilder builder;
    builder.sphere(diffuse(dvec3(0.5)), {0, -earth, 0}, earth)
        .sphere(diffuse(dvec3(0.8, 0.3, 0.2)), {0, 0.1, 0}, 0.1)
        .camera({0, 0.4, 1.2}, {0, 0.05, 0}, 30.0)
        .background(dvec3(0.2));
    Scene planet = builder.scene();
    PunctualLight sun;
    sun.kind = PunctualKind::sun;
    sun.direction = glm::normalize(dvec3(-1.0, -1.0, -0.5));
    sun.intensity = dvec3(2.0);
    planet.lights.push_back(sun);
    struct Case {
        std::string name;
        Scene far, near;
        bool lost;  // in float
    };
    const dvec3 away = 1e5 * size * dvec3(1.0, -0.7, 0.4);
    const Case cases[]{{"a room 10^5 times its size away", moved(box, away), box, false},
        {"a room 10^5 times its size away in its own coordinates", moved_within(box, away), box, false},
        {"a planet", planet, planet, true}};
    for (const Case& c : cases) {
        CAPTURE(c.name);
        RenderSettings settings = small(c.near);
        settings.integrator = Integrator::next_event;
        const std::vector<double> expected = image(*reference, c.near, settings);
        for (Arm& arm : single) {
            CAPTURE(arm.name);
            const std::vector<double> found = image(*arm.renderer, c.far, settings);
            const double floor = root_mean_square(found, expected);
            MESSAGE(c.name, ": ", arm.name, " is ", floor, " of the mean off, ", apart(found, expected, 1e-4),
                " of all values by more than 1e-4");
            if (c.lost)
                CHECK(floor > 0.05);
            else
                CHECK(apart(found, expected, 1e-4) <= 0.05);
        }
        for (Arm& arm : mixed) {
            CAPTURE(arm.name);
            const double floor = root_mean_square(image(*arm.renderer, c.far, settings), expected);
            MESSAGE(c.name, ": ", arm.name, " is ", floor, " of the mean off");
            CHECK(floor < 0.001);
        }
    }
}

namespace {

// The nearest half of a normal one, ties to even; 65504 beyond the greatest.
double nearest_half(double value) {
    const double step = std::ldexp(1.0, std::ilogb(value) - 10);
    return std::min(std::nearbyint(value / step) * step, 65504.0);
}

}  // namespace

TEST_CASE("half storage: the light that waits for its shadow ray is rounded to the nearest half, at most 65504") {
    SceneBuilder builder;
    builder.sphere(diffuse(dvec3(0.9, 0.5, 0.2)), {0, 0, 0}, 1.0).camera({0, 0, 4}, {0, 0, 0}, 40.0);
    Scene ball = builder.scene();
    PunctualLight sun;
    sun.kind = PunctualKind::sun;
    sun.direction = glm::normalize(dvec3(-0.3, -0.4, -1.0));
    ball.lights.push_back(sun);
    RenderSettings settings = with_longer_side(default_settings(ball), 16);
    settings.integrator = Integrator::next_event;
    settings.bounces = 1;
    const auto single = make(vulkan_backend(), Precision::single_precision);
    const auto half = make(vulkan_backend(), Precision::half_storage);
    for (const double strength : {1.0, 1e6}) {
        CAPTURE(strength);
        ball.lights.front().intensity = dvec3(strength);
        const auto one = [&](Renderer& renderer) {
            return mean_of(renderer.prepare(ball, settings)->render({0, 1}).estimate);
        };
        const std::vector<double> exact = one(*single), rounded = one(*half);
        std::size_t lit = 0, greatest = 0;
        for (std::size_t i = 0; i < exact.size(); ++i) {
            if (exact[i] == 0.0) continue;
            CHECK(rounded[i] == nearest_half(exact[i]));
            ++lit;
            greatest += rounded[i] == 65504.0 ? 1 : 0;
        }
        CHECK(lit > 100);
        CHECK((greatest > 0) == (strength > 1.0));
    }
}

TEST_CASE("half storage: paths stay the same, and values err by the roundings of half") {
    const auto single = make(vulkan_backend(), Precision::single_precision, "stages");
    const auto half = make(vulkan_backend(), Precision::half_storage);
    for (const std::string name : {"cornell-classic", "nested-glass", "textures", "cloud"}) {
        CAPTURE(name);
        const Scene scene = shipped(name);
        RenderSettings settings = small(scene);
        settings.integrator = Integrator::next_event;
        const std::vector<double> expected = image(*single, scene, settings), found = image(*half, scene, settings);
        // Three roundings of 2^-11 a vertex: throughput, gathered light and pending light.
        const double bound = 3.0 * (settings.bounces + 1) * 0x1p-11;
        MESSAGE(name, ": ", root_mean_square(found, expected), " of the mean off, ", apart(found, expected, bound),
            " of all values by more than ", bound);
        CHECK(apart(found, expected, bound) <= 0.01);
        CHECK(root_mean_square(found, expected) > 1e-6);
        const auto bytes = [&](Renderer& renderer) {
            return renderer.prepare(scene, settings)->facts().bytes_per_path;
        };
        CHECK(bytes(*half) + 24 == bytes(*single));  // of 16 bytes of gathered light none, of 16 of pending light 8
    }
}

TEST_CASE("half storage is refused where nothing is kept between kernels") {
    const Scene scene = shipped("cornell-classic");
    CHECK_THROWS_AS(static_cast<void>(make(cpu_backend(), Precision::half_storage)), UnsupportedError);
    for (const std::string kernel : {"megakernel", "image-stages", "fragment", "thesis"}) {
        CAPTURE(kernel);
        BackendOptions options;
        options.precision = Precision::half_storage;
        options.kernel = kernel;
        const auto renderer = vulkan_backend().create(options);
        CHECK_THROWS_AS(static_cast<void>(renderer->prepare(scene, small(scene))), UnsupportedError);
    }
}
