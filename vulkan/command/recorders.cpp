#include "vulkan/command/recorders.h"

#include <time.h>

#include <algorithm>
#include <utility>

namespace tandem {

double thread_cpu_seconds() {
    timespec now{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

Recorders::Recorders(unsigned threads) : count_(std::max(1u, threads)) {
    for (unsigned thread = 1; thread < count_; ++thread) threads_.emplace_back([this, thread] { serve(thread); });
}

Recorders::~Recorders() {
    {
        const std::scoped_lock lock(mutex_);
        ending_ = true;
    }
    wake_.notify_all();
}

void Recorders::serve(unsigned thread) {
    std::uint64_t seen = 0;
    std::unique_lock lock(mutex_);
    while (true) {
        wake_.wait(lock, [&] { return ending_ || round_ != seen; });
        if (ending_) return;
        seen = round_;
        const auto& work = *work_;
        lock.unlock();
        const double start = thread_cpu_seconds();
        std::exception_ptr failure;
        try {
            work(thread);
        } catch (...) {
            failure = std::current_exception();
        }
        const double spent = thread_cpu_seconds() - start;
        lock.lock();
        cpu_seconds_ += spent;
        if (failure) failure_ = failure;
        if (--busy_ == 0) done_.notify_one();
    }
}

double Recorders::run(const std::function<void(unsigned)>& work) {
    {
        const std::scoped_lock lock(mutex_);
        work_ = &work;
        busy_ = count_ - 1;
        cpu_seconds_ = 0.0;
        failure_ = nullptr;
        ++round_;
    }
    if (count_ > 1) wake_.notify_all();
    const double start = thread_cpu_seconds();
    std::exception_ptr failure;
    try {
        work(0);
    } catch (...) {
        failure = std::current_exception();
    }
    const double spent = thread_cpu_seconds() - start;
    std::unique_lock lock(mutex_);
    done_.wait(lock, [&] { return busy_ == 0; });
    if (failure) std::rethrow_exception(failure);
    if (failure_) std::rethrow_exception(std::exchange(failure_, nullptr));
    return cpu_seconds_ + spent;
}

}  // namespace tandem
