#include "common/commands/bench_library.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <optional>
#include <vector>

#include "common/commands/child_process.h"
#include "common/commands/console.h"
#include "common/deadline.h"
#include "common/error.h"
#include "common/external/child.h"
#include "common/files/read_file.h"
#include "common/files/write_file.h"
#include "common/stopwatch.h"
#include "common/text.h"

namespace tandem {

namespace {

// How a process with the library ended.
struct LibraryEnd {
    ExitStatus status = ExitStatus::fine;
    std::string line;    // what it, or this program in its place, says of its failure; with the program's name
    std::string output;  // all that it wrote
};

std::string last_line(std::string text) {
    while (!text.empty() && text.back() == '\n') text.pop_back();
    return text.substr(text.rfind('\n') + 1);
}

// What an exit status says where no function of the library was under way.
LibraryEnd told_end(int status, std::string output) {
    LibraryEnd end{static_cast<ExitStatus>(status), {}, std::move(output)};
    if (status > 0) end.line = last_line(end.output);
    return end;
}

// Runs `tandem` with these words and the note's file in a process. One that is not over after `seconds` and the overrun
// that any command has, or after a stop, is killed. Throws Error where it cannot be started.
LibraryEnd run_with_library(
    const std::string& library, std::vector<std::string> words, double seconds, const std::stop_token& stop) {
    const TemporaryFile log, note_file;
    const CallNote note(note_file.name());
    words.insert(words.begin(), "/proc/self/exe");
    words.insert(words.end(), {"--call-note", note_file.name()});
    // A process with a hung library ends by itself, with what it knows; a little later than this it is hung as a whole.
    constexpr double poll_seconds = 0.02, to_end_by_itself = 5.0;
    const Stopwatch watch;
    const auto said = [&](const std::string& what, ExitStatus status) {
        const std::string where = note.read();
        return LibraryEnd{status,
            "tandem: " + escaped(library + ": " + (where.empty() ? std::string() : where + ": ") + what),
            read_file(log.name())};
    };
    Child child(words, log.name(), false);
    while (!child.ended_within(poll_seconds)) {
        if (stop.stop_requested()) return said("stopped", ExitStatus::undecided);
        if (watch.seconds() > with_overrun(seconds) + to_end_by_itself)
            return said("did not come to an end", ExitStatus::undecided);
    }
    const int status = child.exit_status();
    if (status >= 128) return said("the program " + child.how_it_ended(), ExitStatus::unusable_input);
    if (note.read().empty()) return told_end(status, read_file(log.name()));
    if (watch.seconds() >= seconds) return said("had not returned when --time was over", ExitStatus::undecided);
    return said("the program " + child.how_it_ended(), ExitStatus::unusable_input);
}

// The library's arms are listed or looked at by another process: its output is this one's.
ExitStatus pass_on(const BenchArguments& arguments, const CommandContext& context, const CommandTime& time) {
    const TemporaryFile file;
    std::vector<std::string> words = words_of(arguments, {time.left(), 1, 1}, {}, file.name());
    words.emplace_back(arguments.list ? "--list" : "--validation");
    const LibraryEnd end = run_with_library(arguments.arm_library, words, time.left(), time.token());
    if (end.status != ExitStatus::fine) {
        fmt::print(stderr, "{}\n", end.line);
        return end.status;
    }
    fmt::print("{}", end.output);
    if (arguments.list) write_json(context, nlohmann::json::parse(read_file(file.name())));
    return ExitStatus::fine;
}

}  // namespace

CallNote::CallNote(const std::string& file) {
    const Descriptor open_file(::open(file.c_str(), O_RDWR | O_CLOEXEC));
    if (open_file.get() < 0 || ::ftruncate(open_file.get(), bytes) != 0)
        throw Error("cannot open " + file + ": " + std::strerror(errno));
    void* const memory = ::mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, open_file.get(), 0);
    if (memory == MAP_FAILED) throw Error("cannot map " + file + ": " + std::strerror(errno));
    text_ = static_cast<char*>(memory);
}

CallNote::~CallNote() { ::munmap(text_, bytes); }

void CallNote::write(const std::string& where) {
    const std::size_t length = std::min(where.size(), bytes - 1);
    std::memcpy(text_, where.data(), length);
    text_[length] = '\0';
}

std::string CallNote::read() const { return {text_, ::strnlen(text_, bytes)}; }

void refuse_beside_library(const BenchArguments& arguments, const CommandContext& context) {
    if (arguments.arm_library.empty() && arguments.validation)
        throw InputError(
            "--validation is for --arm-library; TANDEM_VALIDATION=1 has the layer beside the program's own arms");
    if (arguments.arm_library.empty()) return;
    if (!arguments.families.empty() || !arguments.sizes.empty() || arguments.self_test || !arguments.compare.empty() ||
        arguments.method != "paired" || arguments.scene != BenchArguments{}.scene)
        throw InputError(
            "--arm-library has a family of its own, which says how much work there is; leave out --family, --size, "
            "--scene, --self-test, --method and --compare");
    if (arguments.validation && (arguments.list || !arguments.resume.empty() || !context.json_file.empty()))
        throw InputError("--validation times nothing; leave out --list, --resume and --json");
}

ExitStatus measure_library(const BenchArguments& arguments, const CommandContext& context, const CommandTime& time) {
    check_outputs(arguments, context, {arguments.arm_library});
    if (arguments.list || arguments.validation) return pass_on(arguments, context, time);
    std::optional<BenchResults> results;
    if (!arguments.resume.empty()) results = load_results(arguments.resume);
    bool measured = false;
    const std::vector<CampaignPart> parts = parts_of(campaign_options(arguments, time), arguments.processes);
    LibraryEnd end;
    {
        ProgressLine line;
        for (std::size_t i = 0; i < parts.size() && end.status == ExitStatus::fine; ++i) {
            line.update(static_cast<double>(i) / static_cast<double>(parts.size()), fmt::format("process {}", i + 1));
            const TemporaryFile known, file;
            if (results) write_text_file(known.name(), to_json(*results, {}).dump());
            CampaignPart part = parts[i];
            part.seconds = std::max(1e-3, time.left() / static_cast<double>(parts.size() - i));
            end = run_with_library(arguments.arm_library,
                words_of(arguments, part, results ? known.name() : std::string(), file.name()), part.seconds,
                context.stop);
            if (std::filesystem::file_size(file.name()) == 0) continue;
            results = load_results(file.name());
            measured = true;
        }
    }
    if (measured) {
        results->command = context.command_line;
        tell_results(arguments, context, *results, {});
    }
    if (end.status != ExitStatus::fine) fmt::print(stderr, "{}\n", end.line);
    return end.status;
}

}  // namespace tandem
