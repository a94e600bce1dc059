#include "common/external/child.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <thread>

#include "common/error.h"
#include "common/stopwatch.h"

namespace tandem {

namespace {

struct Pipe {
    int read = -1, write = -1;
    Pipe() {
        std::array<int, 2> ends{};
        if (::pipe2(ends.data(), O_CLOEXEC) != 0)
            throw Error(std::string("cannot make a pipe: ") + std::strerror(errno));
        read = ends[0];
        write = ends[1];
    }
    ~Pipe() {
        close_read();
        close_write();
    }
    Pipe(const Pipe&) = delete;
    Pipe& operator=(const Pipe&) = delete;
    void close_read() { close_end(read); }
    void close_write() { close_end(write); }
    static void close_end(int& end) {
        if (end >= 0) ::close(end);
        end = -1;
    }
};

// In the child between fork and exec: only what is safe in a signal handler, as other threads may hold locks.
[[noreturn]] void become(char* const* arguments, int input, int output, int errors, int failure, pid_t parent) {
    ::setpgid(0, 0);
    // Should this program be killed, the other is too.
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (::getppid() != parent) ::_exit(127);
    sigset_t none;
    sigemptyset(&none);
    ::sigprocmask(SIG_SETMASK, &none, nullptr);
    for (const int ignored : {SIGPIPE, SIGXFSZ}) ::signal(ignored, SIG_DFL);
    if (::dup2(input, STDIN_FILENO) >= 0 && ::dup2(output, STDOUT_FILENO) >= 0 && ::dup2(errors, STDERR_FILENO) >= 0)
        ::execvp(arguments[0], arguments);
    const int error = errno;
    static_cast<void>(!::write(failure, &error, sizeof error));
    ::_exit(127);
}

int opened(const std::filesystem::path& path, int flags) {
    const int descriptor = ::open(path.c_str(), flags | O_CLOEXEC, 0600);
    if (descriptor < 0) throw Error("cannot open " + path.string() + ": " + std::strerror(errno));
    return descriptor;
}

}  // namespace

Child::Child(const std::vector<std::string>& words, const std::filesystem::path& log, bool talks) {
    Pipe failure, to_child, from_child;
    int errors = opened(log, O_WRONLY | O_CREAT | O_TRUNC | O_APPEND), nothing = opened("/dev/null", O_RDONLY);
    std::vector<std::string> copies = words;
    std::vector<char*> arguments;
    for (std::string& word : copies) arguments.push_back(word.data());
    arguments.push_back(nullptr);
    const pid_t parent = ::getpid();
    pid_ = ::fork();
    if (pid_ == 0)
        become(arguments.data(), talks ? to_child.read : nothing, talks ? from_child.write : errors, errors,
            failure.write, parent);
    Pipe::close_end(errors);
    Pipe::close_end(nothing);
    if (pid_ < 0) throw Error(std::string("cannot start a process: ") + std::strerror(errno));
    ::setpgid(pid_, pid_);  // whichever of the two comes first
    failure.close_write();
    int error = 0;
    ssize_t count = 0;
    while ((count = ::read(failure.read, &error, sizeof error)) < 0 && errno == EINTR) {
    }
    if (count == sizeof error) {
        ::waitpid(pid_, nullptr, 0);
        pid_ = -1;
        throw Error(words.front() + " cannot be started: " + std::strerror(error));
    }
    if (!talks) return;
    std::swap(input_, to_child.write);
    std::swap(output_, from_child.read);
}

void Child::kill_group() const {
    if (pid_ > 0) ::kill(-pid_, SIGKILL);
}

Child::~Child() {
    close_input();
    if (pid_ > 0 && !status_) {
        // One that stays up may end by itself, as its input has; nobody waits long for it.
        if (output_ >= 0) static_cast<void>(ended_within(0.2));
        kill_group();
        if (!status_) ::waitpid(pid_, nullptr, 0);
    }
    if (output_ >= 0) ::close(output_);
}

bool Child::ended_within(double seconds) {
    const Stopwatch watch;
    auto pause = std::chrono::microseconds(200);
    while (!status_) {
        int status = 0;
        const pid_t ended = ::waitpid(pid_, &status, WNOHANG);
        if (ended == pid_) {
            kill_group();  // what it may have left behind
            status_ = status;
            break;
        }
        if (watch.seconds() >= seconds) return false;
        std::this_thread::sleep_for(pause);
        pause = std::min(2 * pause, std::chrono::microseconds(10'000));
    }
    return true;
}

int Child::exit_status() const {
    const int status = status_.value_or(0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

std::string Child::how_it_ended() const {
    const int status = status_.value_or(0);
    if (WIFEXITED(status)) return "ended with status " + std::to_string(WEXITSTATUS(status));
    const int signal = WTERMSIG(status);
    return "was ended by signal " + std::to_string(signal) + " (" + ::strsignal(signal) + ")";
}

bool Child::send(std::string line) {
    line += '\n';
    for (std::size_t done = 0; done < line.size();) {
        const ssize_t count = ::write(input_, line.data() + done, line.size() - done);
        if (count < 0 && errno == EINTR) continue;
        if (count <= 0) return false;
        done += static_cast<std::size_t>(count);
    }
    return true;
}

std::optional<std::string> Child::line_within(double seconds) {
    const Stopwatch watch;
    for (;;) {
        if (const std::size_t end = received_.find('\n'); end != std::string::npos) {
            std::string line = received_.substr(0, end);
            received_.erase(0, end + 1);
            return line;
        }
        if (closed()) return std::nullopt;
        const double left = std::max(0.0, seconds - watch.seconds());
        pollfd wait{output_, POLLIN, 0};
        const int ready = ::poll(&wait, 1, static_cast<int>(1000.0 * left));
        if (ready == 0) return std::nullopt;
        if (ready < 0 && errno == EINTR) continue;
        std::array<char, 4096> bytes{};
        const ssize_t count = ::read(output_, bytes.data(), bytes.size());
        if (count < 0 && errno == EINTR) continue;
        if (count <= 0)
            Pipe::close_end(output_);
        else
            received_.append(bytes.data(), static_cast<std::size_t>(count));
    }
}

void Child::close_input() { Pipe::close_end(input_); }

}  // namespace tandem
