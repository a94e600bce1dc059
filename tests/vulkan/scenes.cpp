#include "tests/vulkan/scenes.h"

#include <cmath>
#include <cstring>
#include <glm/ext/matrix_transform.hpp>
#include <map>
#include <memory>

namespace tandem::testing {

Material conductor(double roughness) {
    Material material;
    material.kind = MaterialKind::conductor;
    material.roughness = roughness;
    material.eta = {0.21, 0.92, 1.10};
    material.k = {3.58, 2.58, 2.45};
    return material;
}

Scene full_scene() {
    SceneBuilder builder;
    builder.camera({0.0, 1.0, 4.0}, {0.0, 1.0, 0.0}, 50.0).background({0.1, 0.1, 0.1}, {0.3, 0.4, 0.6});
    builder.scene().camera.lens_radius = 0.05;
    builder.scene().camera.focus_distance = 4.0;
    const std::uint32_t white = builder.material(diffuse(glm::dvec3(0.75)));
    const std::uint32_t red = builder.material(diffuse({0.7, 0.2, 0.2}));
    const std::uint32_t lamp = builder.material(emitter(glm::dvec3(8.0)));
    const std::uint32_t fuzzy = builder.material(mirror({0.8, 0.8, 0.9}, 0.3));
    const std::uint32_t clear = builder.material(glass(1.5, Fresnel::exact, 0.4));
    Material glow = glass(1.3, Fresnel::exact, 0.5);
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
    return builder.scene();
}

namespace {

std::shared_ptr<const Pixels> picture(std::uint32_t width, std::uint32_t height, float brightest) {
    auto pixels = std::make_shared<Pixels>();
    pixels->width = width;
    pixels->height = height;
    for (std::uint32_t i = 0; i < 3 * width * height; ++i)
        pixels->rgb.push_back(brightest * static_cast<float>(i * i % 17) / 16.0f);
    return pixels;
}

std::uint32_t textured(SceneBuilder& builder, const Texture& texture) {
    Material material = diffuse(glm::dvec3(1.0));
    material.colour_texture = static_cast<std::uint32_t>(builder.scene().textures.size());
    builder.scene().textures.push_back(texture);
    return builder.material(material);
}

std::vector<Texture> textures_of_all_kinds() {
    Texture checks;
    checks.first = {0.1, 0.2, 0.3};
    checks.second = {0.8, 0.7, 0.6};
    checks.frequency = {3.1, 0.0, 2.3};
    Texture by_coordinates = checks;
    by_coordinates.space = TextureSpace::coordinates;
    Texture noise = checks;
    noise.kind = TextureKind::noise;
    noise.frequency = glm::dvec3(2.7);
    noise.seed = 5;
    Texture turbulence = noise, marble = noise, image;
    turbulence.style = NoiseStyle::turbulence;
    marble.style = NoiseStyle::marble;
    marble.space = TextureSpace::coordinates;
    image.kind = TextureKind::image;
    image.image = picture(5, 3, 1.0f);
    return {checks, by_coordinates, noise, turbulence, marble, image};
}

// The triangle that was added last is shaded by normals that turn from corner to corner; all else stays flat.
void smooth_last_triangle(Scene& scene) {
    const std::size_t first = scene.vertices.size() - 3;
    const auto corner = [&](std::size_t i) { return scene.vertices[first + i]; };
    const glm::dvec3 normal = glm::normalize(glm::cross(corner(1) - corner(0), corner(2) - corner(0)));
    scene.normals.resize(first, glm::dvec3(0.0));
    for (std::size_t i = 0; i < 3; ++i)
        scene.normals.push_back(glm::normalize(normal + 0.8 * glm::normalize(corner(i))));
}

}  // namespace

Scene outdoor_scene(bool punctual) {
    SceneBuilder builder;
    builder.camera({0.0, 1.2, 4.5}, {0.0, 0.8, 0.0}, 50.0);
    builder.scene().camera.position_motion = {0.1, 0.02, 0.0};
    builder.scene().camera.target_motion = {0.0, 0.05, 0.0};
    builder.scene().background.image = picture(8, 4, 2.0f);
    builder.scene().background.rotation_degrees = 35.0;
    builder.scene().background.sampled = true;
    const std::vector<Texture> textures = textures_of_all_kinds();
    builder.cuboid(textured(builder, textures[0]), {-3.0, -0.1, -3.0}, {3.0, 0.0, 3.0});
    builder.sphere(textured(builder, textures[1]), {-1.6, 0.5, 0.0}, 0.5);
    builder.cuboid(textured(builder, textures[2]), {-0.9, 0.0, -0.4}, {-0.3, 0.7, 0.2});
    builder.sphere(textured(builder, textures[3]), {0.3, 0.4, 0.2}, 0.4);
    builder.quad(textured(builder, textures[4]), {glm::dvec3{-2, 0, -2}, {2, 0, -2}, {2, 2, -2}, {-2, 2, -2}});
    builder.triangle(textured(builder, textures[5]), {glm::dvec3{1.9, 0.1, 0.0}, {1.9, 0.1, 0.8}, {1.5, 1.2, 0.4}});
    smooth_last_triangle(builder.scene());
    builder.sphere(builder.material(conductor(0.0)), {1.1, 0.3, 0.7}, 0.3);
    builder.sphere(builder.material(conductor(0.4)), {-0.5, 0.25, 1.0}, 0.25);
    builder.scene().entities.back().motion = {0.3, 0.1, 0.0};
    builder.sphere(builder.material(rough_diffuse(glm::dvec3(0.7), 0.5)), {-1.1, 0.2, 1.3}, 0.2);
    builder.sphere(builder.material(emitter(glm::dvec3(6.0))), {0.8, 1.9, 0.0}, 0.2);
    builder.scene().normals.resize(builder.scene().vertices.size(), glm::dvec3(0.0));
    if (!punctual) return builder.scene();
    PunctualLight point, spot, sun;
    point.position = {-1.0, 2.0, 1.0};
    point.intensity = {2.0, 1.0, 1.0};
    spot.kind = PunctualKind::spot;
    spot.position = {1.0, 2.5, 1.0};
    spot.direction = glm::normalize(glm::dvec3(-0.3, -1.0, -0.2));
    spot.intensity = glm::dvec3(5.0);
    spot.inner_degrees = 20.0;
    sun.kind = PunctualKind::sun;
    sun.direction = glm::normalize(glm::dvec3(0.4, -1.0, -0.3));
    sun.intensity = {0.9, 0.8, 0.7};
    builder.scene().lights = {point, spot, sun};
    return builder.scene();
}

Scene foggy_scene() {
    SceneBuilder builder;
    Scene& scene = builder.scene();
    builder.camera({0.0, 1.0, 4.0}, {0.0, 0.8, 0.0}, 50.0).background({0.2, 0.2, 0.3}, {0.5, 0.7, 1.0});
    Medium fog, cloud, tint;
    fog.absorption = glm::dvec3(0.02);
    fog.scattering = {0.05, 0.06, 0.08};
    cloud.scattering = glm::dvec3(3.0);
    cloud.absorption = {0.0, 0.1, 0.2};
    cloud.anisotropy = 0.6;
    auto grid = std::make_shared<DensityGrid>();
    grid->cells = {3, 2, 2};
    grid->low = {-1.5, 0.0, -0.5};
    grid->high = {-0.5, 1.0, 0.5};
    grid->density = {0.0f, 0.5f, 1.0f, 0.2f, 0.0f, 2.0f, 1.0f, 1.0f, 0.0f, 0.3f, 0.7f, 0.1f};
    cloud.grid = grid;
    tint.absorption = {2.0, 0.5, 0.1};
    scene.media = {fog, cloud, tint};
    scene.medium = 0;
    Material boundary;
    boundary.kind = MaterialKind::boundary;
    boundary.interior = 1;
    Material outer = glass(1.5), inner = glass(1.33);
    outer.interior = 2;
    outer.priority = 2;
    inner.priority = 1;
    builder.cuboid(builder.material(diffuse(glm::dvec3(0.6))), {-3.0, -0.1, -3.0}, {3.0, 0.0, 3.0});
    builder.cuboid(builder.material(boundary), {-1.6, 0.01, -0.6}, {-0.4, 1.1, 0.6});
    builder.sphere(builder.material(outer), {0.8, 0.6, 0.3}, 0.5);
    builder.sphere(builder.material(inner), {1.1, 0.7, 0.5}, 0.4);
    builder.sphere(builder.material(conductor(0.5)), {0.1, 0.3, 1.0}, 0.25);
    Material frosted = glass(1.5);
    frosted.roughness = 0.3;
    builder.cuboid(builder.material(frosted), {-0.6, 0.01, 1.2}, {-0.2, 0.5, 1.6});
    builder.cuboid(builder.material(emitter(glm::dvec3(6.0))), {-0.4, 2.2, -0.4}, {0.4, 2.2, 0.4});
    return scene;
}

namespace {

// Made before its destruction is registered, so that it goes before what its driver registers while it is made.
template <Acceleration acceleration>
Renderer& shared_renderer() {
    static const std::unique_ptr<Renderer> renderer = vulkan_backend(acceleration).create({});
    return *renderer;
}

}  // namespace

Renderer& default_renderer(Acceleration acceleration) {
    switch (acceleration) {
        case Acceleration::loops:
            return shared_renderer<Acceleration::loops>();
        case Acceleration::trees:
            return shared_renderer<Acceleration::trees>();
        case Acceleration::automatic:
            break;
    }
    return shared_renderer<Acceleration::automatic>();
}

Renderer& renderer_with_kernel(const std::string& kernel) {
    static std::map<std::string, std::unique_ptr<Renderer>> renderers;
    std::unique_ptr<Renderer>& renderer = renderers[kernel];
    if (!renderer) {
        BackendOptions options;
        options.kernel = kernel;
        renderer = vulkan_backend().create(options);
    }
    return *renderer;
}

RenderResult render(const Scene& scene, const RenderSettings& settings, std::uint64_t count) {
    return default_renderer().prepare(scene, settings)->render({0, count});
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
