// Rendering until enough: which of samples, error, time and stop request ends a render.
#include <doctest/doctest.h>

#include <algorithm>
#include <bit>
#include <chrono>
#include <cmath>
#include <thread>

#include "common/deadline.h"
#include "common/render/scrambled_film.h"
#include "common/render/stopping.h"
#include "common/stopwatch.h"
#include "tests/common/synthetic_renderer.h"

using namespace tandem;

namespace {

StoppedRender stopped(const StoppingRule& rule, const Sampler& sampler, std::stop_token stop = {}) {
    RenderSettings settings;
    settings.width = settings.height = 4;
    SyntheticJob job(settings, sampler);
    return render_until(job, rule, stop, {});
}

Radiance noisy(std::uint32_t, std::uint32_t, SampleRandom& random) {
    const double value = random.exponential();
    return {value, value, value};
}
Radiance black(std::uint32_t, std::uint32_t, SampleRandom&) { return {0.0, 0.0, 0.0}; }

}  // namespace

TEST_CASE("a render by samples has just so many") {
    const StoppedRender result = stopped({.samples = 100, .seconds = {}, .relative_error = {}}, noisy);
    CHECK(result.film.count() == 100);
    CHECK(result.complete);
}

TEST_CASE("a render by error ends at the samples that the error needs") {
    // The standard deviation is the mean, so 2 % takes 2500 samples; the step overshoots by a quarter and a block at
    // most.
    const StoppedRender result = stopped({.samples = {}, .seconds = {}, .relative_error = 0.02}, noisy);
    CHECK(*result.relative_error <= 0.02);
    CHECK(result.film.count() > 2000);
    CHECK(result.film.count() < 3800);
    CHECK(result.complete);
}

namespace {

// Renders of exponential samples by an error of 15 %, which takes 44 of them. `expected`: by the forecast.
StoppedRender by_forecast(SyntheticJob& job, double expected, std::stop_token stop = {}) {
    return render_until(
        job, {.samples = {}, .seconds = {}, .relative_error = 0.15, .expected_samples = expected}, stop, {});
}

RenderSettings many_pixels() {
    RenderSettings settings;
    settings.width = settings.height = 64;
    return settings;
}

}  // namespace

TEST_CASE("a render by error that needs less than a block ends within it, where that is forecast") {
    SyntheticJob job(many_pixels(), noisy);
    const StoppedRender result = by_forecast(job, 46.5);
    CHECK(result.film.count() == 48);  // a multiple of two
    CHECK(*result.relative_error <= 0.15);
    CHECK(result.relative_error_interval.has_value());
}

TEST_CASE("a forecast that was too low is mended, and the image is that of as many samples") {
    SyntheticJob job(many_pixels(), noisy);
    const StoppedRender result = by_forecast(job, 10.0);
    CHECK(result.film.count() >= 42);
    CHECK(result.film.count() <= 50);
    const auto samples = static_cast<std::uint64_t>(result.film.count());
    const Estimate::Plane asked = SyntheticJob(many_pixels(), noisy).render({0, samples}, {}).estimate.totals();
    CHECK(std::ranges::equal(result.film.moments, asked,
        [](const Moments& a, const Moments& b) { return a.sum == b.sum && a.sum_of_squares == b.sum_of_squares; }));
}

TEST_CASE("a look that misses beyond the first block costs no more than that block") {
    SyntheticJob job(many_pixels(), noisy);  // 6.25 % take 256 samples, and are missed or met near there
    for (const double target : {0.0620, 0.0625, 0.0630}) {
        const StoppedRender result =
            render_until(job, {.samples = {}, .seconds = {}, .relative_error = target}, {}, {});
        CHECK(*result.relative_error <= target);
        CHECK(result.film.count() <= 1.1 / (target * target) + samples_per_block);
    }
}

TEST_CASE("an error that no number of samples meets is asked for in steps") {
    SyntheticJob job(many_pixels(), noisy);
    const StoppingRule rule{.samples = 256, .seconds = {}, .relative_error = 1e-300, .expected_samples = 1e300};
    CHECK(render_until(job, rule, {}, {}).film.count() == 256);
}

