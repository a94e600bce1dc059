#include "common/distribution/plan.h"

#include <fmt/format.h>

#include <sstream>

#include "common/error.h"
#include "common/files/read_file.h"

namespace tandem {

namespace {

using nlohmann::json;

PlanItem item_from(const json& line, const std::string& plan, std::size_t number) {
    const auto refuse = [&](const std::string& reason) {
        return input_error(plan, "", fmt::format("line {} {}", number, reason), "make it again with tandem plan");
    };
    if (!line.is_object() || !line.contains("command") || !line.at("command").is_array() || !line.contains("number") ||
        !line.at("number").is_number_unsigned() || !line.contains("version") || !line.at("version").is_string())
        throw refuse("is no item of a plan");
    PlanItem item;
    item.number = line.at("number").get<std::uint64_t>();
    item.version = line.at("version").get<std::string>();
    for (const json& word : line.at("command")) {
        if (!word.is_string()) throw refuse("has a command of other things than words");
        item.words.push_back(word.get<std::string>());
    }
    if (item.words.empty()) throw refuse("has no command");
    if (item.number != number) throw refuse(fmt::format("is item {}", item.number));
    return item;
}

}  // namespace

json to_json(const PlanItem& item) {
    return {{"number", item.number}, {"command", item.words}, {"version", item.version}};
}

std::vector<PlanItem> read_plan(const std::filesystem::path& plan) {
    std::istringstream lines(read_file(plan));
    std::vector<PlanItem> items;
    for (std::string line; std::getline(lines, line);)
        items.push_back(item_from(json::parse(line, nullptr, false), plan.string(), items.size() + 1));
    if (items.empty()) throw input_error(plan.string(), "", "has no items", "make it again with tandem plan");
    return items;
}

std::filesystem::path results_folder(const std::filesystem::path& plan, const std::string& named) {
    if (!named.empty()) return named;
    return std::filesystem::path(plan).replace_extension(".results");
}

std::filesystem::path result_file(const std::filesystem::path& folder, const PlanItem& item, const std::string& what) {
    if (what == "log" || what == "report") return folder / fmt::format("{:04}.{}", item.number, what);
    return folder /
           fmt::format("{:04}{}{}.{}", item.number, what.empty() ? "" : ".", what, item.is_part() ? "exr" : "json");
}

json read_result(const std::filesystem::path& file, const PlanItem& item) {
    json result = json::parse(read_file(file), nullptr, false);
    if (!result.is_object() || !result.contains("item") || !result.contains("report") || !result.contains("status"))
        throw input_error(file.string(), "", "is no result of an item", "remove it, and work on the item again");
    if (result.at("item") != to_json(item))
        throw input_error(file.string(), "", "is a result of another plan or version of the program",
            "remove it, or name another folder with --results");
    return result;
}

}  // namespace tandem
