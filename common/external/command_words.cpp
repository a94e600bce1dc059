#include "common/external/command_words.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <sstream>

#include "common/error.h"
#include "common/text.h"

namespace tandem {

namespace {

const std::vector<std::string> known_placeholders{
    "scene", "width", "height", "samples", "seed", "first_sample", "bounces", "filter", "threads", "out"};

// Programs that run the one that is meant.
constexpr const char* interpreters[] = {"python", "pypy", "sh", "bash", "dash", "zsh", "ksh", "perl", "ruby", "node",
    "julia", "lua", "java", "env", "nice", "timeout", "taskset", "mpirun", "mpiexec", "srun", "blender"};

InputError refusal(const std::string& reason, const std::string& mend) {
    return InputError("exec: " + reason + "; " + mend);
}

// Calls `take` with each {name} of the word and gives the word with what `take` returns in their places. {{ and }}
// stand for single braces.
std::string with_placeholders(const std::string& word, const std::function<std::string(const std::string&)>& take) {
    std::string result;
    for (std::size_t at = 0; at < word.size(); ++at) {
        const char c = word[at];
        if ((c == '{' || c == '}') && at + 1 < word.size() && word[at + 1] == c) {
            result += c;
            ++at;
            continue;
        }
        const std::size_t end = c == '{' ? word.find('}', at) : std::string::npos;
        if (end == std::string::npos) {
            result += c;
            continue;
        }
        result += take(word.substr(at + 1, end - at - 1));
        at = end;
    }
    return result;
}

bool is_file(const std::filesystem::path& path) {
    std::error_code error;
    return std::filesystem::is_regular_file(path, error);
}

}  // namespace

CommandWords::CommandWords(const std::string& text) : text_(text) {
    split();
    if (words_.empty()) throw refusal("no command", "write exec:'COMMAND ...'");
    find_placeholders();
    check_shell();
    check_program();
    for (const char* needed : {"out", "samples", "seed"})
        if (!stays_up() && !has(needed))
            throw refusal(fmt::format("the command '{}' has no {{{}}}", printable(text_), needed),
                "add it; a command without any placeholder is asked on its standard input");
}

void CommandWords::split() {
    std::string word;
    bool begun = false;
    char quote = '\0';
    for (std::size_t at = 0; at < text_.size(); ++at) {
        const char c = text_[at];
        if (c == '\\' && quote != '\'' && at + 1 < text_.size()) {
            word += text_[++at];
            begun = true;
        } else if (quote != '\0') {
            if (c == quote)
                quote = '\0';
            else
                word += c;
        } else if (c == '\'' || c == '"') {
            quote = c;
            begun = true;
        } else if (c == ' ' || c == '\t' || c == '\n') {
            if (begun) words_.push_back(std::exchange(word, {}));
            begun = false;
        } else {
            word += c;
            begun = true;
        }
    }
    if (quote != '\0') throw refusal(fmt::format("the command has an open {}", quote), "close the quote");
    if (begun) words_.push_back(word);
}

void CommandWords::find_placeholders() {
    for (const std::string& word : words_)
        static_cast<void>(with_placeholders(word, [&](const std::string& found) {
            std::string name = found;
            if (name.starts_with("out:") && name.size() > 4) {
                ending_ = name.substr(4);
                name = "out";
            }
            if (std::ranges::find(known_placeholders, name) == known_placeholders.end())
                throw refusal(fmt::format("unknown placeholder {{{}}}", printable(name)),
                    did_you_mean(name, known_placeholders) + fmt::format("choose of {{{}}}, and write {{{{ for a brace",
                                                                 fmt::join(known_placeholders, "} {")));
            placeholders_.push_back(name);
            return std::string();
        }));
}

// A file name put into a shell's text would be read as code.
void CommandWords::check_shell() const {
    const std::string first = std::filesystem::path(words_[0]).filename().string();
    const std::vector<std::string> shells{"sh", "bash", "dash", "zsh", "ksh"};
    if (words_.size() < 3 || std::ranges::find(shells, first) == shells.end() || words_[1] != "-c") return;
    static_cast<void>(with_placeholders(words_[2], [&](const std::string& name) -> std::string {
        throw refusal(fmt::format("{{{}}} within the text of {} -c would be read as code", name, first),
            "write $1, $2, ... there, and the placeholders behind: sh -c 'render \"$1\" \"$2\"' - {scene} {out}");
    }));
}

void CommandWords::check_program() const {
    const std::string& program = words_.front();
    bool found = false;
    if (program.find('/') != std::string::npos) {
        if (is_file(program) && ::access(program.c_str(), X_OK) != 0)
            throw refusal("'" + printable(program) + "' is not executable", "chmod +x it, or name its interpreter");
        found = is_file(program);
    } else {
        const char* const path = std::getenv("PATH");
        std::istringstream folders(path == nullptr ? "/usr/bin:/bin" : path);
        for (std::string folder; std::getline(folders, folder, ':') && !found;)
            found = ::access((folder + "/" + program).c_str(), X_OK) == 0;
    }
    if (found) return;
    throw refusal("no program '" + printable(program) + "'",
        is_file(program) ? "write ./" + program : std::string("check its path; no shell reads the command"));
}

bool CommandWords::has(const std::string& placeholder) const {
    return std::ranges::find(placeholders_, placeholder) != placeholders_.end();
}

std::string CommandWords::program_name() const {
    const std::string first = std::filesystem::path(words_.front()).filename().string();
    const bool runs_another = std::ranges::any_of(interpreters, [&](const char* name) {
        return first.starts_with(name) &&
               first.find_first_not_of("0123456789.", std::strlen(name)) == std::string::npos;
    });
    const auto file = std::ranges::find_if(words_.begin() + 1, words_.end(), is_file);
    return runs_another && file != words_.end() ? std::filesystem::path(*file).filename().string() : first;
}

std::vector<std::string> CommandWords::filled(const ImageRequest& request) const {
    const auto value = [&](const std::string& name) -> std::string {
        if (name == "scene") return request.scene.string();
        if (name == "width") return std::to_string(request.width);
        if (name == "height") return std::to_string(request.height);
        if (name == "samples") return std::to_string(request.samples);
        if (name == "seed") return std::to_string(request.seed);
        if (name == "first_sample") return std::to_string(request.first_sample);
        if (name == "bounces") return std::to_string(request.bounces);
        if (name == "filter") return std::string(pixel_filter_names[static_cast<std::size_t>(request.filter)]);
        if (name == "threads") return std::to_string(request.threads);
        return request.out.string();
    };
    std::vector<std::string> words;
    for (const std::string& word : words_) words.push_back(with_placeholders(word, value));
    return words;
}

}  // namespace tandem
