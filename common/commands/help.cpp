#include "common/commands/help.h"

#include <fmt/format.h>

#include <sstream>
#include <vector>

namespace tandem {

namespace {

constexpr std::size_t page_width = 100, text_column = 28;  // characters

// `text` in lines of the page's width, of which all but the first are indented.
std::string wrapped(const std::string& text, std::size_t column, std::size_t indent) {
    std::string page;
    std::istringstream words(text);
    for (std::string word; words >> word;) {
        const bool first = page.empty();
        if (!first && column + 1 + word.size() > page_width) {
            page += "\n" + std::string(indent, ' ');
            column = indent;
        } else if (!first) {
            page += " ";
            ++column;
        }
        page += word;
        column += word.size();
    }
    return page + "\n";
}

// A label on the left and its text on the right; under a long label the text has a line of its own.
std::string row(const std::string& label, const std::string& text) {
    const std::string left = "  " + label;
    const std::string gap = left.size() + 2 > text_column ? "\n" + std::string(text_column, ' ')
                                                          : std::string(text_column - left.size(), ' ');
    return left + gap + wrapped(text, text_column, text_column);
}

// Lines that begin with a space stand as they are; all others are wrapped.
std::string paragraphs(const std::string& text) {
    std::string page;
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);)
        page += line.starts_with(' ') ? line + "\n" : wrapped(line, 0, 0);
    return page;
}

// What stands for the value: CLI11's names of types say too little, and its checks are told by the text.
std::string value_of(const CLI::Option& option) {
    if (option.get_expected_max() == 0) return {};
    std::string type = option.get_type_name();
    type = type.substr(0, type.find(':'));
    if (type == "TEXT") return "NAME";
    if (type == "UINT" || type == "INT" || type == "FLOAT") return "NUMBER";
    return type;
}

std::string label_of(const CLI::Option& option) {
    if (option.get_positional()) return value_of(option);
    std::string names = option.get_name(false, true);
    if (const std::size_t comma = names.find(','); comma != std::string::npos) names.insert(comma + 1, " ");
    const std::string value = value_of(option);
    if (value.empty()) return names;
    const bool list = option.get_delimiter() == ',' && option.get_expected_max() > 2;
    return names + " " + value + (list ? ",..." : "");
}

std::string row_of(const CLI::Option& option) {
    std::string text = option.get_description();
    if (const std::string otherwise = option.get_default_str(); !otherwise.empty())
        text += fmt::format(" (default: {})", otherwise);
    return row(label_of(option), text);
}

std::string shortest_name(const CLI::Option& option) {
    return option.get_snames().empty() ? option.get_name() : "-" + option.get_snames().front();
}

std::string usage_of(const CLI::App& app, const std::string& name) {
    std::string usage = "Usage: " + name;
    for (const CLI::Option* option : app.get_options()) {
        const std::string more = option->get_expected_max() == CLI::detail::expected_max_vector_size ? "..." : "";
        if (option->get_positional())
            usage += option->get_required() ? " " + value_of(*option) + more : " [" + value_of(*option) + more + "]";
        else if (option->get_required())
            usage += " " + shortest_name(*option) + " " + value_of(*option);
    }
    return usage + " [OPTIONS]\n";
}

// Those of the command itself first, then those that every program has.
std::string common_options_of(const CLI::App& app) {
    std::string own, help;
    for (const CLI::Option* option : app.get_options()) {
        const bool is_help = option == app.get_help_ptr() || option == app.get_help_all_ptr();
        if (option->get_group().empty()) continue;  // for processes that the program starts
        if (option->get_group() != rare_options) (is_help ? help : own) += row_of(*option);
    }
    return own + help;
}

std::string rare_options_of(const CLI::App& app) {
    std::string page;
    for (const CLI::Option* option : app.get_options())
        if (option->get_group() == rare_options) page += row_of(*option);
    return page;
}

}  // namespace

std::string HelpPage::make_help(const CLI::App* app, std::string name, CLI::AppFormatMode mode) const {
    const std::vector<const CLI::App*> commands = app->get_subcommands({});
    std::string page = wrapped(app->get_description(), 0, 0);
    if (commands.empty()) page += usage_of(*app, name);
    page += "\n" + paragraphs(app->get_footer());
    if (!commands.empty()) page += "\nCommands:\n";
    for (const CLI::App* command : commands) page += row(command->get_name(), command->get_description());
    page += "\nOptions:\n" + common_options_of(*app);
    const std::string rare = rare_options_of(*app);
    if (mode == CLI::AppFormatMode::All && !rare.empty()) page += fmt::format("\n{}:\n{}", rare_options, rare);
    return page;
}

}  // namespace tandem
