#include "common/commands/rank_items.h"

#include <fmt/format.h>
#include <stdlib.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <fstream>
#include <thread>

#include "common/commands/console.h"
#include "common/commands/plan_items.h"
#include "common/commands/shipped_files.h"
#include "common/deadline.h"
#include "common/distribution/ranks.h"
#include "common/error.h"
#include "common/files/read_file.h"
#include "common/scene/loader/scene_loader.h"
#include "common/text.h"
#include "common/validation/report/report.h"

namespace tandem {

namespace {

using nlohmann::json;
namespace fs = std::filesystem;

// Gone with the object.
class TemporaryFolder {
public:
    TemporaryFolder() {
        std::string name = (fs::temp_directory_path() / "tandem-items-XXXXXX").string();
        if (::mkdtemp(name.data()) == nullptr) throw Error("cannot make " + name + ": " + std::strerror(errno));
        path_ = name;
    }
    ~TemporaryFolder() {
        std::error_code ignored;
        fs::remove_all(path_, ignored);
    }
    TemporaryFolder(const TemporaryFolder&) = delete;
    TemporaryFolder& operator=(const TemporaryFolder&) = delete;
    [[nodiscard]] const fs::path& path() const { return path_; }

private:
    fs::path path_;
};

// The hash of the files that an item's result depends on; "" where there are none beside the program's own.
std::string hash_of_inputs(const PlanItem& item) {
    if (item.words.front() != "verify") return "";
    std::vector<std::string> inputs;
    static_cast<void>(load_scene(shipped_file(item.words.at(1)), &inputs));
    std::string all;
    for (const std::string& file : inputs) all += hash_of(read_file(file));
    return hash_of(all);
}

std::string text_of(const std::vector<std::uint8_t>& bytes) { return {bytes.begin(), bytes.end()}; }

json bytes_of(const fs::path& file) {
    const std::string bytes = read_file(file);
    return json::binary({bytes.begin(), bytes.end()});
}

// What an item left, for rank 0: its files by their names in the folder.
std::string packed(const PlanItem& item, const ItemOutcome& outcome, const fs::path& folder) {
    json files = json::object();
    if (outcome.has_result) {
        const fs::path result = result_file(folder, item), report = result_file(folder, item, "report");
        files[result.filename().string()] = bytes_of(result);
        if (fs::is_directory(report))
            for (const fs::directory_entry& file : fs::directory_iterator(report))
                files[fs::relative(file.path(), folder).string()] = bytes_of(file.path());
    }
    return text_of(json::to_cbor(
        {{"has_result", outcome.has_result}, {"status", outcome.status}, {"told", outcome.told}, {"files", files}}));
}

ItemOutcome unpacked(const std::string& message, const fs::path& folder) {
    const json answer = json::from_cbor(message);
    for (const auto& [name, bytes] : answer.at("files").items()) {
        fs::create_directories((folder / name).parent_path());
        write_text_file(folder / name, text_of(bytes.get_binary()));
    }
    return {answer.at("has_result").get<bool>(), answer.at("status").get<int>(), answer.at("told").get<std::string>()};
}

std::string never() { return ""; }

// As do_item, but an item that fails takes no other one's result with it. A stop goes on to the caller.
ItemOutcome outcome_of(const PlanItem& item, const fs::path& folder, const std::function<std::string()>& over,
    const CommandContext& context) {
    try {
        return do_item(item, folder, over, context);
    } catch (const StoppedError& stopped) {
        if (context.stop.stop_requested()) throw;
        return {false, static_cast<int>(ExitStatus::undecided), stopped.what()};
    } catch (const std::exception& error) {
        return {false, static_cast<int>(ExitStatus::unusable_input), error.what()};
    }
}

// A rank that is not the first: the item that it is asked for, on this machine.
std::string answer_to(const std::string& request, const fs::path& folder, const CommandContext& context) {
    const json asked = json::parse(request);
    const PlanItem item{asked.at("item").at("number").get<std::uint64_t>(),
        asked.at("item").at("command").get<std::vector<std::string>>(), git_version()};
    if (hash_of_inputs(item) != asked.at("inputs").get<std::string>())
        return packed(item, {false, 2, "this machine has another scene; give all machines the same files"}, folder);
    return packed(item, outcome_of(item, folder, never, context), folder);
}

// Rank 0: hands items to ranks that are free, itself among them, and gathers what they left.
class Sharing {
public:
    Sharing(Ranks& ranks, const std::vector<PlanItem>& items, const fs::path& folder, const CommandContext& context)
        : ranks_(ranks), items_(items), folder_(folder), context_(context) {
        in_hand_.resize(static_cast<std::size_t>(ranks.size()), nullptr);
    }

