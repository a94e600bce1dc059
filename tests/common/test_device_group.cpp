// Renderers that share a render: the bits of one alone, whatever the split, and whoever fails or hangs.
#include <doctest/doctest.h>

#include <algorithm>
#include <atomic>
#include <span>
#include <stdexcept>
#include <thread>

#include "common/deadline.h"
#include "common/distribution/device_group.h"
#include "common/error.h"
#include "synthetic_renderer.h"

using namespace tandem;

namespace {

constexpr SampleRange range{0, 64 * 40 + 7};

RenderSettings small_settings() {
    RenderSettings settings;
    settings.width = 8;
    settings.height = 4;
    settings.seed = 5;
    return settings;
}

std::unique_ptr<Renderer> sound() { return std::make_unique<SyntheticRenderer>(mixed, "sound"); }

// Renders so many samples of a pixel and channel as it should, and then does what `fault` does.
std::unique_ptr<Renderer> faulty(std::uint64_t samples, std::function<void()> fault) {
    const auto count = std::make_shared<std::atomic<std::uint64_t>>(0);
    return std::make_unique<SyntheticRenderer>(
        [=](std::uint32_t x, std::uint32_t y, SampleRandom& random) {
            if (++*count > samples) fault();
            return mixed(x, y, random);
        },
        "faulty");
}

struct Rendered {
    Estimate estimate;
    std::vector<std::string> told;
};

Rendered rendered_by(std::vector<std::unique_ptr<Renderer>> members, double patience = 60.0) {
    Rendered result;
    const auto group = device_group(
        std::move(members), [&](const std::string& text) { result.told.push_back(text); }, patience);
    const auto job = group->prepare(Scene{}, small_settings());
    result.estimate = job->render(range).estimate;
    return result;
}

template <class... Member>
std::vector<std::unique_ptr<Renderer>> members(Member... member) {
    std::vector<std::unique_ptr<Renderer>> all;
    (all.push_back(std::move(member)), ...);
    return all;
}

bool same_bits(const Estimate& a, const Estimate& b) {
    const Estimate::Plane left = a.totals(), right = b.totals();
    return a.ranges() == b.ranges() && a.invalid() == b.invalid() &&
           std::ranges::equal(left, right, [](const Moments& x, const Moments& y) {
               return x.sum == y.sum && x.sum_of_squares == y.sum_of_squares;
           });
}

}  // namespace

TEST_CASE("a group of equal renderers has the bits of one") {
    const Estimate alone = rendered_by(members(sound())).estimate;
    CHECK(same_bits(rendered_by(members(sound(), sound())).estimate, alone));
    CHECK(same_bits(rendered_by(members(sound(), sound(), sound(), sound(), sound())).estimate, alone));
}

TEST_CASE("the blocks of a renderer that fails are done by others, and it is told") {
    const Estimate alone = rendered_by(members(sound())).estimate;
    for (const std::uint64_t samples : {0u, 1u, 5000u}) {
        const Rendered result =
            rendered_by(members(sound(), faulty(samples, [] { throw std::runtime_error("device lost"); })));
        CHECK(same_bits(result.estimate, alone));
        // Where it was too late to fail, the other had done all before.
        for (const std::string& text : result.told) CHECK(text.find("device lost") != std::string::npos);
        if (samples == 0) CHECK(result.told.size() <= 1);
    }
    CHECK_THROWS_AS(rendered_by(members(faulty(0, [] { throw std::runtime_error("device lost"); }),
                        faulty(0, [] { throw std::runtime_error("device lost"); }))),
        DeviceError);
}

TEST_CASE("a renderer that failed takes no part in later jobs, nor in lists of pixels") {
    int told = 0, prepared = 0;
    bool fails_to_prepare = false;
    class Failing : public Renderer {
    public:
        Failing(int& count, const bool& fails) : count_(count), fails_(fails) {}
        RendererInfo info() const override { return {"failing", "no device", "no driver", "C++"}; }
        std::unique_ptr<RenderJob> prepare(const Scene&, const RenderSettings&) override {
            ++count_;
            if (fails_) throw std::runtime_error("device lost");
            struct Job : RenderJob {
                RenderResult render(SampleRange, const RenderControl&) override { throw DeviceError("device lost"); }
                RenderResult render_pixels(SampleRange, std::span<const std::uint32_t>, const RenderControl&) override {
                    throw DeviceError("device lost");
                }
            };
            return std::make_unique<Job>();
        }

    private:
        int& count_;
        const bool& fails_;
    };
    const std::vector<std::uint32_t> pixels{1, 5};
    RenderSettings settings = small_settings();
    settings.sampling = Sampling::adaptive;
    const auto group_of_two = [&] {
        told = prepared = 0;
        return device_group(
            members(std::unique_ptr<Renderer>(std::make_unique<Failing>(prepared, fails_to_prepare)), sound()),
            [&](const std::string&) { ++told; });
    };
    const auto alone = device_group(members(sound()), {})->prepare(Scene{}, settings);
    const Estimate expected = alone->render_pixels({0, 64}, pixels, {}).estimate;
    for (const bool at_once : {false, true}) {
        fails_to_prepare = at_once;
        const auto group = group_of_two();
        for (int job = 0; job < 2; ++job)
            CHECK(same_bits(group->prepare(Scene{}, settings)->render_pixels({0, 64}, pixels, {}).estimate, expected));
        CHECK(told == 1);
        CHECK(prepared == 1);
    }
    fails_to_prepare = true;
    const auto none =
        device_group(members(std::unique_ptr<Renderer>(std::make_unique<Failing>(prepared, fails_to_prepare)),
                         std::unique_ptr<Renderer>(std::make_unique<Failing>(prepared, fails_to_prepare))),
            [](const std::string&) {});
    CHECK_THROWS_AS(static_cast<void>(none->prepare(Scene{}, settings)), DeviceError);
}

