// Threads that record command buffers. They are woken for each batch, so that no batch waits for threads to be created.
#pragma once

#include <condition_variable>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace tandem {

// Seconds of CPU time that the calling thread has used so far.
[[nodiscard]] double thread_cpu_seconds();

class Recorders {
public:
    explicit Recorders(unsigned threads);  // 1: the caller's own thread does the work
    ~Recorders();
    Recorders(const Recorders&) = delete;
    Recorders& operator=(const Recorders&) = delete;

    [[nodiscard]] unsigned count() const { return count_; }
    // Calls work(0) … work(count - 1) in parallel, work(0) on the calling thread, and waits for all. Returns the CPU
    // seconds that the threads spent on it, summed. An exception of any of them is thrown on.
    [[nodiscard]] double run(const std::function<void(unsigned thread)>& work);

private:
    void serve(unsigned thread);

    unsigned count_;
    std::mutex mutex_;
    std::condition_variable wake_, done_;
    const std::function<void(unsigned)>* work_ = nullptr;
    std::uint64_t round_ = 0;
    unsigned busy_ = 0;
    bool ending_ = false;
    double cpu_seconds_ = 0.0;
    std::exception_ptr failure_;
    std::vector<std::jthread> threads_;
};

}  // namespace tandem
