#include "vulkan/window/view_window.h"

#include <algorithm>

#include "common/error.h"
#include "common/stopwatch.h"
#include "vulkan/window/panel.h"

namespace tandem {

namespace {

constexpr std::size_t remembered_frames = 4096;
constexpr double least_seconds_a_frame = 1.0 / 60.0;

// When frames were presented.
class Pace {
public:
    void add() {
        const double now = watch_.seconds();
        if (frames_++ > 0) {
            if (between_.size() < remembered_frames)
                between_.push_back(now - last_);
            else
                between_[frames_ % remembered_frames] = now - last_;
        } else {
            first_ = now;
        }
        last_ = now;
    }
    [[nodiscard]] std::uint64_t frames() const { return frames_; }
    [[nodiscard]] double seconds() const { return last_ - first_; }
    [[nodiscard]] double seconds_since_last() const { return watch_.seconds() - last_; }
    [[nodiscard]] double recent() const { return between_.empty() ? 0.0 : between_.back(); }
    // 95 % are shorter.
    [[nodiscard]] double slow() const {
        if (between_.empty()) return 0.0;
        std::vector<double> sorted = between_;
        const auto place = sorted.begin() + static_cast<std::ptrdiff_t>(0.95 * static_cast<double>(sorted.size() - 1));
        std::ranges::nth_element(sorted, place);
        return *place;
    }

private:
    Stopwatch watch_;
    std::uint64_t frames_ = 0;
    double first_ = 0.0, last_ = 0.0;
    std::vector<double> between_;
};

class ViewWindow {
public:
    ViewWindow(GlfwWindow& window, const Instance& instance, const WindowOptions& options)
        : window_(window),
          instance_(instance),
          surface_(window_.surface(instance_.handle())),
          device_(instance_, options.device, Queues::one, {VK_KHR_SWAPCHAIN_EXTENSION_NAME}),
          presenter_(device_, surface_, window_.size(), options.present_mode),
          panel_(instance_, device_, window_, presenter_) {
        panel_.set_appearance(options.appearance);
        if (options.full_screen) window_.set_full_screen(true);
    }

    WindowReport run(ViewSession& session, const WindowOptions& options, const std::stop_token& stop) {
        Pace pace;
        bool drawn = true;
        while (!window_.closing() && !stop.stop_requested()) {
            const bool shown = options.frames > 0 && pace.frames() >= options.frames;
            if (shown && (!options.frames_wait || session.finished())) break;
            const vk::Extent2D size = window_.size();
            const bool minimised = size.width == 0 || size.height == 0;
            const double rest = least_seconds_a_frame - pace.seconds_since_last();
            window_.poll(minimised ? 0.1 : drawn ? std::max(0.0, rest) : least_seconds_a_frame);
            panel_.update(session, options, pace.recent());
            session.follow();
            take_picture(session);
            drawn = presenter_.draw(window_.size(), [&](vk::CommandBuffer commands) { panel_.draw(commands); });
            if (drawn) pace.add();
            instance_.log().raise();
        }
        return {pace.frames(), pace.seconds(), pace.slow(), presenter_.swapchains_made(), presenter_.swapchain().mode(),
            static_cast<std::uint32_t>(presenter_.swapchain().image_count()), panel_.appearance(),
            device_.description().name};
    }

private:
    void take_picture(const ViewSession& session) {
        const Appearance& appearance = panel_.appearance();
        if (session.version() == version_ && appearance == appearance_) return;
        version_ = session.version();
        appearance_ = appearance;
        if (const ViewSession::Shown shown = session.shown(appearance); shown.width > 0) presenter_.set_picture(shown);
    }

    GlfwWindow& window_;
    const Instance& instance_;
    vk::raii::SurfaceKHR surface_;
    Device device_;
    Presenter presenter_;
    Panel panel_;
    std::uint64_t version_ = 0;
    Appearance appearance_;
};

}  // namespace

WindowReport show_in_window(ViewSession& session, const WindowOptions& options, const std::stop_token& stop) {
    try {
        GlfwWindow window(options.title, options.width, options.height);
        const Instance instance(validation_wanted(options.validation), window.instance_extensions());
        const WindowReport report = ViewWindow(window, instance, options).run(session, options, stop);
        instance.log().raise();  // also about what was left when the device was destroyed
        return report;
    } catch (const vk::DeviceLostError&) {
        throw DeviceError("the device that shows the window was lost; start tandem view again");
    } catch (const vk::SystemError& failure) {
        throw DeviceError(std::string("the window cannot be shown: ") + failure.what());
    }
}

}  // namespace tandem
