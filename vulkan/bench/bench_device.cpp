#include "vulkan/bench/bench_device.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "common/error.h"

namespace tandem {

namespace {

std::vector<ImageSize> sizes_for(const BenchRequest& request, const Device& device) {
    if (!request.sizes.empty()) {
        std::vector<ImageSize> sizes;
        for (const auto& [width, height] : request.sizes) sizes.push_back({width, height});
        return sizes;
    }
    if (device.description().type == DeviceType::cpu) return {{32, 18}, {64, 36}, {128, 72}};
    return {{128, 72}, {480, 270}, {1920, 1080}};
}

class RenderRun : public ArmRun {
public:
    RenderRun(SharedDevice device, const RenderWork& work, const JobPatterns& patterns, const Tuning& tuning)
        : device_(std::move(device)),
          work_(work),
          job_(device_->job(work.size, work.bounces, patterns, tuning)),
          host_times_(device_) {}

    [[nodiscard]] ClockReadings run() override {
        const double start = steady_seconds();
        const SubmissionTimes times = job_->frame(work_.samples);
        ClockReadings readings = readings_of(times, steady_seconds() - start);
        host_times_.add_to(readings, times);
        return readings;
    }

    [[nodiscard]] std::optional<ArmOutput> output() override {
        auto estimate = std::make_shared<const Estimate>(job_->render({0, gate_samples}, {}).estimate);
        return ArmOutput{digest_of(*estimate), std::move(estimate)};
    }

private:
    SharedDevice device_;
    RenderWork work_;
    std::unique_ptr<VulkanJob> job_;
    HostTimes host_times_;
};

class FunctionRun : public ArmRun {
public:
    explicit FunctionRun(std::function<ClockReadings()> run) : run_(std::move(run)) {}
    [[nodiscard]] ClockReadings run() override { return run_(); }

private:
    std::function<ClockReadings()> run_;
};

std::optional<DeviceClock> clock_of(const Device& device) {
    try {
        return DeviceClock(device);
    } catch (const UnsupportedError&) {
        return std::nullopt;
    }
}

}  // namespace

BenchDevice::BenchDevice(const BenchRequest& request, const std::vector<const char*>& instance_extensions,
    const std::vector<const char*>& device_extensions)
    : request_(request),
      instance_(validation_wanted(false), instance_extensions),
      device_(instance_, request.device, Queues::all, device_extensions),
      clock_(clock_of(device_)),
      stages_(device_),
      sizes_(sizes_for(request, device_)) {}

std::unique_ptr<VulkanJob> BenchDevice::job(
    ImageSize size, std::uint32_t bounces, const JobPatterns& patterns, const Tuning& tuning) {
    RenderSettings settings = default_settings(request_.scene);
    settings.width = size.width;
    settings.height = size.height;
    settings.bounces = bounces;
    settings.roulette_start = no_roulette;
    if (tuning) tuning(settings);
    return std::make_unique<VulkanJob>(
        instance_, device_, stages_, request_.scene, settings, Acceleration::automatic, PlantedBug::none, patterns);
}

const Specialisation& BenchDevice::specialisation() {
    if (!specialisation_) specialisation_ = job(sizes_.front(), bounces(), {})->specialisation();
    return *specialisation_;
}

JobPatterns thesis_frame_patterns() {
    JobPatterns patterns;
    patterns.tracer.kernel = KernelShape::thesis;
    patterns.vulkan.scene = BufferPlacement::host_visible;
    patterns.vulkan.parameters = ParameterPattern::uniform;
    return patterns;
}

Workload workload_of(const RenderWork& work) {
    return {fmt::format("{}x{}, {} sample{}, {} bounces", work.size.width, work.size.height, work.samples,
                work.samples == 1 ? "" : "s", work.bounces),
        {{"pixels", work.size.pixels()}, {"width", work.size.width}, {"samples", work.samples},
            {"bounces", work.bounces}}};
}

RenderWork work_of(const Workload& workload) {
    const auto factor = [&](const char* name) { return static_cast<std::uint32_t>(workload.factors.at(name)); };
    const std::uint32_t width = factor("width");
    return {{width, factor("pixels") / width}, factor("samples"), factor("bounces")};
}

Arm render_arm(const SharedDevice& device, const Workload& workload, std::string name, std::string text,
    const JobPatterns& patterns) {
    return tuned_arm(device, workload, std::move(name), std::move(text), patterns, {});
}

Arm tuned_arm(const SharedDevice& device, const Workload& workload, std::string name, std::string text,
    const JobPatterns& patterns, const Tuning& tuning) {
    return {std::move(name), std::move(text),
        [=, work = work_of(workload)] { return std::make_unique<RenderRun>(device, work, patterns, tuning); }};
}

ClockReadings readings_of(const SubmissionTimes& times, double total) {
    ClockReadings readings{{"total", total}, {"record", times.record}, {"record-cpu", times.record_cpu},
        {"submit", times.submit}, {"wait", times.wait}};
    if (times.device) readings["device"] = *times.device;
    return readings;
}

HostTimes::HostTimes(const SharedDevice& device) : device_(device) {
    if (device_->clock()) last_ = device_->clock()->now();
}

void HostTimes::add_to(ClockReadings& readings, const SubmissionTimes& times) {
    if (!last_ || !times.moments) return;
    const ClockPair before = *last_, after = device_->clock()->now();
    const SubmissionTimes::Moments& at = *times.moments;
    readings["submit-to-start"] = host_seconds(before, after, at.first_stamp, at.stamp_bits) - at.submitted;
    readings["end-to-known"] = at.known - host_seconds(before, after, at.last_stamp, at.stamp_bits);
    readings["clock-deviation"] = std::max(before.deviation, after.deviation);
    last_ = after;
}

void HostTimes::add_to(ClockReadings& readings, const std::vector<SubmissionTimes>& times) {
    const auto has_moments = [](const SubmissionTimes& one) { return one.moments.has_value(); };
    if (!last_ || !std::ranges::all_of(times, has_moments)) return;
    const ClockPair before = *last_, after = device_->clock()->now();
    std::vector<std::pair<double, double>> spans;
    for (const SubmissionTimes& one : times)
        spans.emplace_back(host_seconds(before, after, one.moments->first_stamp, one.moments->stamp_bits),
            host_seconds(before, after, one.moments->last_stamp, one.moments->stamp_bits));
    readings["overlap"] = overlap_of(std::move(spans));
    readings["clock-deviation"] = std::max(before.deviation, after.deviation);
    last_ = after;
}

double overlap_of(std::vector<std::pair<double, double>> spans) {
    std::ranges::sort(spans);
    double overlap = 0.0, end = -std::numeric_limits<double>::infinity();
    for (const auto& [first, last] : spans) {
        overlap += std::max(0.0, std::min(end, last) - first);
        end = std::max(end, last);
    }
    return overlap;
}

std::vector<double> time_empty_submissions(const Device& device, std::size_t count) {
    Submission submission(device, {});
    std::vector<double> seconds;
    for (std::size_t i = 0; i < count; ++i) {
        submission.add({}, [](const vk::raii::CommandBuffer&) {});
        const SubmissionTimes times = submission.run();
        seconds.push_back(times.submit + times.wait);
    }
    return seconds;
}

std::unique_ptr<ArmRun> run_of(std::function<ClockReadings()> run) {
    return std::make_unique<FunctionRun>(std::move(run));
}

}  // namespace tandem
