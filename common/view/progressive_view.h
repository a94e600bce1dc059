// One backend that renders a scene progressively while its camera moves.
#pragma once

#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "common/render/renderer.h"

namespace tandem {

// What there is to be seen of one backend.
struct ViewState {
    std::uint64_t version = 0;  // grows with each change
    std::uint64_t samples = 0;  // a pixel; 0: nothing yet since the camera moved
    double seconds = 0.0;       // of rendering since then
    double prepare_seconds = 0.0;
    bool finished = false;  // as many samples as were asked for
    std::string failure;    // why nothing more will come; empty: nothing is wrong
};

// Renders on a thread of its own. Samples are those of `tandem render`: of n samples the image has the same bits.
class ProgressiveView {
public:
    // At most `samples` of every pixel. Waits for restart() to begin.
    ProgressiveView(
        std::unique_ptr<Renderer> renderer, Scene scene, const RenderSettings& settings, std::uint64_t samples);
    ~ProgressiveView();
    ProgressiveView(const ProgressiveView&) = delete;
    ProgressiveView& operator=(const ProgressiveView&) = delete;

    // Begins anew, from another place or at another size. What is under way is dropped.
    void restart(const Camera& camera, std::uint32_t width, std::uint32_t height);
    // No more than what is done, until it restarts.
    void stop();

    [[nodiscard]] ViewState state() const;
    // The newest image, or that of the camera before. Without either its size is 0.
    [[nodiscard]] Estimate estimate() const;
    // Its mean and size, linear: what is shown.
    struct Picture {
        std::uint32_t width = 0, height = 0;
        std::vector<double> mean;  // mean_of(estimate)
    };
    [[nodiscard]] std::shared_ptr<const Picture> picture() const;
    [[nodiscard]] const RendererInfo& info() const { return info_; }

private:
    struct Wish {
        std::uint64_t number = 0;
        Camera camera;
        std::uint32_t width = 0, height = 0;
    };

    void work(const std::stop_token& quit);
    void render(const Wish& wish, const std::stop_token& stop);
    [[nodiscard]] bool publish(const Wish& wish, Estimate part, bool adds, double seconds, double prepare_seconds);
    void fail(const Wish& wish, const std::string& why);

    std::unique_ptr<Renderer> renderer_;
    RendererInfo info_;
    Scene scene_;
    RenderSettings settings_;
    std::uint64_t most_samples_;

    mutable std::mutex mutex_;  // of all below but the thread
    std::condition_variable_any wished_;
    Wish wish_;
    std::stop_source stop_;  // of what is under way
    ViewState state_;
    Estimate estimate_;
    std::shared_ptr<const Picture> picture_;
    std::jthread thread_;
};

}  // namespace tandem
