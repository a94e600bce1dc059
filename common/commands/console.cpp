#include "common/commands/console.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <pthread.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <string_view>
#include <utility>

#include "common/error.h"
#include "common/files/write_file.h"
#include "common/text.h"

namespace tandem {

namespace {

bool is_set(const char* variable) {
    const char* value = std::getenv(variable);
    return value != nullptr && value[0] != '\0';
}

bool moves_its_cursor(int descriptor) {
    const char* terminal = std::getenv("TERM");
    return isatty(descriptor) == 1 && !is_set("NO_COLOR") &&
           !(terminal != nullptr && std::string_view(terminal) == "dumb");
}

}  // namespace

ProgressLine::ProgressLine() : terminal_(moves_its_cursor(STDERR_FILENO)) {}

ProgressLine::~ProgressLine() {
    if (drawn_) fmt::print(stderr, "\r\033[K");
}

void ProgressLine::update(double fraction, const std::string& text) {
    const Clock::time_point now = Clock::now();
    if (!terminal_ || now - last_ < std::chrono::milliseconds(100)) return;
    last_ = now;
    drawn_ = true;
    const double elapsed = std::chrono::duration<double>(now - start_).count();
    const double done = std::clamp(fraction, 0.0, 1.0);
    std::string left = "estimating";
    if (done > 0.0 && elapsed > 0.5) {
        const long seconds = static_cast<long>(elapsed * (1.0 - done) / done + 0.5);
        left = fmt::format("{}:{:02} left", seconds / 60, seconds % 60);
    }
    fmt::print(stderr, "\r\033[K{:3.0f} %  {}  {}", 100.0 * done, left, escaped(text));
    std::fflush(stderr);
}

bool nobody_reads(int error) { return error == EPIPE || error == EIO || error == EBADF; }

ssize_t StandardStreams::write(void* sink, const char* bytes, std::size_t count) {
    Sink& to = *static_cast<Sink*>(sink);
    if (to.error == 0 && !write_all(to.descriptor, {bytes, count})) to.error = errno;
    return static_cast<ssize_t>(count);  // a stream that failed would throw from every line that is printed
}

std::FILE* StandardStreams::stream_to(Sink& sink, int buffering) {
    std::FILE* stream = fopencookie(&sink, "w", {.read = nullptr, .write = &write, .seek = nullptr, .close = nullptr});
    if (stream != nullptr) std::setvbuf(stream, nullptr, buffering, BUFSIZ);
    return stream;
}

StandardStreams::StandardStreams() : before_output_(stdout), before_errors_(stderr) {
    for (int descriptor = 0; descriptor <= STDERR_FILENO; ++descriptor)
        if (fcntl(descriptor, F_GETFD) < 0) (void)open("/dev/null", O_RDWR);  // takes the lowest number, this one
    std::signal(SIGPIPE, SIG_IGN);
    std::FILE* output = stream_to(output_, isatty(STDOUT_FILENO) == 1 ? _IOLBF : _IOFBF);
    std::FILE* errors = stream_to(errors_, _IONBF);
    if (output != nullptr) stdout = output;
    if (errors != nullptr) stderr = errors;
}

StandardStreams::~StandardStreams() {
    if (stdout != before_output_) std::fclose(std::exchange(stdout, before_output_));
    if (stderr != before_errors_) std::fclose(std::exchange(stderr, before_errors_));
    if (taken_ >= 0) close(taken_);
}

int StandardStreams::take_standard_output() {
    std::fflush(stdout);
    taken_ = fcntl(STDOUT_FILENO, F_DUPFD_CLOEXEC, STDERR_FILENO + 1);
    if (taken_ < 0 || dup2(STDERR_FILENO, STDOUT_FILENO) < 0)
        throw Error(std::string("standard output cannot be had: ") + std::strerror(errno));
    return taken_;
}

int StandardStreams::failure() {
    std::fflush(stdout);
    return nobody_reads(output_.error) ? 0 : output_.error;
}

InterruptWatch::InterruptWatch() {
    sigset_t signals;
    sigemptyset(&signals);
    sigaddset(&signals, SIGINT);
    sigaddset(&signals, SIGTERM);
    struct sigaction hang_up {};
    if (sigaction(SIGHUP, nullptr, &hang_up) == 0 && hang_up.sa_handler != SIG_IGN) sigaddset(&signals, SIGHUP);
    pthread_sigmask(SIG_BLOCK, &signals, nullptr);
    thread_ = std::jthread([this, signals, source = source_](const std::stop_token& ending) mutable {
        // A signal to this thread alone tells it to end, so that no command waits for its watch.
        sigset_t awaited = signals;
        sigaddset(&awaited, SIGRTMIN);
        pthread_sigmask(SIG_BLOCK, &awaited, nullptr);
        const std::stop_callback wake(ending, [self = pthread_self()] { pthread_kill(self, SIGRTMIN); });
        constexpr std::chrono::seconds same_wish{1};
        std::chrono::steady_clock::time_point first;
        while (!ending.stop_requested()) {
            const int caught = sigwaitinfo(&awaited, nullptr);
            if (caught < 0 || sigismember(&signals, caught) != 1) continue;
            const auto now = std::chrono::steady_clock::now();
            if (source.stop_requested() || nothing_to_keep_ > 0) {
                if (source.stop_requested() && now - first < same_wish) continue;
                std::signal(caught, SIG_DFL);
                pthread_sigmask(SIG_UNBLOCK, &signals, nullptr);
                std::raise(caught);
            }
            first = now;
            source.request_stop();
        }
    });
}

}  // namespace tandem
