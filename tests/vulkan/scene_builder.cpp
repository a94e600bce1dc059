#include "tests/vulkan/scene_builder.h"

#include <cmath>
#include <cstring>
#include <glm/ext/matrix_transform.hpp>
#include <span>

namespace tandem::testing {

SceneBuilder& SceneBuilder::camera(glm::dvec3 position, glm::dvec3 target, double field_degrees) {
    scene.camera.position = position;
    scene.camera.target = target;
    scene.camera.vertical_field_degrees = field_degrees;
    return *this;
}

SceneBuilder& SceneBuilder::background(glm::dvec3 down, glm::dvec3 up) {
    scene.background.down = down;
    scene.background.up = up;
    return *this;
}

std::uint32_t SceneBuilder::material(const Material& material) {
    scene.materials.push_back(material);
    return static_cast<std::uint32_t>(scene.materials.size() - 1);
}

void SceneBuilder::entity(
    std::uint32_t material, Primitive primitive, const glm::dmat4& m, std::span<const glm::dvec3> points) {
    for (std::size_t i = 0; i < points.size(); ++i) {
        primitive.index[i] = static_cast<std::uint32_t>(scene.vertices.size());
        scene.vertices.push_back(points[i]);
    }
    Entity placed;
    placed.material = material;
    placed.first_primitive = static_cast<std::uint32_t>(scene.primitives.size());
    placed.primitive_count = 1;
    placed.object_to_world = m;
    scene.entities.push_back(placed);
    scene.primitives.push_back(primitive);
}

SceneBuilder& SceneBuilder::triangle(std::uint32_t material, std::array<glm::dvec3, 3> corners, const glm::dmat4& m) {
    entity(material, {PrimitiveKind::triangle, {}, 0.0}, m, corners);
    return *this;
}

SceneBuilder& SceneBuilder::sphere(std::uint32_t material, glm::dvec3 centre, double radius, const glm::dmat4& m) {
    entity(material, {PrimitiveKind::sphere, {}, radius}, m, std::array{centre});
    return *this;
}

SceneBuilder& SceneBuilder::cuboid(std::uint32_t material, glm::dvec3 low, glm::dvec3 high, const glm::dmat4& m) {
    entity(material, {PrimitiveKind::cuboid, {}, 0.0}, m, std::array{low, high});
    return *this;
}

SceneBuilder& SceneBuilder::quad(std::uint32_t material, std::array<glm::dvec3, 4> corners) {
    triangle(material, {corners[0], corners[1], corners[2]});
    return triangle(material, {corners[0], corners[2], corners[3]});
}

Material diffuse(glm::dvec3 colour) {
    Material material;
    material.colour = colour;
    return material;
}

Material emissive(glm::dvec3 radiance) {
    Material material;
    material.kind = MaterialKind::emissive;
    material.radiance = radiance;
    return material;
}

Material mirror(glm::dvec3 colour, double fuzz) {
    Material material;
    material.kind = MaterialKind::specular;
    material.colour = colour;
    material.fuzz = fuzz;
    return material;
}

Material glass(double refractive_index, double alpha) {
    Material material = mirror(glm::dvec3(1.0));
    material.translucent = true;
    material.alpha = alpha;
    material.refractive_index = refractive_index;
    return material;
}

RenderSettings settings_of(std::uint32_t size, std::uint32_t bounces, Integrator integrator, std::uint64_t seed) {
    RenderSettings settings;
    settings.width = settings.height = size;
    settings.bounces = bounces;
    settings.integrator = integrator;
    settings.seed = seed;
    return settings;
}

Scene full_scene() {
    SceneBuilder builder;
    builder.camera({0.0, 1.0, 4.0}, {0.0, 1.0, 0.0}, 50.0).background({0.1, 0.1, 0.1}, {0.3, 0.4, 0.6});
    builder.scene.camera.lens_radius = 0.05;
    builder.scene.camera.focus_distance = 4.0;
    const std::uint32_t white = builder.material(diffuse(glm::dvec3(0.75)));
    const std::uint32_t red = builder.material(diffuse({0.7, 0.2, 0.2}));
    const std::uint32_t lamp = builder.material(emissive(glm::dvec3(8.0)));
    const std::uint32_t fuzzy = builder.material(mirror({0.8, 0.8, 0.9}, 0.3));
    const std::uint32_t clear = builder.material(glass(1.5, 0.4));
    Material glow = glass(1.3, 0.5);
    glow.kind = MaterialKind::emissive;
    glow.radiance = {0.2, 0.5, 0.2};
    glow.colour = {0.5, 1.0, 0.5};
    glow.fresnel = Fresnel::schlick;
    glow.fuzz = 0.1;
    const std::uint32_t glowing = builder.material(glow);
    Material panel = diffuse({0.2, 0.2, 0.6});
    panel.radiance = {0.1, 0.1, 1.0};
    panel.sides = EmittingSides::front;
    const std::uint32_t shining = builder.material(panel);

    const glm::dmat4 turned =
        glm::rotate(glm::translate(glm::dmat4(1.0), {-0.8, 0.5, 0.0}), 0.6, glm::normalize(glm::dvec3(1.0, 2.0, 0.5)));
    builder.cuboid(white, {-2.0, -0.1, -2.0}, {2.0, 0.0, 2.0}).cuboid(red, {-2.0, 0.01, -2.1}, {2.0, 2.5, -2.0});
    builder.cuboid(fuzzy, glm::dvec3(-0.3), glm::dvec3(0.3), turned);
    builder.cuboid(lamp, {-0.5, 2.3, -0.5}, {0.5, 2.3, 0.5});  // flat
    builder.sphere(clear, {0.7, 0.5, 0.6}, 0.4).sphere(lamp, {-1.5, 1.8, -1.0}, 0.15);
    builder.sphere(glowing, glm::dvec3(0.0), 1.0,
        glm::scale(
            glm::translate(glm::dmat4(1.0), {1.0, 1.4, -0.6}), glm::dvec3(-0.5, 0.2, 0.3)));  // mirrored ellipsoid
    builder.quad(shining, {glm::dvec3{1.9, 0.1, -1.0}, {1.9, 0.1, 1.0}, {1.9, 1.1, 1.0}, {1.9, 1.1, -1.0}});
    builder.triangle(lamp, {glm::dvec3{-1.8, 0.2, 0.0}, {-1.8, 0.2, 0.8}, {-1.8, 0.9, 0.4}});
    return builder.scene;
}

RenderResult render(const Scene& scene, const RenderSettings& settings, std::uint64_t count) {
    const auto renderer = vulkan_backend().create({});
    return renderer->prepare(scene, settings)->render({0, count});
}

double image_mean(const Estimate& estimate, int channel) {
    const std::vector<double> mean = mean_of(estimate);
    double sum = 0.0;
    for (std::size_t i = static_cast<std::size_t>(channel); i < mean.size(); i += channel_count) sum += mean[i];
    return sum / static_cast<double>(estimate.pixel_count());
}

double standard_error(const Estimate& estimate, int channel) {
    const std::vector<double> variance = variance_of(estimate);
    double sum = 0.0;
    for (std::size_t i = static_cast<std::size_t>(channel); i < variance.size(); i += channel_count) sum += variance[i];
    const double pixels = static_cast<double>(estimate.pixel_count());
    return std::sqrt(sum / static_cast<double>(estimate.count())) / pixels;
}

bool same_bits(const Estimate& a, const Estimate& b) {
    const Estimate::Plane x = a.totals(), y = b.totals();
    return x.size() == y.size() && std::memcmp(x.data(), y.data(), x.size() * sizeof(Moments)) == 0;
}

}  // namespace tandem::testing
