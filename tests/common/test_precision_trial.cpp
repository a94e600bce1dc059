// Paths that part by the rounding of one side, by that of its intersections, or by a formula.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include "common/error.h"
#include "common/validation/explanation/suspects.h"
#include "common/validation/verify/precision_trial.h"
#include "tests/common/traced_renderer.h"

namespace tandem::test {
namespace {

// Every path goes the same way, but for `parting` of 64 that a fault turns.
std::unique_ptr<TracedRenderer> traced(std::uint64_t parting) {
    return std::make_unique<TracedRenderer>([parting](const Scene&, std::uint64_t sample) {
        return scattered_once(sample < parting ? glm::dvec3(0.0, 1.0, 0.0) : glm::dvec3(0.0, 0.0, 1.0));
    });
}

struct Sides {
    std::uint64_t reference = 0, candidate = 0;  // of 64 paths that a fault turns
};
using Parting = std::function<std::uint64_t(VerifiedSide, Precision)>;

std::optional<PrecisionTrial> trial_of(const Sides& sides, const Parting& parting, bool in_time = true) {
    const Scene scene;
    const auto reference = traced(sides.reference), candidate = traced(sides.candidate);
    const std::vector<glm::uvec2> pixels{{0, 0}, {1, 0}};
    const InPrecision in_precision = [&](VerifiedSide side, Precision precision) -> std::unique_ptr<Renderer> {
        return traced(parting(side, precision));
    };
    const RetracedPaths paths({scene, {}, *reference, *candidate, pixels});
    return try_precisions(
        {.paths = paths, .scene = scene, .settings = {}, .in_precision = in_precision, .in_time = [&] {
             return in_time;
         }});
}

std::vector<Suspect> suspects_of(const PrecisionTrial& trial, const PathPartings& partings) {
    Judgement judgement;
    const Signature signature{};
    const FaultPlace place;
    return suspects_of_difference({.judgement = judgement,
                                      .signature = signature,
                                      .partings = partings,
                                      .place = place,
                                      .precision_trial = &trial},
        {.patterns = {}})
        .suspects;
}

}  // namespace

TEST_CASE("a side whose paths are right in double precision errs in its arithmetic") {
    for (const VerifiedSide faulty : {VerifiedSide::reference, VerifiedSide::candidate})
        for (const bool in_mixed : {false, true}) {
            CAPTURE(name_of(faulty));
            CAPTURE(in_mixed);
            const Sides sides{
                faulty == VerifiedSide::reference ? 40u : 0u, faulty == VerifiedSide::candidate ? 40u : 0u};
            const std::optional<PrecisionTrial> trial = trial_of(sides, [&](VerifiedSide side, Precision precision) {
                if (side != faulty) return std::uint64_t{0};
                return std::uint64_t{precision == Precision::double_precision || in_mixed ? 2u : 40u};
            });
            REQUIRE(trial);
            CHECK(trial->side == faulty);
            CHECK(trial->parted == 80);
            CHECK(trial->in_double == 4);
            CHECK(trial->right_in_mixed == in_mixed);
            CHECK(told(*trial) == fmt::format("4 of 80 paths that part do where the {} computes in double precision{}",
                                      name_of(faulty), in_mixed ? "" : ", most where its intersections alone do"));
            // Where rays go elsewhere, other code in double precision may be the reason.
            PathPartings partings;
            partings.parted = 80;
            partings.by[static_cast<std::size_t>(PartsBy::met)] = 1.0;
            const std::vector<Suspect> suspects = suspects_of(*trial, partings);
            REQUIRE(!suspects.empty());
            CHECK((suspects[0].part == Subsystem::arithmetic) == !in_mixed);
            partings.by = {};
            partings.by[static_cast<std::size_t>(PartsBy::direction)] = 1.0;
            CHECK(
                suspects_of(*trial, partings).at(0).part == (in_mixed ? Subsystem::scene_data : Subsystem::arithmetic));
        }
}

TEST_CASE("no precision is blamed for a formula, for rounding that remains, for few paths, or without time") {
    const auto formula = [](VerifiedSide side, Precision) -> std::uint64_t {
        return side == VerifiedSide::candidate ? 40 : 0;
    };
    CHECK_FALSE(trial_of({0, 40}, formula));
    CHECK_FALSE(trial_of({0, 40}, [](VerifiedSide, Precision) -> std::uint64_t { return 5; }));
    const auto right = [](VerifiedSide, Precision) -> std::uint64_t { return 0; };
    CHECK_FALSE(trial_of({0, 7}, right));
    CHECK(trial_of({0, 8}, right));
    CHECK_FALSE(trial_of({0, 40}, right, false));
    CHECK_FALSE(trial_of({0, 40}, [](VerifiedSide, Precision) -> std::uint64_t { throw UnsupportedError("no fp64"); }));
    // Neither most nor few part in mixed precision: that tells nothing.
    const std::optional<PrecisionTrial> between = trial_of({0, 40}, [](VerifiedSide side, Precision precision) {
        if (side == VerifiedSide::reference) return std::uint64_t{0};
        return std::uint64_t{precision == Precision::mixed ? 10u : 0u};
    });
    REQUIRE(between);
    CHECK_FALSE(between->right_in_mixed.has_value());
}

}  // namespace tandem::test
