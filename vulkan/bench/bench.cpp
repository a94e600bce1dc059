#include "vulkan/bench/bench.h"

#include "vulkan/bench/device_facts.h"
#include "vulkan/bench/families.h"

namespace tandem {

namespace {

class VulkanThesisJob : public ThesisJob {
public:
    VulkanThesisJob(SharedDevice device, const ThesisSetup& setup) : device_(std::move(device)) {
        JobPatterns patterns;
        patterns.vulkan.memory = setup.cohesive ? MemoryLayout::per_set : MemoryLayout::per_buffer;
        patterns.vulkan.recording_threads = setup.threads;
        job_ = device_->job({setup.width, setup.height}, setup.bounces, patterns);
    }

    [[nodiscard]] double frame(std::uint32_t samples, bool fresh) override {
        const double start = steady_seconds();
        (void)job_->frame(samples, fresh);
        return steady_seconds() - start;
    }

private:
    SharedDevice device_;
    std::unique_ptr<VulkanJob> job_;
};

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

}  // namespace

std::vector<Family> all_families(const SharedDevice& device, const MakeShowPlace& make_window) {
    return {memory_family(device), fresh_memory_family(device), submission_family(device), waiting_family(device),
        recording_family(device), threads_family(device), barriers_family(device), parameters_family(device),
        descriptors_family(device), queues_family(device), frames_family(device), transfers_family(device),
        transfers_beside_family(device), pipelines_family(device), kernels_family(device), workgroups_family(device),
        megakernel_family(device), candidates_family(device), images_family(device),
        presentation_family(device, make_window)};
}

BenchTarget vulkan_bench(const BenchRequest& request, const MakeShowPlace& make_window) {
    const auto device = std::make_shared<BenchDevice>(request);
    BenchTarget target;
    target.device = facts_of(device->device());
    target.families = all_families(device, make_window);
    target.self_test = self_test_family(device);
    target.self_test_seconds = self_test_busy_seconds;
    target.claims = pattern_claims();
    target.empty_submissions = [device](std::size_t count) { return time_empty_submissions(device->device(), count); };
    target.thesis_job = [device](const ThesisSetup& setup) -> std::unique_ptr<ThesisJob> {
        return std::make_unique<VulkanThesisJob>(device, setup);
    };
    return target;
}

}  // namespace tandem
