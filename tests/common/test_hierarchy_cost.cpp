// What pays for few samples and for many: time to build a hierarchy against time to trace.
#include <doctest/doctest.h>

#include "common/cost/cost.h"
#include "common/cost/hierarchy_cost.h"

namespace tandem {
namespace {

// The baseline takes 10 s for 100 samples, and 3 s to build.
ArmFigures baseline() {
    ArmFigures figures;
    figures.arm.knob = "baseline";
    figures.arm.hierarchy_seconds = 3.0;
    CostPoint point;
    point.samples = 100;
    point.seconds = {10.0, 9.0, 11.0};
    figures.points = {point};
    return figures;
}

ArmFigures arm_of(double build, Estimated ratio) {
    ArmFigures figures = baseline();
    figures.arm.knob = hierarchy_knob;
    figures.arm.setting = "low";
    figures.arm.hierarchy_seconds = build;
    figures.time_ratio = ratio;
    return figures;
}

PaysFor pays(double build, Estimated ratio) { return hierarchy_cost(arm_of(build, ratio), baseline()).pays; }

}  // namespace

TEST_CASE("what is built sooner and renders slower pays up to the samples that spend what building saved") {
    const HierarchyCost cost = hierarchy_cost(arm_of(1.0, {1.25, 1.2, 1.4}), baseline());
    CHECK(cost.pays == PaysFor::few_samples);
    // 2 s saved, 0.1 s x 0.25 lost a sample.
    CHECK(cost.even_samples.value == doctest::Approx(80.0));
    CHECK(cost.even_samples.low == doctest::Approx(50.0));
    CHECK(cost.even_samples.high == doctest::Approx(100.0));
    CHECK(cost.seconds_a_sample == doctest::Approx(0.125));
    CHECK(cost.baseline_seconds_a_sample == doctest::Approx(0.1));
}

TEST_CASE("what is built later and renders faster pays from so many samples on") {
    const HierarchyCost cost = hierarchy_cost(arm_of(5.0, {0.8, 0.75, 0.9}), baseline());
    CHECK(cost.pays == PaysFor::many_samples);
    CHECK(cost.even_samples.value == doctest::Approx(100.0));
    CHECK(cost.even_samples.low == doctest::Approx(80.0));
    CHECK(cost.even_samples.high == doctest::Approx(200.0));
}

TEST_CASE("what is better or worse in both pays always or never, and what is not told apart is said so") {
    CHECK(pays(1.0, {0.8, 0.7, 0.9}) == PaysFor::any_count);
    CHECK(pays(3.0, {0.8, 0.7, 0.9}) == PaysFor::any_count);
    CHECK(pays(4.0, {1.2, 1.1, 1.3}) == PaysFor::no_count);
    CHECK(pays(2.999, {1.2, 1.1, 1.3}) == PaysFor::no_count);  // what is saved is spent before the first sample ends
    CHECK(pays(3.001, {0.8, 0.7, 0.9}) == PaysFor::any_count);
    CHECK(pays(4.0, {1.0, 0.9, 1.1}) == PaysFor::unknown);
    const HierarchyCost open = hierarchy_cost(arm_of(1.0, {1.0, 0.9, 1.1}), baseline());
    CHECK(open.pays == PaysFor::unknown);
    CHECK(open.even_samples.low == doctest::Approx(200.0));
    const ArmFigures alike = arm_of(2.999, {1.0, 0.9, 1.1});
    CHECK(sentence_on_building(alike, baseline()).ends_with(": which one pays is not known"));
}

TEST_CASE("the report says both times and what pays, of arms of the hierarchy alone") {
    CostReport report;
    report.figures = {baseline(), arm_of(1.0, {1.25, 1.2, 1.4})};
    for (ArmFigures& arm : report.figures)
        for (const double error : cost_errors) arm.times.push_back({error, {}, {}, {}});
    const std::string expected =
        "hierarchy-quality low builds its hierarchy in 1 s, the baseline in 3 s; a sample of the image takes 125 ms "
        "and "
        "100 ms: it pays up to 80 samples a pixel (50 to 100)";
    CHECK(sentence_on_building(report.figures[1], report.figures[0]) == expected);
    CHECK(sentence_on_building(report.figures[0], report.figures[0]).empty());
    CHECK(recommendations(report).back() == expected + ".");
    CHECK(to_text(report).find(expected) != std::string::npos);
}

}  // namespace tandem
