// How a frame ends in an image: what writes it, what moves it, and when its layout changes.
#include "vulkan/bench/families.h"
#include "vulkan/bench/frame_image.h"

namespace tandem {

namespace {

using Usage = vk::ImageUsageFlagBits;

struct Ending {
    const char *name, *text;
    ImagePattern pattern;
    bool keeps_first = false;  // the commands before the samples are recorded once
};

std::vector<Ending> endings() {
    const auto with = [](ImagePattern pattern, const auto& change) {
        change(pattern);
        return pattern;
    };
    const ImagePattern blit;
    const ImagePattern direct = with(blit, [](ImagePattern& p) { p.move = ImageMove::none; });
    const auto written_by = [&](ImageWriter writer) {
        return with(direct, [&](ImagePattern& p) { p.writer = writer; });
    };
    const auto first = with(blit, [](ImagePattern& p) { p.transition_first = true; });
    return {{"blit", "a kernel stores to an image of its own, whose layout changes after the samples; a blit", blit},
        {"copy", "the same, copied", with(blit, [](ImagePattern& p) { p.move = ImageMove::copy; })},
        {"linear", "the same as blit, its own image of linear tiling",
            with(blit, [](ImagePattern& p) { p.tiling = vk::ImageTiling::eLinear; })},
        {"direct", "a kernel stores to the image that is shown", direct},
        {"buffer", "a kernel packs pixels into a buffer, which is copied",
            with(blit,
                [](ImagePattern& p) {
                    p.writer = ImageWriter::packer;
                    p.move = ImageMove::copy;
                })},
        {"transition-first", "blit, but the layout changes before the samples (the thesis's pre-processing)", first},
        {"first-recorded-once", "the same, and that command buffer is recorded once", first, true},
        {"attachment", "fragments of a full-screen pass, nothing loaded", written_by(ImageWriter::pass)},
        {"attachment-clear", "the same, cleared before",
            with(written_by(ImageWriter::pass), [](ImagePattern& p) { p.load = vk::AttachmentLoadOp::eClear; })},
        {"attachment-load", "the same, loaded before",
            with(written_by(ImageWriter::pass), [](ImagePattern& p) { p.load = vk::AttachmentLoadOp::eLoad; })},
        {"sub-passes", "means in floats by one sub-pass, not stored; encoded by the next from its input attachment",
            written_by(ImageWriter::sub_passes)},
        {"sub-passes-stored", "the same, and the means are stored",
            with(
                written_by(ImageWriter::sub_passes), [](ImagePattern& p) { p.store = vk::AttachmentStoreOp::eStore; })},
        {"two-passes", "the same by two render passes", written_by(ImageWriter::two_passes)}};
}

// Stands for a swapchain's image where nothing is presented.
ShownImages shown_images(const DeviceImage& image) {
    return {{{image.handle(), image.view()}}, image.spec().format, image.spec().size, copied_from};
}

class ImageRun : public ArmRun {
public:
    ImageRun(SharedDevice device, const RenderWork& work, const Ending& ending)
        : device_(std::move(device)),
          keeps_first_(ending.keeps_first),
          samples_(work.samples),
          image_(device_->device(), {.size = {work.size.width, work.size.height},
                                        .usage = shown_usage(ending.pattern) | Usage::eTransferSrc}),
          job_(device_->job(work.size, work.bounces, {}, summed_in_pairs)),
          shown_(shown_images(image_)),
          frame_image_(device_->device(), ending.pattern, shown_, {job_->sums(0), job_->sums(1)}, samples_),
          host_times_(device_) {
        if (ending.pattern.transition_first) has_first_ = true;
        if (ending.pattern.load != vk::AttachmentLoadOp::eLoad) return;
        job_->submission().add({shown_recording, 2}, [this](const vk::raii::CommandBuffer& commands) {
            transition(commands, image_.handle(), unused_image, shown_.left);
        });
        (void)job_->submission().run();
    }

    [[nodiscard]] ClockReadings run() override {
        const double start = steady_seconds();
        add_frame();
        job_->submit_frame();
        const SubmissionTimes times = job_->finish_frame();
        ClockReadings readings = readings_of(times, steady_seconds() - start);
        host_times_.add_to(readings, times);
        return readings;
    }

    [[nodiscard]] std::optional<ArmOutput> output() override {
        const FetchedImage fetched(device_->device(), shown_);
        add_frame();
        job_->submission().add(
            {shown_recording, 3}, [&](const vk::raii::CommandBuffer& commands) { fetched.record(commands, 0); });
        job_->submit_frame();
        (void)job_->finish_frame();
        return ArmOutput{digest_of(fetched.pixels()), nullptr};
    }

private:
    void add_frame() {
        Submission& submission = job_->submission();
        const auto first = [this](const vk::raii::CommandBuffer& commands) { frame_image_.record_first(commands); };
        if (has_first_ && keeps_first_) submission.add_kept_first({shown_recording, 0}, first);
        if (has_first_ && !keeps_first_) submission.add({shown_recording, 0}, first);
        job_->add_frame(samples_);
        const std::uint32_t place = job_->sums_place();
        submission.add({shown_recording, 1, place},
            [this, place](const vk::raii::CommandBuffer& commands) { frame_image_.record_last(commands, place, 0); });
    }

    SharedDevice device_;
    bool has_first_ = false, keeps_first_;
    std::uint32_t samples_;
    DeviceImage image_;
    std::unique_ptr<VulkanJob> job_;
    ShownImages shown_;
    FrameImage frame_image_;
    HostTimes host_times_;
};

}  // namespace

Family images_family(const SharedDevice& device) {
    Family family;
    family.name = "images";
    family.question = "How should a frame end in an image?";
    family.hypothesis =
        "Kernels that store to the image that is shown save a copy; when the layout changes does not matter";
    family.source = "Ferreira 2019 (future work)";
    family.held = "the samples of a frame, their sums, the pixels of the image, one submission, one recording thread";
    family.base =
        "a frame of the six stages as a wavefront, in one submission, with a fence. A kernel stores its sums to an "
        "image, which is blitted to the one that is shown. Its total lasts from before recording to the end of the "
        "wait";
    family.along = "pixels";
    for (const ImageSize& size : device->sizes()) family.workloads.push_back(workload_of({size, 1, device->bounces()}));
    family.arms = [device](const Workload& workload) {
        std::vector<Arm> arms;
        for (const Ending& ending : endings())
            arms.push_back({ending.name, ending.text,
                [=, work = work_of(workload)] { return std::make_unique<ImageRun>(device, work, ending); }});
        return arms;
    };
    return family;
}

}  // namespace tandem
