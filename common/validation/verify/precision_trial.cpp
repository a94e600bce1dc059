#include "common/validation/verify/precision_trial.h"

#include <fmt/format.h>

#include "common/error.h"

namespace tandem {

namespace {

constexpr double that_stays = 0.5;  // of paths that part, at least, where intersections are not the cause

std::optional<std::size_t> parted_in(const PrecisionQuestion& question, VerifiedSide side, Precision precision) {
    if (!question.in_time()) return std::nullopt;
    try {
        const std::unique_ptr<Renderer> other = question.in_precision(side, precision);
        if (!other) return std::nullopt;
        return question.paths.parted_with(side, *other, question.scene, question.settings);
    } catch (const Error&) {  // not on this device
        return std::nullopt;
    }
}

}  // namespace

std::optional<PrecisionTrial> try_precisions(const PrecisionQuestion& question) {
    const RetracedPaths& paths = question.paths;
    if (!question.in_precision || !paths.tell()) return std::nullopt;
    for (const VerifiedSide side : {VerifiedSide::reference, VerifiedSide::candidate}) {
        const std::optional<std::size_t> left = parted_in(question, side, Precision::double_precision);
        if (!left || !paths.undone(*left)) continue;
        PrecisionTrial trial{.side = side, .right_in_mixed = {}, .parted = paths.parted(), .in_double = *left};
        if (const std::optional<std::size_t> in_mixed = parted_in(question, side, Precision::mixed)) {
            const bool stays = static_cast<double>(*in_mixed) >= that_stays * static_cast<double>(paths.parted());
            if (paths.undone(*in_mixed) || stays) trial.right_in_mixed = !stays;
        }
        return trial;
    }
    return std::nullopt;
}

std::string told(const PrecisionTrial& trial) {
    return fmt::format("{} of {} paths that part do where the {} computes in double precision{}", trial.in_double,
        trial.parted, name_of(trial.side),
        trial.right_in_mixed == false ? ", most where its intersections alone do" : "");
}

}  // namespace tandem
