// Small scenes in memory for the Vulkan renderer's tests.
#pragma once

#include <array>
#include <span>

#include "common/render/renderer.h"
#include "vulkan/backend.h"

namespace tandem::testing {

// Adds one entity a primitive, each with its own transform.
class SceneBuilder {
public:
    SceneBuilder& camera(glm::dvec3 position, glm::dvec3 target, double field_degrees = 40.0);
    SceneBuilder& background(glm::dvec3 down, glm::dvec3 up);
    std::uint32_t material(const Material& material);
    SceneBuilder& triangle(
        std::uint32_t material, std::array<glm::dvec3, 3> corners, const glm::dmat4& m = glm::dmat4(1.0));
    SceneBuilder& sphere(
        std::uint32_t material, glm::dvec3 centre, double radius, const glm::dmat4& m = glm::dmat4(1.0));
    SceneBuilder& cuboid(
        std::uint32_t material, glm::dvec3 low, glm::dvec3 high, const glm::dmat4& m = glm::dmat4(1.0));
    // Two triangles, counter-clockwise seen from the front.
    SceneBuilder& quad(std::uint32_t material, std::array<glm::dvec3, 4> corners);

    Scene scene;

private:
    void entity(std::uint32_t material, Primitive primitive, const glm::dmat4& m, std::span<const glm::dvec3> points);
};

[[nodiscard]] Material diffuse(glm::dvec3 colour);
[[nodiscard]] Material rough_diffuse(glm::dvec3 colour, double roughness);
[[nodiscard]] Material emissive(glm::dvec3 radiance);
[[nodiscard]] Material mirror(glm::dvec3 colour, double fuzz = 0.0);
[[nodiscard]] Material glass(double refractive_index, double alpha = 0.0);
[[nodiscard]] Material conductor(double roughness);

[[nodiscard]] RenderSettings settings_of(
    std::uint32_t size, std::uint32_t bounces, Integrator integrator = Integrator::path, std::uint64_t seed = 1);

// The scene with every feature: all kinds of primitives and materials, transforms, a lens and a background.
[[nodiscard]] Scene full_scene();

// Textures of all kinds, conductors, a rough diffuse ball, an image for a sky, motion of entities and camera, and
// (unless for the path integrator, which cannot find them) lights without a surface.
[[nodiscard]] Scene outdoor_scene(bool punctual);

// Fog around everything, and bodies within bodies: a cloud on a grid that scatters forward, glass in coloured glass;
// rough glass.
[[nodiscard]] Scene foggy_scene();

// One renderer for all tests on the default device: drivers allow a process few instances in its life.
[[nodiscard]] Renderer& default_renderer(Acceleration acceleration = Acceleration::automatic);

// A renderer with kernels of this shape: "stages", "megakernel".
[[nodiscard]] Renderer& renderer_with_kernel(const std::string& kernel);

// Samples [0, count) with the default device and no validation.
[[nodiscard]] RenderResult render(const Scene& scene, const RenderSettings& settings, std::uint64_t count);

// Mean over the image of one channel.
[[nodiscard]] double image_mean(const Estimate& estimate, int channel = 0);
// Its standard error, from the variances of the pixels.
[[nodiscard]] double standard_error(const Estimate& estimate, int channel = 0);

// Whether two estimates hold the same bits.
[[nodiscard]] bool same_bits(const Estimate& a, const Estimate& b);

}  // namespace tandem::testing
