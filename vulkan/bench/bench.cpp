#include "vulkan/bench/bench.h"

#include "common/error.h"
#include "vulkan/bench/device_facts.h"
#include "vulkan/bench/families.h"
#include "vulkan/bench/own_arms/own_arms.h"
#include "vulkan/bench/thesis_window.h"

namespace tandem {

namespace {

class VulkanThesisJob : public ThesisJob {
public:
    // `presentation`: where frames go; null: to an image of the job's own.
    VulkanThesisJob(SharedDevice device, std::shared_ptr<ThesisWindow> presentation, const ThesisSetup& setup)
        : device_(std::move(device)), presentation_(std::move(presentation)) {
        JobPatterns patterns = thesis_frame_patterns();
        patterns.vulkan.memory = setup.cohesive ? MemoryLayout::per_set : MemoryLayout::per_buffer;
        patterns.vulkan.recording_threads = setup.threads;
        job_ = device_->job({setup.width, setup.height}, setup.bounces, patterns);
    }

    [[nodiscard]] std::string frame_text() const override {
        const std::string text =
            "pre-processing, a recording a sample and post-processing (n + 2), each stage over the whole image. Scene, "
            "Camera and Settings are host-visible, Rays device-local. The mean is written to ";
        return text + (presentation_ ? "the window's image (" + presentation_->text() + ")"
                                     : std::string("a storage image (R8G8B8A8) that is not shown"));
    }
    [[nodiscard]] std::string clock_text() const override {
        return presentation_
                   ? "from before the image is acquired to the end of the wait for the frame's fence; recording, "
                     "submission and the request to present lie between"
                   : "from the call, which records, to the end of the wait for the frame's fence";
    }

    [[nodiscard]] double frame(std::uint32_t samples, bool fresh) override {
        if (presentation_) presentation_->poll();
        const double start = steady_seconds();
        if (presentation_) job_->show_in(presentation_->acquire());
        job_->start_frame(samples, fresh);
        if (presentation_) presentation_->present();
        (void)job_->finish_frame();
        return steady_seconds() - start;
    }

private:
    SharedDevice device_;
    std::shared_ptr<ThesisWindow> presentation_;
    std::unique_ptr<VulkanJob> job_;
};

// Jobs of the thesis's experiment, and the window that they share, opened when it is first asked for.
class ThesisJobs {
public:
    ThesisJobs(SharedDevice device, BenchRequest request, MakeShowPlace make_window)
        : device_(std::move(device)), request_(std::move(request)), make_window_(std::move(make_window)) {}

    [[nodiscard]] std::string no_presentation(const ThesisSetup& setup) {
        try {
            (void)presentation(setup);
        } catch (const DeviceError& reason) {
            return reason.what();
        } catch (const UnsupportedError& reason) {
            return reason.what();
        }
        return {};
    }

    [[nodiscard]] std::unique_ptr<ThesisJob> make(const ThesisSetup& setup) {
        if (!setup.presented) return std::make_unique<VulkanThesisJob>(device_, nullptr, setup);
        const std::shared_ptr<ThesisWindow>& shown = presentation(setup);
        return std::make_unique<VulkanThesisJob>(shown->device(), shown, setup);
    }

private:
    [[nodiscard]] const std::shared_ptr<ThesisWindow>& presentation(const ThesisSetup& setup) {
        if (!presentation_)
            presentation_ =
                std::make_shared<ThesisWindow>(request_, make_window_, ImageSize{setup.width, setup.height});
        return presentation_;
    }

    SharedDevice device_;
    BenchRequest request_;
    MakeShowPlace make_window_;
    std::shared_ptr<ThesisWindow> presentation_;
};

}  // namespace

std::vector<Family> all_families(const SharedDevice& device, const MakeShowPlace& make_window) {
    return {memory_family(device), fresh_memory_family(device), submission_family(device), waiting_family(device),
        recording_family(device), threads_family(device), barriers_family(device), parameters_family(device),
        descriptors_family(device), queues_family(device), frames_family(device), transfers_family(device),
        transfers_beside_family(device), readback_family(device), pipelines_family(device), kernels_family(device),
        thesis_steps_family(device), workgroups_family(device), megakernel_family(device), candidates_family(device),
        images_family(device), presentation_family(device, make_window)};
}

BenchTarget vulkan_bench(const BenchRequest& request, const MakeShowPlace& make_window) {
    if (!request.arm_library.empty()) return own_arms_bench(request);
    const auto device = std::make_shared<BenchDevice>(request);
    BenchTarget target;
    target.device = facts_of(device->device());
    target.families = all_families(device, make_window);
    target.self_test = self_test_family(device);
    target.self_test_seconds = self_test_busy_seconds;
    target.claims = pattern_claims();
    target.empty_submissions = [device](std::size_t count) { return time_empty_submissions(device->device(), count); };
    const auto thesis = std::make_shared<ThesisJobs>(device, request, make_window);
    target.no_presentation = [thesis](const ThesisSetup& setup) { return thesis->no_presentation(setup); };
    target.thesis_job = [thesis](const ThesisSetup& setup) { return thesis->make(setup); };
    return target;
}

}  // namespace tandem
