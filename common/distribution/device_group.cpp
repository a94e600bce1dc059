#include "common/distribution/device_group.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <chrono>
#include <condition_variable>
#include <map>
#include <mutex>
#include <set>
#include <thread>
#include <utility>

#include "common/distribution/range_render.h"
#include "common/error.h"
#include "common/render/path_trace.h"
#include "common/stopwatch.h"

namespace tandem {

namespace {

// A member's job, which outlives the group where the device hangs.
struct Member {
    std::string name;
    std::shared_ptr<Renderer> renderer;
    std::shared_ptr<bool> left_out;  // of all jobs of the group: what failed or hangs in one is no use to the next
    std::shared_ptr<RenderJob> job;
};

using Told = std::function<void(const std::string&)>;

// Returns what is told of it.
std::string exclude(Member& member, const std::string& reason, const Told& told) {
    *member.left_out = true;
    std::string text = fmt::format("{}: {}", member.name, reason);
    told(text);
    return text;
}

DeviceError none_left(const std::string& last) { return DeviceError("no device is left to render; the last: " + last); }

// What a hanging call uses cannot be destroyed without hanging too.
void keep_for_ever(const Member& member) {
    static std::mutex lock;
    static auto* const kept = new std::vector<Member>;
    const std::lock_guard hold(lock);
    kept->push_back(member);
}

// What the threads of a render share. A thread that hangs keeps it alive.
struct Sharing {
    std::mutex lock;
    std::condition_variable changed;
    std::vector<SampleRange> units;  // to be done, the next one last
    Estimate sums;
    Estimate begun;              // after a stop: the most that a member had of a block. No film has two such pieces.
    std::exception_ptr failure;  // of the member that failed last
    struct Hand {
        SampleRange unit{};    // that it has in hand
        double silent = 0.0;   // seconds that it has told of no progress
        double samples = 0.0;  // of it, done
        bool working = false, ended = false, given_up = false;
        std::string reason;  // why it gets no more
    };
    std::vector<Hand> hands;
    double done = 0.0;
    bool stopped = false;
    std::stop_source abandon;

    [[nodiscard]] bool all_ended() const {
        return std::ranges::all_of(hands, [](const Hand& hand) { return hand.ended || hand.given_up; });
    }
    // Work that nobody has begun or may have to do for another.
    [[nodiscard]] bool is_work_left() const {
        return !units.empty() || std::ranges::any_of(hands, [](const Hand& hand) { return hand.working; });
    }
};

// Renders units until there are none. One whose member was given up meanwhile is dropped: another does it.
void work(const std::shared_ptr<Sharing>& all, std::size_t index, const std::shared_ptr<RenderJob>& job,
    const std::stop_token& stop) {
    std::unique_lock hold(all->lock);
    Sharing::Hand& hand = all->hands[index];
    while (!stop.stop_requested() && !hand.given_up) {
        if (all->units.empty()) {
            if (!all->is_work_left()) break;
            all->changed.wait(hold);  // another may fail, and leave its unit
            continue;
        }
        hand.unit = all->units.back();
        all->units.pop_back();
        hand.silent = 0.0;
        hand.working = true;
        hold.unlock();
        RenderResult part;
        std::string reason;
        try {
            part = job->render(hand.unit, {.stop = stop, .progress = [&](double samples) {
                                               std::lock_guard<std::mutex> brief(all->lock);
                                               if (samples > hand.samples) hand.silent = 0.0;
                                               hand.samples = samples;
                                               all->changed.notify_all();
                                           }});
        } catch (const std::exception& error) {
            reason = error.what();
        }
        hold.lock();
        if (hand.given_up) break;
        hand.working = false;
        hand.samples = 0.0;
        const bool whole = reason.empty() && part.estimate.count() == hand.unit.count();
        if (!reason.empty() || (!whole && !stop.stop_requested())) {
            hand.reason = reason.empty() ? "it stopped by itself" : reason;
            all->units.push_back(hand.unit);
            break;
        }
        if (!whole) {  // a stop
            Estimate begun = part.estimate.take_ragged();
            if (part.estimate.pixel_count() > 0) all->sums.merge(std::move(part.estimate));
            if (begun.count() > all->begun.count()) all->begun = std::move(begun);
            break;
        }
        all->sums.merge(std::move(part.estimate));
        all->done += static_cast<double>(hand.unit.count());
        all->changed.notify_all();
    }
    hand.ended = true;
    all->changed.notify_all();
}

class GroupJob final : public RenderJob {
public:
    GroupJob(std::vector<Member> members, const RenderSettings& settings, Told told, double patience)
        : members_(std::move(members)), settings_(settings), told_(std::move(told)), patience_(patience) {}

