#include "common/scene/loader/models.h"

#include <map>
#include <tuple>

namespace tandem::scene_json {

void set_coordinates(TriangleModel& model, const std::vector<CornerCoordinates>& corners) {
    using Key = std::tuple<std::uint32_t, double, double>;
    std::map<Key, std::uint32_t> split;
    TriangleModel result;
    result.triangles.reserve(model.triangles.size());
    for (std::size_t t = 0; t < model.triangles.size(); ++t) {
        std::array<std::uint32_t, 3> triangle{};
        for (std::size_t i = 0; i < 3; ++i) {
            const std::uint32_t vertex = model.triangles[t][i];
            const glm::dvec2& at = corners[t][i];
            const auto [place, added] =
                split.emplace(Key{vertex, at.x, at.y}, static_cast<std::uint32_t>(result.vertices.size()));
            if (added) {
                result.vertices.push_back(model.vertices[vertex]);
                result.texture_coordinates.push_back(at);
            }
            triangle[i] = place->second;
        }
        result.triangles.push_back(triangle);
    }
    model = std::move(result);
}

}  // namespace tandem::scene_json
