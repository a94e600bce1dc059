#include "common/validation/verify/precision_trial.h"

#include <fmt/format.h>

#include "common/error.h"
#include "common/validation/verify/fault_place.h"
#include "common/validation/verify/path_partings.h"

namespace tandem {

namespace {

// Where another fault parts at least half of them still, one of 16 paths at most remains with a chance of 17 / 2^16, or
// 0.03 %.
constexpr std::size_t fewest = 16;    // paths that part
constexpr double that_remains = 0.1;  // of them, where rounding is the cause
constexpr double that_stays = 0.5;    // at least, where it is not

class Trials {
public:
    explicit Trials(const PrecisionQuestion& question)
        : question_(question), reference_(traces_of(question.reference)), candidate_(traces_of(question.candidate)) {}

    std::optional<PrecisionTrial> run() const {
        const std::size_t all = parted(reference_, candidate_);
        if (all < fewest) return std::nullopt;
        const double parting = static_cast<double>(all);
        for (const VerifiedSide side : {VerifiedSide::reference, VerifiedSide::candidate}) {
            const std::optional<std::size_t> left = parted_in(side, Precision::double_precision);
            if (!left || static_cast<double>(*left) > that_remains * parting) continue;
            PrecisionTrial trial{.side = side, .right_in_mixed = {}, .parted = all, .in_double = *left};
            if (const std::optional<std::size_t> in_mixed = parted_in(side, Precision::mixed)) {
                const double share = static_cast<double>(*in_mixed) / parting;
                if (share <= that_remains || share >= that_stays) trial.right_in_mixed = share <= that_remains;
            }
            return trial;
        }
        return std::nullopt;
    }

private:
    [[nodiscard]] std::vector<PathTrace> traces_of(Renderer& renderer) const {
        const std::unique_ptr<RenderJob> job = renderer.prepare(question_.scene, question_.settings);
        std::vector<PathTrace> traces;
        for (const glm::uvec2& pixel : question_.pixels)
            for (PathTrace& trace : job->trace(pixel.x, pixel.y, first_block)) traces.push_back(std::move(trace));
        return traces;
    }

    static std::size_t parted(const std::vector<PathTrace>& reference, const std::vector<PathTrace>& candidate) {
        std::size_t count = 0;
        for (std::size_t i = 0; i < reference.size(); ++i)
            if (parting_of(reference[i], candidate[i])) ++count;
        return count;
    }

    [[nodiscard]] std::optional<std::size_t> parted_in(VerifiedSide side, Precision precision) const {
        if (!question_.in_time()) return std::nullopt;
        try {
            const std::unique_ptr<Renderer> other = question_.in_precision(side, precision);
            if (!other) return std::nullopt;
            const std::vector<PathTrace> traces = traces_of(*other);
            return side == VerifiedSide::reference ? parted(traces, candidate_) : parted(reference_, traces);
        } catch (const Error&) {  // not on this device
            return std::nullopt;
        }
    }

    const PrecisionQuestion& question_;
    std::vector<PathTrace> reference_, candidate_;
};

}  // namespace

std::optional<PrecisionTrial> try_precisions(const PrecisionQuestion& question) {
    if (!question.in_precision || question.pixels.empty()) return std::nullopt;
    return Trials(question).run();
}

std::string told(const PrecisionTrial& trial) {
    return fmt::format("{} of {} paths that part do where the {} computes in double precision{}", trial.in_double,
        trial.parted, name_of(trial.side),
        trial.right_in_mixed == false ? ", most where its intersections alone do" : "");
}

}  // namespace tandem
