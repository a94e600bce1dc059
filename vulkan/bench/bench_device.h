// What all arms share: one device, its pipelines and the scene. Also the arms that render.
#pragma once

#include <functional>

#include "common/experiment/bench.h"
#include "common/stopwatch.h"
#include "vulkan/core/device_clock.h"
#include "vulkan/renderer/job/job.h"

namespace tandem {

// Samples of the renders that the gate compares: a few tell one image from another.
inline constexpr std::uint64_t gate_samples = 4;

struct ImageSize {
    std::uint32_t width, height;
    [[nodiscard]] double pixels() const { return static_cast<double>(width) * height; }
};

// What of the path tracer's settings is another than the scene's file says.
using Tuning = std::function<void(RenderSettings&)>;

class BenchDevice {
public:
    // `instance_extensions`, `device_extensions`: besides its own.
    explicit BenchDevice(const BenchRequest& request, const std::vector<const char*>& instance_extensions = {},
        const std::vector<const char*>& device_extensions = {});

    [[nodiscard]] const BenchRequest& request() const { return request_; }
    [[nodiscard]] const Instance& instance() const { return instance_; }
    [[nodiscard]] const Device& device() const { return device_; }
    // Log of the validation layer, which only TANDEM_VALIDATION=1 wakes: it has no place beside a clock.
    [[nodiscard]] ValidationLog& log() const { return instance_.log(); }
    [[nodiscard]] std::unique_ptr<VulkanJob> job(
        ImageSize size, std::uint32_t bounces, const JobPatterns& patterns, const Tuning& tuning = {});
    // Specialisation of the six stages for the scene, and the code and the layout that go with it.
    [[nodiscard]] const Specialisation& specialisation();
    [[nodiscard]] std::vector<std::uint32_t> code(Stage kernel) const { return stages_.prepared(shader_code(kernel)); }
    [[nodiscard]] vk::PipelineLayout layout() { return stages_.layout().handle(); }
    // The device's clock beside the host's; none where they cannot be related, as facts_of() says why.
    [[nodiscard]] const std::optional<DeviceClock>& clock() const { return clock_; }
    // Small, middle and large images, fit for the device or as asked for.
    [[nodiscard]] const std::vector<ImageSize>& sizes() const { return sizes_; }
    [[nodiscard]] std::uint32_t bounces() const { return 12; }  // the thesis's

private:
    BenchRequest request_;
    Instance instance_;
    Device device_;
    std::optional<DeviceClock> clock_;
    Stages stages_;
    std::vector<ImageSize> sizes_;
    std::optional<Specialisation> specialisation_;
};
// Arms and families hold the device together.
using SharedDevice = std::shared_ptr<BenchDevice>;

// The thesis's frame: its stages, and Scene, Camera and Settings where the host writes them.
[[nodiscard]] JobPatterns thesis_frame_patterns();

// A frame's worth of work.
struct RenderWork {
    ImageSize size;
    std::uint32_t samples = 1, bounces = 12;
};
// "320x180, 12 samples, 12 bounces"; factors pixels, samples, bounces.
[[nodiscard]] Workload workload_of(const RenderWork& work);
[[nodiscard]] RenderWork work_of(const Workload& workload);

// What render_arm times with the patterns' defaults: Family::base of all families whose baseline it is.
inline constexpr const char* plain_frame =
    "a frame of the six stages as a wavefront, in one submission, with a fence. One thread records it anew, a command "
    "buffer a sample and one for the sums. Its total lasts from before recording to the end of the wait";

// Times frames of an unchanged scene; the gate compares whole renders.
[[nodiscard]] Arm render_arm(const SharedDevice& device, const Workload& workload, std::string name, std::string text,
    const JobPatterns& patterns);
// The same with other settings.
[[nodiscard]] Arm tuned_arm(const SharedDevice& device, const Workload& workload, std::string name, std::string text,
    const JobPatterns& patterns, const Tuning& tuning);

// When submissions began and ended by the host's clock. What a device cannot say is left out. Readings of both clocks
// are taken outside of what is timed: the last ones of an earlier run serve as this one's first.
class HostTimes {
public:
    explicit HostTimes(const SharedDevice& device);
    // After a run: adds "submit-to-start", from before vkQueueSubmit to the first stamp, and "end-to-known", from the
    // last stamp to the end of the host's wait. Adds "clock-deviation", by how much either may be wrong.
    void add_to(ClockReadings& readings, const SubmissionTimes& times);
    // Adds the readings of several submissions that were under way together. "overlap" is the time that they had in
    // common: the sum of what each took, less the time in which any was at work. Adds "clock-deviation" too.
    void add_to(ClockReadings& readings, const std::vector<SubmissionTimes>& times);

private:
    SharedDevice device_;
    std::optional<ClockPair> last_;
};

// The sum of the lengths of spans (first, last), less that of their union.
[[nodiscard]] double overlap_of(std::vector<std::pair<double, double>> spans);

// Clocks of a frame as readings.
[[nodiscard]] ClockReadings readings_of(const SubmissionTimes& times, double total);

// Seconds that so many submissions of nothing took, each with its wait.
[[nodiscard]] std::vector<double> time_empty_submissions(const Device& device, std::size_t count);

// An arm's `run` as a function, for arms that are not about rendering; what it owns lives in its captures.
[[nodiscard]] std::unique_ptr<ArmRun> run_of(std::function<ClockReadings()> run);

}  // namespace tandem
