#include "vulkan/bench/presentation.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <thread>

#include "common/error.h"
#include "vulkan/bench/families.h"
#include "vulkan/bench/frame_image.h"

namespace tandem {

// What the arms vary.
struct Showing {
    std::optional<PresentMode> mode;  // none: the one that waits for no refresh, of those that there are
    std::uint32_t images = 0;         // of the swapchain; 0: one more than the surface keeps
    std::uint32_t in_flight = 2;
    WaitPattern wait = WaitPattern::fence;
    bool acquires_by_fence = false;  // the host waits for an image, not the device
    bool waits_for_present = false;  // the host begins a frame when the one before is shown
    ImagePattern pattern;
};

namespace {

constexpr std::uint64_t forever = std::numeric_limits<std::uint64_t>::max();
constexpr std::uint32_t frames_a_run = 8;

// A surface whose images nobody sees.
class HeadlessPlace : public ShowPlace {
public:
    [[nodiscard]] static bool offered() {
        const vk::raii::Context context;
        const auto extensions = context.enumerateInstanceExtensionProperties();
        return std::ranges::any_of(extensions, [](const vk::ExtensionProperties& one) {
            return one.extensionName == std::string_view(VK_EXT_HEADLESS_SURFACE_EXTENSION_NAME);
        });
    }
    [[nodiscard]] std::vector<const char*> instance_extensions() const override {
        return {VK_KHR_SURFACE_EXTENSION_NAME, VK_EXT_HEADLESS_SURFACE_EXTENSION_NAME};
    }
    [[nodiscard]] vk::raii::SurfaceKHR surface(const vk::raii::Instance& instance) const override {
        return {instance, vk::HeadlessSurfaceCreateInfoEXT()};
    }
    void resize(vk::Extent2D) override {}
    void poll() override {}
};

PresentMode mode_of(const SurfaceAbilities& abilities, const Showing& showing) {
    return showing.mode ? *showing.mode : fastest_mode(abilities);
}

void check(const PresentationStage& stage, const Showing& showing) {
    const SurfaceAbilities& abilities = stage.abilities();
    const PresentMode mode = mode_of(abilities, showing);
    if (!abilities.has(mode))
        throw UnsupportedError(
            fmt::format("the surface does not present {}", present_mode_names[static_cast<std::size_t>(mode)]));
    const Device& device = stage.device()->device();
    if (showing.waits_for_present && !device.features().present_waits)
        throw UnsupportedError(device.description().name + " has no VK_KHR_present_wait");
    const vk::ImageUsageFlags usage = shown_usage(showing.pattern);
    if ((abilities.usage() & usage) != usage)
        throw UnsupportedError("the surface's images have no " + vk::to_string(usage));
    const vk::FormatProperties has = device.physical().getFormatProperties(abilities.format().format);
    if (usage & vk::ImageUsageFlagBits::eStorage &&
        !(has.optimalTilingFeatures & vk::FormatFeatureFlagBits::eStorageImage))
        throw UnsupportedError(
            "kernels cannot store to the surface's format, " + vk::to_string(abilities.format().format));
}

}  // namespace

PresentMode fastest_mode(const SurfaceAbilities& abilities) {
    for (const PresentMode mode : {PresentMode::immediate, PresentMode::mailbox})
        if (abilities.has(mode)) return mode;
    return PresentMode::fifo;
}

std::shared_ptr<ShowPlace> open_place(const MakeShowPlace& make_window, std::uint32_t width, std::uint32_t height) {
    std::string reason = "this build has no window (TANDEM_WINDOW is off)";
    try {
        if (make_window) return make_window(width, height);
    } catch (const DeviceError& failure) {
        reason = failure.what();
    }
    if (HeadlessPlace::offered()) return std::make_shared<HeadlessPlace>();
    throw UnsupportedError(reason + "; nor has Vulkan a surface without a display (VK_EXT_headless_surface)");
}

// Presents rows of frames. Its swapchain is there while it holds the surface.
class PresentRun : public ArmRun {
public:
    PresentRun(std::shared_ptr<PresentationStage> stage, const RenderWork& work, const Showing& showing)
        : stage_(std::move(stage)), work_(work), showing_(showing) {
        check(*stage_, showing);
        JobPatterns patterns;
        patterns.vulkan.wait = showing.wait;
        const SharedDevice& device = stage_->device();
        for (std::uint32_t i = 0; i < showing.in_flight; ++i) {
            Frame& frame = frames_.emplace_back();
            frame.job = device->job(work.size, work.bounces, patterns, summed_in_pairs);
            frame.acquired = vk::raii::Semaphore(device->device().handle(), vk::SemaphoreCreateInfo());
            frame.image_is_there = vk::raii::Fence(device->device().handle(), vk::FenceCreateInfo());
        }
        try {
            begin({});  // what the surface refuses is refused here
        } catch (...) {
            stage_->leave(this);
            throw;
        }
    }
    ~PresentRun() override {
        try {
            drop();
        } catch (const vk::SystemError&) {  // a lost device has nothing left to wait for
        }
        stage_->leave(this);
    }

