// Records command buffers, submits them together and waits for them, as VulkanPatterns choose. Each phase is timed.
#pragma once

#include <compare>
#include <functional>
#include <map>
#include <optional>
#include <vector>

#include "vulkan/command/recorders.h"
#include "vulkan/core/device.h"
#include "vulkan/patterns.h"

namespace tandem {

// Where the time of submissions went, in seconds.
struct SubmissionTimes {
    double record = 0.0;                 // recording, wall clock; with reset and allocation of command buffers
    double record_cpu = 0.0;             // recording, CPU time summed over the recording threads
    double submit = 0.0;                 // inside vkQueueSubmit
    double wait = 0.0;                   // from there until the host knew that the device had finished
    std::optional<double> device = 0.0;  // between the first and the last command, by the device's clock if it has one
    std::uint64_t submissions = 0, command_buffers = 0;
    // Moments of a single submission. By the steady clock, in seconds: when it was handed over and known to have
    // finished. The device's stamps at its begin and end (device_clock.h).
    struct Moments {
        double submitted = 0.0, known = 0.0;
        std::uint64_t first_stamp = 0, last_stamp = 0;
        std::uint32_t stamp_bits = 0;
    };
    std::optional<Moments> moments;

    void add(const SubmissionTimes& other);
};

// The queue family of that kind. Throws UnsupportedError where the device has none.
[[nodiscard]] std::uint32_t family_of(const Device& device, const QueueSlot& slot);

class Submission {
public:
    // What makes two recordings the same commands, so that pre-recorded ones can be found again.
    struct Key {
        std::uint32_t kind = 0;
        std::uint64_t first = 0, second = 0, third = 0, fourth = 0;
        auto operator<=>(const Key&) const = default;
    };
    // Must not depend on anything that changes before run() returns: it is called from any thread, or not at all.
    using Recording = std::function<void(const vk::raii::CommandBuffer&)>;

    Submission(const Device& device, const VulkanPatterns& patterns);

    void add(const Key& key, Recording recording);
    // The same for commands that go before all others of the next submission. Their command buffer is recorded once and
    // found again by its key.
    void add_kept_first(const Key& key, Recording recording);
    // Binary semaphores of the next submission alone: its commands wait for the one at this stage, and signal the other
    // when they are done.
    void wait_for(vk::Semaphore semaphore, vk::PipelineStageFlags at);
    void signal(vk::Semaphore semaphore) { signalled_ = semaphore; }
    // Records what was added, submits it in this order and waits. Nothing added: nothing is submitted.
    [[nodiscard]] SubmissionTimes run();
    // The two halves of run(): with several Submissions, those of one can run while another is recorded. Between them
    // nothing may be added.
    void start();
    [[nodiscard]] SubmissionTimes finish();
    [[nodiscard]] bool started() const { return started_; }
    // Forgets pre-recorded command buffers: what they refer to is about to change.
    void forget_recorded();

private:
    // The command buffers of one recording thread.
    struct Pool {
        vk::raii::CommandPool pool;
        std::vector<vk::raii::CommandBuffer> buffers;
        std::size_t used = 0;
    };
    struct Pending {
        Key key;
        Recording recording;
    };

    void make_free(Pool& pool) const;
    [[nodiscard]] const vk::raii::CommandBuffer& take(Pool& pool) const;
    void record_all(std::vector<vk::CommandBuffer>& handles, SubmissionTimes& times);
    void record_pre_recorded(const std::vector<Pending>& pending, std::vector<vk::CommandBuffer>& handles);
    void record_primary(std::vector<vk::CommandBuffer>& handles);
    void submit(const std::vector<vk::CommandBuffer>& handles);
    void wait();
    // Reads the stamps, if there are any.
    void read_stamps();

    const Device& device_;
    VulkanPatterns patterns_;
    std::uint32_t family_;
    const vk::raii::Queue& queue_;
    Recorders recorders_;
    std::vector<Pool> pools_;                                       // by recording thread
    Pool own_pool_;                                                 // stamps and primaries
    std::map<std::vector<Key>, vk::raii::CommandBuffer> recorded_;  // of own_pool_
    std::vector<Pending> pending_, kept_first_;
    vk::Semaphore waited_for_, signalled_;  // of the next submission; null: none
    vk::PipelineStageFlags waited_at_;
    std::uint32_t stamp_bits_;  // of the queue's clock; 0: it has none
    vk::raii::QueryPool stamps_;
    vk::raii::CommandBuffers stamp_buffers_ = nullptr;  // first and last of each submission
    vk::raii::CommandBuffers primary_ = nullptr;
    vk::raii::Fence fence_;
    vk::raii::Semaphore timeline_;
    std::uint64_t timeline_value_ = 0;
    bool started_ = false;
    double submitted_ = 0.0, known_ = 0.0;  // seconds by the steady clock
    SubmissionTimes times_;                 // of the submission that was started
};

}  // namespace tandem
