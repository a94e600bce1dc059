// The terminal: a progress line with an estimate of the remaining time, closed output pipes, and Ctrl-C as a stop
// request.
#pragma once

#include <sys/types.h>

#include <atomic>
#include <chrono>
#include <cstdio>
#include <stop_token>
#include <string>
#include <thread>

namespace tandem {

// One line on stderr, redrawn at most ten times a second and erased on destruction. It is only shown where stderr is a
// terminal that moves its cursor: not with TERM=dumb, nor with NO_COLOR [no-color.org].
class ProgressLine {
public:
    ProgressLine();
    ~ProgressLine();
    ProgressLine(const ProgressLine&) = delete;
    ProgressLine& operator=(const ProgressLine&) = delete;

    // `fraction` in [0, 1] of the work is done; `text` says what is being done.
    void update(double fraction, const std::string& text);

private:
    using Clock = std::chrono::steady_clock;
    bool terminal_;
    bool drawn_ = false;
    Clock::time_point start_ = Clock::now(), last_{};
};

// While it lives, a reader of the standard streams may go away, as `head -c 1` and a closed terminal do. What nobody
// reads is dropped, and the work and its files go on. Descriptors that were closed lead to /dev/null, so that no file
// gets their numbers. Make it before anything is printed.
class StandardStreams {
public:
    StandardStreams();
    ~StandardStreams();
    StandardStreams(const StandardStreams&) = delete;
    StandardStreams& operator=(const StandardStreams&) = delete;

    // From now on text goes to the error output; returns the descriptor that standard output had.
    [[nodiscard]] int take_standard_output();
    // Why standard output could not be written, an errno; 0 where it could, or nobody reads.
    [[nodiscard]] int failure();

private:
    struct Sink {
        int descriptor, error = 0;
    };
    static std::FILE* stream_to(Sink& sink, int buffering);
    static ssize_t write(void* sink, const char* bytes, std::size_t count);

    Sink output_{1}, errors_{2};
    std::FILE *before_output_, *before_errors_;
    int taken_ = -1;
};

// Whether a write failed because nobody reads: the pipe's other end, or the terminal, is gone.
[[nodiscard]] bool nobody_reads(int error);

// While it lives, the first SIGINT, SIGTERM or SIGHUP (unless nohup(1) has it ignored) requests a stop. One that comes
// more than a second later ends the program at once. (timeout(1) sends two, to the process and to its group.) Make it
// before any other thread, so that all inherit the blocked signals.
class InterruptWatch {
public:
    InterruptWatch();
    [[nodiscard]] std::stop_token token() const { return source_.get_token(); }

private:
    friend class NothingToKeep;
    std::stop_source source_;
    std::atomic<int> nothing_to_keep_ = 0;
    std::jthread thread_;
};

// While it lives, the first SIGINT or SIGTERM ends the program at once. It is for loading scenes, and for other work
// that has no results yet and heeds no wish to stop.
class NothingToKeep {
public:
    explicit NothingToKeep(InterruptWatch& watch) : watch_(&watch) { ++watch_->nothing_to_keep_; }
    ~NothingToKeep() { end(); }
    NothingToKeep(const NothingToKeep&) = delete;
    NothingToKeep& operator=(const NothingToKeep&) = delete;
    // From now on there is.
    void end() {
        if (watch_ != nullptr) --watch_->nothing_to_keep_;
        watch_ = nullptr;
    }

private:
    InterruptWatch* watch_;
};

}  // namespace tandem