    [[nodiscard]] JobFacts facts() const override { return members_.front().job->facts(); }

    [[nodiscard]] RenderResult render(SampleRange range, const RenderControl& control) override {
        const Stopwatch watch;
        const auto all = std::make_shared<Sharing>();
        all->sums = Estimate(settings_.width, settings_.height);
        all->units = units_of(range);
        std::vector<std::size_t> who;
        for (std::size_t i = 0; i < members_.size(); ++i)
            if (!*members_[i].left_out) who.push_back(i);
        all->hands.resize(who.size());
        // Before any thread, so that a stop finds all of them.
        const std::stop_callback on_stop(control.stop, [&all] {
            all->abandon.request_stop();
            all->changed.notify_all();
        });
        std::vector<std::thread> threads;
        for (std::size_t i = 0; i < who.size(); ++i)
            threads.emplace_back(
                [all, i, job = members_[who[i]].job, stop = all->abandon.get_token()] { work(all, i, job, stop); });
        wait(*all, control);
        for (std::size_t i = 0; i < who.size(); ++i)
            if (all->hands[i].given_up)
                threads[i].detach();  // its device hangs, and nothing can end the call
            else
                threads[i].join();
        const std::lock_guard<std::mutex> hold(all->lock);
        leave_out(*all, who);
        if (all->sums.count() < range.count() && !control.stop.stop_requested()) throw none_left(last_reason_);
        RenderResult result;
        result.estimate = all->sums;
        if (all->begun.count() > 0) result.estimate.merge(all->begun);
        result.seconds = watch.seconds();
        return result;
    }

    [[nodiscard]] RenderResult render_pixels(
        SampleRange range, std::span<const std::uint32_t> pixels, const RenderControl& control) override {
        for (Member& member : members_) {
            if (*member.left_out) continue;
            try {
                return member.job->render_pixels(range, pixels, control);
            } catch (const UnsupportedError&) {
                throw;
            } catch (const std::exception& error) {
                last_reason_ = exclude(member, error.what(), told_);
            }
        }
        throw none_left(last_reason_);
    }
    [[nodiscard]] std::vector<PathTrace> trace(std::uint32_t x, std::uint32_t y, SampleRange samples) override {
        return first().trace(x, y, samples);
    }
    [[nodiscard]] bool first_vertices(
        FilmSize film, SampleRange samples, const RenderControl& control, const FirstVertexVisitor& visit) override {
        return first().first_vertices(film, samples, control, visit);
    }

private:
    [[nodiscard]] RenderJob& first() const {
        for (const Member& member : members_)
            if (!*member.left_out) return *member.job;
        throw none_left(last_reason_);
    }
    // The first ones last, as they are taken from the end. Enough of them that none waits long for the slowest.
    [[nodiscard]] std::vector<SampleRange> units_of(SampleRange range) const {
        constexpr std::uint64_t units_per_member = 8;
        const std::uint64_t wanted = range.count() / (units_per_member * members_.size());
        const std::uint64_t unit = std::max(samples_per_block, std::bit_floor(std::max<std::uint64_t>(1, wanted)));
        std::vector<SampleRange> units = cut({range}, unit);
        std::ranges::reverse(units);
        return units;
    }

