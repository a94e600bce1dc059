#include "common/render/check_settings.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/error.h"

namespace tandem {

namespace {

void check_size(const RenderSettings& settings) {
    constexpr std::uint32_t most = 65536;
    const auto fits = [](std::uint32_t side) { return side >= 1 && side <= most; };
    const std::uint64_t pixels = std::uint64_t{settings.width} * settings.height;
    if (!fits(settings.width) || !fits(settings.height) || pixels >= std::uint64_t{1} << 32)
        throw UnsupportedError(
            fmt::format("an image of {} x {} pixels is out of range; each side is 1 to {} and their product below 2^32",
                settings.width, settings.height, most));
}

void check_paths(const RenderSettings& settings) {
    if (!(settings.ray_min >= 0.0) || !(settings.ray_max >= settings.ray_min))
        throw UnsupportedError("the interval of ray distances is empty or begins below 0; use 0 <= ray_min <= ray_max");
    if (settings.bounces >= 1u << 28)
        throw UnsupportedError("more than 2^28 bounces have no random numbers; ask for fewer");
}

void check_light_sampling(const RenderSettings& settings) {
    if (settings.light_sampling == LightSampling::power || chooses_lights(settings.integrator)) return;
    const bool from_both_ends = settings.integrator == Integrator::bidirectional;
    throw UnsupportedError(fmt::format(
        "--light-sampling {}: the integrator {} {}; add --integrator next-event, or leave it out",
        light_sampling_names[static_cast<std::size_t>(settings.light_sampling)], integrator_name(settings.integrator),
        from_both_ends ? "begins paths at lights that no receiver has chosen, in proportion to their power"
                       : "samples no light"));
}

// The least of |a + t b| over t in [0, 1].
double least_length(const glm::dvec3& a, const glm::dvec3& b) {
    const double b2 = glm::dot(b, b);
    const double t = b2 > 0.0 ? glm::clamp(-glm::dot(a, b) / b2, 0.0, 1.0) : 0.0;
    return glm::length(a + t * b);
}

void check_camera(const Camera& camera) {
    const glm::dvec3 view = camera.target - camera.position, moved = camera.target_motion - camera.position_motion;
    // Below this the frame's axes are rounding noise.
    const double noise = 1e-12 * (glm::length(view) + glm::length(moved)) * glm::length(camera.up);
    const double least = least_length(glm::cross(view, camera.up), glm::cross(moved, camera.up));
    if (!(least > noise))
        throw UnsupportedError(
            "the camera has no frame: its target is its position or its up vector is along its view; move one");
}

// Sums in singles hold squares up to 1.8e19 squared. A sample may be more than the radiance of its light, by 1/pdf: so
// much is left to that.
void check_brightness(const Scene& scene) {
    const auto check = [](double radiance, const std::string& whose) {
        constexpr double brightest = 1e15;
        if (radiance > brightest)
            throw UnsupportedError(fmt::format(
                "{}: sums in single precision hold squares of radiances up to {:g}; use --precision double or "
                "--accumulation double, or scale the scene's radiances down",
                whose, brightest));
    };
    const auto greatest = [](const glm::dvec3& v) { return std::max({v.x, v.y, v.z}); };
    for (const Material& material : scene.materials)
        check(greatest(material.radiance), fmt::format("material '{}'", material.name));
    for (const PunctualLight& light : scene.lights)
        check(greatest(light.intensity), fmt::format("light '{}'", light.name));
    const Background& sky = scene.background;
    check(sky.image ? sky.image_scale * double{std::ranges::max(sky.image->rgb)} : greatest(max(sky.down, sky.up)),
        "the background");
}

}  // namespace

void check_settings(const Scene& scene, const RenderSettings& settings) {
    check_size(settings);
    check_paths(settings);
    check_sampling(settings);
    check_light_sampling(settings);
    check_camera(scene.camera);
    if (settings.accumulation.value_or(Accumulation::in_double) != Accumulation::in_double) check_brightness(scene);
}

void check_sampling(const RenderSettings& settings) {
    if (settings.sampling == Sampling::uniform) return;
    if (settings.generator == Generator::sobol)
        throw UnsupportedError(
            "adaptive sampling goes by the scatter of a pixel's samples, which says nothing of the error of Sobol "
            "points; use another --generator or --sampling uniform");
    if (settings.integrator == Integrator::bidirectional)
        throw UnsupportedError(
            "a bidirectional sample lights several pixels, so that none can have more samples than another; use "
            "another --integrator or --sampling uniform");
    if (settings.accumulation == Accumulation::plain)
        throw UnsupportedError(
            "plain sums run over all samples of every pixel alike; use another --accumulation or --sampling uniform");
}

}  // namespace tandem
