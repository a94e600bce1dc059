// Feature images: what the camera's rays meet first (MODEL.md section 11.5), for denoisers, and to look at.
#pragma once

#include <array>
#include <functional>
#include <glm/vec3.hpp>
#include <optional>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "common/render/renderer.h"

namespace tandem {

enum class Feature { albedo, normal, depth, distance, position, coverage, primitive, material };
inline constexpr std::array<std::string_view, 8> feature_names{
    "albedo", "normal", "depth", "distance", "position", "coverage", "primitive", "material"};

// "albedo,normal", "all". Throws InputError.
[[nodiscard]] std::vector<Feature> features_from(const std::string& list);

// At most so many samples of a pixel, its first ones, are looked at.
inline constexpr std::uint64_t most_feature_samples = 16;

// What one pixel's first hits have in the mean. For a pixel without any, distances are infinite and all else is 0.
struct PixelFeatures {
    glm::dvec3 albedo{0.0}, normal{0.0}, position{0.0};
    double depth = 0.0, distance = 0.0;                       // along the view axis; along the ray
    double coverage = 0.0;                                    // the share of rays that hit something
    std::uint32_t primitive = no_index, material = no_index;  // which most rays hit
};

// What the job to look with is to be prepared with: the paths' first two segments.
[[nodiscard]] RenderSettings feature_settings(RenderSettings settings, const Scene& scene);

// [y * width + x], of these samples, which are of one block and at most most_feature_samples; nothing after a stop.
// `job` is prepared with feature_settings().
[[nodiscard]] std::optional<std::vector<PixelFeatures>> render_features(RenderJob& job, const Scene& scene,
    const RenderSettings& settings, SampleRange samples, const std::stop_token& stop,
    const std::function<void(double fraction)>& progress);

}  // namespace tandem
