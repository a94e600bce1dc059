#include "common/exercise/submission.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <sstream>

#include "common/files/read_file.h"
#include "common/text.h"

namespace tandem {

namespace {

[[noreturn]] void refuse(const std::string& text, std::size_t place, const std::string& reason) {
    const auto line = 1 + std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(place), '\n');
    throw RefusedSubmission(fmt::format("line {}: {}", line, reason));
}

bool in_word(char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_'; }

// Resources, entry points and other shaders' variables begin with one of these. GLSL has no other way to them.
constexpr std::array<std::string_view, 14> forbidden{"layout", "buffer", "uniform", "shared", "main", "in", "attribute",
    "varying", "subroutine", "precision", "coherent", "volatile", "readonly", "writeonly"};

void check_word(const std::string& text, std::size_t place, std::string_view word, bool outside) {
    // `in` is a parameter's qualifier, too.
    if (word == "in" && !outside) return;
    if (std::ranges::find(forbidden, word) != forbidden.end() || word.starts_with("gl_"))
        refuse(text, place, fmt::format("'{}' reaches beyond the function; leave it out", word));
    if (word.starts_with("tandem_"))
        refuse(text, place, "names that begin with tandem_ are the marker's; choose another");
    if (word.find("__") != std::string_view::npos)
        refuse(text, place, "names with two underscores are the compiler's; choose another");
}

}  // namespace

std::string read_submission(const std::filesystem::path& path) {
    std::error_code error;
    const auto size = std::filesystem::file_size(path, error);
    if (!error && size > greatest_submission_bytes)
        throw RefusedSubmission(
            fmt::format("it has {} bytes; a submission may have {}", size, greatest_submission_bytes));
    return read_file(path, greatest_submission_bytes);
}

std::string without_comments(const std::string& text) {
    std::string code = text;
    for (std::size_t i = 0; i < code.size();) {
        if (code.compare(i, 2, "//") == 0) {
            while (i < code.size() && code[i] != '\n' && code[i] != '\r') code[i++] = ' ';
        } else if (code.compare(i, 2, "/*") == 0) {
            const std::size_t end = code.find("*/", i + 2);
            if (end == std::string::npos) refuse(text, i, "a comment /* has no end; close it by */");
            for (; i < end + 2; ++i)
                if (code[i] != '\n' && code[i] != '\r') code[i] = ' ';
        } else {
            ++i;
        }
    }
    int depth = 0;
    for (std::size_t i = 0; i < code.size();) {
        const char c = code[i];
        depth += (c == '(' || c == '{') - (c == ')' || c == '}');
        if (c == '#') refuse(text, i, "directives (#include, #extension, #define) are not allowed; leave it out");
        if (c == '\\') refuse(text, i, "there is a backslash; leave it out");
        if ((c < ' ' && c != '\n' && c != '\r' && c != '\t') || c > '~')
            refuse(text, i, "outside comments only ASCII is allowed; replace the character");
        std::size_t end = i;
        while (end < code.size() && in_word(code[end])) ++end;
        if (end > i && std::isdigit(static_cast<unsigned char>(c)) == 0)
            check_word(text, i, std::string_view(code).substr(i, end - i), depth == 0);
        i = std::max(end, i + 1);
    }
    return code;
}

std::string shader_of(const Exercise& exercise, const std::string& submission) {
    const std::size_t given = names_of_values(exercise.arguments).size(),
                      made = names_of_values(exercise.results).size();
    return fmt::format(R"(#version 460
#line 1
{}
#line 1 1
layout(local_size_x = 64) in;
layout(std430, set = 0, binding = 0) readonly buffer tandem_Given {{ float tandem_given[]; }};
layout(std430, set = 0, binding = 1) writeonly buffer tandem_Answers {{ float tandem_answers[]; }};
layout(push_constant) uniform tandem_Counts {{ uint tandem_count; }};
void main() {{
    const uint tandem_i = gl_GlobalInvocationID.x;
    if (tandem_i >= tandem_count) return;
#define given(k) tandem_given[tandem_i * {}u + k]
#define given2(k) vec2(given(k), given(k + 1))
#define given3(k) vec3(given(k), given(k + 1), given(k + 2))
#define answer(k, tandem_v) tandem_answers[tandem_i * {}u + k] = (tandem_v)
#define answer2(k, tandem_v) {{ const vec2 tandem_x = (tandem_v); answer(k, tandem_x.x); answer(k + 1, tandem_x.y); }}
#define answer3(k, tandem_v) {{ const vec3 tandem_y = (tandem_v); answer2(k, tandem_y.xy); answer(k + 2, tandem_y.z); }}
    {}
}}
)",
        without_comments(submission), given, made, exercise.call);
}

std::string starter_of(const Exercise& exercise, std::size_t number) {
    std::string text = fmt::format("// Exercise {}: {} (lesson {})\n//\n", number, exercise.title, exercise.lesson);
    std::istringstream lines{std::string(exercise.task)};
    for (std::string line; std::getline(lines, line);) text += line.empty() ? "//\n" : "// " + line + "\n";
    return text +
           fmt::format("//\n// Mark it: tandem exercise check {:02}-{}.glsl\n\n{} {{\n    // Write it here.\n}}\n",
               number, exercise.slug, exercise.prototype);
}

std::vector<std::string> names_of_values(std::string_view list) {
    std::vector<std::string> names;
    std::istringstream words{std::string(list)};
    for (std::string word; words >> word;) {
        const std::size_t colon = word.find(':');
        if (colon == std::string::npos) {
            names.push_back(word);
            continue;
        }
        for (int i = 0; i < word[colon + 1] - '0'; ++i) names.push_back(word.substr(0, colon) + "." + "xyzw"[i]);
    }
    return names;
}

}  // namespace tandem