    [[nodiscard]] ClockReadings run() override {
        if (!swapchain_) begin({});
        return present(frames_a_run, nullptr);
    }

    [[nodiscard]] std::optional<ArmOutput> output() override {
        constexpr auto readable = vk::ImageUsageFlagBits::eTransferSrc;
        if (!(stage_->abilities().usage() & readable)) return std::nullopt;
        drop();
        begin(readable);
        const FetchedImage fetched(stage_->device()->device(), shown_);
        (void)present(1, &fetched);
        drop();
        return ArmOutput{digest_of(fetched.pixels()), nullptr};
    }

    // Gives the surface up.
    void drop() {
        if (!swapchain_) return;
        stage_->device()->device().handle().waitIdle();
        for (Frame& frame : frames_) frame.image.reset();
        drawn_.clear();
        swapchain_.reset();
        stage_->leave(this);
    }

private:
    struct Frame {
        std::unique_ptr<VulkanJob> job;
        std::optional<FrameImage> image;
        vk::raii::Semaphore acquired = nullptr;
        vk::raii::Fence image_is_there = nullptr;
    };
    struct Row {
        SubmissionTimes times;
        double acquire = 0.0, present = 0.0, released = 0.0, longest = 0.0, last = 0.0, shown = 0.0;
        std::uint32_t releases = 0;
    };

    void begin(vk::ImageUsageFlags besides);
    void wait_until_shown(Row& row) const;
    void show(Frame& frame, Row& row, const FetchedImage* fetched);
    [[nodiscard]] std::uint32_t acquire(Frame& frame);
    [[nodiscard]] ClockReadings present(std::uint32_t count, const FetchedImage* fetched);

