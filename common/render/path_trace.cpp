#include "common/render/path_trace.h"

#include <array>
#include <glm/geometric.hpp>

#include "common/scene/materials.h"

namespace tandem {

glm::dvec3 weight_of(const TracedVertex& vertex) {
    glm::dvec3 weight(0.0);
    for (int c = 0; c < 3; ++c)
        if (vertex.throughput[c] != 0.0) weight[c] = vertex.next_throughput[c] / vertex.throughput[c];
    return weight;
}

std::string event_name(const Scene& scene, const TracedVertex& vertex) {
    constexpr std::array ends{"goes on", "left the scene", "absorbed by an emitter", "ended: no bounces left",
        "ended by roulette", "absorbed", "ended: direct light only", "invalid: inside of nine bodies"};
    if (vertex.end != PathEnd::goes_on) return ends.at(static_cast<std::size_t>(vertex.end));
    if (vertex.in_medium) return "scattered in a medium";
    if (vertex.material >= scene.materials.size()) return "scattered";
    const Material& material = scene.materials[vertex.material];
    if (row_of(material.kind).receives == Receives::always) return "scattered";
    const bool crosses =
        (glm::dot(vertex.direction, vertex.normal) < 0.0) == (glm::dot(vertex.next_direction, vertex.normal) < 0.0);
    if (!crosses) return "reflected";
    // Where a body of greater priority hides a surface (MODEL.md section 9.4), the ray goes on as it came.
    if (material.kind == MaterialKind::boundary || vertex.next_direction == vertex.direction) return "passed through";
    return "refracted";
}

}  // namespace tandem
