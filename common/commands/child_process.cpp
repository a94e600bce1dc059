#include "common/commands/child_process.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstring>
#include <filesystem>

#include "common/error.h"

namespace tandem {

int run_self(const std::vector<std::string>& words) {
    std::vector<std::string> all{"tandem"};
    all.insert(all.end(), words.begin(), words.end());
    std::vector<char*> arguments;
    for (std::string& word : all) arguments.push_back(word.data());
    arguments.push_back(nullptr);
    posix_spawn_file_actions_t files;
    posix_spawn_file_actions_init(&files);
    posix_spawn_file_actions_addopen(&files, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
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
    int status = 0;
    while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
    }
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