TEST_CASE("after a first look a render by error ends at the samples that it needs, within a block, too") {
    SyntheticJob job(many_pixels(), noisy);  // 10 % take 100 samples
    const StoppedRender result = render_until(job, {.samples = {}, .seconds = {}, .relative_error = 0.1}, {}, {});
    CHECK(result.film.count() >= 96);
    CHECK(result.film.count() <= 112);
    StoppingRule whole{.samples = {}, .seconds = {}, .relative_error = 0.1};
    whole.whole_blocks = true;
    CHECK(render_until(job, whole, {}, {}).film.count() == 2 * samples_per_block);
}

// Goes on within blocks, and counts the samples that it renders. A stop ends its second call before there are more.
class GoingOnJob : public SyntheticJob {
public:
    explicit GoingOnJob(std::stop_source* stop = nullptr) : SyntheticJob(many_pixels(), noisy), stop_(stop) {}
    bool goes_on_in_blocks() const override { return true; }
    RenderResult render(SampleRange range, const RenderControl& control) override {
        const std::uint64_t begun = samples_begun(control, range);
        if (begun > 0) (void)control.begun->take_ragged_moments(range.begin);
        if (++calls_ == 2 && stop_ != nullptr) {
            stop_->request_stop();
            range.end = range.begin + begun;
        }
        rendered += range.count() - begun;
        return SyntheticJob::render(range, {});
    }
    std::uint64_t rendered = 0;

private:
    std::stop_source* stop_;
    unsigned calls_ = 0;
};

TEST_CASE("a job that goes on within a block renders no sample twice, and ends nearer to what is needed") {
    for (const double expected : {10.0, 42.0}) {  // 44 are needed
        CAPTURE(expected);
        GoingOnJob job;
        const StoppedRender result = by_forecast(job, expected);
        CHECK(*result.relative_error <= 0.15);
        CHECK(result.film.count() >= 42);
        CHECK(result.film.count() <= 48);
        CHECK(static_cast<double>(job.rendered) == result.film.count());
    }
    std::stop_source source;
    GoingOnJob stopping(&source);
    CHECK(by_forecast(stopping, 10.0, source.get_token()).film.count() == 10);
}

TEST_CASE("a stop while a block is rendered anew keeps the samples that it had") {
    std::stop_source source;
    SyntheticJob job(many_pixels(), noisy);
    class Stopping : public RenderJob {
    public:
        Stopping(RenderJob& inner, std::stop_source& source) : inner_(inner), source_(source) {}
        RenderResult render(SampleRange range, const RenderControl& control) override {
            if (++calls_ < 2) return inner_.render(range, control);
            source_.request_stop();
            return inner_.render({range.begin, range.begin + 3}, {});
        }

    private:
        RenderJob& inner_;
        std::stop_source& source_;
        unsigned calls_ = 0;
    } stopping(job, source);
    const StoppingRule rule{.samples = {}, .seconds = {}, .relative_error = 0.15, .expected_samples = 10.0};
    const StoppedRender result = render_until(stopping, rule, source.get_token(), {});
    CHECK(result.film.count() == 10);
    CHECK_FALSE(result.complete);
}

TEST_CASE("scramblings end within a block, too, with as many points each") {
    const StoppedRender result = [] {
        SyntheticJob job(many_pixels(), noisy);
        const StoppingRule rule{.samples = {}, .seconds = {}, .relative_error = 0.15, .expected_samples = 49.0};
        return render_until(job, rule, {}, {}, Sampling::uniform, 2);
    }();
    CHECK(result.film.count() == 50);
    CHECK(*result.relative_error <= 0.15);
}

TEST_CASE("a black image has no relative error, and a render by error gives it up") {
    const StoppedRender result = stopped({.samples = {}, .seconds = {}, .relative_error = 0.02}, black);
    CHECK_FALSE(result.relative_error.has_value());
    CHECK_FALSE(result.complete);
}

TEST_CASE("few pixels that are black in their first samples make no black image") {
    const Sampler rare = [](std::uint32_t, std::uint32_t, SampleRandom& random) {
        const double value = random.exponential() > 12.0 ? 1.0 : 0.0;  // six paths of a million find the light
        return Radiance{value, value, value};
    };
    REQUIRE_FALSE(stopped({.samples = 1024, .seconds = {}, .relative_error = 0.9}, rare).relative_error.has_value());
    const StoppedRender result = stopped({.samples = {}, .seconds = {}, .relative_error = 0.9}, rare);
    CHECK(result.complete);
    CHECK(*result.relative_error <= 0.9);
}

