#include "common/validation/verify/retraced_paths.h"

#include "common/validation/verify/fault_place.h"
#include "common/validation/verify/path_partings.h"

namespace tandem {

namespace {

// Where another fault parts at least half of them still, one of 16 paths at most remains with a chance of 17 / 2^16, or
// 0.03 %.
constexpr std::size_t fewest = 16;              // paths that part
constexpr std::size_t one_of_that_remain = 10;  // at most, where the change undoes it

std::size_t count_parted(const std::vector<PathTrace>& reference, const std::vector<PathTrace>& candidate) {
    std::size_t count = 0;
    for (std::size_t i = 0; i < reference.size(); ++i)
        if (parting_of(reference[i], candidate[i])) ++count;
    return count;
}

}  // namespace

RetracedPaths::RetracedPaths(const RetracedSides& sides)
    : sides_(sides), reference_(traces_of(sides.reference)), candidate_(traces_of(sides.candidate)) {
    for (std::size_t i = 0; i < reference_.size(); ++i) parted_ += count_parted(reference_[i], candidate_[i]);
}

bool RetracedPaths::tell() const { return parted_ >= fewest; }

std::size_t RetracedPaths::most_left() const { return parted_ / one_of_that_remain; }

std::size_t RetracedPaths::parted_with(
    VerifiedSide side, Renderer& renderer, const Scene& scene, const RenderSettings& settings, std::size_t most) const {
    const std::unique_ptr<RenderJob> job = renderer.prepare(scene, settings);
    std::size_t count = 0;
    for (std::size_t i = 0; i < sides_.pixels.size() && count <= most; ++i) {
        const std::vector<PathTrace> traces = job->trace(sides_.pixels[i].x, sides_.pixels[i].y, first_block);
        count +=
            side == VerifiedSide::reference ? count_parted(traces, candidate_[i]) : count_parted(reference_[i], traces);
    }
    return count;
}

RetracedPaths::Traces RetracedPaths::traces_of(Renderer& renderer) const {
    const std::unique_ptr<RenderJob> job = renderer.prepare(sides_.scene, sides_.settings);
    Traces traces;
    for (const glm::uvec2& pixel : sides_.pixels) traces.push_back(job->trace(pixel.x, pixel.y, first_block));
    return traces;
}

}  // namespace tandem
