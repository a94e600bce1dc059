#include "common/scene/loader/models.h"

#include <fmt/format.h>

#include <algorithm>
#include <glm/geometric.hpp>
#include <map>
#include <tuple>

namespace tandem::scene_json {

namespace {

// Makes the normals unit; without one at some corner, the triangle has none.
void make_unit(Corners& corners) {
    const bool smooth =
        std::ranges::all_of(corners, [](const Corner& corner) { return glm::length(corner.normal) > 0.0; });
    for (Corner& corner : corners) corner.normal = smooth ? glm::normalize(corner.normal) : glm::dvec3(0.0);
}

}  // namespace

void set_corners(TriangleModel& model, std::vector<Corners> corners, ModelParts parts) {
    if (corners.empty()) return;
    corners.resize(model.triangles.size());
    for (Corners& triangle : corners) make_unit(triangle);
    const bool smooth =
        std::ranges::any_of(corners, [](const Corners& triangle) { return triangle[0].normal != glm::dvec3(0.0); });
    if (!parts.coordinates && !smooth) return;
    using Key = std::tuple<std::uint32_t, double, double, double, double, double>;
    std::map<Key, std::uint32_t> split;
    std::vector<glm::dvec3> vertices;
    for (std::size_t t = 0; t < model.triangles.size(); ++t) {
        for (std::size_t i = 0; i < 3; ++i) {
            const std::uint32_t vertex = model.triangles[t][i];
            const auto& [at, normal] = corners[t][i];
            const auto [place, added] = split.emplace(
                Key{vertex, at.x, at.y, normal.x, normal.y, normal.z}, static_cast<std::uint32_t>(vertices.size()));
            if (added) {
                vertices.push_back(model.vertices[vertex]);
                if (parts.coordinates) model.texture_coordinates.push_back(at);
                if (smooth) model.normals.push_back(normal);
            }
            model.triangles[t][i] = place->second;
        }
    }
    model.vertices = std::move(vertices);
}

std::shared_ptr<const Pixels> ModelImages::read(
    const std::string& name, bool srgb, const glm::dvec3& factor, std::string_view bytes) {
    const std::string key = fmt::format("{} {} {} {} {}", srgb, factor.x, factor.y, factor.z, name);
    std::shared_ptr<const Pixels>& pixels = read_[key];
    if (!pixels)
        pixels = read_pixels({.path = folder_ / name,
            .place = place_,
            .shown = name,
            .srgb = srgb,
            .alpha = true,
            .bytes = bytes,
            .factor = factor});
    return pixels;
}

}  // namespace tandem::scene_json
