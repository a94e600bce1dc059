// Transfers between the memories of host and device. Bytes are written or read in place, or copied by one of the
// queues, alone or beside a frame.
#include <fmt/format.h>

#include <cstring>

#include "common/error.h"
#include "vulkan/bench/families.h"
#include "vulkan/command/barrier.h"

namespace tandem {

namespace {

enum class Way { staging, staged_before, transfer_queue, mapped };
enum class WayBack { cached, copied_alone, uncached, transfer_queue, mapped };

using BufferUsage = vk::BufferUsageFlagBits;

// The families of the queues that share what is copied.
std::vector<std::uint32_t> families_of(const Device& device, bool transfer_queue) {
    if (!transfer_queue) return {};
    return {device.queue_family(), family_of(device, {QueueKind::transfer_only, 0})};
}

VulkanPatterns on_queue(bool transfer_queue) {
    VulkanPatterns patterns;
    if (transfer_queue) patterns.queue.kind = QueueKind::transfer_only;
    return patterns;
}

std::vector<std::uint64_t> words_of(std::uint64_t bytes) {
    std::vector<std::uint64_t> words(bytes / sizeof(std::uint64_t));
    for (std::size_t i = 0; i < words.size(); ++i) words[i] = (i + 1) * 0x9e3779b97f4a7c15u;
    return words;
}

std::uint64_t digest_of_words(std::span<const std::uint64_t> words) {
    std::uint64_t digest = 0xcbf29ce484222325u;
    for (const std::uint64_t word : words) digest = (digest ^ word) * 0x100000001b3u;
    return digest;
}

// Memory that the host reaches and that is the device's own too.
void check_mapped(const Device& device) {
    using Flag = vk::MemoryPropertyFlagBits;
    const auto wanted = Flag::eDeviceLocal | Flag::eHostVisible | Flag::eHostCoherent;
    const vk::PhysicalDeviceMemoryProperties memory = device.physical().getMemoryProperties();
    for (std::uint32_t i = 0; i < memory.memoryTypeCount; ++i)
        if ((memory.memoryTypes[i].propertyFlags & wanted) == wanted) return;
    throw UnsupportedError(device.description().name + " has no memory of its own that the host reaches");
}

class TransferRun : public ArmRun {
public:
    TransferRun(SharedDevice device, std::uint64_t bytes, Way way, bool beside)
        : device_(std::move(device)),
          way_(way),
          source_(words_of(bytes)),
          target_(device_->device(), way == Way::mapped ? MemoryDomain::mapped : MemoryDomain::device,
              std::array{
                  BufferSpec{bytes, BufferUsage::eTransferDst | BufferUsage::eTransferSrc | BufferUsage::eStorageBuffer,
                      families_of(device_->device(), way == Way::transfer_queue)}}),
          submission_(device_->device(), on_queue(way == Way::transfer_queue)) {
        if (way == Way::mapped) check_mapped(device_->device());
        if (way != Way::mapped)
            staging_.emplace(
                device_->device(), MemoryDomain::upload, std::array{BufferSpec{bytes, BufferUsage::eTransferSrc}});
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
            device_->device(), MemoryDomain::readback, std::array{BufferSpec{bytes(), BufferUsage::eTransferDst}});
        Submission fetch(device_->device(), {});
        fetch.add({}, [&](const vk::raii::CommandBuffer& commands) {
            commands.copyBuffer(target_[0], fetched[0], vk::BufferCopy(0, 0, bytes()));
            barrier(commands, transfer_write, host_read);
        });
        (void)fetch.run();
        std::vector<std::uint64_t> words(source_.size());
        std::memcpy(words.data(), fetched.mapped(0), bytes());
        return ArmOutput{digest_of_words(words), nullptr};
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

// Memory of the host that its caches leave out: what copies from the device are read slowly from.
void check_uncached(const Device& device) {
    using Flag = vk::MemoryPropertyFlagBits;
    constexpr vk::MemoryPropertyFlags reached = Flag::eHostVisible | Flag::eHostCoherent;
    if (device.memory_type(~0u, reached, {}) == device.memory_type(~0u, reached, Flag::eHostCached))
        throw UnsupportedError(device.description().name + " has cached and uncached memory of the host in one type");
}

MemoryDomain landing(WayBack way) { return way == WayBack::uncached ? MemoryDomain::upload : MemoryDomain::readback; }

// Words in the device's memory that the host wants in a vector of its own.
class ReadbackRun : public ArmRun {
public:
    ReadbackRun(SharedDevice device, std::uint64_t bytes, WayBack way)
        : device_(std::move(device)),
          way_(way),
          words_(bytes / sizeof(std::uint64_t)),
          source_(device_->device(), way == WayBack::mapped ? MemoryDomain::mapped : MemoryDomain::device,
              std::array{
                  BufferSpec{bytes, BufferUsage::eTransferDst | BufferUsage::eTransferSrc | BufferUsage::eStorageBuffer,
                      families_of(device_->device(), way == WayBack::transfer_queue)}}),
          submission_(device_->device(), on_queue(way == WayBack::transfer_queue)) {
        if (way == WayBack::mapped) check_mapped(device_->device());
        if (way == WayBack::uncached) check_uncached(device_->device());
        if (way != WayBack::mapped)
            landed_.emplace(device_->device(), landing(way), std::array{BufferSpec{bytes, BufferUsage::eTransferDst}});
        fill();
    }

