#include "vulkan/bench/own_arms/own_arms.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <span>

#include "common/error.h"
#include "vulkan/bench/bench_device.h"
#include "vulkan/bench/device_facts.h"
#include "vulkan/bench/own_arms/arm_library.h"

namespace tandem {

namespace {

// The library and the device that its arms work on.
class OwnDevice {
public:
    explicit OwnDevice(const BenchRequest& request)
        : library_(request.arm_library, request.entering),
          instance_(validation_wanted(request.validation)),
          device_(instance_, request.device, Queues::one, extensions_of(library_.told())) {}

    [[nodiscard]] const ArmLibrary& library() const { return library_; }
    [[nodiscard]] const Device& device() const { return device_; }
    [[nodiscard]] TandemDevice handles() const {
        return {*instance_.handle(), *device_.physical(), *device_.handle(), *device_.queue(), device_.queue_family()};
    }
    void raise_messages() const { instance_.log().raise(); }

private:
    static std::vector<const char*> extensions_of(const TandemArmLibrary& told) {
        const std::span extensions(told.extensions, told.extension_count);
        return {extensions.begin(), extensions.end()};
    }

    ArmLibrary library_;
    Instance instance_;
    Device device_;
};
using SharedOwnDevice = std::shared_ptr<const OwnDevice>;

// What make() of an arm set, freed with this object.
class OwnState {
public:
    OwnState(SharedOwnDevice device, const TandemArm& arm, double work)
        : device_(std::move(device)), handles_(device_->handles()), arm_(arm) {
        try {
            call("make", [&] { return arm_.make(&handles_, work, &state_); });
        } catch (...) {
            destroy();
            throw;
        }
    }
    ~OwnState() { destroy(); }
    OwnState(const OwnState&) = delete;
    OwnState& operator=(const OwnState&) = delete;

    [[nodiscard]] void* get() const { return state_; }
    template <class Function>
    void call(const char* name, Function function) const {
        device_->library().call(arm_, name, function);
    }

private:
    void destroy() {
        if (state_ == nullptr || arm_.destroy == nullptr) return;
        (void)device_->library().tell(arm_, "destroy", [&] {
            arm_.destroy(state_);
            return static_cast<const char*>(nullptr);
        });
    }

    SharedOwnDevice device_;
    TandemDevice handles_;
    const TandemArm& arm_;
    void* state_ = nullptr;
};

// The bytes that the first arm gave at one amount of work.
struct FirstResult {
    std::string arm;
    std::vector<std::byte> bytes;
};

std::uint64_t digest_of(std::span<const std::byte> bytes) {
    std::uint64_t digest = 0xcbf29ce484222325u;
    for (const std::byte byte : bytes) digest = (digest ^ std::to_integer<std::uint64_t>(byte)) * 0x100000001b3u;
    return digest;
}

class OwnRun : public ArmRun {
public:
    OwnRun(SharedOwnDevice device, const TandemArm& arm, double work, std::shared_ptr<FirstResult> first)
        : device_(std::move(device)),
          arm_(arm),
          first_(std::move(first)),
          state_(device_, arm, work),
          submission_(device_->device(), {}) {
        for (std::uint32_t i = 0; i < device_->library().told().warm_up_runs; ++i) (void)run();
        device_->raise_messages();
    }

    [[nodiscard]] ClockReadings run() override {
        try {
            ClockReadings readings = arm_.record != nullptr ? run_recorded() : run_submitted();
            device_->raise_messages();
            return readings;
        } catch (const vk::SystemError& failure) {
            throw Error(fmt::format("{}: {}: Vulkan says {}", device_->library().file(), arm_.name, failure.what()));
        }
    }

