// Runs hard cases on arms: backend x precision x kernel (or guard). It compares their hits with the surfaces
// themselves, in double, and with the promises of each case. Expected failures are told apart from others.
#pragma once

#include <functional>
#include <memory>
#include <stop_token>
#include <string>
#include <vector>

#include "common/render/renderer.h"
#include "common/stability/hard_case.h"

namespace tandem::stability {

// A renderer of one precision, and what it is called.
struct Bench {
    std::string backend;
    Precision precision = Precision::single_precision;
    std::unique_ptr<Renderer> renderer;
};

enum class Outcome { pass, expected_failure, fail };
inline constexpr std::array<std::string_view, 3> outcome_names{"pass", "expected failure", "fail"};

struct CaseResult {
    std::string id, name, backend, precision, kernel, bound_text;
    std::uint64_t rays = 0, misses = 0, false_hits = 0, self_hits = 0;
    double worst_ulp = 0.0, bound = 0.0;
    double nanoseconds_per_ray = 0.0;
    bool aimed = false;  // at edges and vertices
    bool cut = false;    // its share of the time was too short for all its rays
    Outcome outcome = Outcome::pass;
    std::string remark;  // why, where it fails
};

struct Skipped {
    std::string backend, precision, kernel, reason;
};

struct StabilityReport {
    std::vector<CaseResult> results;
    std::vector<Skipped> skipped;       // combinations that a backend lacks
    std::size_t not_run = 0;            // arms that a stop request came before, or cut short
    [[nodiscard]] bool failed() const;  // an arm of those that ran did
};

struct StabilityOptions {
    std::string kernel;      // of triangles, of convex bodies or a guard: that one alone; empty: all
    double seconds = 300.0;  // planned; what is slow shoots fewer rays, but some of every scene
    std::stop_token stop;    // cuts where that takes longer
    std::function<void(const StabilityReport&)> keep;  // what there is after each arm
    std::function<void(double fraction, const std::string& now)> progress;
};

// The default arms of all cases first. Throws InputError where an image case's scene cannot be used.
[[nodiscard]] StabilityReport run_cases(
    const std::vector<HardCase>& cases, const std::vector<Bench>& benches, const StabilityOptions& options);

}  // namespace tandem::stability
