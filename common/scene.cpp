#include "common/scene.h"

namespace tandem {

std::vector<PlacedPrimitive> placed_primitives(const Scene& scene) {
    std::vector<PlacedPrimitive> placed;
    for (std::uint32_t e = 0; e < scene.entities.size(); ++e) {
        const Entity& entity = scene.entities[e];
        for (std::uint32_t p = 0; p < entity.primitive_count; ++p) placed.push_back({e, entity.first_primitive + p});
    }
    return placed;
}

}  // namespace tandem
