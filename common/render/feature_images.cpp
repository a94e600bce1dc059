#include "common/render/feature_images.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <limits>
#include <span>
#include <sstream>

#include "common/error.h"
#include "common/render/path_trace.h"
#include "common/render/random.h"
#include "common/text.h"

namespace tandem {

namespace {

// Where several are equally frequent, the lowest.
std::uint32_t most_frequent(std::span<std::uint32_t> ids) {
    std::ranges::sort(ids);
    std::uint32_t found = no_index;
    std::ptrdiff_t most = 0;
    for (auto run = ids.begin(); run != ids.end();) {
        const auto next = std::find_if(run, ids.end(), [&](std::uint32_t id) { return id != *run; });
        if (next - run > most) found = *run;
        most = std::max(most, next - run);
        run = next;
    }
    return found;
}

// What the traced paths of a scene's pixels meet first.
class FirstHits {
public:
    FirstHits(const Scene& scene, const RenderSettings& settings)
        : scene_(scene), settings_(settings), placed_(placed_primitives(scene)), moves_(camera_moves(scene.camera)) {
        for (const Entity& entity : scene.entities) {
            to_object_.push_back(glm::inverse(entity.object_to_world));
            moves_ = moves_ || entity.motion != glm::dvec3(0.0);
        }
    }

    // A pixel by its samples from `begin` on, at most most_feature_samples.
    [[nodiscard]] PixelFeatures features_of(
        std::span<const TracedVertex> vertices, std::uint32_t pixel, std::uint64_t begin) const {
        PixelFeatures mean;
        std::array<std::uint32_t, most_feature_samples> primitives{}, materials{};
        std::size_t hits = 0, surfaces = 0;
        for (std::size_t sample = 0; sample < vertices.size(); ++sample) {
            const TracedVertex& first = vertices[sample];
            if (first.end == PathEnd::left_scene) continue;
            ++hits;
            const double time = time_of(pixel, begin + sample);
            if (first.end == PathEnd::goes_on) mean.albedo += weight_of(first);
            mean.position += first.position;
            mean.distance += first.t;
            mean.depth += glm::dot(first.position - first.origin, view_axis(time));
            if (first.in_medium) continue;
            mean.normal += shading_normal(first, time);
            primitives.at(surfaces) = first.primitive;
            materials.at(surfaces++) = first.material;
        }
        if (hits == 0) {
            mean.depth = mean.distance = std::numeric_limits<double>::infinity();
            return mean;
        }
        const auto count = static_cast<double>(hits);
        for (glm::dvec3* sum : {&mean.albedo, &mean.normal, &mean.position}) *sum /= count;
        for (double* sum : {&mean.depth, &mean.distance}) *sum /= count;
        mean.coverage = count / static_cast<double>(vertices.size());
        mean.primitive = most_frequent(std::span(primitives).first(surfaces));
        mean.material = most_frequent(std::span(materials).first(surfaces));
        return mean;
    }

private:
    static bool camera_moves(const Camera& camera) {
        return camera.position_motion != glm::dvec3(0.0) || camera.target_motion != glm::dvec3(0.0);
    }
    // MODEL.md section 4; 0 where nothing moves.
    [[nodiscard]] double time_of(std::uint32_t pixel, std::uint64_t sample) const {
        if (!moves_) return 0.0;
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
        const glm::dmat4& to_object = to_object_[placed.entity];
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
    std::vector<glm::dmat4> to_object_;  // by entity
    bool moves_;                         // the camera, or an entity
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

RenderSettings feature_settings(RenderSettings settings, const Scene& scene) {
    // The path integrator refuses punctual lights.
    settings.integrator = scene.lights.empty() ? Integrator::path : Integrator::next_event;
    settings.mis = true;
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
    const FilmSize film{settings.width, settings.height};
    std::vector<PixelFeatures> features(film.pixel_count());
    RenderControl control{stop, {}};
    if (progress) control.progress = [&](double done) { progress(done / static_cast<double>(samples.count())); };
    const bool complete =
        job.first_vertices(film, samples, control, [&](std::uint32_t pixel, std::span<const TracedVertex> vertices) {
            features[pixel] = hits.features_of(vertices, pixel, samples.begin);
        });
    if (!complete) return std::nullopt;
    return features;
}

}  // namespace tandem
