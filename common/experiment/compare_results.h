// Compares two results of tandem bench, arm by arm: of two drivers, devices or days.
#pragma once

#include "common/experiment/results.h"

namespace tandem {

// One arm's own time in B over that in A. The runs were not interleaved, so the state of the machine may explain a
// difference. Several replicates of a file are compared by their means. One alone has only the scatter within.
struct ChangeOfArm {
    std::string family, arm, workload;
    double ratio = 1.0, low = 1.0, high = 1.0;  // 95 %
    double p_family = 1.0;
    Change change = Change::ambiguous;  // Holm over all arms
};

struct ResultsComparison {
    std::vector<ChangeOfArm> arms;         // in both files
    std::vector<std::string> only_in_one;  // "memory, per-set at …: only in A"
};

[[nodiscard]] ResultsComparison compare_results(const BenchResults& a, const BenchResults& b);
[[nodiscard]] nlohmann::json to_json(const ResultsComparison& comparison);
[[nodiscard]] std::string to_text(const ResultsComparison& comparison);

}  // namespace tandem
