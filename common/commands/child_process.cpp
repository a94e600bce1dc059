#include "common/commands/child_process.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <optional>
#include <thread>

#include "common/error.h"

namespace tandem {

namespace {

// Its status. A stop asks it to end, and after a second ends it.
int wait_for(pid_t child, const std::stop_token& stop) {
    using std::chrono::steady_clock;
    constexpr std::chrono::milliseconds between(10);
    std::optional<steady_clock::time_point> asked;
    int status = 0;
    while (waitpid(child, &status, WNOHANG) == 0) {
        std::this_thread::sleep_for(between);
        if (!stop.stop_requested()) continue;
        if (!asked) kill(child, SIGTERM);
        asked = asked.value_or(steady_clock::now());
        if (steady_clock::now() - *asked > std::chrono::seconds(1)) kill(child, SIGKILL);
    }
    return status;
}

}  // namespace

int run_self(const std::vector<std::string>& words, const std::string& errors, const std::stop_token& stop) {
    std::vector<std::string> all{"tandem"};
    all.insert(all.end(), words.begin(), words.end());
    std::vector<char*> arguments;
    for (std::string& word : all) arguments.push_back(word.data());
    arguments.push_back(nullptr);
    posix_spawn_file_actions_t files;
    posix_spawn_file_actions_init(&files);
    posix_spawn_file_actions_addopen(&files, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
    if (!errors.empty()) posix_spawn_file_actions_addopen(&files, STDERR_FILENO, errors.c_str(), O_WRONLY | O_TRUNC, 0);
    // The parent's signals are blocked for its watching thread; the child must hear Ctrl-C itself.
    posix_spawnattr_t attributes;
    posix_spawnattr_init(&attributes);
    sigset_t none;
    sigemptyset(&none);
    posix_spawnattr_setsigmask(&attributes, &none);
    posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK);
    pid_t child = 0;
    const int failure = posix_spawn(&child, "/proc/self/exe", &files, &attributes, arguments.data(), environ);
    posix_spawn_file_actions_destroy(&files);
    posix_spawnattr_destroy(&attributes);
    if (failure != 0) throw Error(std::string("cannot start a process of its own: ") + std::strerror(failure));
    const int status = wait_for(child, stop);
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

TemporaryFile::TemporaryFile() {
    name_ = (std::filesystem::temp_directory_path() / "tandem-XXXXXX").string();
    const int descriptor = mkstemp(name_.data());
    if (descriptor < 0) throw Error("cannot make a file in " + std::filesystem::temp_directory_path().string());
    close(descriptor);
}

TemporaryFile::~TemporaryFile() { std::remove(name_.c_str()); }

}  // namespace tandem
