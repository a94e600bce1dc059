#include "common/validation/report/junit.h"

#include <fmt/format.h>

#include <algorithm>

namespace tandem {

namespace {

constexpr const char* replacement = "\xEF\xBF\xBD";  // U+FFFD

// Length of the UTF-8 sequence of an XML character at `at` [RFC 3629; XML 1.0 section 2.2], 0 where there is none.
std::size_t character_length(const std::string& text, std::size_t at) {
    const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
    const unsigned first = byte(at);
    if (first < 0x80) return first >= 0x20 || first == '\t' || first == '\n' || first == '\r' ? 1 : 0;
    const std::size_t length = first >= 0xf0 ? 4 : first >= 0xe0 ? 3 : 2;
    if (first < 0xc2 || first > 0xf4 || at + length > text.size()) return 0;
    unsigned code = first & (0x7fu >> length);
    for (std::size_t i = 1; i < length; ++i) {
        if ((byte(at + i) & 0xc0u) != 0x80u) return 0;
        code = code << 6 | (byte(at + i) & 0x3fu);
    }
    constexpr unsigned least[] = {0, 0, 0x80, 0x800, 0x10000};
    const bool surrogate = code >= 0xd800 && code <= 0xdfff, no_character = code == 0xfffe || code == 0xffff;
    return code < least[length] || code > 0x10ffff || surrogate || no_character ? 0 : length;
}

}  // namespace

std::string xml_escaped(const std::string& text) {
    std::string result;
    for (std::size_t at = 0; at < text.size();) {
        const std::size_t length = character_length(text, at);
        if (length != 1) {
            result += length == 0 ? replacement : text.substr(at, length);
            at += std::max<std::size_t>(length, 1);
            continue;
        }
        const char c = text[at++];
        if (c == '&')
            result += "&amp;";
        else if (c == '<')
            result += "&lt;";
        else if (c == '>')
            result += "&gt;";
        else if (c == '"')
            result += "&quot;";
        else if (c == '\n' || c == '\r' || c == '\t')
            result += fmt::format("&#{};", static_cast<int>(c));
        else
            result += c;
    }
    return result;
}

namespace {

std::string case_of(const std::string& command, const SceneVerdict& verdict) {
    std::string text = fmt::format(R"(    <testcase classname="tandem.{}" name="{}" time="{:.3f}">)", command,
        xml_escaped(verdict.scene), verdict.seconds);
    text += "\n";
    std::string reasons;
    for (const std::string& reason : verdict.judgement.reasons) reasons += xml_escaped(reason) + "\n";
    const auto outcome = [&](const char* element) {
        text += fmt::format("      <{0} type=\"{1}\" message=\"{2}\">{3}</{0}>\n", element,
            verdict.failure.empty() ? name_of(verdict.verdict) : "failed", xml_escaped(verdict.sentence), reasons);
    };
    if (verdict.verdict == Verdict::disagree) outcome("failure");
    if (verdict.verdict == Verdict::undecided) outcome("error");
    if (verdict.verdict == Verdict::agree)
        text += fmt::format("      <system-out>{}</system-out>\n", xml_escaped(verdict.sentence));
    return text + "    </testcase>\n";
}

std::string properties_of(const SceneVerdict& verdict) {
    std::string text = "    <properties>\n";
    for (const auto& [side, info] :
        {std::pair{"reference", &verdict.reference_info}, {"candidate", &verdict.candidate_info}})
        for (const auto& [key, value] : {std::pair{"backend", &info->backend}, {"device", &info->device},
                 {"driver", &info->driver}, {"api", &info->api}})
            text += fmt::format("      <property name=\"{}.{}\" value=\"{}\"/>\n", side, key, xml_escaped(*value));
    return text + "    </properties>\n";
}

}  // namespace

std::string junit_xml(const std::string& command, std::span<const SceneVerdict> verdicts,
    const std::vector<std::string>& not_run, const LayerMessages& layer) {
    const auto count = [&](Verdict which) { return std::ranges::count(verdicts, which, &SceneVerdict::verdict); };
    double seconds = 0.0;
    for (const SceneVerdict& verdict : verdicts) seconds += verdict.seconds;
    const std::string figures = fmt::format(R"(tests="{}" failures="{}" errors="{}" skipped="{}" time="{:.3f}")",
        verdicts.size() + not_run.size() + layer.size(), count(Verdict::disagree) + std::ssize(layer),
        count(Verdict::undecided), not_run.size(), seconds);
    std::string xml = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n";
    xml += fmt::format("<testsuites {0}>\n  <testsuite name=\"tandem {1}\" {0}>\n", figures, command);
    if (!verdicts.empty()) xml += properties_of(verdicts.front());
    for (const SceneVerdict& verdict : verdicts) xml += case_of(command, verdict);
    for (const std::string& scene : not_run)
        xml += fmt::format(
            "    <testcase classname=\"tandem.{}\" name=\"{}\" time=\"0\">\n"
            "      <skipped message=\"stopped before its turn\"/>\n    </testcase>\n",
            command, xml_escaped(scene));
    for (const auto& [scene, text] : layer)
        xml += fmt::format(
            "    <testcase classname=\"tandem.{}.layer\" name=\"{}\" time=\"0\">\n"
            "      <failure type=\"validation-layer\" message=\"the Vulkan validation layer reports\">{}</failure>\n"
            "    </testcase>\n",
            command, xml_escaped(scene), xml_escaped(text));
    return xml + "  </testsuite>\n</testsuites>\n";
}

}  // namespace tandem
