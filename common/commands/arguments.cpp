#include "common/commands/arguments.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <optional>
#include <string_view>

#include "common/error.h"
#include "common/text.h"

namespace tandem {

namespace {

struct Synonym {
    std::string_view word, meant;
};

// What other renderers and tools call it: pbrt, Mitsuba, Cycles, LuxCore, and the words of the field.
constexpr std::array option_synonyms{Synonym{"spp", "samples"}, Synonym{"samples-per-pixel", "samples"},
    Synonym{"nsamples", "samples"}, Synonym{"iterations", "samples"}, Synonym{"quality", "samples"},
    Synonym{"resolution", "size"}, Synonym{"res", "size"}, Synonym{"width", "size"}, Synonym{"height", "size"},
    Synonym{"dimensions", "size"}, Synonym{"out", "output"}, Synonym{"outfile", "output"},
    Synonym{"output-file", "output"}, Synonym{"image", "output"}, Synonym{"depth", "bounces"},
    Synonym{"max-depth", "bounces"}, Synonym{"maxdepth", "bounces"}, Synonym{"max-bounces", "bounces"},
    Synonym{"path-length", "bounces"}, Synonym{"timeout", "time"}, Synonym{"time-limit", "time"},
    Synonym{"seconds", "time"}, Synonym{"duration", "time"}, Synonym{"budget", "time"},
    Synonym{"error", "target-error"}, Synonym{"noise", "target-error"}, Synonym{"noise-threshold", "target-error"},
    Synonym{"rr", "roulette"}, Synonym{"rr-depth", "roulette"}, Synonym{"russian-roulette", "roulette"},
    Synonym{"sampler", "generator"}, Synonym{"rng", "generator"}, Synonym{"nthreads", "threads"},
    Synonym{"jobs", "threads"}, Synonym{"cores", "threads"}, Synonym{"cpus", "threads"}, Synonym{"gpu", "device"},
    Synonym{"engine", "backend"}, Synonym{"renderer", "backend"}, Synonym{"tolerance", "margin"},
    Synonym{"threshold", "margin"}, Synonym{"nee", "integrator"}, Synonym{"method", "integrator"},
    Synonym{"xml", "junit"}, Synonym{"html", "report"}, Synonym{"random-seed", "seed"}, Synonym{"gamma", "exposure"},
    Synonym{"firefly-clamp", "clamp"}, Synonym{"clamping", "clamp"}, Synonym{"debug", "verbose"}};

constexpr std::array command_synonyms{Synonym{"diff", "compare"}, Synonym{"cmp", "compare"},
    Synonym{"benchmark", "bench"}, Synonym{"check", "verify"}, Synonym{"test", "verify"}, Synonym{"validate", "verify"},
    Synonym{"info", "devices"}, Synonym{"list", "devices"}, Synonym{"gpus", "devices"}, Synonym{"draw", "render"},
    Synonym{"image", "render"}, Synonym{"path", "trace"}, Synonym{"time", "cost"}};

// The word of `known` that is the same or means the same; empty: none.
template <std::size_t count>
std::string exactly_meant(
    const std::string& word, const std::array<Synonym, count>& synonyms, const std::vector<std::string>& known) {
    const auto is_known = [&](std::string_view name) { return std::ranges::find(known, name) != known.end(); };
    if (is_known(word)) return word;
    for (const Synonym& synonym : synonyms)
        if (synonym.word == word && is_known(synonym.meant)) return std::string(synonym.meant);
    return {};
}

// The same, else the nearest in spelling.
template <std::size_t count>
std::string meant_by(
    const std::string& word, const std::array<Synonym, count>& synonyms, const std::vector<std::string>& known) {
    const std::string exact = exactly_meant(word, synonyms, known);
    return exact.empty() ? nearest(word, known) : exact;
}

std::vector<std::string> long_names(const CLI::App& app) {
    std::vector<std::string> names;
    for (const CLI::Option* option : app.get_options())
        names.insert(names.end(), option->get_lnames().begin(), option->get_lnames().end());
    return names;
}

std::vector<std::string> command_names(const CLI::App& app) {
    std::vector<std::string> names;
    for (const CLI::App* command : app.get_subcommands({})) names.push_back(command->get_name());
    return names;
}

const CLI::App* command_named(const CLI::App& app, const std::string& name) {
    for (const CLI::App* command : app.get_subcommands({}))
        if (command->get_name() == name) return command;
    return &app;
}

[[noreturn]] void refuse_option(const CLI::App& app, const CLI::App& command, const std::string& given) {
    const std::string name = given.substr(given.find_first_not_of('-'));
    const std::string meant = meant_by(name, option_synonyms, long_names(command));
    std::string of_others;
    for (const CLI::App* other : app.get_subcommands({}))
        if (other->get_option_no_throw("--" + name) != nullptr)
            of_others += (of_others.empty() ? "" : " and ") + other->get_name();
    const std::string here = &command == &app ? "tandem" : "tandem " + command.get_name();
    const std::string told = !meant.empty()       ? "; did you mean --" + meant + "?"
                             : !of_others.empty() ? "; it is one of " + of_others
                                                  : "";
    throw InputError(fmt::format("{}: no such option{}; see {} --help", given, told, here));
}

bool is_blank(std::string_view text) { return text.find_first_not_of(" \t\r\n\v\f") == std::string_view::npos; }

// Whether a value between commas is left out.
bool has_gap(const std::string& list) {
    return list.starts_with(',') || list.ends_with(',') || list.find(",,") != std::string::npos;
}

void check_value(const std::string& option, const CLI::Option* known, const std::string& value) {
    if (is_blank(value))
        throw InputError(option.empty() ? "an argument is empty; leave it out"
                                        : option + ": its value is empty; give one, or leave the option out");
    if (known != nullptr && known->get_delimiter() == ',' && has_gap(value))
        throw InputError(option + ": '" + value + "' has an empty place; write values between single commas");
}

// A word that begins with a dash; returns the option if its value is the next word.
const CLI::Option* check_option(const CLI::App& app, const CLI::App& command, const std::string& word) {
    const bool is_long = word.starts_with("--");
    const std::size_t equals = word.find('=');
    const std::string name = is_long ? word.substr(0, equals) : word.substr(0, 2);
    const CLI::Option* option = command.get_option_no_throw(name);
    const std::string whole = word.substr(0, equals);
    // "-output" would be taken for the option "-o" and its value "utput".
    const bool one_dash =
        !is_long && whole.size() > 2 && !exactly_meant(whole.substr(1), option_synonyms, long_names(command)).empty();
    if (option == nullptr || one_dash) refuse_option(app, command, whole);
    if (!is_long && equals == name.size())
        throw InputError(fmt::format("{}: write {} VALUE or --{}=VALUE", word, name, option->get_lnames().front()));
    if (is_long && equals != std::string::npos) check_value(name, option, word.substr(equals + 1));
    const bool ends_here = is_long ? equals == std::string::npos : word.size() == name.size();
    return ends_here && option->get_expected_max() > 0 ? option : nullptr;
}

}  // namespace

std::string command_meant(const CLI::App& app, const std::string& name) {
    return meant_by(name, command_synonyms, command_names(app));
}

void check_arguments(const CLI::App& app, const std::vector<std::string>& arguments) {
    for (const std::string& word : arguments)
        if (!is_utf8(word))
            throw InputError("'" + word + "' is no UTF-8 text; rename the file, or write the name in UTF-8");
    const CLI::App* command = &app;
    const CLI::Option* waiting = nullptr;  // for its value
    std::string option;
    bool positional_alone = false;
    for (const std::string& word : arguments) {
        const bool is_option = word.starts_with('-') && word.size() > 1 && !positional_alone;
        const bool is_number =
            is_option && waiting != nullptr && std::isdigit(static_cast<unsigned char>(word[1])) != 0;
        if (word == "--") {
            positional_alone = true;
        } else if (is_option && !is_number) {
            option = word;
            waiting = check_option(app, *command, word);
        } else {
            check_value(waiting != nullptr ? option : "", waiting, word);
            if (waiting == nullptr) command = command_named(*command, word);  // itself, where it has no such one
            if (waiting == nullptr || waiting->get_expected_max() <= 1) waiting = nullptr;
        }
    }
}

CLI::Validator one_of(std::vector<std::string> names) {
    const auto check = [names = std::move(names)](std::string& text) -> std::string {
        if (std::ranges::find(names, text) != names.end()) return {};
        return fmt::format("there is no '{}'; {}there are {}", text, did_you_mean(text, names), fmt::join(names, ", "));
    };
    return {check, ""};
}

}  // namespace tandem