TEST_CASE("more samples than scramblings have are refused at once") {
    RenderSettings settings;
    settings.width = settings.height = 4;
    SyntheticJob job(settings, noisy);
    CHECK_THROWS_AS(
        static_cast<void>(render_until(
            job, {.samples = 3 * most_points, .seconds = {}, .relative_error = {}}, {}, {}, Sampling::uniform, 2)),
        UnsupportedError);
}

TEST_CASE("a black image is rendered to its end where samples are asked for too") {
    const StoppedRender result = stopped({.samples = 5000, .seconds = {}, .relative_error = 0.02}, black);
    CHECK(result.film.count() == 5000);
    CHECK(result.complete);
}

TEST_CASE("a stop request ends a render that nothing else would end soon") {
    std::stop_source source;
    std::uint64_t samples = 0;
    const StoppedRender result = stopped(
        {.samples = std::uint64_t{1} << 40, .seconds = {}, .relative_error = {}},
        [&](std::uint32_t x, std::uint32_t y, SampleRandom& random) {
            if (++samples == 1000) source.request_stop();
            return noisy(x, y, random);
        },
        source.get_token());
    CHECK_FALSE(result.complete);
    CHECK(result.film.count() > 0);
}

TEST_CASE("a render by time has one sample at least") {
    const StoppedRender result = stopped({.samples = {}, .seconds = 1e-9, .relative_error = {}}, noisy);
    CHECK(result.film.count() > 0);
}

TEST_CASE("a first sample that does not end in its time is given up, and the part that was done is told") {
    // A job that only a stop ends.
    class Endless : public RenderJob {
    public:
        RenderResult render(SampleRange, const RenderControl& control) override {
            control.progress(0.25);
            while (!control.stop.stop_requested()) std::this_thread::yield();
            return {Estimate(4, 4), 0.0, std::nullopt};
        }
    } job;
    const StoppedRender result =
        render_until(job, {.samples = {}, .seconds = 0.01, .relative_error = {}, .first_sample_seconds = 0.03}, {}, {});
    CHECK(result.film.count() == 0);
    CHECK(result.begun == 0.25);
}

TEST_CASE("the time ends a render as soon as every pixel has a sample, and not before") {
    // It goes on after its time until it has a sample, and would go on for ever.
    class Slow : public RenderJob {
    public:
        RenderResult render(SampleRange range, const RenderControl& control) override {
            const Stopwatch watch;
            double done = 0.0;
            while (!control.stop.stop_requested()) {
                done = watch.seconds() / 0.05;
                control.progress(done);
            }
            Estimate estimate(4, 4);
            const std::uint64_t samples = std::min(range.count(), static_cast<std::uint64_t>(done));
            if (samples > 0)
                estimate.add_block(
                    {range.begin, range.begin + samples}, Estimate::Plane(estimate.pixel_count() * channel_count));
            return {std::move(estimate), watch.seconds(), std::nullopt};
        }
    } job;
    const StoppedRender result = render_until(job, {.samples = {}, .seconds = 0.01, .relative_error = {}}, {}, {});
    CHECK(result.film.count() >= 1);
    CHECK(result.seconds >= 0.05);
}

TEST_CASE("a deadline comes with the stop that it follows, or at its time, or never") {
    std::stop_source source;
    const Deadline never(source.get_token(), std::nullopt), late(source.get_token(), 1e12), soon({}, 0.01);
    CHECK_FALSE(never.passed());
    CHECK_FALSE(late.passed());
    while (!soon.passed()) std::this_thread::yield();
    source.request_stop();
    CHECK(never.passed());
    CHECK(late.passed());
}

TEST_CASE("a render by time ends") {
    const StoppedRender result = stopped({.samples = {}, .seconds = 0.01, .relative_error = {}}, noisy);
    CHECK(result.film.count() > 0);
    CHECK(result.complete);
}