    // Throws DifferentResults where the bytes are not the first arm's.
    [[nodiscard]] std::optional<ArmOutput> output() override {
        if (arm_.result == nullptr) return std::nullopt;
        (void)run();
        const void* data = nullptr;
        std::size_t size = 0;
        state_.call("result", [&] { return arm_.result(state_.get(), &data, &size); });
        const std::span bytes(static_cast<const std::byte*>(data), data == nullptr ? 0 : size);
        if (first_->arm.empty())
            *first_ = {arm_.name, {bytes.begin(), bytes.end()}};
        else if (!std::ranges::equal(bytes, first_->bytes))
            throw DifferentResults(difference(bytes));
        return ArmOutput{digest_of(bytes), nullptr};
    }

private:
    [[nodiscard]] ClockReadings run_recorded() {
        const char* failure = nullptr;
        submission_.add({}, [&](const vk::raii::CommandBuffer& commands) {
            failure = device_->library().tell(arm_, "record", [&] { return arm_.record(state_.get(), *commands); });
        });
        const double start = steady_seconds();
        const SubmissionTimes times = submission_.run();
        const double end = steady_seconds();
        state_.call("record", [&] { return failure; });
        return readings_of(times, end - start);
    }

    [[nodiscard]] ClockReadings run_submitted() {
        const double start = steady_seconds();
        state_.call("run", [&] { return arm_.run(state_.get()); });
        return {{"total", steady_seconds() - start}};
    }

    [[nodiscard]] std::string difference(std::span<const std::byte> bytes) const {
        const std::string who =
            fmt::format("{}: {}: its result is not that of {}: ", device_->library().file(), arm_.name, first_->arm);
        if (bytes.size() != first_->bytes.size())
            return who + fmt::format("{} bytes, not {}", bytes.size(), first_->bytes.size());
        const auto at = std::ranges::mismatch(bytes, first_->bytes).in1 - bytes.begin();
        return who + fmt::format("byte {} of {} is the first that differs", at, bytes.size());
    }

    SharedOwnDevice device_;
    const TandemArm& arm_;
    std::shared_ptr<FirstResult> first_;
    OwnState state_;
    Submission submission_;
};

std::string text_of(const char* text, const char* otherwise) { return text == nullptr ? otherwise : text; }

std::vector<Arm> arms_at(const SharedOwnDevice& device, double work) {
    const TandemArmLibrary& told = device->library().told();
    const auto first = std::make_shared<FirstResult>();
    std::vector<Arm> arms;
    for (const TandemArm& arm : std::span(told.arms, told.arm_count))
        arms.push_back({arm.name, text_of(arm.text, ""), [=, &arm]() -> std::unique_ptr<ArmRun> {
                            const TandemDevice handles = device->handles();
                            const char* reason =
                                arm.unsupported == nullptr ? nullptr : device->library().tell(arm, "unsupported", [&] {
                                    return arm.unsupported(&handles);
                                });
                            if (reason != nullptr) throw UnsupportedError(reason);
                            return std::make_unique<OwnRun>(device, arm, work, first);
                        }});
    return arms;
}

Family family_of(const SharedOwnDevice& device) {
    const TandemArmLibrary& told = device->library().told();
    Family family;
    family.name = told.name;
    family.question = text_of(told.question, "Which arm is faster?");
    family.hypothesis = "none";
    family.source = std::filesystem::path(device->library().file()).filename().string();
    family.held = text_of(told.held, "not said");
    family.base =
        "the library's first arm: what record() records, in one submission, with a fence, or what run() does. Its "
        "total lasts from before the call to the end of the wait";
    family.along = told.unit;
    for (const double work : std::span(told.work, told.work_count))
        family.workloads.push_back({fmt::format("{:.15g} {}", work, told.unit), {{told.unit, work}}});
    family.arms = [device, unit = family.along](
                      const Workload& workload) { return arms_at(device, workload.factors.at(unit)); };
    return family;
}

}  // namespace

BenchTarget own_arms_bench(const BenchRequest& request) {
    const auto device = std::make_shared<const OwnDevice>(request);
    BenchTarget target;
    target.device = facts_of(device->device());
    target.device["arm_library_hash"] = device->library().hash();
    target.families = {family_of(device)};
    target.empty_submissions = [device](std::size_t count) { return time_empty_submissions(device->device(), count); };
    return target;
}

}  // namespace tandem
