// A command split into items that any job scheduler can run. Each item is a line of JSON that holds all it needs.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace tandem {

struct PlanItem {
    std::uint64_t number = 0;        // from 1
    std::vector<std::string> words;  // of the command line, without what names the result
    std::string version;             // the commit of the program that planned it
    [[nodiscard]] bool is_part() const { return words.front() == "render"; }  // else its result is JSON
    bool operator==(const PlanItem&) const = default;
};

[[nodiscard]] nlohmann::json to_json(const PlanItem& item);

// All items of a plan. Throws InputError, naming file, line and mend.
[[nodiscard]] std::vector<PlanItem> read_plan(const std::filesystem::path& plan);

// Where results are kept: beside the plan, unless a folder is named.
[[nodiscard]] std::filesystem::path results_folder(const std::filesystem::path& plan, const std::string& named);

// The files of an item: its result, and beside that "log", "unchecked", the "sums" of a part that is not done, and the
// folder "report".
[[nodiscard]] std::filesystem::path result_file(
    const std::filesystem::path& folder, const PlanItem& item, const std::string& what = "");

// The stored result of an item that is no part: {"item", "status", "report"}. Throws InputError where it is of another
// plan.
[[nodiscard]] nlohmann::json read_result(const std::filesystem::path& file, const PlanItem& item);

}  // namespace tandem