    // Until all items are done, or a stop.
    void run() {
        try {
            while (!context_.stop.stop_requested()) {
                look_at_others();
                if (const PlanItem* const own = next()) {
                    take(*own, 0,
                        outcome_of(
                            *own, folder_, [this] { return look_at_others(); }, context_));
                    continue;
                }
                if (std::ranges::all_of(in_hand_, [](const PlanItem* item) { return item == nullptr; })) return;
                constexpr auto poll = std::chrono::milliseconds(5);
                std::this_thread::sleep_for(poll);
            }
        } catch (const StoppedError&) {
            // What the others have is merged all the same.
        }
    }
    // The status of the first item that has no result; nothing where none failed.
    [[nodiscard]] std::optional<int> failure() const { return failure_; }

private:
    [[nodiscard]] const PlanItem* next() { return next_ < items_.size() ? &items_[next_++] : nullptr; }

    std::string look_at_others() {
        for (int other = 1; other < ranks_.size(); ++other) {
            const PlanItem*& item = in_hand_[static_cast<std::size_t>(other)];
            if (item != nullptr) {
                const std::optional<std::string> answer = ranks_.answer_of(other);
                if (!answer) continue;
                take(*item, other, unpacked(*answer, folder_));
            }
            item = next();
            if (item != nullptr)
                ranks_.ask(other, json{{"item", to_json(*item)}, {"inputs", hash_of_inputs(*item)}}.dump());
        }
        return never();
    }

    void take(const PlanItem& item, int rank, const ItemOutcome& outcome) {
        ++done_;
        line_.update(static_cast<double>(done_) / static_cast<double>(items_.size()),
            fmt::format("{} of {} items", done_, items_.size()));
        if (outcome.has_result) return;
        if (!failure_) failure_ = outcome.status;
        fmt::print(stderr, "tandem: item {} has no result (rank {}, status {}): {}\n", item.number, rank,
            outcome.status, escaped(outcome.told));
    }

    Ranks& ranks_;
    const std::vector<PlanItem>& items_;
    const fs::path& folder_;
    const CommandContext& context_;
    std::vector<const PlanItem*> in_hand_;  // of each rank; rank 0 waits for its own
    std::size_t next_ = 0, done_ = 0;
    std::optional<int> failure_;
    ProgressLine line_;
};

std::string value_of(const CLI::App& command, const std::string& option) {
    const CLI::Option* const found = command.get_option_no_throw(option);
    return found == nullptr || found->results().empty() ? "" : found->results().front();
}

ExitStatus lead(Ranks& ranks, const CLI::App& command, const CommandContext& context) {
    std::vector<PlanItem> items;
    try {
        std::vector<std::string> read;
        items = plan_items(command, context, read);
        const VerdictFiles files{value_of(command, "--junit"), value_of(command, "--report")};
        check_outputs(context,
            {{"--junit", files.junit}, {"--report", files.report, OutputKind::folder, report_files({})}}, read);
    } catch (const InputError& error) {
        throw InputError(fmt::format("under mpirun, {}", error.what()));
    }
    ranks.greet(git_version());
    if (items.size() < static_cast<std::size_t>(ranks.size()))
        fmt::print(stderr, "tandem: {} item{} for {} ranks: the others have nothing to do\n", items.size(),
            items.size() == 1 ? "" : "s", ranks.size());
    const TemporaryFolder folder;
    std::optional<int> failure;
    {
        Sharing sharing(ranks, items, folder.path(), context);
        sharing.run();
        failure = sharing.failure();
    }
    const bool any =
        std::ranges::any_of(items, [&](const PlanItem& item) { return fs::exists(result_file(folder.path(), item)); });
    if (any)
        return merge_reports_of(
            items, folder.path(), {value_of(command, "--junit"), value_of(command, "--report")}, context);
    if (failure && *failure >= 2 && *failure <= 4) return static_cast<ExitStatus>(*failure);
    throw StoppedError("no item has a result");
}

}  // namespace

bool has_items_for_ranks(const std::string& command) { return command == "verify" || command == "stability"; }

ExitStatus items_by_ranks(const CLI::App& command, const CommandContext& context) {
    Ranks ranks;
    if (ranks.rank() == 0) return lead(ranks, command, context);
    const TemporaryFolder folder;
    ranks.answer(git_version(), [&](const std::string& request) { return answer_to(request, folder.path(), context); });
    return ExitStatus::fine;
}

}  // namespace tandem
