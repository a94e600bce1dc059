#include "common/scene/scene.h"

#include <algorithm>
#include <cmath>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <stdexcept>

namespace tandem {

PlacedPrimitives::PlacedPrimitives(const Scene& scene) : entities_(&scene.entities), firsts_(1, 0) {
    firsts_.reserve(scene.entities.size() + 1);
    for (const Entity& entity : scene.entities) firsts_.push_back(firsts_.back() + entity.primitive_count);
}

PlacedPrimitive PlacedPrimitives::operator[](std::uint32_t id) const {
    if (id >= size()) throw std::out_of_range("no primitive has this id");
    const auto after = std::upper_bound(firsts_.begin(), firsts_.end(), id);
    const auto entity = static_cast<std::uint32_t>(after - firsts_.begin()) - 1;
    return {entity, (*entities_)[entity].first_primitive + id - firsts_[entity]};
}

double largest_coordinate(const glm::dvec3& v) { return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)}); }

bool is_similarity(const glm::dmat4& map) {
    const glm::dmat3 linear(map), gram = glm::transpose(linear) * linear;
    const double mean = (gram[0][0] + gram[1][1] + gram[2][2]) / 3.0;
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
            if (!(std::abs(gram[i][j] - (i == j ? mean : 0.0)) <= 2e-5 * mean)) return false;
    return true;
}

}  // namespace tandem
