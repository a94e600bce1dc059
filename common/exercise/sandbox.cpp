#include "common/exercise/sandbox.h"

#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <cstring>
#include <sstream>

#include "common/external/child.h"
#include "common/files/read_file.h"
#include "common/files/write_file.h"
#include "common/text.h"

namespace tandem {

namespace {

namespace fs = std::filesystem;

// A right answer takes about a second. On a machine with much other work it took 27 of the clock's, few of its own.
constexpr double seconds_for_all = 60.0;
constexpr rlim_t processor_seconds = 15, memory_bytes = rlim_t{4} << 30, file_bytes = rlim_t{64} << 20;

enum Status : int { ran = 0, not_compiled = 11, no_compiler = 12, no_device_found = 13, compiler_stopped = 14 };

constexpr const char *shader_file = "shader.comp", *code_file = "shader.spv", *counts_file = "counts.txt",
                     *arguments_file = "arguments.bin", *answers_file = "answers.bin", *compiler_log = "compiler.txt";

class Folder {
public:
    Folder() : path_((fs::temp_directory_path() / "tandem-exercise-XXXXXX").string()) {
        if (mkdtemp(path_.data()) == nullptr)
            throw Error("cannot make a folder in " + fs::temp_directory_path().string() + ": " + std::strerror(errno));
    }
    ~Folder() {
        std::error_code error;
        fs::remove_all(path_, error);
    }
    Folder(const Folder&) = delete;
    Folder& operator=(const Folder&) = delete;
    [[nodiscard]] fs::path operator/(const char* name) const { return fs::path(path_) / name; }
    [[nodiscard]] const std::string& path() const { return path_; }

private:
    std::string path_;
};

template <class Number>
std::string bytes_of(std::span<const Number> numbers) {
    return {reinterpret_cast<const char*>(numbers.data()), numbers.size_bytes()};
}

template <class Number>
std::vector<Number> numbers_of(const std::string& bytes) {
    std::vector<Number> numbers(bytes.size() / sizeof(Number));
    std::memcpy(numbers.data(), bytes.data(), numbers.size() * sizeof(Number));
    return numbers;
}

// The compiler's complaints about the submission: "line 7: 'x' : undeclared identifier". It calls the submission by the
// file's name, and the marker's own text 1.
std::vector<std::string> complaints(const Folder& folder) {
    std::vector<std::string> lines;
    std::istringstream text(read_file(folder / compiler_log));
    const std::string submission = (folder / shader_file).string() + ":", error = "ERROR: ";
    for (std::string line; std::getline(text, line) && lines.size() < 5;) {
        if (!line.starts_with(error) || line.find("compilation errors") != std::string::npos) continue;
        line.erase(0, error.size());
        if (line.find("Missing entry point") != std::string::npos ||
            line.find("compilation terminated") != std::string::npos)
            continue;
        if (line.starts_with(submission)) line.replace(0, submission.size(), "line ");
        if (line.starts_with("1:")) line = "it cannot be called as the task says: " + line.substr(line.find(": ") + 2);
        lines.push_back(printable(line));
    }
    return lines;
}

void limit(__rlimit_resource what, rlim_t most) {
    const rlimit both{most, most};
    if (::setrlimit(what, &both) != 0) throw Error(std::string("cannot set a limit: ") + std::strerror(errno));
}

}  // namespace

std::vector<float> run_apart(
    const std::string& shader, std::span<const float> arguments, std::uint32_t count, std::uint32_t results) {
    const Folder folder;
    write_text_file(folder / shader_file, shader);
    write_text_file(folder / arguments_file, bytes_of(arguments));
    write_text_file(folder / counts_file, fmt::format("{} {}\n", count, results));
    Child child({"/proc/self/exe", "exercise", "inside", folder.path()}, folder / "log.txt", false);
    const auto fail = [&](const std::string& what, std::vector<std::string> log = {}) {
        throw SubmissionFailure(what, std::move(log));
    };
    // No shader can wait: one that used up its time has ended by the limit below.
    if (!child.ended_within(seconds_for_all))
        throw Error(fmt::format(
            "the machine is too busy: a submission had no mark after {:.0f} s; try again", seconds_for_all));
    const int status = child.exit_status();
    if (status == 128 + SIGXCPU || status == 128 + SIGKILL)
        fail(fmt::format("does not end within {} s of a processor; is there an endless loop?", processor_seconds));
    if (status == not_compiled) fail("does not compile", complaints(folder));
    if (status == compiler_stopped) fail("is more than the compiler can take within its limits");
    if (status == no_compiler)
        throw Error("the compiler glslangValidator cannot be started; install it (apt-get install glslang-tools)");
    if (status == no_device_found) throw DeviceError(read_file(folder / "log.txt"));
    if (status != ran) fail("crashes: the process " + child.how_it_ended());
    std::vector<float> answers = numbers_of<float>(read_file(folder / answers_file));
    if (answers.size() != std::size_t{count} * results) throw Error("the marker's process left its answers out");
    return answers;
}

int run_inside(const fs::path& folder, RunListShader run) {
    limit(RLIMIT_CORE, 0);
    limit(RLIMIT_CPU, processor_seconds);
    limit(RLIMIT_FSIZE, file_bytes);
    limit(RLIMIT_AS, memory_bytes);
    std::signal(SIGXFSZ, SIG_DFL);
    ::setenv("MESA_SHADER_CACHE_DISABLE", "true", 1);  // no submission outlives its mark
    std::uint32_t count = 0, results = 0;
    std::istringstream(read_file(folder / counts_file)) >> count >> results;
    try {
        Child compiler({"glslangValidator", "-V", "--target-env", "vulkan1.2", "-o", (folder / code_file).string(),
                           (folder / shader_file).string()},
            folder / compiler_log, false);
        while (!compiler.ended_within(seconds_for_all)) {
        }
        if (!compiler.succeeded()) return compiler.exit_status() >= 128 ? compiler_stopped : not_compiled;
    } catch (const Error&) {
        return no_compiler;
    }
    try {
        const auto code = numbers_of<std::uint32_t>(read_file(folder / code_file));
        const auto arguments = numbers_of<float>(read_file(folder / arguments_file));
        const std::vector<float> answers = run(code, arguments, count, results);
        write_text_file(folder / answers_file, bytes_of(std::span<const float>(answers)));
    } catch (const DeviceError& error) {
        fmt::print(stderr, "{}", error.what());
        return no_device_found;
    }
    return ran;
}

}  // namespace tandem
