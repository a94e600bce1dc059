// Verdicts as JUnit XML, which CI servers show: one testsuite, a testcase a scene.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

namespace tandem {

// Scenes, and what Vulkan's validation layer says while they are rendered.
using LayerMessages = std::vector<std::pair<std::string, std::string>>;

// agree      a testcase that passed.
// disagree   <failure>: the sentence as its message, the reasons as its text.
// undecided  <error>, not <skipped>: servers count skipped tests as no harm, and what is not known is no agreement.
// not_run    <skipped>: scenes that a stop request left out.
// layer      a testcase of its own with <failure>, beside the scene's.
// `report`: verdict_json.h's, with "validation_layer": [{"scene", "messages"}] where there was such a look.
// `command` ("verify") names the suite and the class of its cases. Characters that XML 1.0 cannot hold, and bytes that
// are no UTF-8, become U+FFFD.
[[nodiscard]] std::string junit_xml(const std::string& command, const nlohmann::json& report);

// For attributes and text alike. Line ends as references, so that attributes keep them.
[[nodiscard]] std::string xml_escaped(const std::string& text);

}  // namespace tandem