    [[nodiscard]] ClockReadings run() override {
        const double start = steady_seconds();
        SubmissionTimes times;
        if (landed_) {
            submission_.add({}, [this](const vk::raii::CommandBuffer& commands) {
                commands.copyBuffer(source_[0], (*landed_)[0], vk::BufferCopy(0, 0, bytes()));
                barrier(commands, transfer_write, host_read);
            });
            times = submission_.run();
        }
        if (way_ != WayBack::copied_alone) read();
        return readings_of(times, steady_seconds() - start);
    }

    [[nodiscard]] std::optional<ArmOutput> output() override {
        std::ranges::fill(words_, 0);
        (void)run();
        if (way_ == WayBack::copied_alone) read();
        return ArmOutput{digest_of_words(words_), nullptr};
    }

private:
    [[nodiscard]] std::uint64_t bytes() const { return words_.size() * sizeof words_[0]; }
    void read() { std::memcpy(words_.data(), landed_ ? landed_->mapped(0) : source_.mapped(0), bytes()); }

    void fill() const {
        const std::vector<std::uint64_t> words = words_of(bytes());
        const BufferGroup staging(
            device_->device(), MemoryDomain::upload, std::array{BufferSpec{bytes(), BufferUsage::eTransferSrc}});
        std::memcpy(staging.mapped(0), words.data(), bytes());
        Submission send(device_->device(), {});
        send.add({}, [&](const vk::raii::CommandBuffer& commands) {
            commands.copyBuffer(staging[0], source_[0], vk::BufferCopy(0, 0, bytes()));
            barrier(commands, transfer_write, host_read);
        });
        (void)send.run();
    }

    SharedDevice device_;
    WayBack way_;
    std::vector<std::uint64_t> words_;
    BufferGroup source_;
    std::optional<BufferGroup> landed_;
    Submission submission_;
};

std::string size_text(std::uint64_t bytes) {
    return bytes >= 1u << 20 ? fmt::format("{} MiB", bytes >> 20) : fmt::format("{} KiB", bytes >> 10);
}

// 4 KiB to `most`.
std::vector<Workload> sizes_to(std::uint64_t most) {
    std::vector<Workload> sizes;
    for (std::uint64_t bytes = 4096; bytes <= most; bytes *= 16)
        sizes.push_back({size_text(bytes), {{"bytes", static_cast<double>(bytes)}}});
    return sizes;
}

// To what shows the bandwidth.
std::vector<Workload> transfer_sizes(const SharedDevice& device) {
    const bool on_cpu = device->device().description().type == DeviceType::cpu;
    return sizes_to(on_cpu ? std::uint64_t{16} << 20 : std::uint64_t{256} << 20);
}

std::vector<Arm> readback_arms(const SharedDevice& device, const Workload& workload) {
    const auto bytes = static_cast<std::uint64_t>(workload.factors.at("bytes"));
    const auto arm = [&](const char* name, const char* text, WayBack way) {
        return Arm{name, text, [=] { return std::make_unique<ReadbackRun>(device, bytes, way); }};
    };
    return {arm("cached", "copied on the rendering queue to cached memory of the host, read there", WayBack::cached),
        arm("copy-alone", "the same, but not read: the copy alone", WayBack::copied_alone),
        arm("uncached", "copied to memory of the host that is not cached, read there", WayBack::uncached),
        arm("transfer-queue", "copied to cached memory on a queue for transfers alone", WayBack::transfer_queue),
        arm("mapped", "read by the host in memory of the device", WayBack::mapped)};
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

Family readback_family(const SharedDevice& device) {
    Family family;
    family.name = "readback";
    family.question = "How should bytes of the device get to the host?";
    family.hypothesis = "By a copy to cached memory; to read what is not cached is slow";
    family.source = "Vulkan's memory properties (HOST_CACHED); vendors' advice";
    family.held = "the bytes, one copy command, one wait, one read into memory of the program";
    family.base =
        "the bytes copied by one command to the host's cached memory, and read from there. The total lasts from before "
        "the command is recorded to the end of the read";
    family.along = "bytes";
    family.workloads = sizes_to(std::uint64_t{16} << 20);  // reads of mapped memory may take a second beyond that
    family.arms = [device](const Workload& workload) { return readback_arms(device, workload); };
    return family;
}

}  // namespace tandem