    // Until all have ended, or are given up. A long time between two looks is that of a process that was paused, with
    // its members: no silence.
    void wait(Sharing& all, const RenderControl& control) const {
        constexpr double poll = 0.05;  // seconds
        std::unique_lock hold(all.lock);
        for (Stopwatch since_look; !all.all_ended();) {
            all.changed.wait_for(hold, std::chrono::duration<double>(poll));
            const double passed = std::min(since_look.seconds(), 2.0 * poll);
            since_look = Stopwatch();
            double samples = all.done, most = 0.0;
            for (Sharing::Hand& hand : all.hands) {
                if (!hand.working) continue;
                samples += hand.samples;
                most = std::max(most, hand.samples);
                hand.silent += passed;
                if (hand.silent < patience_) continue;
                hand.given_up = true;
                hand.working = false;
                hand.reason = fmt::format("it has not answered for {:.0f} s", hand.silent);
                all.units.push_back(hand.unit);
                all.changed.notify_all();
            }
            if (!control.progress) continue;
            if (all.done == 0.0 && most < 1.0) samples = most;  // halves of two are no sample of every pixel
            hold.unlock();
            control.progress(samples);
            hold.lock();
        }
    }

    void leave_out(const Sharing& all, const std::vector<std::size_t>& who) {
        for (std::size_t i = 0; i < who.size(); ++i) {
            if (all.hands[i].reason.empty()) continue;
            last_reason_ = exclude(members_[who[i]], all.hands[i].reason, told_);
            if (all.hands[i].given_up) keep_for_ever(members_[who[i]]);
        }
    }

    std::vector<Member> members_;
    RenderSettings settings_;
    Told told_;
    double patience_;  // seconds
    std::string last_reason_;
};

class DeviceGroup final : public Renderer {
public:
    DeviceGroup(std::vector<std::unique_ptr<Renderer>> members, Told told, double patience)
        : told_(std::move(told)), patience_(patience) {
        for (std::unique_ptr<Renderer>& member : members) {
            const std::string name = member->info().device;
            members_.push_back({name, std::move(member), std::make_shared<bool>(false), nullptr});
        }
    }

    [[nodiscard]] RendererInfo info() const override {
        RendererInfo all = members_.front().renderer->info();
        std::map<std::string, std::size_t> devices;
        std::set<std::string> backends, drivers, apis;
        for (const Member& member : members_) {
            const RendererInfo one = member.renderer->info();
            ++devices[one.device];
            backends.insert(one.backend);
            drivers.insert(one.driver);
            apis.insert(one.api);
            all.follows_numbers = all.follows_numbers && one.follows_numbers;
            all.samples_lights = all.samples_lights && one.samples_lights;
        }
        all.device.clear();
        for (const auto& [device, count] : devices)
            all.device += fmt::format(
                "{}{}{}", all.device.empty() ? "" : " + ", count == 1 ? "" : fmt::format("{} x ", count), device);
        all.backend = fmt::format("{}", fmt::join(backends, " + "));
        all.driver = fmt::format("{}", fmt::join(drivers, " + "));
        all.api = fmt::format("{}", fmt::join(apis, " + "));
        return all;
    }

    [[nodiscard]] std::unique_ptr<RenderJob> prepare(const Scene& scene, const RenderSettings& settings) override {
        std::vector<Member> ready;
        std::string last = "it failed before";
        for (Member& member : members_) {
            if (*member.left_out) continue;
            Member one = member;
            try {
                one.job = member.renderer->prepare(scene, settings);
            } catch (const UnsupportedError&) {
                throw;
            } catch (const InputError&) {
                throw;
            } catch (const std::exception& error) {
                last = exclude(member, error.what(), told_);
                continue;
            }
            ready.push_back(std::move(one));
        }
        if (ready.empty()) throw none_left(last);
        return std::make_unique<GroupJob>(std::move(ready), settings, told_, patience_);
    }
    [[nodiscard]] std::unique_ptr<RayIntersector> intersector(
        const Scene& scene, const RenderSettings& settings) override {
        return members_.front().renderer->intersector(scene, settings);
    }
    [[nodiscard]] std::unique_ptr<ArithmeticProbe> arithmetic() override {
        return members_.front().renderer->arithmetic();
    }

private:
    std::vector<Member> members_;  // without jobs
    Told told_;
    double patience_;
};

}  // namespace

std::unique_ptr<Renderer> device_group(
    std::vector<std::unique_ptr<Renderer>> members, std::function<void(const std::string&)> told, double patience) {
    if (members.size() == 1) return std::move(members.front());
    return std::make_unique<DeviceGroup>(std::move(members), std::move(told), patience);
}

}  // namespace tandem