TEST_CASE("a target error is met, and the interval that is stated holds the error that the image has") {
    // Light tails and heavier ones, unevenly over the image; the truth is 1 everywhere.
    const auto uneven = [](std::uint32_t x, std::uint32_t, SampleRandom& random) {
        const double value = x % 4 == 0 ? random.exponential() : 1.0 + 0.3 * random.triangular();
        return Radiance{value, value, value};
    };
    for (const Sampling sampling : {Sampling::uniform, Sampling::adaptive}) {
        CAPTURE(sampling_names[static_cast<std::size_t>(sampling)]);
        constexpr double target = 0.04;
        unsigned held = 0;
        constexpr unsigned renders = 40;
        for (unsigned i = 0; i < renders; ++i) {
            RenderSettings settings;
            settings.width = settings.height = 24;
            settings.seed = 100 + i;
            settings.sampling = sampling;
            SyntheticJob job(settings, uneven);
            const StoppedRender result = render_until(job, {{}, {}, target}, {}, {}, sampling);
            REQUIRE(result.relative_error.has_value());
            REQUIRE(result.relative_error_interval.has_value());
            CHECK(*result.relative_error <= target);
            CHECK(*result.relative_error > 0.8 * target);  // not long after it was met
            double squares = 0.0;
            const std::vector<double> mean = mean_of(result.film);
            for (const double value : mean) squares += (value - 1.0) * (value - 1.0);
            const double error = std::sqrt(squares / static_cast<double>(mean.size()));
            const auto [low, high] = *result.relative_error_interval;
            CHECK(high / low < 1.5);  // it says something
            held += low <= error && error <= high ? 1 : 0;
        }
        // Fewer than 33 of 40 at 95 %: once in 10^3.5.
        CHECK(held >= 33);
    }
}

TEST_CASE(
    "adaptive sampling meets an error with fewer samples where noise is uneven, and its interval holds for lights "
    "that are rarely seen") {
    // A quarter of the pixels is lit once in fifty samples; the rest is nearly free of noise. The truth is 1
    // everywhere.
    const auto spotted = [](std::uint32_t x, std::uint32_t y, SampleRandom& random) {
        const bool rare = x / 6 % 2 == 0 && y / 6 % 2 == 0;
        const double value = rare ? (random.uniform() < 0.02 ? 50.0 : 0.0) : 1.0 + 0.1 * random.triangular();
        return Radiance{value, value, value};
    };
    constexpr double target = 0.08;
    unsigned held = 0;
    for (unsigned i = 0; i < 40; ++i) {
        RenderSettings settings;
        settings.width = settings.height = 24;
        settings.seed = 1000 + i;
        settings.sampling = Sampling::adaptive;
        SyntheticJob job(settings, spotted);
        const StoppedRender result = render_until(job, {{}, {}, target}, {}, {}, Sampling::adaptive);
        REQUIRE(result.relative_error_interval.has_value());
        double squares = 0.0;
        const std::vector<double> mean = mean_of(result.film);
        for (const double value : mean) squares += (value - 1.0) * (value - 1.0);
        const double error = std::sqrt(squares / static_cast<double>(mean.size()));
        held += result.relative_error_interval->low <= error && error <= result.relative_error_interval->high ? 1 : 0;
        // Uniform sampling needs 0.25 x 49 / 0.08^2 = 1914.
        CHECK(result.film.count() < 0.6 * 1914);
    }
    CHECK(held >= 33);
}

