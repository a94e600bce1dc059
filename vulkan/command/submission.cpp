#include "vulkan/command/submission.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <utility>

#include "common/error.h"

namespace tandem {

namespace {

using Clock = std::chrono::steady_clock;

double seconds_between(Clock::time_point start, Clock::time_point end) {
    return std::chrono::duration<double>(end - start).count();
}

double seconds_of(Clock::time_point moment) { return std::chrono::duration<double>(moment.time_since_epoch()).count(); }

// Pre-recorded command buffers are kept up to so many; renders of many samples never use one twice.
constexpr std::size_t most_recorded = 4096;

vk::raii::QueryPool make_stamps(const Device& device, std::uint32_t bits) {
    if (bits == 0) return nullptr;
    return vk::raii::QueryPool(device.handle(), vk::QueryPoolCreateInfo({}, vk::QueryType::eTimestamp, 2));
}

vk::raii::CommandPool make_pool(const Device& device, std::uint32_t family, vk::CommandPoolCreateFlags flags) {
    return vk::raii::CommandPool(device.handle(), vk::CommandPoolCreateInfo(flags, family));
}

const vk::raii::Queue& queue_of(const Device& device, const QueueSlot& slot) {
    const auto& queues = device.queues(family_of(device, slot));
    if (slot.index >= queues.size())
        throw UnsupportedError(fmt::format(
            "{} has {} queue{} of the kind", device.description().name, queues.size(), queues.size() == 1 ? "" : "s"));
    return queues[slot.index];
}

vk::CommandPoolCreateFlags pool_flags(const VulkanPatterns& patterns) {
    using Flag = vk::CommandPoolCreateFlagBits;
    vk::CommandPoolCreateFlags flags;
    if (patterns.one_time_submit) flags |= Flag::eTransient;
    if (patterns.reset == ResetPattern::buffer) flags |= Flag::eResetCommandBuffer;
    return flags;
}

vk::raii::Semaphore make_timeline(const Device& device, const VulkanPatterns& patterns) {
    if (patterns.wait != WaitPattern::timeline) return nullptr;
    if (!device.features().timeline_semaphores)
        throw UnsupportedError(device.description().name + " has no timeline semaphores");
    const vk::StructureChain info(
        vk::SemaphoreCreateInfo(), vk::SemaphoreTypeCreateInfo(vk::SemaphoreType::eTimeline, 0));
    return vk::raii::Semaphore(device.handle(), info.get<vk::SemaphoreCreateInfo>());
}

vk::raii::CommandBuffers allocate(
    const Device& device, const vk::raii::CommandPool& pool, vk::CommandBufferLevel level, std::uint32_t count) {
    return vk::raii::CommandBuffers(device.handle(), vk::CommandBufferAllocateInfo(*pool, level, count));
}

// Whether its command buffers may write stamps: resetting them takes more than transfers.
std::uint32_t stamp_bits(const Device& device, std::uint32_t family) {
    using Flag = vk::QueueFlagBits;
    const vk::QueueFamilyProperties properties = device.physical().getQueueFamilyProperties()[family];
    return properties.queueFlags & (Flag::eCompute | Flag::eGraphics) ? properties.timestampValidBits : 0;
}

// `call` to the device; where that is lost, what a user can do.
template <class Call>
void on(const Device& device, const Call& call) {
    try {
        call();
    } catch (const vk::DeviceLostError&) {
        throw DeviceError(device.description().name +
                          " was lost: its driver gave it up or reset it; start again, and give --resume FILE to a long "
                          "render, so that it goes on");
    }
}

}  // namespace

std::uint32_t family_of(const Device& device, const QueueSlot& slot) {
    using Flag = vk::QueueFlagBits;
    std::optional<std::uint32_t> family;
    const std::string& name = device.description().name;
    switch (slot.kind) {
        case QueueKind::rendering:
            return device.queue_family();
        case QueueKind::compute_only:
            family = device.family_with(Flag::eCompute, Flag::eGraphics);
            if (!family) throw UnsupportedError(name + " has no queue family with compute and without graphics");
            break;
        case QueueKind::transfer_only:
            family = device.family_with(Flag::eTransfer, Flag::eGraphics | Flag::eCompute);
            if (!family) throw UnsupportedError(name + " has no queue family for transfers alone");
            break;
    }
    return family.value();
}

void SubmissionTimes::add(const SubmissionTimes& other) {
    record += other.record;
    record_cpu += other.record_cpu;
    submit += other.submit;
    wait += other.wait;
    if (device && other.device)
        *device += *other.device;
    else
        device.reset();
    moments = submissions == 0 ? other.moments : std::nullopt;
    submissions += other.submissions;
    command_buffers += other.command_buffers;
}

Submission::Submission(const Device& device, const VulkanPatterns& patterns)
    : device_(device),
      patterns_(patterns),
      family_(family_of(device, patterns.queue)),
      queue_(queue_of(device, patterns.queue)),
      recorders_(patterns.recording == RecordingPattern::pre_recorded ? 1 : patterns.recording_threads),
      own_pool_{make_pool(device, family_, vk::CommandPoolCreateFlagBits::eResetCommandBuffer), {}},
      stamp_bits_(stamp_bits(device, family_)),
      stamps_(make_stamps(device, stamp_bits_)),
      primary_(allocate(device, own_pool_.pool, vk::CommandBufferLevel::ePrimary, 1)),
      fence_(device.handle(), vk::FenceCreateInfo()),
      timeline_(make_timeline(device, patterns)) {
    for (unsigned thread = 0; thread < recorders_.count(); ++thread)
        pools_.push_back({make_pool(device, family_, pool_flags(patterns)), {}});
    if (!*stamps_) return;
    stamp_buffers_ = allocate(device, own_pool_.pool, vk::CommandBufferLevel::ePrimary, 2);
    stamp_buffers_[0].begin(vk::CommandBufferBeginInfo());
    stamp_buffers_[0].resetQueryPool(*stamps_, 0, 2);
    stamp_buffers_[0].writeTimestamp(vk::PipelineStageFlagBits::eTopOfPipe, *stamps_, 0);
    stamp_buffers_[0].end();
    stamp_buffers_[1].begin(vk::CommandBufferBeginInfo());
    stamp_buffers_[1].writeTimestamp(vk::PipelineStageFlagBits::eBottomOfPipe, *stamps_, 1);
    stamp_buffers_[1].end();
}

void Submission::add(const Key& key, Recording recording) { pending_.push_back({key, std::move(recording)}); }

void Submission::add_kept_first(const Key& key, Recording recording) {
    kept_first_.push_back({key, std::move(recording)});
}

void Submission::wait_for(vk::Semaphore semaphore, vk::PipelineStageFlags at) {
    waited_for_ = semaphore;
    waited_at_ = at;
}

void Submission::forget_recorded() { recorded_.clear(); }

void Submission::make_free(Pool& pool) const {
    switch (patterns_.reset) {
        case ResetPattern::pool:
            pool.pool.reset();
            break;
        case ResetPattern::buffer:
            for (std::size_t i = 0; i < pool.used; ++i) pool.buffers[i].reset();
            break;
        case ResetPattern::free:
            pool.buffers.clear();
            break;
    }
    pool.used = 0;
}

// Begun.
const vk::raii::CommandBuffer& Submission::take(Pool& pool) const {
    const bool secondary = patterns_.recording == RecordingPattern::secondary;
    if (pool.used == pool.buffers.size()) {
        const auto level = secondary ? vk::CommandBufferLevel::eSecondary : vk::CommandBufferLevel::ePrimary;
        for (vk::raii::CommandBuffer& buffer : allocate(device_, pool.pool, level, 16))
            pool.buffers.push_back(std::move(buffer));
    }
    const vk::raii::CommandBuffer& commands = pool.buffers[pool.used++];
    const vk::CommandBufferInheritanceInfo inheritance;
    vk::CommandBufferUsageFlags flags;
    if (patterns_.one_time_submit) flags |= vk::CommandBufferUsageFlagBits::eOneTimeSubmit;
    commands.begin(vk::CommandBufferBeginInfo(flags, secondary ? &inheritance : nullptr));
    return commands;
}

// Groups of recordings go to the threads in runs of about the same length, each thread recording from its own pool.
void Submission::record_all(std::vector<vk::CommandBuffer>& handles, SubmissionTimes& times) {
    const std::size_t per_buffer = std::max(1u, patterns_.recordings_per_buffer);
    const std::size_t groups = (pending_.size() + per_buffer - 1) / per_buffer;
    handles.resize(groups);
    times.record_cpu += recorders_.run([&](unsigned thread) {
        Pool& pool = pools_[thread];
        make_free(pool);
        const std::size_t end = groups * (thread + 1) / recorders_.count();
        for (std::size_t group = groups * thread / recorders_.count(); group < end; ++group) {
            const vk::raii::CommandBuffer& commands = take(pool);
            const std::size_t last = std::min(pending_.size(), (group + 1) * per_buffer);
            for (std::size_t i = group * per_buffer; i < last; ++i) pending_[i].recording(commands);
            commands.end();
            handles[group] = *commands;
        }
    });
}

void Submission::record_pre_recorded(const std::vector<Pending>& pending, std::vector<vk::CommandBuffer>& handles) {
    const std::size_t per_buffer = std::max(1u, patterns_.recordings_per_buffer);
    for (std::size_t first = 0; first < pending.size(); first += per_buffer) {
        const std::size_t last = std::min(pending.size(), first + per_buffer);
        std::vector<Key> keys;
        for (std::size_t i = first; i < last; ++i) keys.push_back(pending[i].key);
        auto found = recorded_.find(keys);
        if (found == recorded_.end()) {
            vk::raii::CommandBuffer commands =
                std::move(allocate(device_, own_pool_.pool, vk::CommandBufferLevel::ePrimary, 1).front());
            commands.begin(vk::CommandBufferBeginInfo());
            for (std::size_t i = first; i < last; ++i) pending[i].recording(commands);
            commands.end();
            found = recorded_.emplace(std::move(keys), std::move(commands)).first;
        }
        handles.push_back(*found->second);
    }
}

// Puts the secondary command buffers that were recorded into one primary.
void Submission::record_primary(std::vector<vk::CommandBuffer>& handles) {
    const vk::raii::CommandBuffer& primary = primary_.front();
    primary.begin(vk::CommandBufferBeginInfo(vk::CommandBufferUsageFlagBits::eOneTimeSubmit));
    primary.executeCommands(handles);
    primary.end();
    handles = {*primary};
}

void Submission::submit(const std::vector<vk::CommandBuffer>& handles) {
    const bool signals = patterns_.wait == WaitPattern::timeline;
    if (signals) ++timeline_value_;
    std::vector<vk::SubmitInfo> infos;
    if (patterns_.submission == SubmissionPattern::many_buffers)
        infos.emplace_back(nullptr, nullptr, handles);
    else
        for (const vk::CommandBuffer& handle : handles) infos.emplace_back(nullptr, nullptr, handle);
    // The values of binary semaphores are ignored.
    const std::array<std::uint64_t, 2> values{timeline_value_, 0};
    std::vector<vk::Semaphore> signalled;
    if (signals) signalled.push_back(*timeline_);
    if (signalled_) signalled.push_back(signalled_);
    vk::TimelineSemaphoreSubmitInfo value;
    value.setSignalSemaphoreValueCount(static_cast<std::uint32_t>(signalled.size()))
        .setPSignalSemaphoreValues(values.data());
    infos.back().setSignalSemaphores(signalled);
    if (signals) infos.back().setPNext(&value);
    if (waited_for_) infos.front().setWaitSemaphores(waited_for_).setWaitDstStageMask(waited_at_);
    const vk::Fence fence = patterns_.wait == WaitPattern::fence ? *fence_ : vk::Fence();
    if (patterns_.submission == SubmissionPattern::many_submits) {
        for (const vk::SubmitInfo& info : infos) queue_.submit(info, &info == &infos.back() ? fence : vk::Fence());
    } else {
        queue_.submit(infos, fence);
    }
    waited_for_ = signalled_ = nullptr;
}

void Submission::wait() {
    switch (patterns_.wait) {
        case WaitPattern::fence:
            while (device_.handle().waitForFences(*fence_, true, UINT64_MAX) == vk::Result::eTimeout) {
            }
            device_.handle().resetFences(*fence_);
            break;
        case WaitPattern::timeline: {
            const vk::Semaphore timeline = *timeline_;
            const vk::SemaphoreWaitInfo info({}, timeline, timeline_value_);
            while (device_.handle().waitSemaphores(info, UINT64_MAX) == vk::Result::eTimeout) {
            }
            break;
        }
        case WaitPattern::queue_idle:
            queue_.waitIdle();
            break;
    }
}

void Submission::read_stamps() {
    times_.device.reset();
    if (!*stamps_) return;
    const auto [result, stamps] = stamps_.getResults<std::uint64_t>(0, 2, 2 * sizeof(std::uint64_t),
        sizeof(std::uint64_t), vk::QueryResultFlagBits::e64 | vk::QueryResultFlagBits::eWait);
    if (result != vk::Result::eSuccess) return;
    const std::uint64_t mask = stamp_bits_ >= 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << stamp_bits_) - 1;
    const std::uint64_t ticks = (stamps[1] - stamps[0]) & mask;  // right across one wrap of the counter
    times_.device = static_cast<double>(ticks) * static_cast<double>(device_.limits().timestampPeriod) * 1e-9;
    times_.moments = {submitted_, known_, stamps[0], stamps[1], stamp_bits_};
}

