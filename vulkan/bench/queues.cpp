// Several jobs at a time: parts of an image on several queues, and several frames in flight on one.
#include <fmt/format.h>

#include "vulkan/bench/families.h"

namespace tandem {

namespace {

using Jobs = std::vector<std::unique_ptr<VulkanJob>>;

// The image of which each job renders a part.
ArmOutput image_of(Jobs& jobs) {
    std::shared_ptr<Estimate> whole;
    Estimate::Plane plane;
    std::uint64_t invalid = 0;
    for (const std::unique_ptr<VulkanJob>& job : jobs) {
        const Estimate part = job->render({0, gate_samples}, {}).estimate;
        if (!whole) whole = std::make_shared<Estimate>(part.width(), part.height());
        plane.resize(part.pixel_count() * 3);
        const Estimate::Plane totals = part.totals();
        for (std::size_t i = 0; i < totals.size(); ++i) {
            plane[i].sum += totals[i].sum;  // zero but for the part
            plane[i].sum_of_squares += totals[i].sum_of_squares;
        }
        invalid += part.invalid();
    }
    whole->add_block({0, gate_samples}, std::move(plane));
    whole->add_invalid(invalid);
    return {digest_of(*whole), whole};
}

// All parts are submitted, then all are waited for. "device" is the sum of what the parts took: more than "total" where
// queues overlap.
class PartsRun : public ArmRun {
public:
    PartsRun(SharedDevice device, const RenderWork& work, std::vector<QueueSlot> queues) : device_(std::move(device)) {
        samples_ = work.samples;
        host_times_.emplace(device_);
        for (std::uint32_t part = 0; part < queues.size(); ++part) {
            JobPatterns patterns;
            patterns.vulkan.queue = queues[part];
            patterns.tracer.part = part;
            patterns.tracer.parts = static_cast<std::uint32_t>(queues.size());
            jobs_.push_back(device_->job(work.size, work.bounces, patterns));
        }
    }

    [[nodiscard]] ClockReadings run() override {
        const double start = steady_seconds();
        for (const std::unique_ptr<VulkanJob>& job : jobs_) job->start_frame(samples_);
        SubmissionTimes times;
        std::vector<SubmissionTimes> parts;
        for (const std::unique_ptr<VulkanJob>& job : jobs_) {
            parts.push_back(job->finish_frame());
            times.add(parts.back());
        }
        ClockReadings readings = readings_of(times, steady_seconds() - start);
        host_times_->add_to(readings, parts);
        return readings;
    }
    [[nodiscard]] std::optional<ArmOutput> output() override { return image_of(jobs_); }

private:
    SharedDevice device_;
    std::uint32_t samples_ = 1;
    Jobs jobs_;
    std::optional<HostTimes> host_times_;
};

// A row of frames, each by the next of so many jobs in turn. A frame begins when the job that it takes is free.
class FlightRun : public ArmRun {
public:
    static constexpr std::size_t frames = 6;

    FlightRun(SharedDevice device, const RenderWork& work, std::size_t in_flight)
        : device_(std::move(device)), samples_(work.samples) {
        for (std::size_t i = 0; i < in_flight; ++i) jobs_.push_back(device_->job(work.size, work.bounces, {}));
    }

    [[nodiscard]] ClockReadings run() override {
        const double start = steady_seconds();
        SubmissionTimes times;
        for (std::size_t frame = 0; frame < frames; ++frame) {
            VulkanJob& job = *jobs_[frame % jobs_.size()];
            if (frame >= jobs_.size()) times.add(job.finish_frame());
            job.start_frame(samples_);
        }
        for (std::size_t frame = frames; frame < frames + std::min(frames, jobs_.size()); ++frame)
            times.add(jobs_[frame % jobs_.size()]->finish_frame());
        return readings_of(times, steady_seconds() - start);
    }
    [[nodiscard]] std::optional<ArmOutput> output() override {
        Jobs one;
        one.push_back(std::move(jobs_.front()));
        ArmOutput image = image_of(one);
        jobs_.front() = std::move(one.front());
        return image;
    }

private:
    SharedDevice device_;
    std::uint32_t samples_;
    Jobs jobs_;
};

Arm parts_arm(const SharedDevice& device, const Workload& workload, std::string name, std::string text,
    std::vector<QueueSlot> queues) {
    return {std::move(name), std::move(text),
        [=, work = work_of(workload)] { return std::make_unique<PartsRun>(device, work, queues); }};
}

std::vector<QueueSlot> slots(QueueKind kind, std::uint32_t count, bool all_first) {
    std::vector<QueueSlot> list;
    for (std::uint32_t i = 0; i < count; ++i) list.push_back({kind, all_first ? 0 : i});
    return list;
}

}  // namespace

Family queues_family(const SharedDevice& device) {
    Family family;
    family.name = "queues";
    family.question = "Should parts of an image go to several queues?";
    family.hypothesis = "Several queues keep the device busy where one leaves gaps: small images gain";
    family.source = "Ferreira 2019 (future work); users disagree";
    family.held = "the work of a frame, six stages; a part of the image is a job of its own, recorded by one thread";
    family.base = plain_frame;
    family.along = "pixels";
    for (const ImageSize& size : device->sizes()) family.workloads.push_back(workload_of({size, 4, device->bounces()}));
    family.arms = [device](const Workload& workload) {
        std::vector<Arm> arms{parts_arm(device, workload, "one-queue", "the whole image on one queue", {{}})};
        for (const std::uint32_t count : {2u, 4u, 8u}) {
            arms.push_back(parts_arm(device, workload, fmt::format("{}-parts", count),
                fmt::format("{} parts of the image, all on one queue", count),
                slots(QueueKind::rendering, count, true)));
            arms.push_back(parts_arm(device, workload, fmt::format("{}-queues", count),
                fmt::format("{} parts of the image, each on a queue of its own of one family", count),
                slots(QueueKind::rendering, count, false)));
        }
        arms.push_back(parts_arm(device, workload, "compute-queue", "the whole image on a queue without graphics",
            {{QueueKind::compute_only, 0}}));
        arms.push_back(
            parts_arm(device, workload, "both-kinds", "half of the image on a queue with graphics, half on one without",
                {{QueueKind::rendering, 0}, {QueueKind::compute_only, 0}}));
        return arms;
    };
    return family;
}

Family frames_family(const SharedDevice& device) {
    Family family;
    family.name = "frames-in-flight";
    family.question = "How many frames should be in flight?";
    family.hypothesis = "Two hide recording and waiting behind the device's work; three add nothing";
    family.source = "Vulkan Tutorial; vendors' advice";
    family.held = fmt::format(
        "{} frames of one sample in a row, each job with its own buffers; one queue, one thread", FlightRun::frames);
    family.base = fmt::format("{} frames in a row, one in flight, each: {}", FlightRun::frames, plain_frame);
    family.along = "pixels";
    for (const ImageSize& size : device->sizes()) family.workloads.push_back(workload_of({size, 1, device->bounces()}));
    family.arms = [device](const Workload& workload) {
        std::vector<Arm> arms;
        for (const std::size_t count : {1u, 2u, 3u})
            arms.push_back(
                {fmt::format("{}-in-flight", count), fmt::format("{} frame{} in flight", count, count == 1 ? "" : "s"),
                    [=, work = work_of(workload)] { return std::make_unique<FlightRun>(device, work, count); }});
        return arms;
    };
    return family;
}

}  // namespace tandem