namespace {

// What a scrambling's pixel is off by, but for the number of points.
using Deviation = double (*)(std::uint64_t pixel, SampleRandom& random);

// Every fourth pixel has heavier tails.
double fairly_even(std::uint64_t pixel, SampleRandom& random) {
    return pixel % 4 == 0 ? random.exponential() - 1.0 : 0.3 * random.triangular();
}

// The first pixels make most of the error, and one scrambling of eight sees what the others miss. Their kurtosis is 3.1
// above the normal distribution's.
double uneven_and_rare(std::uint64_t pixel, SampleRandom& random) {
    return 0.1 / static_cast<double>(pixel + 1) * (random.uniform() < 0.125 ? 7.0 : -1.0);
}

// The mean of a scrambling's n points is off by a draw of its own that falls as n^-0.7, faster than that of independent
// samples. Ranges that grow keep the draw: their sums are those of all points so far.
class ScrambledJob : public RenderJob {
public:
    ScrambledJob(std::uint32_t side, std::uint64_t seed, Deviation deviation = fairly_even)
        : side_(side), seed_(seed), deviation_(deviation) {}
    RenderResult render(SampleRange range, const RenderControl&) override {
        RenderResult result;
        result.estimate = Estimate(side_, side_);
        const std::uint64_t scrambling = range.begin >> 32, first = range.begin & 0xFFFFFFFFu;
        CHECK(scrambling < 8);
        for (std::uint64_t block = 0; block < range.count(); block += samples_per_block) {
            Estimate::Plane plane(result.estimate.pixel_count() * channel_count);
            const std::uint64_t end = first + std::min(block + samples_per_block, range.count());
            for (std::uint64_t pixel = 0; pixel < result.estimate.pixel_count(); ++pixel) {
                SampleRandom random(seed_, pixel, scrambling);
                const double draw = deviation_(pixel, random);
                const auto sum = [&](std::uint64_t n) {
                    return static_cast<double>(n) + (n > 0 ? draw * std::pow(static_cast<double>(n), 0.3) : 0.0);
                };
                for (std::size_t c = 0; c < channel_count; ++c)
                    plane[pixel * channel_count + c].sum = sum(end) - sum(first + block);
            }
            result.estimate.add_block({range.begin + block, (range.begin - first) + end}, std::move(plane));
        }
        return result;
    }

private:
    std::uint32_t side_;
    std::uint64_t seed_;
    Deviation deviation_;
};

}  // namespace

TEST_CASE("the interval of Sobol points holds where tails are heavy and few pixels make the error") {
    for (const std::uint32_t side : {16u, 64u}) {  // of eight scramblings and of two
        const unsigned scramblings = scramblings_for(std::uint64_t{side} * side);
        CAPTURE(scramblings);
        unsigned held = 0;
        constexpr unsigned renders = 200;
        for (unsigned i = 0; i < renders; ++i) {
            ScrambledJob job(side, 100 + i, uneven_and_rare);
            const StoppedRender result =
                render_until(job, {scramblings * samples_per_block, {}, 1e-9}, {}, {}, Sampling::uniform, scramblings);
            REQUIRE(result.relative_error_interval.has_value());
            double squares = 0.0, sum = 0.0;
            const std::vector<double> mean = mean_of(result.film);
            for (const double value : mean) {
                squares += (value - 1.0) * (value - 1.0);
                sum += value;
            }
            const double error = std::sqrt(squares * static_cast<double>(mean.size())) / sum;
            const auto [low, high] = *result.relative_error_interval;
            held += low <= error && error <= high ? 1 : 0;
        }
        // Fewer than 180 of 200 at 95 %: once in 10^3.5.
        CHECK(held >= 180);
    }
}

TEST_CASE("Sobol points state an error by scramblings, meet a target, and their interval holds the true error") {
    for (const std::uint32_t side : {16u, 64u}) {  // of eight scramblings and of two
        const unsigned scramblings = scramblings_for(std::uint64_t{side} * side);
        CAPTURE(scramblings);
        constexpr double target = 0.01;
        unsigned held = 0;
        for (unsigned i = 0; i < 40; ++i) {
            ScrambledJob job(side, 100 + i);
            const StoppedRender result = render_until(job, {{}, {}, target}, {}, {}, Sampling::uniform, scramblings);
            REQUIRE(result.relative_error_interval.has_value());
            CHECK(*result.relative_error <= target);
            const std::uint64_t points = result.film.counts.front() / scramblings;
            CHECK(result.film.counts.front() == scramblings * points);
            CHECK(points % (std::bit_floor(points) / 16) == 0);  // nearly as even as a power of two
            double squares = 0.0;
            const std::vector<double> mean = mean_of(result.film);
            for (const double value : mean) squares += (value - 1.0) * (value - 1.0);
            const double error = std::sqrt(squares / static_cast<double>(mean.size()));
            const auto [low, high] = *result.relative_error_interval;
            CHECK(high / low < 2.0);  // it says something
            held += low <= error && error <= high ? 1 : 0;
        }
        CHECK(held >= 33);
    }
}

