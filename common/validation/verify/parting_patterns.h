// Patterns in where paths part, each of which leaves one cause.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/validation/verify/path_partings.h"

namespace tandem {

// Whether new directions differ on one side of a coordinate plane alone: the frame about the normal is another one
// there. A wrong formula for directions tells at all normals of the material.
class Frames {
public:
    void add(const std::vector<PathTrace>& reference, const std::vector<std::optional<Parting>>& partings);
    // "new directions differ about normals with z below 0 alone"; empty: no such thing.
    [[nodiscard]] std::string words() const;

private:
    struct Scattering {
        glm::dvec3 normal{};
        std::uint32_t material = no_index;
    };
    std::size_t parted_ = 0;
    std::vector<Scattering> differ_, alike_;
};

// Whether paths part at the last primitives alone, from a multiple of 32 on: the last workgroup of those that prepare
// primitives is lost. Others of the same shape are met alike, so that the shape's formula is right. The order is a
// device's: triangles, spheres, cuboids.
class PrimitiveEnd {
public:
    explicit PrimitiveEnd(const Scene& scene);
    void add(const std::vector<PathTrace>& reference, const std::vector<PathTrace>& candidate,
        const std::vector<std::optional<Parting>>& partings);
    // "paths part at the last 36 of 100 primitives alone"; empty: no such thing.
    [[nodiscard]] std::string words() const;

private:
    std::vector<std::uint32_t> slots_;  // of a primitive id
    std::vector<PrimitiveKind> kinds_;  // of a slot
    std::size_t parted_ = 0;
    std::map<std::uint32_t, std::size_t> differ_, alike_;  // by slot
};

}  // namespace tandem
