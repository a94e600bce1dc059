// Bytes of the host on their way to the device's memory: written there, or copied, by which queue, alone or beside a
// frame.
#include <fmt/format.h>

#include <cstring>

#include "common/error.h"
#include "vulkan/bench/families.h"
#include "vulkan/command/barrier.h"

namespace tandem {

namespace {

enum class Way { staging, staged_before, transfer_queue, mapped };

using Usage = vk::BufferUsageFlagBits;

std::vector<std::uint32_t> families_of(const Device& device, Way way) {
    if (way != Way::transfer_queue) return {};
    return {device.queue_family(), family_of(device, {QueueKind::transfer_only, 0})};
}

VulkanPatterns on_queue(Way way) {
    VulkanPatterns patterns;
    if (way == Way::transfer_queue) patterns.queue.kind = QueueKind::transfer_only;
    return patterns;
}

// Memory that the host writes and that is the device's own too.
void check_mapped(const Device& device) {
    using Flag = vk::MemoryPropertyFlagBits;
    const auto wanted = Flag::eDeviceLocal | Flag::eHostVisible | Flag::eHostCoherent;
    const vk::PhysicalDeviceMemoryProperties memory = device.physical().getMemoryProperties();
    for (std::uint32_t i = 0; i < memory.memoryTypeCount; ++i)
        if ((memory.memoryTypes[i].propertyFlags & wanted) == wanted) return;
    throw UnsupportedError(device.description().name + " has no memory of its own that the host can write");
}

class TransferRun : public ArmRun {
public:
    TransferRun(SharedDevice device, std::uint64_t bytes, Way way, bool beside)
        : device_(std::move(device)),
          way_(way),
          source_(bytes / sizeof(std::uint64_t)),
          target_(device_->device(), way == Way::mapped ? MemoryDomain::mapped : MemoryDomain::device,
              std::array{BufferSpec{bytes, Usage::eTransferDst | Usage::eTransferSrc | Usage::eStorageBuffer,
                  families_of(device_->device(), way)}}),
          submission_(device_->device(), on_queue(way)) {
        if (way == Way::mapped) check_mapped(device_->device());
        for (std::size_t i = 0; i < source_.size(); ++i) source_[i] = (i + 1) * 0x9e3779b97f4a7c15u;
        if (way != Way::mapped)
            staging_.emplace(
                device_->device(), MemoryDomain::upload, std::array{BufferSpec{bytes, Usage::eTransferSrc}});
        if (way == Way::staged_before) write(*staging_);
        if (beside) frame_ = device_->job(device_->sizes()[device_->sizes().size() / 2], device_->bounces(), {});
    }

    [[nodiscard]] ClockReadings run() override {
        const double start = steady_seconds();
        if (frame_) frame_->start_frame(4);
        SubmissionTimes times;
        if (way_ == Way::mapped) {
            write(target_);
        } else {
            if (way_ != Way::staged_before) write(*staging_);
            submission_.add({}, [this](const vk::raii::CommandBuffer& commands) {
                commands.copyBuffer((*staging_)[0], target_[0], vk::BufferCopy(0, 0, bytes()));
            });
            times = submission_.run();
        }
        const double sent = steady_seconds();
        if (frame_) (void)frame_->finish_frame();
        ClockReadings readings = readings_of(times, steady_seconds() - start);
        readings["sent"] = sent - start;
        return readings;
    }

    // What lies in the target, fetched by the rendering queue.
    [[nodiscard]] std::optional<ArmOutput> output() override {
        (void)run();
        const BufferGroup fetched(
            device_->device(), MemoryDomain::readback, std::array{BufferSpec{bytes(), Usage::eTransferDst}});
        Submission fetch(device_->device(), {});
        fetch.add({}, [&](const vk::raii::CommandBuffer& commands) {
            commands.copyBuffer(target_[0], fetched[0], vk::BufferCopy(0, 0, bytes()));
            barrier(commands, transfer_write, host_read);
        });
        (void)fetch.run();
        std::uint64_t digest = 0xcbf29ce484222325u;
        for (std::size_t i = 0; i < source_.size(); ++i) {
            std::uint64_t word = 0;
            std::memcpy(&word, fetched.mapped(0) + i * sizeof word, sizeof word);
            digest = (digest ^ word) * 0x100000001b3u;
        }
        return ArmOutput{digest, nullptr};
    }

private:
    [[nodiscard]] std::uint64_t bytes() const { return source_.size() * sizeof source_[0]; }
    void write(const BufferGroup& group) const { std::memcpy(group.mapped(0), source_.data(), bytes()); }

    SharedDevice device_;
    Way way_;
    std::vector<std::uint64_t> source_;
    BufferGroup target_;
    std::optional<BufferGroup> staging_;
    Submission submission_;
    std::unique_ptr<VulkanJob> frame_;
};

std::string size_text(std::uint64_t bytes) {
    return bytes >= 1u << 20 ? fmt::format("{} MiB", bytes >> 20) : fmt::format("{} KiB", bytes >> 10);
}

}  // namespace

namespace {

// 4 KiB to what shows the bandwidth.
std::vector<Workload> transfer_sizes(const SharedDevice& device) {
    const bool on_cpu = device->device().description().type == DeviceType::cpu;
    const std::uint64_t most = on_cpu ? std::uint64_t{16} << 20 : std::uint64_t{256} << 20;
    std::vector<Workload> sizes;
    for (std::uint64_t bytes = 4096; bytes <= most; bytes *= 16)
        sizes.push_back({size_text(bytes), {{"bytes", static_cast<double>(bytes)}}});
    return sizes;
}

std::vector<Arm> transfer_arms(const SharedDevice& device, const Workload& workload, bool beside) {
    const auto bytes = static_cast<std::uint64_t>(workload.factors.at("bytes"));
    const auto arm = [&](const char* name, const char* text, Way way) {
        return Arm{name, text, [=] { return std::make_unique<TransferRun>(device, bytes, way, beside); }};
    };
    return {arm("staging", "written to host memory, copied on the rendering queue", Way::staging),
        arm("copy-alone", "the same, but written before: the copy alone", Way::staged_before),
        arm("transfer-queue", "written to host memory, copied on a queue for transfers alone", Way::transfer_queue),
        arm("mapped", "written by the host into memory of the device", Way::mapped)};
}

}  // namespace

Family transfers_family(const SharedDevice& device) {
    Family family;
    family.name = "transfers";
    family.question = "How should bytes of the host get into the device's memory?";
    family.hypothesis = "Small ones by writing them there, large ones by the transfer queue";
    family.source = "VComputeBench; denied by users of wlroots";
    family.held = "the bytes, one copy command, one wait";
    family.base =
        "the bytes copied on the host into a buffer there, and by one command to the device's. The total lasts from "
        "before the host's copy to the end of the wait";
    family.along = "bytes";
    family.workloads = transfer_sizes(device);
    family.arms = [device](const Workload& workload) { return transfer_arms(device, workload, false); };
    return family;
}

Family transfers_beside_family(const SharedDevice& device) {
    Family family;
    family.name = "transfers-beside";
    family.question = "And how while the device renders?";
    family.hypothesis = "On the transfer queue, where the copy does not wait for the frame";
    family.source = "vendors' advice";
    family.held = "as transfers, while a frame of four samples of the middle size runs on the rendering queue";
    family.base =
        "a frame of four samples begun, the bytes sent as in transfers, the frame waited for; the total lasts over it "
        "all";
    family.along = "bytes";
    family.workloads = transfer_sizes(device);
    family.arms = [device](const Workload& workload) { return transfer_arms(device, workload, true); };
    return family;
}

}  // namespace tandem
