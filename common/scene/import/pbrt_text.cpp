#include "common/scene/import/pbrt_text.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>

#include "common/error.h"

namespace tandem::scene_import {

namespace {

// Words, quoted texts and brackets; # begins a comment.
std::vector<Token> tokens_of(const std::string& text) {
    std::vector<Token> tokens;
    std::size_t line = 1;
    for (std::size_t i = 0; i < text.size();) {
        const char c = text[i];
        if (c == '\n') ++line;
        if (std::isspace(static_cast<unsigned char>(c)) != 0) {
            ++i;
        } else if (c == '#') {
            while (i < text.size() && text[i] != '\n') ++i;
        } else if (c == '"') {
            const std::size_t end = std::min(text.find('"', i + 1), text.size());
            tokens.push_back({text.substr(i + 1, end - i - 1), true, line});
            i = end + 1;
        } else if (c == '[' || c == ']') {
            tokens.push_back({c == '[' ? "[" : "]", false, line});
            ++i;
        } else {
            const std::size_t end = std::min(text.find_first_of(" \t\r\n[]\"#", i), text.size());
            tokens.push_back({text.substr(i, end - i), false, line});
            i = end;
        }
    }
    return tokens;
}

}  // namespace

PbrtText::PbrtText(std::string file, const std::string& text) : file_(std::move(file)), tokens_(tokens_of(text)) {}

void PbrtText::refuse(const std::string& reason, const std::string& mend) const {
    const std::size_t line = tokens_.empty() ? 1 : tokens_[std::min(at_, tokens_.size()) - (at_ > 0 ? 1 : 0)].line;
    throw input_error(fmt::format("{}: line {}", file_, line), "", reason, mend);
}

const Token& PbrtText::next(const char* what) {
    if (at_ >= tokens_.size()) refuse(fmt::format("ends where {} should stand", what), "complete it");
    return tokens_[at_++];
}

std::string PbrtText::text(const char* what) {
    const Token& token = next(what);
    if (!token.quoted)
        refuse(
            fmt::format("\"{}\" stands where {} should, in quotation marks", printable(token.text), what), "write it");
    return token.text;
}

double PbrtText::number_of(const Token& token) const {
    double value = 0.0;
    const char* end = token.text.data() + token.text.size();
    const char* begin = token.text.data() + (token.text.starts_with('+') ? 1 : 0);
    const auto [stop, error] = std::from_chars(begin, end, value);
    if (token.quoted || error != std::errc{} || stop != end || !std::isfinite(value))
        refuse(fmt::format("\"{}\" is no number", printable(token.text)), "write one");
    return value;
}

double PbrtText::number() { return number_of(next("a number")); }
glm::dvec3 PbrtText::point() {
    const double x = number(), y = number(), z = number();
    return {x, y, z};
}

glm::dmat4 PbrtText::matrix() {
    const bool bracket = at_ < tokens_.size() && tokens_[at_].text == "[";
    if (bracket) ++at_;
    glm::dmat4 m;
    for (int i = 0; i < 16; ++i) m[i / 4][i % 4] = number();
    if (bracket && next("]").text != "]") refuse("has more than 16 numbers in a matrix", "write 16");
    return m;
}

Parameters PbrtText::parameters() {
    Parameters found;
    while (at_ < tokens_.size() && tokens_[at_].quoted) {
        const std::string head = tokens_[at_++].text;
        const std::size_t gap = head.find_first_of(" \t");
        const std::size_t name = gap == std::string::npos ? gap : head.find_first_not_of(" \t", gap);
        if (name == std::string::npos)
            refuse(fmt::format("\"{}\" is no type and name", printable(head)), "write \"float x\", say");
        Parameter& parameter = found[head.substr(name, head.find_first_of(" \t", name) - name)];
        parameter.type = head.substr(0, gap);
        if (next("a value").text != "[" || tokens_[at_ - 1].quoted) {
            parameter.values.push_back(tokens_[at_ - 1]);
            continue;
        }
        while (next("]").text != "]" || tokens_[at_ - 1].quoted) parameter.values.push_back(tokens_[at_ - 1]);
    }
    return found;
}

const Parameter* PbrtText::find(const Parameters& parameters, const std::string& name) const {
    const auto found = parameters.find(name);
    if (found == parameters.end()) return nullptr;
    found->second.used = true;
    if (found->second.values.empty()) refuse("the parameter " + printable(name) + " has no value", "write one");
    return &found->second;
}

double PbrtText::real(const Parameters& parameters, const std::string& name, double otherwise) const {
    const Parameter* found = find(parameters, name);
    return found == nullptr ? otherwise : number_of(found->values.front());
}

std::string PbrtText::word(const Parameters& parameters, const std::string& name, const std::string& otherwise) const {
    const Parameter* found = find(parameters, name);
    return found == nullptr ? otherwise : found->values.front().text;
}

std::optional<glm::dvec3> PbrtText::colour(const Parameters& parameters, const std::string& name) const {
    const Parameter* found = find(parameters, name);
    if (found == nullptr) return std::nullopt;
    if (found->type == "float") return glm::dvec3(number_of(found->values.front()));
    if (found->type != "rgb" || found->values.size() != 3)
        refuse(fmt::format("{} is a {}", printable(name), printable(found->type)),
            "write \"rgb " + name + "\" with three numbers");
    return glm::dvec3(number_of(found->values[0]), number_of(found->values[1]), number_of(found->values[2]));
}

void PbrtText::only(
    const Parameters& parameters, const std::string& what, std::initializer_list<const char*> harmless) const {
    for (const auto& [name, parameter] : parameters)
        if (!parameter.used && std::ranges::find(harmless, name) == harmless.end())
            refuse(fmt::format("{} has \"{}\", which Tandem has no word for here", what, printable(name)), "remove it");
}

}  // namespace tandem::scene_import