TEST_CASE("the blocks of a renderer that hangs are done by others") {
    const auto release = std::make_shared<std::atomic<bool>>(false);
    // The sound one waits until the other has a unit.
    const auto begun = std::make_shared<std::atomic<bool>>(false);
    const auto hang = [release, begun] {
        *begun = true;
        while (!*release) std::this_thread::sleep_for(std::chrono::milliseconds(5));
    };
    auto second = std::make_unique<SyntheticRenderer>(
        [begun](std::uint32_t x, std::uint32_t y, SampleRandom& random) {
            while (!*begun) std::this_thread::sleep_for(std::chrono::milliseconds(1));
            return mixed(x, y, random);
        },
        "second");
    const Rendered result = rendered_by(members(std::unique_ptr<Renderer>(std::move(second)), faulty(0, hang)), 2.0);
    CHECK(same_bits(result.estimate, rendered_by(members(sound())).estimate));
    REQUIRE(result.told.size() == 1);
    CHECK(result.told[0].find("has not answered") != std::string::npos);
    *release = true;
    std::this_thread::sleep_for(std::chrono::milliseconds(200));  // for the thread that was left behind
}

// Renders as `render` says.
class ToldRenderer : public Renderer {
public:
    using Render = std::function<RenderResult(RenderJob&, SampleRange, const RenderControl&)>;
    explicit ToldRenderer(Render render) : render_(std::move(render)) {}
    RendererInfo info() const override { return {"told", "no device", "no driver", "C++"}; }
    std::unique_ptr<RenderJob> prepare(const Scene&, const RenderSettings& settings) override {
        struct Job : RenderJob {
            Render own;
            SyntheticJob sound;
            Job(Render render, const RenderSettings& settings) : own(std::move(render)), sound(settings, mixed) {}
            RenderResult render(SampleRange range, const RenderControl& control) override {
                return own(sound, range, control);
            }
        };
        return std::make_unique<Job>(render_, settings);
    }

private:
    Render render_;
};

TEST_CASE("a stop loses nothing that was done, whoever did it") {
    std::stop_source stop;
    std::atomic<int> slow_begun = 0;
    // It has 40 samples of its unit when the stop comes.
    const ToldRenderer::Render slow = [&](RenderJob& sound, SampleRange unit, const RenderControl& control) {
        ++slow_begun;
        while (!control.stop.stop_requested()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
        return sound.render({unit.begin, unit.begin + 40}, {});
    };
    std::uint64_t fast_done = 0;
    const ToldRenderer::Render fast = [&](RenderJob& sound, SampleRange unit, const RenderControl&) {
        while (slow_begun == 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
        RenderResult result = sound.render(unit, {});
        fast_done += unit.count();
        if (fast_done > 1000) stop.request_stop();
        return result;
    };
    const auto left_by = [&](std::vector<std::unique_ptr<Renderer>> all) {
        const auto job = device_group(std::move(all), [](const std::string&) {})->prepare(Scene{}, small_settings());
        return job->render(range, {.stop = stop.get_token(), .progress = {}}).estimate;
    };
    const Estimate estimate =
        left_by(members(std::make_unique<ToldRenderer>(slow), std::make_unique<ToldRenderer>(fast)));
    CHECK(fast_done > 1000);
    CHECK(estimate.count() == fast_done + 40);

    stop = {};
    slow_begun = 0;
    const auto end = [&] {
        while (slow_begun < 2) std::this_thread::sleep_for(std::chrono::milliseconds(1));
        stop.request_stop();
    };
    std::thread ending(end);
    // A film has no place for two begun blocks: one's samples are kept.
    CHECK(left_by(members(std::make_unique<ToldRenderer>(slow), std::make_unique<ToldRenderer>(slow))).count() == 40);
    ending.join();
}

TEST_CASE("a stop that is asked while threads are started reaches all of them") {
    std::stop_source stop;
    std::vector<std::unique_ptr<Renderer>> all;
    // One alone is done with this small film before so many threads have started.
    for (int i = 0; i < 64; ++i)
        all.push_back(std::make_unique<SyntheticRenderer>([&](std::uint32_t x, std::uint32_t y, SampleRandom& random) {
            stop.request_stop();
            return mixed(x, y, random);
        }));
    RenderSettings settings = small_settings();
    settings.width = settings.height = 1;
    const auto job = device_group(std::move(all), [](const std::string&) {})->prepare(Scene{}, settings);
    CHECK(job->render(range, {.stop = stop.get_token(), .progress = {}}).estimate.count() < range.count());
}
