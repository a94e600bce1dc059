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

using nlohmann::json;

std::string text_of(const json& object, const char* key) { return xml_escaped(object.at(key).get<std::string>()); }

std::string case_of(const std::string& command, const json& scene) {
    std::string text = fmt::format(R"(    <testcase classname="tandem.{}" name="{}" time="{:.3f}">)", command,
        text_of(scene, "scene"), scene.at("seconds").get<double>());
    text += "\n";
    std::string reasons;
    for (const json& reason : scene.at("reasons")) reasons += xml_escaped(reason.get<std::string>()) + "\n";
    const auto verdict = scene.at("verdict").get<std::string>();
    const auto outcome = [&](const char* element) {
        text += fmt::format("      <{0} type=\"{1}\" message=\"{2}\">{3}</{0}>\n", element,
            scene.at("failure").is_null() ? verdict : "failed", text_of(scene, "sentence"), reasons);
    };
    if (verdict == "disagree") outcome("failure");
    if (verdict == "undecided") outcome("error");
    if (verdict == "agree") text += fmt::format("      <system-out>{}</system-out>\n", text_of(scene, "sentence"));
    return text + "    </testcase>\n";
}

std::string properties_of(const json& scene) {
    std::string text = "    <properties>\n";
    for (const char* const side : {"reference", "candidate"})
        for (const char* const key : {"backend", "device", "driver", "api"})
            text +=
                fmt::format("      <property name=\"{}.{}\" value=\"{}\"/>\n", side, key, text_of(scene.at(side), key));
    return text + "    </properties>\n";
}

}  // namespace

std::string junit_xml(const std::string& command, const json& report) {
    const json &scenes = report.at("scenes"), &not_run = report.at("not_run");
    const json layer = report.value("validation_layer", json::array());
    const auto count = [&](const char* verdict) {
        return std::ranges::count_if(scenes, [&](const json& scene) { return scene.at("verdict") == verdict; });
    };
    double seconds = 0.0;
    for (const json& scene : scenes) seconds += scene.at("seconds").get<double>();
    const std::string figures = fmt::format(R"(tests="{}" failures="{}" errors="{}" skipped="{}" time="{:.3f}")",
        scenes.size() + not_run.size() + layer.size(), count("disagree") + std::ssize(layer), count("undecided"),
        not_run.size(), seconds);
    std::string xml = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n";
    xml += fmt::format("<testsuites {0}>\n  <testsuite name=\"tandem {1}\" {0}>\n", figures, command);
    if (!scenes.empty()) xml += properties_of(scenes.front());
    for (const json& scene : scenes) xml += case_of(command, scene);
    for (const json& scene : not_run)
        xml += fmt::format(
            "    <testcase classname=\"tandem.{}\" name=\"{}\" time=\"0\">\n"
            "      <skipped message=\"stopped before its turn\"/>\n    </testcase>\n",
            command, xml_escaped(scene.get<std::string>()));
    for (const json& one : layer)
        xml += fmt::format(
            "    <testcase classname=\"tandem.{}.layer\" name=\"{}\" time=\"0\">\n"
            "      <failure type=\"validation-layer\" message=\"the Vulkan validation layer reports\">{}</failure>\n"
            "    </testcase>\n",
            command, text_of(one, "scene"), text_of(one, "messages"));
    return xml + "  </testsuite>\n</testsuites>\n";
}

}  // namespace tandem
