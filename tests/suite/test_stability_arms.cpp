// The catalogue of scenes/hard on every backend: the defaults pass, and known weak kernels are seen to be weak.
#include <doctest/doctest.h>

#include "common/stability/catalogue.h"
#include "common/stability/stability.h"
#include "tests/suite/tracers.h"

using namespace tandem;
using namespace tandem::stability;

namespace {

std::vector<Bench> default_benches() {
    std::vector<Bench> benches;
    benches.push_back({"cpu", Precision::single_precision, cpu_backend().create({})});
    benches.push_back({"vulkan", Precision::single_precision, vulkan_backend().create({})});
    return benches;
}

std::vector<HardCase> cases_where(const std::function<bool(const HardCase&)>& wanted) {
    std::vector<HardCase> cases = load_catalogue(TANDEM_SOURCE_DIR "/scenes/hard/catalogue.json");
    std::erase_if(cases, [&](const HardCase& c) { return !wanted(c); });
    for (HardCase& c : cases) c.rays = std::min<std::uint64_t>(c.rays, 20000);
    return cases;
}

}  // namespace

TEST_CASE("the default kernels and guard pass every ray case") {
    const std::vector<Bench> benches = default_benches();
    for (const char* kernel : {"watertight", "stable", "error-bound"}) {
        StabilityOptions options;
        options.kernel = kernel;
        options.seconds = 600.0;  // rays end it much sooner
        const StabilityReport report =
            run_cases(cases_where([](const HardCase& c) { return c.subject < Subject::images; }), benches, options);
        for (const CaseResult& r : report.results) {
            CAPTURE(r.id);
            CAPTURE(r.backend);
            CAPTURE(r.misses);
            CAPTURE(r.false_hits);
            CAPTURE(r.self_hits);
            CAPTURE(r.worst_ulp);
            CHECK(r.outcome == Outcome::pass);
        }
        CHECK(!report.results.empty());
    }
}

TEST_CASE("a weak kernel fails by expectation, and it is a failure if it does not") {
    std::vector<HardCase> cases = cases_where([](const HardCase& c) { return c.id == "2"; });
    REQUIRE(cases.size() == 1);
    std::vector<Bench> benches;
    benches.push_back({"cpu", Precision::single_precision, cpu_backend().create({})});
    StabilityOptions options;
    options.kernel = "moller-trumbore";
    options.seconds = 600.0;
    CHECK(run_cases(cases, benches, options).results.at(0).outcome == Outcome::expected_failure);
    cases[0].expected_failures.clear();
    CHECK(run_cases(cases, benches, options).results.at(0).outcome == Outcome::fail);
    options.kernel = "watertight";
    cases[0].expected_failures = {{"cpu", "", "watertight", false}};
    const StabilityReport surprise = run_cases(cases, benches, options);
    CHECK(surprise.results.at(0).outcome == Outcome::fail);
    CHECK(surprise.failed());
}