TEST_CASE("a look at scramblings sees their means, over whole blocks and the rest, also of unlike numbers of points") {
    RenderSettings settings;
    settings.width = settings.height = 4;
    SyntheticJob job(settings, noisy);
    const auto check = [&](std::uint64_t points, std::optional<double> stop_at) {
        CAPTURE(points);
        ScrambledFilm film(job, 2);
        std::stop_source source;
        const RenderControl control{.stop = source.get_token(), .progress = [&](double done) {
                                        if (stop_at && done >= *stop_at) source.request_stop();
                                    }};
        CHECK(film.grow_to(points, control).complete == !stop_at.has_value());
        const auto all = static_cast<std::uint64_t>(film.samples());
        const std::uint64_t of_first = std::min(all, points), of_second = all - of_first;
        const ScrambledFilm::Look look = film.look();
        const auto means_of = [&](std::uint64_t scrambling, std::uint64_t count) {
            const std::uint64_t begin = scrambling << 32;
            return count == 0 ? std::vector<double>(48) : mean_of(job.render({begin, begin + count}, {}).estimate);
        };
        const std::vector<double> first = means_of(0, of_first), second = means_of(1, of_second);
        const double share = static_cast<double>(of_first) / static_cast<double>(all);
        std::vector<double> errors(16);
        double sum = 0.0;
        for (std::size_t k = 0; k < first.size(); ++k) {
            sum += share * first[k] + (1.0 - share) * second[k];
            // The weighted squares of both deviations from that.
            errors[k / channel_count] += share * (1.0 - share) * (first[k] - second[k]) * (first[k] - second[k]);
        }
        CHECK(look.mean == doctest::Approx(sum / 48.0));
        REQUIRE(look.pixel_errors.size() == (of_second > 0 ? errors.size() : 0));
        for (std::size_t pixel = 0; pixel < look.pixel_errors.size(); ++pixel)
            CHECK(look.pixel_errors[pixel] == doctest::Approx(errors[pixel]));
        return of_second;
    };
    CHECK(check(samples_per_block + 36, {}) == samples_per_block + 36);
    CHECK(check(4 * samples_per_block, 5.0 * samples_per_block) < 4 * samples_per_block);
    CHECK(check(4 * samples_per_block, 3.0 * samples_per_block) == 0);
    CHECK(ScrambledFilm(job, 2).look().pixel_errors.empty());
}

TEST_CASE("the seconds of a render by error are by the clock, as looks take time, others are the job's") {
    struct Job : SyntheticJob {
        using SyntheticJob::SyntheticJob;
        RenderResult render(SampleRange range, const RenderControl& control) override {
            std::this_thread::sleep_for(std::chrono::milliseconds(5));
            RenderResult result = SyntheticJob::render(range, control);
            result.seconds = 0.0;
            return result;
        }
    };
    RenderSettings settings;
    settings.width = settings.height = 4;
    Job job(settings, noisy);
    CHECK(render_until(job, {.samples = 100, .seconds = {}, .relative_error = {}}, {}, {}).seconds == 0.0);
    CHECK(render_until(job, {.samples = {}, .seconds = {}, .relative_error = 0.1}, {}, {}).seconds >= 0.005);
}

TEST_CASE("scramblings share out the samples that are asked for, and a stop leaves what there is of them") {
    ScrambledJob job(4, 1);
    const StoppedRender result = render_until(job, {100, {}, 1e-9}, {}, {}, Sampling::uniform, 8);
    CHECK(result.film.count() == 96);  // twelve each
    CHECK(result.relative_error.has_value());
    CHECK(result.complete);
    // Fewer than there are scramblings: one.
    CHECK(render_until(job, {5, {}, 1e-9}, {}, {}, Sampling::uniform, 8).film.count() == 5);
}

TEST_CASE("a stop of an adaptive render finds the counts adapted, however many samples were asked for") {
    std::stop_source source;
    std::uint64_t drawn = 0;
    RenderSettings settings;
    settings.width = settings.height = 16;
    settings.sampling = Sampling::adaptive;
    SyntheticJob job(settings, [&](std::uint32_t x, std::uint32_t, SampleRandom& random) {
        if (++drawn == 1000 * 256) source.request_stop();
        const double value = x < 4 ? random.exponential() : 1.0;
        return Radiance{value, value, value};
    });
    const StoppedRender result =
        render_until(job, {std::uint64_t{1} << 30, {}, {}}, source.get_token(), {}, Sampling::adaptive);
    CHECK_FALSE(result.complete);
    CHECK(result.film.paths() == drawn);
    CHECK(result.film.counts[0] > 2 * result.film.counts[15]);
    CHECK(result.relative_error_interval.has_value());
}
