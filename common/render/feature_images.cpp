#include "common/render/feature_images.h"

#include <fmt/format.h>

#include <algorithm>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <limits>
#include <map>
#include <span>
#include <sstream>

#include "common/error.h"
#include "common/render/path_trace.h"
#include "common/render/random.h"
#include "common/text.h"

namespace tandem {

namespace {

using Votes = std::map<std::uint32_t, std::uint32_t>;

// The lower id of equal numbers.
std::uint32_t most_frequent(const Votes& votes) {
    const auto most = std::ranges::max_element(votes, [](const auto& a, const auto& b) { return a.second < b.second; });
    return most == votes.end() ? no_index : most->first;
}

// What the traced paths of a scene's pixels meet first.
class FirstHits {
public:
    FirstHits(const Scene& scene, const RenderSettings& settings)
        : scene_(scene), settings_(settings), placed_(placed_primitives(scene)) {}

    // A pixel by its samples from `begin` on.
    [[nodiscard]] PixelFeatures features_of(
        std::span<const PathTrace> paths, std::uint32_t pixel, std::uint64_t begin) const {
        PixelFeatures mean;
        Votes primitives, materials;
        double hits = 0.0;
        for (std::size_t path = 0; path < paths.size(); ++path) {
            const TracedVertex& first = paths[path].vertices.front();
            if (first.end == PathEnd::left_scene) continue;
            hits += 1.0;
            const double time = time_of(pixel, begin + path);
            if (first.end == PathEnd::goes_on) mean.albedo += weight_of(first);
            mean.position += first.position;
            mean.distance += first.t;
            mean.depth += glm::dot(first.position - first.origin, view_axis(time));
            if (first.in_medium) continue;
            mean.normal += shading_normal(first, time);
            ++primitives[first.primitive];
            ++materials[first.material];
        }
        if (hits == 0.0) {
            mean.depth = mean.distance = std::numeric_limits<double>::infinity();
            return mean;
        }
        for (glm::dvec3* sum : {&mean.albedo, &mean.normal, &mean.position}) *sum /= hits;
        for (double* sum : {&mean.depth, &mean.distance}) *sum /= hits;
        mean.coverage = hits / static_cast<double>(paths.size());
        mean.primitive = most_frequent(primitives);
        mean.material = most_frequent(materials);
        return mean;
    }

private:
    // MODEL.md section 4.
    [[nodiscard]] double time_of(std::uint32_t pixel, std::uint64_t sample) const {
        return to_unit<double>(random_block(settings_.generator, settings_.seed, pixel, sample, 1)[0]);
    }
    [[nodiscard]] glm::dvec3 view_axis(double time) const {
        const Camera& camera = scene_.camera;
        return glm::normalize(camera.target - camera.position + time * (camera.target_motion - camera.position_motion));
    }

    // Section 5.4: n_s on the side that the ray comes from, by the weights of the point that the backend found.
    [[nodiscard]] glm::dvec3 shading_normal(const TracedVertex& hit, double time) const {
        const glm::dvec3 flat = glm::dot(hit.direction, hit.normal) < 0.0 ? hit.normal : -hit.normal;
        const PlacedPrimitive placed = placed_[hit.primitive];
        const Primitive& primitive = scene_.primitives[placed.primitive];
        if (scene_.normals.empty() || primitive.kind != PrimitiveKind::triangle) return flat;
        const Entity& entity = scene_.entities[placed.entity];
        const auto corner = [&](std::size_t i) { return scene_.vertices[primitive.index.at(i)]; };
        const auto normal = [&](std::size_t i) { return scene_.normals[primitive.index.at(i)]; };
        if (normal(0) == glm::dvec3(0.0) || normal(1) == glm::dvec3(0.0) || normal(2) == glm::dvec3(0.0)) return flat;
        const glm::dmat4 to_object = glm::inverse(entity.object_to_world);
        const glm::dvec3 point(to_object * glm::dvec4(hit.position - time * entity.motion, 1.0));
        const glm::dvec3 edge1 = corner(1) - corner(0), edge2 = corner(2) - corner(0), off = point - corner(0);
        const glm::dvec3 whole = glm::cross(edge1, edge2);
        const double b1 = glm::dot(glm::cross(off, edge2), whole) / glm::dot(whole, whole);
        const double b2 = glm::dot(glm::cross(edge1, off), whole) / glm::dot(whole, whole);
        const glm::dvec3 sum =
            glm::transpose(glm::dmat3(to_object)) * ((1.0 - b1 - b2) * normal(0) + b1 * normal(1) + b2 * normal(2));
        const double along = glm::dot(sum, flat);
        if (!(along != 0.0)) return flat;
        const glm::dvec3 smooth = glm::normalize(along < 0.0 ? -sum : sum);
        return glm::dot(hit.direction, smooth) < 0.0 ? smooth : flat;
    }

    const Scene& scene_;
    const RenderSettings& settings_;
    PlacedPrimitives placed_;
};

}  // namespace

std::vector<Feature> features_from(const std::string& list) {
    const std::vector<std::string> names(feature_names.begin(), feature_names.end());
    std::vector<Feature> features;
    std::istringstream words(list == "all" ? fmt::format("{}", fmt::join(names, ",")) : list);
    for (std::string word; std::getline(words, word, ',');) {
        const auto found = std::ranges::find(names, word);
        if (found == names.end())
            throw InputError(fmt::format("--aov: there is no feature '{}'; {}choose of {}, or all", word,
                did_you_mean(word, names), fmt::join(names, ", ")));
        const auto feature = static_cast<Feature>(found - names.begin());
        if (std::ranges::find(features, feature) == features.end()) features.push_back(feature);
    }
    if (features.empty())
        throw InputError(fmt::format("--aov: names no feature; choose of {}", fmt::join(names, ", ")));
    return features;
}

RenderSettings feature_settings(RenderSettings settings) {
    settings.integrator = Integrator::path;
    settings.light_sampling = LightSampling::power;
    settings.bounces = 1;
    settings.roulette_start = no_roulette;
    settings.sampling = Sampling::uniform;
    settings.accumulation.reset();
    return settings;
}

std::optional<std::vector<PixelFeatures>> render_features(RenderJob& job, const Scene& scene,
    const RenderSettings& settings, SampleRange samples, const std::stop_token& stop,
    const std::function<void(double fraction)>& progress) {
    const FirstHits hits(scene, settings);
    const std::uint32_t all = settings.width * settings.height;
    std::vector<PixelFeatures> features;
    features.reserve(all);
    for (std::uint32_t pixel = 0; pixel < all; ++pixel) {
        if (stop.stop_requested()) return std::nullopt;
        const std::vector<PathTrace> paths = job.trace(pixel % settings.width, pixel / settings.width, samples);
        features.push_back(hits.features_of(paths, pixel, samples.begin));
        if (progress) progress(static_cast<double>(pixel + 1) / all);
    }
    return features;
}

}  // namespace tandem
