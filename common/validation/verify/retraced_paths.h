// Paths of both sides for the same random numbers, and how many part where one side's are traced again, changed.
#pragma once

#include <cstddef>
#include <glm/vec2.hpp>
#include <limits>
#include <span>
#include <vector>

#include "common/render/path_trace.h"
#include "common/render/renderer.h"
#include "common/validation/verify/verified_side.h"

namespace tandem {

struct RetracedSides {
    const Scene& scene;
    RenderSettings settings;  // the seed is that of both sides
    Renderer& reference;
    Renderer& candidate;
    std::span<const glm::uvec2> pixels;  // whose first block of samples is traced
};

class RetracedPaths {
public:
    // Errors: UnsupportedError where a side cannot trace paths.
    explicit RetracedPaths(const RetracedSides& sides);

    [[nodiscard]] std::size_t parted() const { return parted_; }
    // Enough paths part to tell whether a change undoes it.
    [[nodiscard]] bool tell() const;
    // Nine of ten paths that part do so no more, if so many are left: at most most_left().
    [[nodiscard]] bool undone(std::size_t left) const { return left <= most_left(); }
    [[nodiscard]] std::size_t most_left() const;
    // How many part where `side` is that renderer, of that scene. Traces no more pixels once they are more than `most`.
    [[nodiscard]] std::size_t parted_with(VerifiedSide side, Renderer& renderer, const Scene& scene,
        const RenderSettings& settings, std::size_t most = std::numeric_limits<std::size_t>::max()) const;

private:
    using Traces = std::vector<std::vector<PathTrace>>;  // by pixel
    [[nodiscard]] Traces traces_of(Renderer& renderer) const;

    RetracedSides sides_;
    Traces reference_, candidate_;
    std::size_t parted_ = 0;
};

}  // namespace tandem
