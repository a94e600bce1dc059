#include <doctest/doctest.h>

#include <cmath>

#include "common/validation/trace_comparison.h"

namespace tandem {
namespace {

PathTrace three_rays() {
    PathTrace trace;
    for (std::uint32_t k = 0; k < 3; ++k)
        trace.rays.push_back({{1.0 + k, 2.0, 3.0}, {0.0, 0.6, 0.8}, glm::dvec3(std::pow(0.5, k)), glm::dvec3(0.0), k});
    return trace;
}

TEST_CASE("traces: equal ones are the same path, and rounding is counted in ulp of single precision") {
    PathTrace a = three_rays(), b = a;
    CHECK_FALSE(compare_traces(a, b).first_divergence.has_value());
    b.rays[1].origin.x += 0x1p-22;      // its vector's magnitude is 3: an ulp is 2^-22
    b.rays[2].throughput.y += 0x1p-25;  // 0.25: 2^-25
    const TraceComparison close = compare_traces(a, b);
    CHECK_FALSE(close.first_divergence.has_value());
    CHECK(close.rays[1].origin_ulp == doctest::Approx(1.0));
    CHECK(close.rays[2].throughput_ulp == doctest::Approx(1.0));
    CHECK(close.rays[2].origin_ulp == 0.0);
}

TEST_CASE("traces: the first divergence has its place and its reason") {
    const PathTrace a = three_rays();
    PathTrace b = a;
    b.rays[1].primitive = 9;
    b.rays[2].direction = {1.0, 0.0, 0.0};
    CHECK(compare_traces(a, b).first_divergence == 1);
    CHECK(compare_traces(a, b).reason.find("primitive 1 and primitive 9") != std::string::npos);
    b = a;
    b.rays[2].direction = {1.0, 0.0, 0.0};
    CHECK(compare_traces(a, b).first_divergence == 2);
    CHECK(compare_traces(a, b).reason.find("directions") != std::string::npos);
    b = a;
    b.rays[2].throughput = glm::dvec3(0.26);
    CHECK(compare_traces(a, b).reason.find("throughputs") != std::string::npos);
    b = a;
    b.rays.pop_back();
    CHECK(compare_traces(a, b).first_divergence == 2);
    CHECK(compare_traces(a, b).reason.find("ends") != std::string::npos);
    b = a;
    b.rays[0].origin.x = NAN;
    CHECK(compare_traces(a, b).first_divergence == 0);
}

}  // namespace
}  // namespace tandem
