#include "common/scene/scene.h"

#include <cmath>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>

namespace tandem {

std::vector<PlacedPrimitive> placed_primitives(const Scene& scene) {
    std::vector<PlacedPrimitive> placed;
    for (std::uint32_t e = 0; e < scene.entities.size(); ++e) {
        const Entity& entity = scene.entities[e];
        for (std::uint32_t p = 0; p < entity.primitive_count; ++p) placed.push_back({e, entity.first_primitive + p});
    }
    return placed;
}

bool is_similarity(const glm::dmat4& map) {
    const glm::dmat3 linear(map), gram = glm::transpose(linear) * linear;
    const double mean = (gram[0][0] + gram[1][1] + gram[2][2]) / 3.0;
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
            if (!(std::abs(gram[i][j] - (i == j ? mean : 0.0)) <= 2e-5 * mean)) return false;
    return true;
}

}  // namespace tandem
