#include "common/view/progressive_view.h"

#include <algorithm>
#include <exception>
#include <utility>

#include "common/stopwatch.h"

namespace tandem {

namespace {

// Blocks are whole (estimate.h); of the first one its beginning is shown earlier, and rendered again.
constexpr std::uint64_t preview_growth = 4;
// Calls cost time of their own, and a picture that changes more often is no better.
constexpr double least_seconds_a_call = 0.1;

}  // namespace

ProgressiveView::ProgressiveView(
    std::unique_ptr<Renderer> renderer, Scene scene, const RenderSettings& settings, std::uint64_t samples)
    : renderer_(std::move(renderer)),
      info_(renderer_->info()),
      scene_(std::move(scene)),
      settings_(settings),
      most_samples_(samples),
      thread_([this](const std::stop_token& quit) { work(quit); }) {}

ProgressiveView::~ProgressiveView() {
    thread_.request_stop();
    stop();
}

void ProgressiveView::restart(const Camera& camera, std::uint32_t width, std::uint32_t height) {
    const std::scoped_lock lock(mutex_);
    stop_.request_stop();
    stop_ = std::stop_source();
    wish_ = {wish_.number + 1, camera, width, height};
    state_ = {.version = state_.version + 1, .samples = 0, .failure = {}};
    wished_.notify_all();
}

void ProgressiveView::stop() {
    const std::scoped_lock lock(mutex_);
    stop_.request_stop();
}

ViewState ProgressiveView::state() const {
    const std::scoped_lock lock(mutex_);
    return state_;
}

Estimate ProgressiveView::estimate() const {
    const std::scoped_lock lock(mutex_);
    return estimate_;
}

std::shared_ptr<const ProgressiveView::Picture> ProgressiveView::picture() const {
    const std::scoped_lock lock(mutex_);
    return picture_;
}

void ProgressiveView::work(const std::stop_token& quit) {
    std::uint64_t done = 0;
    while (!quit.stop_requested()) {
        Wish wish;
        std::stop_token stop;
        {
            std::unique_lock lock(mutex_);
            if (!wished_.wait(lock, quit, [&] { return wish_.number != done; })) return;
            wish = wish_;
            stop = stop_.get_token();
        }
        done = wish.number;
        try {
            render(wish, stop);
        } catch (const std::exception& failure) {
            fail(wish, failure.what());
        }
    }
}

void ProgressiveView::render(const Wish& wish, const std::stop_token& stop) {
    const Stopwatch watch;
    scene_.camera = wish.camera;
    RenderSettings settings = settings_;
    settings.width = wish.width;
    settings.height = wish.height;
    const std::unique_ptr<RenderJob> job = renderer_->prepare(scene_, settings);
    const double prepare_seconds = watch.seconds();
    RenderControl control;
    control.stop = stop;

    for (std::uint64_t count = 1; count < std::min(samples_per_block, most_samples_); count *= preview_growth) {
        RenderResult result = job->render({0, count}, control);
        if (result.estimate.count() != count) return;
        if (!publish(wish, std::move(result.estimate), false, watch.seconds(), prepare_seconds)) return;
    }
    std::uint64_t step = samples_per_block;
    for (std::uint64_t begin = 0; begin < most_samples_;) {
        const std::uint64_t end = std::min(begin + step, most_samples_);
        RenderResult result = job->render({begin, end}, control);
        if (result.estimate.count() != end - begin) return;
        if (result.seconds < least_seconds_a_call) step *= 2;
        if (!publish(wish, std::move(result.estimate), begin > 0, watch.seconds(), prepare_seconds)) return;
        begin = end;
    }
}

// False: nobody wants it any more.
bool ProgressiveView::publish(const Wish& wish, Estimate part, bool adds, double seconds, double prepare_seconds) {
    const std::scoped_lock lock(mutex_);
    if (wish.number != wish_.number) return false;
    if (adds)
        estimate_.merge(std::move(part));
    else
        estimate_ = std::move(part);
    picture_ = std::make_shared<const Picture>(Picture{estimate_.width(), estimate_.height(), mean_of(estimate_)});
    const std::uint64_t samples = estimate_.count();
    state_ = {state_.version + 1, samples, seconds, prepare_seconds, samples == most_samples_, {}};
    return true;
}

void ProgressiveView::fail(const Wish& wish, const std::string& why) {
    const std::scoped_lock lock(mutex_);
    if (wish.number != wish_.number) return;
    ++state_.version;
    state_.failure = why;
}

}  // namespace tandem
