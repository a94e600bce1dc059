// Verdicts as JUnit XML. That a parser takes it is tested in tests/commands.
#include <doctest/doctest.h>

#include "common/validation/report/junit.h"
#include "common/validation/report/verdict_json.h"
#include "tests/refusal.h"

using namespace tandem;

namespace {

SceneVerdict verdict_of(const std::string& scene, Verdict verdict, const std::string& sentence) {
    SceneVerdict result;
    result.scene = scene;
    result.verdict = verdict;
    result.sentence = sentence;
    result.seconds = 1.5;
    return result;
}

}  // namespace

TEST_CASE("JUnit: disagree is a failure, undecided an error, what was not run is skipped") {
    std::vector<SceneVerdict> verdicts{verdict_of("good", Verdict::agree, "yes"),
        verdict_of("bad", Verdict::disagree, "no"), verdict_of("open", Verdict::undecided, "perhaps")};
    verdicts[1].judgement.reasons = {"image: red differs"};
    const std::string xml = junit_xml("verify", to_json(verdicts, {"late"}));
    CHECK(contains(
        xml, R"(<testsuite name="tandem verify" tests="4" failures="1" errors="1" skipped="1" time="4.500">)"));
    CHECK(contains(xml, R"(<failure type="disagree" message="no">image: red differs)"));
    CHECK(contains(xml, R"(<error type="undecided" message="perhaps">)"));
    CHECK(contains(xml, R"(name="late" time="0">)"));
    CHECK(contains(xml, "<skipped "));
}

TEST_CASE("JUnit: what XML reserves or forbids is escaped or replaced") {
    const std::vector<SceneVerdict> verdicts{verdict_of("a<b>&\"c\"\n\x01\xff\xed\xa0\x80 ±", Verdict::agree, "fine")};
    const std::string xml = junit_xml("verify", to_json(verdicts));
    const std::string bad = "\xEF\xBF\xBD";
    CHECK(contains(xml, "name=\"a&lt;b&gt;&amp;&quot;c&quot;&#10;" + bad + bad + bad + bad + bad + " ±\""));
}