    std::shared_ptr<PresentationStage> stage_;
    RenderWork work_;
    Showing showing_;
    std::vector<Frame> frames_;
    std::optional<Swapchain> swapchain_;
    ShownImages shown_;
    std::vector<vk::raii::Semaphore> drawn_;  // by image of the swapchain
    std::vector<double> submitted_;           // likewise, when; 0: never
    std::uint64_t presented_ = 0;             // frames by this swapchain, which are their identities
};

void PresentRun::begin(vk::ImageUsageFlags besides) {
    const vk::Extent2D size{work_.size.width, work_.size.height};
    stage_->take(this, size);
    const Device& device = stage_->device()->device();
    const SurfaceAbilities& abilities = stage_->abilities();
    swapchain_.emplace(device, stage_->surface(),
        SwapchainSpec{.format = abilities.format(),
            .mode = mode_of(abilities, showing_),
            .images = showing_.images,
            .usage = shown_usage(showing_.pattern) | besides},
        size, nullptr);
    shown_ = {{}, abilities.format().format, swapchain_->size(), presented};
    for (std::size_t i = 0; i < swapchain_->image_count(); ++i) {
        shown_.images.push_back({swapchain_->image(i), swapchain_->view(i)});
        drawn_.emplace_back(device.handle(), vk::SemaphoreCreateInfo());
    }
    submitted_.assign(swapchain_->image_count(), 0.0);
    presented_ = 0;
    for (Frame& frame : frames_)
        frame.image.emplace(
            device, showing_.pattern, shown_, std::array{frame.job->sums(0), frame.job->sums(1)}, work_.samples);
    // Each image once: what happens but once is no part of what is measured.
    if (!besides) (void)present(static_cast<std::uint32_t>(swapchain_->image_count()) + 1, nullptr);
}

std::uint32_t PresentRun::acquire(Frame& frame) {
    const vk::raii::Device& device = stage_->device()->device().handle();
    if (!showing_.acquires_by_fence) {
        const std::uint32_t image = swapchain_->handle().acquireNextImage(forever, *frame.acquired).second;
        frame.job->submission().wait_for(*frame.acquired, shown_stage(showing_.pattern));
        return image;
    }
    const std::uint32_t image = swapchain_->handle().acquireNextImage(forever, nullptr, *frame.image_is_there).second;
    (void)device.waitForFences(*frame.image_is_there, true, forever);
    device.resetFences(*frame.image_is_there);
    return image;
}

void PresentRun::wait_until_shown(Row& row) const {
    if (!showing_.waits_for_present || presented_ == 0) return;
    const double start = steady_seconds();
    constexpr std::uint64_t patience = 5'000'000'000;  // nanoseconds: a window that is hidden shows nothing
    if (swapchain_->handle().waitForPresent(presented_, patience) == vk::Result::eTimeout)
        throw Error("a frame was not shown within five seconds; leave the window visible");
    row.shown += steady_seconds() - start;
}

void PresentRun::show(Frame& frame, Row& row, const FetchedImage* fetched) {
    wait_until_shown(row);
    const double start = steady_seconds();
    const std::uint32_t image = acquire(frame);
    const double acquired = steady_seconds();
    row.acquire += acquired - start;
    if (submitted_[image] > 0.0) {
        row.released += acquired - submitted_[image];
        ++row.releases;
    }
    Submission& submission = frame.job->submission();
    frame.job->add_frame(work_.samples);
    const std::uint32_t place = frame.job->sums_place();
    submission.add({shown_recording, 1, place, image}, [&frame, place, image](const vk::raii::CommandBuffer& commands) {
        frame.image->record_last(commands, place, image);
    });
    if (fetched != nullptr)
        submission.add(
            {shown_recording, 2}, [=](const vk::raii::CommandBuffer& commands) { fetched->record(commands, image); });
    submission.signal(*drawn_[image]);
    frame.job->submit_frame();
    const double submitted = submitted_[image] = steady_seconds();
    ++presented_;
    const vk::PresentIdKHR identity(1, &presented_);
    (void)stage_->device()->device().queue().presentKHR(vk::PresentInfoKHR(
        *drawn_[image], *swapchain_->handle(), image, {}, showing_.waits_for_present ? &identity : nullptr));
    const double now = steady_seconds();
    row.present += now - submitted;
    if (row.last > 0.0) row.longest = std::max(row.longest, now - row.last);
    row.last = now;
}

ClockReadings PresentRun::present(std::uint32_t count, const FetchedImage* fetched) {
    stage_->poll();
    Row row;
    std::ranges::fill(submitted_, 0.0);
    const double start = steady_seconds();
    try {
        for (std::uint32_t i = 0; i < count; ++i) {
            Frame& frame = frames_[i % frames_.size()];
            if (i >= frames_.size()) row.times.add(frame.job->finish_frame());
            show(frame, row, fetched);
        }
        for (std::uint32_t i = count - std::min(count, showing_.in_flight); i < count; ++i)
            row.times.add(frames_[i % frames_.size()].job->finish_frame());
    } catch (const vk::OutOfDateKHRError&) {
        throw Error("the window changed while frames were timed; leave it alone");
    }
    ClockReadings readings = readings_of(row.times, steady_seconds() - start);
    readings["acquire"] = row.acquire;
    readings["present"] = row.present;
    readings["longest-interval"] = row.longest;
    if (showing_.waits_for_present) readings["wait-until-shown"] = row.shown;
    if (row.releases > 0) readings["submit-to-released"] = row.released / row.releases;
    return readings;
}

PresentationStage::PresentationStage(const BenchRequest& request, const MakeShowPlace& make_place)
    : place_(open_place(make_place, 320, 180)) {
    try {
        device_ = std::make_shared<BenchDevice>(
            request, place_->instance_extensions(), std::vector<const char*>{VK_KHR_SWAPCHAIN_EXTENSION_NAME});
        surface_ = place_->surface(device_->instance().handle());
        abilities_.emplace(device_->device(), surface_);
    } catch (const DeviceError& failure) {
        throw UnsupportedError(failure.what());
    }
}

void PresentationStage::take(PresentRun* run, vk::Extent2D size) {
    if (holder_ != nullptr && holder_ != run) holder_->drop();
    holder_ = run;
    place_->resize(size);
    constexpr double patience = 5.0;  // seconds
    for (const double start = steady_seconds(); steady_seconds() - start < patience;) {
        place_->poll();
        if (swapchain_size(device_->device(), surface_, size) == size) return;
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    holder_ = nullptr;
    throw UnsupportedError(fmt::format("the window does not take {}x{} pixels", size.width, size.height));
}

void PresentationStage::leave(const PresentRun* run) {
    if (holder_ == run) holder_ = nullptr;
}

namespace {

struct NamedShowing {
    std::string name, text;
    Showing showing;
};

std::vector<NamedShowing> showings() {
    const auto with = [](const auto& change) {
        Showing showing;
        change(showing);
        return showing;
    };
    std::vector<NamedShowing> list{{"base",
        "immediate or else mailbox, an image more than the surface keeps, 2 frames in flight, a blit, fences", {}}};
    constexpr std::array<const char*, 4> modes{
        "at each refresh one, none left out", "the same, a late one at once", "at each refresh the newest", "at once"};
    for (std::size_t i = 0; i < modes.size(); ++i)
        list.push_back({std::string(present_mode_names[i]), modes[i],
            with([&](Showing& s) { s.mode = static_cast<PresentMode>(i); })});
    for (const std::uint32_t count : {1u, 2u, 3u, 4u})
        list.push_back({fmt::format("{}-image{}", count, count == 1 ? "" : "s"),
            fmt::format("a swapchain of {} image{}, or as many more as the driver adds", count, count == 1 ? "" : "s"),
            with([&](Showing& s) { s.images = count; })});
    for (const std::uint32_t count : {1u, 3u})
        list.push_back(
            {fmt::format("{}-in-flight", count), fmt::format("{} frame{} in flight", count, count == 1 ? "" : "s"),
                with([&](Showing& s) { s.in_flight = count; })});
    list.push_back({"timeline", "the host waits for frames by a timeline semaphore",
        with([](Showing& s) { s.wait = WaitPattern::timeline; })});
    list.push_back({"acquire-fence", "the host waits for the image, not the device by a semaphore",
        with([](Showing& s) { s.acquires_by_fence = true; })});
    list.push_back({"present-wait", "the host begins a frame when the one before is shown (VK_KHR_present_wait)",
        with([](Showing& s) { s.waits_for_present = true; })});
    list.push_back({"copy", "a copy, not a blit", with([](Showing& s) { s.pattern.move = ImageMove::copy; })});
    list.push_back({"storage", "kernels store to the swapchain's image; no kernel begins before it is there",
        with([](Showing& s) { s.pattern.move = ImageMove::none; })});
    list.push_back({"attachment", "fragments of a full-screen pass draw to the swapchain's image", with([](Showing& s) {
                        s.pattern.writer = ImageWriter::pass;
                        s.pattern.move = ImageMove::none;
                    })});
    return list;
}

// Made with the first arm.
class LazyStage {
public:
    LazyStage(BenchRequest request, MakeShowPlace make_place)
        : request_(std::move(request)), make_place_(std::move(make_place)) {}
    [[nodiscard]] const std::shared_ptr<PresentationStage>& get() {
        if (!stage_) stage_ = std::make_shared<PresentationStage>(request_, make_place_);
        return stage_;
    }

private:
    BenchRequest request_;
    MakeShowPlace make_place_;
    std::shared_ptr<PresentationStage> stage_;
};

}  // namespace

Family presentation_family(const SharedDevice& device, const MakeShowPlace& make_window) {
    Family family;
    family.name = "presentation";
    family.question = "How should frames reach the screen?";
    family.hypothesis = "The mode decides; two frames in flight hide the host; images beyond three change nothing";
    family.source = "Ferreira 2019; Vulkan Tutorial; vendors' advice";
    family.held = fmt::format(
        "{} frames of one sample in a row, in a window of the image's size. All but what the arm names is as in base",
        frames_a_run);
    family.base = fmt::format(
        "{} frames in a row, each blitted to the swapchain's image and presented. The total lasts from before the "
        "first is acquired to the end of the last wait",
        frames_a_run);
    family.along = "pixels";
    family.everywhere = false;
    for (const ImageSize& size : device->sizes()) family.workloads.push_back(workload_of({size, 1, device->bounces()}));
    const auto stage = std::make_shared<LazyStage>(device->request(), make_window);
    family.arms = [stage](const Workload& workload) {
        std::vector<Arm> arms;
        for (const NamedShowing& one : showings())
            arms.push_back({one.name, one.text, [=, work = work_of(workload)] {
                                return std::make_unique<PresentRun>(stage->get(), work, one.showing);
                            }});
        return arms;
    };
    return family;
}

}  // namespace tandem
