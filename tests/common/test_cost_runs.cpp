// How `tandem cost` samples: rounds, floors, references, what is kept, mixes of knobs.
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <fstream>
#include <mutex>
#include <nlohmann/json.hpp>

#include "common/deadline.h"
#include "common/render/concurrent_renderer.h"
#include "tests/common/known_cost.h"
#include "tests/scene_builder.h"
#include "tests/temporary_folder.h"

namespace tandem {
namespace {

using namespace known_cost;

TEST_CASE("cost: a device that is slow until it is warm gets the samples of one that is warm") {
    double busy = 0.0;
    CostRequest request = request_for(0.0);
    request.make = [&](const BackendOptions& options) {
        struct Cold : KnownRenderer {
            Cold(const BackendOptions& options, double& busy) : KnownRenderer(options, 0.0), busy_(busy) {}
            std::unique_ptr<RenderJob> prepare(const Scene& scene, const RenderSettings& settings) override {
                struct ColdJob : RenderJob {
                    ColdJob(std::unique_ptr<RenderJob> job, double& busy) : job_(std::move(job)), busy_(busy) {}
                    RenderResult render(SampleRange range, const RenderControl& control) override {
                        RenderResult result = job_->render(range, control);
                        if (busy_ < 0.15) result.seconds *= 4.0;
                        busy_ += result.seconds;
                        return result;
                    }
                    std::unique_ptr<RenderJob> job_;
                    double& busy_;
                };
                return std::make_unique<ColdJob>(KnownRenderer::prepare(scene, settings), busy_);
            }
            double& busy_;
        };
        return std::make_unique<Cold>(options, busy);
    };
    const auto short_samples = [](const CostRequest& asked) {
        std::vector<std::uint64_t> counts;
        int looks = 0;
        CostControl control = control_of(looks);
        control.save = [&](const CostSamples& samples) {
            counts.clear();
            for (const ArmTrials& trials : samples.arms)
                if (trials.stage == short_stage && !trials.name.starts_with("mix"))
                    counts.push_back(trials.samples.back());
        };
        (void)run_cost(Scene{}, asked, control);
        return counts;
    };
    CHECK(short_samples(request) == short_samples(request_for(0.0)));
}

TEST_CASE("cost: arms are made ready at once where the renderer can, and stay in their order") {
    struct Meeting {
        std::mutex mutex;
        std::condition_variable changed;
        int calls = 0, inside = 0;
        bool met = false;
    } meeting;
    struct Concurrent : KnownRenderer, ConcurrentRenderer {
        Concurrent(const BackendOptions& options, Meeting& meeting) : KnownRenderer(options, 0.0), meeting_(meeting) {}
        unsigned prepares_at_once() const override { return 2; }
        std::unique_ptr<RenderJob> prepare(const Scene& scene, const RenderSettings& settings) override {
            std::unique_lock lock(meeting_.mutex);
            if (meeting_.calls++ > 0 && !meeting_.met) {  // the baseline comes alone
                ++meeting_.inside;
                meeting_.changed.notify_all();
                meeting_.changed.wait_for(
                    lock, std::chrono::seconds(10), [&] { return meeting_.met || meeting_.inside > 1; });
                meeting_.met = meeting_.met || meeting_.inside > 1;
                --meeting_.inside;
                meeting_.changed.notify_all();
            }
            lock.unlock();
            return KnownRenderer::prepare(scene, settings);
        }
        Meeting& meeting_;
    };
    const auto names_of = [](const CostRequest& request) {
        int looks = 0;
        CostControl control = control_of(looks);
        std::mutex mutex;
        control.now = [&mutex, now = control.now] {
            const std::lock_guard lock(mutex);
            return now();
        };
        const CostReport report = run_cost(Scene{}, request, control);
        std::vector<std::string> names;
        for (const ArmFigures& figures : report.figures) names.push_back(figures.arm.name());
        for (const SkippedArm& skipped : report.skipped) names.push_back(skipped.setting + ": " + skipped.reason);
        return names;
    };
    CostRequest request = request_for(0.0);
    request.seconds = 20.0;
    const std::vector<std::string> one_by_one = names_of(request);
    CHECK(std::ranges::find(one_by_one, "bidirectional: no bidirectional paths here") != one_by_one.end());
    request.make = [&](const BackendOptions& options) { return std::make_unique<Concurrent>(options, meeting); };
    CHECK(names_of(request) == one_by_one);
    CHECK(meeting.met);
}

TEST_CASE("cost: arms of unlike numbers of samples are held against each other at one that both have") {
    const auto trials = [](std::vector<std::uint64_t> samples) {
        ArmTrials arm;
        arm.samples = std::move(samples);
        for (std::uint64_t round = 0; round < 5; ++round) {
            Replicate replicate;
            replicate.round = round;
            for (const std::uint64_t count : arm.samples)
                replicate.seconds.push_back(1.0 + 0.01 * static_cast<double>(count));
            arm.replicates.push_back(replicate);
        }
        return arm;
    };
    CHECK(paired_seconds(trials({8, 16, 32}), trials({16, 32, 64, 128})).value == doctest::Approx(0.0));
    CHECK(paired_seconds(trials({1, 2}), trials({32, 64})).value == doctest::Approx(std::log(0.51 / (1.64 / 64.0))));
}

TEST_CASE("cost: floors are found where there are none no more often than 5 % of the runs") {
    unsigned false_floors = 0, intervals = 0, held = 0;
    for (std::uint64_t seed = 1; seed <= 12; ++seed) {
        CostRequest request = request_for(0.0, seed);
        request.seconds = 3.0;
        int looks = 0;
        const CostReport report = run_cost(Scene{}, std::move(request), control_of(looks));
        bool any = false;
        for (const ArmFigures& figures : report.figures) {
            any = any || figures.has_floor;
            ++intervals;
            held += figures.squared_bias.high >= 0.0 && figures.squared_bias.low <= 0.0 ? 1 : 0;
        }
        false_floors += any ? 1 : 0;
    }
    // More than 3 of 12 at 5 %: once in 450.
    CHECK(false_floors <= 3);
    CHECK(held >= intervals * 8 / 10);
}

TEST_CASE("cost: the reference's noise is known and does not enter the floors") {
    const CostReport report = measured(0.0);
    const CostReference& reference = report.reference;
    const double expected = std::sqrt(0.25 / static_cast<double>(reference.samples)) / level;  // by next events
    CHECK(reference.relative_uncertainty() == doctest::Approx(expected).epsilon(0.2));
    for (const double variance : reference.half_variance)
        CHECK(variance == doctest::Approx(0.5 / static_cast<double>(reference.samples)).epsilon(0.25));
    CHECK(reference.image_mean() == doctest::Approx(level).epsilon(0.01));
}

TEST_CASE("cost: a reference is continued to the same bits but for rounding, by its own account of time") {
    RenderSettings settings;
    settings.width = settings.height = 4;
    KnownRenderer renderer({}, 0.0);
    const auto job = renderer.prepare(Scene{}, settings);
    int looks = 0;
    const CostReference part = render_reference(*job, std::nullopt, 0.3, control_of(looks));
    const CostReference whole = render_reference(*job, part, 0.9, control_of(looks));
    CHECK(whole.samples > part.samples);
    CHECK(whole.seconds >= 0.9);
    // In one go.
    const RenderResult first = job->render({0, whole.samples / 2});
    const PixelValues mean = mean_of(first.estimate), variance = variance_of(first.estimate);
    for (std::size_t i = 0; i < mean.size(); ++i)
        CHECK(whole.mean[i] + whole.half_difference[i] == doctest::Approx(mean[i]).epsilon(1e-12));
    CHECK(whole.half_variance[0] == doctest::Approx(variance[0] / static_cast<double>(whole.samples / 2)).epsilon(0.1));
}

TEST_CASE("cost: a measurement is saved after every round, continued, and refused where it is of something else") {
    CostRequest request = request_for(0.1);
    int looks = 0;
    CostControl control = control_of(looks);
    std::string saved;
    control.save = [&](const CostSamples& samples) { saved = to_bytes(samples); };
    const CostReport first = run_cost(Scene{}, request, control);
    request.earlier = samples_from_bytes(saved, "saved");
    const auto replicates_of = [](const CostSamples& samples) {
        std::size_t count = 0;
        for (const ArmTrials& arm : samples.arms) count += arm.replicates.size();
        return count;
    };
    const std::size_t replicates = replicates_of(*request.earlier);
    const CostReport second = run_cost(Scene{}, request, control);
    CHECK(replicates_of(samples_from_bytes(saved, "saved")) >= replicates + fewest_replicates);
    CHECK(second.seconds > first.seconds);
    CHECK(second.reference.samples == first.reference.samples);  // replicates are held against it

    request.earlier = samples_from_bytes(saved, "saved");
    request.baseline.render.bounces = 3;
    CHECK_THROWS_AS((void)run_cost(Scene{}, request, control), InputError);
    request.earlier = samples_from_bytes(saved, "saved");
    request.baseline.render.bounces = RenderSettings{}.bounces;
    request.program = "another";
    CHECK_THROWS_AS((void)run_cost(Scene{}, request, control), InputError);
    request.program = "";
    std::ranges::reverse(request.knobs);  // which are the same
    request.earlier = samples_from_bytes(saved, "saved");
    CHECK_NOTHROW((void)run_cost(Scene{}, request, control));
    request.earlier = samples_from_bytes(saved, "saved");
    request.knobs = {"generator"};  // of other arms, which would never be held against those that are there
    CHECK_THROWS_AS((void)run_cost(Scene{}, request, control), InputError);
    CHECK_THROWS_AS((void)samples_from_bytes(saved.substr(0, saved.size() / 2), "half"), InputError);
    CHECK_THROWS_AS((void)samples_from_bytes("", "empty"), InputError);
    CHECK_THROWS_AS((void)reference_from_bytes(saved, "other"), InputError);
    for (std::size_t i = 0; i < saved.size(); i += 1 + saved.size() / 97) {  // a bit of a figure makes another figure
        std::string damaged = saved;
        damaged[i] = static_cast<char>(damaged[i] ^ (1 << (i % 8)));
        CHECK_THROWS_AS((void)samples_from_bytes(damaged, "damaged"), InputError);
    }
}

TEST_CASE("cost: a reference that an early stop left goes on, as nothing is held against it yet") {
    CostRequest request = request_for(0.1);
    int looks = 0;
    const CostReport whole = run_cost(Scene{}, request, control_of(looks));
    CostControl stopped = control_of(looks);
    std::stop_source stop;
    std::string saved;
    stopped.stop = stop.get_token();
    stopped.save = [&](const CostSamples& samples) { saved = to_bytes(samples); };
    stopped.progress = [&](double, const std::string& what) {
        if (what == "the long reference") stop.request_stop();
    };
    CHECK_THROWS_AS((void)run_cost(Scene{}, request, stopped), StoppedError);
    request.earlier = samples_from_bytes(saved, "saved");
    const std::uint64_t before = request.earlier->reference.samples;
    CHECK(before < whole.reference.samples / 2);
    const CostReport second = run_cost(Scene{}, request, control_of(looks));
    CHECK(second.reference.samples > before);
    CHECK(static_cast<double>(second.reference.samples) > 0.8 * static_cast<double>(whole.reference.samples));
}

TEST_CASE("cost: references are cached by what they depend on") {
    const TemporaryFolder folder;
    CostRequest request = request_for(0.0);
    request.references = folder / "references";
    const auto files = [&] {
        std::size_t count = 0;
        for (const auto& entry : std::filesystem::directory_iterator(request.references))
            count += entry.exists() ? 1 : 0;
        return count;
    };
    int looks = 0;
    const CostReport first = run_cost(Scene{}, request, control_of(looks));
    CHECK(files() == 1);
    const CostReport second = run_cost(Scene{}, request, control_of(looks));
    CHECK(second.reference.samples == first.reference.samples);  // it has had its share of the time
    CHECK(files() == 1);
    request.scene_bytes = "another scene";
    (void)run_cost(Scene{}, request, control_of(looks));
    CHECK(files() == 2);
    for (const auto& entry : std::filesystem::directory_iterator(request.references))
        std::ofstream(entry.path()) << "rubbish";
    CHECK_THROWS_AS((void)run_cost(Scene{}, request, control_of(looks)), InputError);
    // A cache is done without, and why is told.
    std::vector<std::string> faults;
    request.cache_fault = [&](const InputError& error) { faults.emplace_back(error.what()); };
    CHECK(run_cost(Scene{}, request, control_of(looks)).reference.samples > 0);
    CHECK(faults.size() == 1);
    faults.clear();
    CHECK(run_cost(Scene{}, request, control_of(looks)).reference.samples > 0);
    CHECK(faults.empty());  // it was written anew
    std::ofstream(folder / "file") << "no folder";
    request.references = folder / "file" / "references";
    CHECK(run_cost(Scene{}, request, control_of(looks)).reference.samples > 0);
    CHECK(faults.size() == 1);
    request.cache_fault = {};
    CHECK_THROWS_AS((void)run_cost(Scene{}, request, control_of(looks)), InputError);
}

TEST_CASE("cost: an unknown knob and a black image are refused") {
    CostRequest request = request_for(0.0);
    int looks = 0;
    request.knobs = {"colour"};
    CHECK_THROWS_AS((void)run_cost(Scene{}, request, control_of(looks)), InputError);
    request = request_for(0.0);
    CostControl by_looks;
    by_looks.now = [&looks] { return 0.1 * looks++; };
    request.make = request.make_reference = [](const BackendOptions&) {
        return std::make_unique<SyntheticRenderer>(
            [](std::uint32_t, std::uint32_t, SampleRandom&) { return Radiance{}; });
    };
    request.baseline.render.width = request.baseline.render.height = 1;
    request.seconds = 1.0;
    CHECK_THROWS_AS((void)run_cost(Scene{}, request, by_looks), InputError);
}

TEST_CASE("cost: a mix has a limit of bounces or roulette, whichever is better, as either undoes the other") {
    const auto figure = [](const char* knob, const char* setting, double cost) {
        ArmFigures arm;
        arm.arm = {knob, setting, "", {}, true};
        arm.cost_ratio = {cost, cost, cost};
        arm.cost_differs = true;
        return arm;
    };
    const std::vector<ArmFigures> figures{figure("baseline", "", 1.0), figure("bounces", "16", 0.8),
        figure("generator", "sobol", 0.5), figure("roulette", "4", 0.7), figure("roulette", "8", 0.9)};
    CHECK(mixed_settings(figures).front() == std::vector<std::size_t>{2, 3});
    const std::vector<ArmFigures> lights{figure("baseline", "", 1.0), figure("integrator", "next-event", 0.8),
        figure("mis", "off", 0.7), figure("generator", "hash", 0.9)};
    CHECK(mixed_settings(lights).front() == std::vector<std::size_t>{2, 3});
    const std::vector<ArmFigures> choices{figure("baseline", "", 1.0), figure("integrator", "bidirectional", 0.8),
        figure("light-sampling", "tree", 0.7), figure("generator", "hash", 0.9)};
    CHECK(mixed_settings(choices).front() == std::vector<std::size_t>{2, 3});  // which bidirectional has not
    const std::vector<ArmFigures> noise{figure("baseline", "", 1.0), figure("generator", "sobol", 0.6),
        figure("sampling", "adaptive", 0.5), figure("integrator", "next-event", 0.8)};
    CHECK(mixed_settings(noise).front() == std::vector<std::size_t>{2, 3});  // which refuses Sobol points
}

TEST_CASE("cost: where a limit of bounces may leave more than 0.3 %, Sobol points are measured without it, too") {
    const auto figure = [](const char* knob, const char* setting, double cost, std::uint32_t bounces) {
        ArmFigures arm;
        arm.arm = {knob, setting, "", {}, true};
        arm.arm.settings.render.bounces = bounces;
        arm.cost_ratio = {cost, cost, cost};
        return arm;
    };
    std::vector<ArmFigures> figures{figure("baseline", "", 1.0, 10), figure("bounces", "8", 0.8, 8),
        figure("bounces", "32", 1.2, 32), figure("roulette", "1", 1.4, 256), figure("roulette", "8", 1.1, 256),
        figure("generator", "sobol", 0.5, 10), figure("sampling", "adaptive", 0.9, 10)};
    const std::vector<std::vector<std::size_t>> without_limit{{4, 5}, {4, 6}};
    figures.front().squared_bias = {0.0, 0.0, 0.0029 * 0.0029};
    CHECK(mixed_settings(figures).empty());
    figures.front().squared_bias.high = 0.0031 * 0.0031;
    CHECK(mixed_settings(figures) == without_limit);
    figures[4].has_floor = true;
    figures[4].squared_bias.value = 0.0049 * 0.0049;  // 1 % can be reached with it
    CHECK(mixed_settings(figures) == without_limit);
    figures[4].squared_bias.value = 0.0051 * 0.0051;
    // A higher limit may leave a bias, too: the cheapest without any is there besides.
    CHECK(mixed_settings(figures) == std::vector<std::vector<std::size_t>>{{2, 5}, {3, 5}, {2, 6}, {3, 6}});
    // What is best with independent samples goes with them, and is left out, too.
    figures.push_back(figure("integrator", "path", 0.9, 10));
    figures.back().cost_differs = true;
    CHECK(mixed_settings(figures) == std::vector<std::vector<std::size_t>>{{5, 7}, {2, 5, 7}, {2, 5}, {3, 5, 7}, {3, 5},
                                         {6, 7}, {2, 6, 7}, {2, 6}, {3, 6, 7}, {3, 6}});
}

TEST_CASE("cost: of a setting without noise it is said that there is none") {
    CostPoint point;
    point.samples = 4;
    point.seconds = {1.0, 1.0, 1.0};
    CostReport report;
    for (const double variance : {0.25, 0.0, 0.5}) {
        ArmFigures& arm = report.figures.emplace_back();
        arm.arm.knob = "bounces";
        arm.points.push_back(point);
        arm.variance = variance;
    }
    const std::vector<std::string> sentences = recommendations(report);
    const std::string without = sentences.at(sentences.size() - 2), with = sentences.back();
    CHECK(without.find("time; there is no noise.") != std::string::npos);
    CHECK(with.find("; the noise is down as soon as the baseline's") != std::string::npos);
}

TEST_CASE("cost: the best settings of several knobs are measured together") {
    CostRequest request = request_for(0.0);
    request.knobs = {"integrator", "bounces"};
    request.seconds = 30.0;
    // Fewer bounces take half the time and cost nothing here: a renderer whose paths end by themselves.
    request.make = [](const BackendOptions& options) -> std::unique_ptr<Renderer> {
        struct Sooner : KnownRenderer {
            using KnownRenderer::KnownRenderer;
            std::unique_ptr<RenderJob> prepare(const Scene& scene, const RenderSettings& settings) override {
                struct FasterJob : RenderJob {
                    std::unique_ptr<RenderJob> job;
                    double factor = 1.0;
                    RenderResult render(SampleRange range, const RenderControl& control) override {
                        RenderResult result = job->render(range, control);
                        result.seconds *= factor;
                        return result;
                    }
                };
                auto faster = std::make_unique<FasterJob>();
                faster->job = KnownRenderer::prepare(scene, settings);
                faster->factor = settings.bounces == 8 ? 0.5 : 1.0;
                return faster;
            }
        };
        return std::make_unique<Sooner>(options, 0.3);
    };
    int looks = 0;
    const CostReport report = run_cost(Scene{}, request, control_of(looks));
    const ArmFigures& mix = arm(report, "mix integrator next-event + bounces 8");
    CHECK(mix.arm.options == "--integrator next-event --bounces 8");
    CHECK(mix.cost_ratio.value == doctest::Approx(0.25).epsilon(0.1));
    CHECK(soonest(report.figures, 0.01) == &mix);
}

}  // namespace
}  // namespace tandem