void Submission::start() {
    SubmissionTimes& times = times_ = {};
    if (pending_.empty()) return;
    const auto start = Clock::now();
    if (recorded_.size() > most_recorded) recorded_.clear();
    std::vector<vk::CommandBuffer> handles;
    if (patterns_.recording == RecordingPattern::pre_recorded) {
        const double cpu_start = thread_cpu_seconds();
        record_pre_recorded(pending_, handles);
        times.record_cpu = thread_cpu_seconds() - cpu_start;
    } else {
        record_all(handles, times);
    }
    pending_.clear();
    times.command_buffers = handles.size();
    if (patterns_.recording == RecordingPattern::secondary) record_primary(handles);
    std::vector<vk::CommandBuffer> first;
    record_pre_recorded(std::exchange(kept_first_, {}), first);
    handles.insert(handles.begin(), first.begin(), first.end());
    if (*stamps_) {
        handles.insert(handles.begin(), *stamp_buffers_[0]);
        handles.push_back(*stamp_buffers_[1]);
    }
    const auto recorded = Clock::now();
    submitted_ = seconds_of(recorded);
    on(device_, [&] { submit(handles); });
    started_ = true;
    times.record = seconds_between(start, recorded);
    times.submit = seconds_between(recorded, Clock::now());
    times.submissions = 1;
}

SubmissionTimes Submission::finish() {
    if (!started_) return times_;
    started_ = false;
    const auto start = Clock::now();
    on(device_, [&] {
        wait();
        const auto known = Clock::now();
        known_ = seconds_of(known);
        times_.wait = seconds_between(start, known);
        read_stamps();
    });
    return times_;
}

SubmissionTimes Submission::run() {
    start();
    return finish();
}

}  // namespace tandem
