// Adaptive sampling (MODEL.md section 11.3) where the truth is known: no bias, the best counts, what it is worth.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "common/error.h"
#include "common/render/adaptive_sampling.h"
#include "common/render/check_settings.h"
#include "common/statistics/sample_moments.h"
#include "tests/common/synthetic_renderer.h"

namespace tandem {
namespace {

RenderSettings adaptive(std::uint32_t size, std::uint64_t seed = 1) {
    RenderSettings settings;
    settings.width = settings.height = size;
    settings.seed = seed;
    settings.sampling = Sampling::adaptive;
    return settings;
}

FilmMoments grown(const RenderSettings& settings, const Sampler& sampler, std::initializer_list<std::uint64_t> to) {
    SyntheticJob job(settings, sampler);
    GrowingFilm film(job, settings.sampling);
    for (const std::uint64_t samples : to) CHECK(film.grow_to(samples, {}).complete);
    CHECK(film.samples() == doctest::Approx(film.film().count()));
    return film.film();
}

double sum_of(const std::vector<double>& values) { return std::accumulate(values.begin(), values.end(), 0.0); }

// Lit once in fifty samples: mean 1. Most pixels have seen one or two lights after a block, a quarter of them none.
Radiance rarely_lit(std::uint32_t, std::uint32_t, SampleRandom& random) {
    const double value = random.uniform() < 0.02 ? 50.0 : 0.0;
    return {value, value, value};
}

// Means of an image's pixels, which are 1 in truth, over many renders.
template <class Render>
SampleMoments means_of_images(const Render& render) {
    SampleMoments images;
    for (std::uint64_t seed = 1; seed <= 60; ++seed) {
        const std::vector<double> mean = mean_of(render(seed));
        images.add(sum_of(mean) / static_cast<double>(mean.size()));
    }
    return images;
}

double standard_errors_off(const SampleMoments& images) {
    return (images.mean - 1.0) / std::sqrt(images.variance_of_mean());
}

// Noise of standard deviation 0.4 in the leftmost columns, a twentieth of that elsewhere; mean 1.
constexpr std::uint32_t noisy_columns = 8;
double deviation_at(std::uint32_t x, std::uint32_t) { return x < noisy_columns ? 1.0 : 0.05; }
Radiance uneven(std::uint32_t x, std::uint32_t y, SampleRandom& random) {
    const double value = 1.0 + deviation_at(x, y) * 0.4 * random.triangular();
    return {value, value, value};
}

}  // namespace

TEST_CASE("adaptive sampling of rarely lit pixels has the right mean, and the naive scheme has not") {
    const SampleMoments ours = means_of_images([](std::uint64_t seed) {
        return grown(adaptive(16, seed), rarely_lit, {64, 128, 256});
    });
    CHECK(std::abs(standard_errors_off(ours)) < 4.0);
    // Naive [as Kirk and Arvo 1991 warn]: counts by a pixel's own first samples, which are part of its mean. Where they
    // were bright they are made little of by many more, where they were dark they stay.
    const SampleMoments naive = means_of_images([](std::uint64_t seed) {
        SyntheticJob job(adaptive(16, seed), rarely_lit);
        FilmMoments film = film_of(job.render({0, 64}, {}).estimate);
        std::vector<double> deviations;
        for (const double variance : variance_of(film)) deviations.push_back(std::sqrt(variance));
        std::vector<double> of_pixels;
        for (std::size_t i = 0; i < deviations.size(); i += channel_count) of_pixels.push_back(deviations[i]);
        const std::vector<double> counts = allocate(of_pixels, std::vector<double>(256, 64.0), 256.0 * 256.0);
        for (std::uint32_t pixel = 0; pixel < 256; ++pixel) {
            const auto more = static_cast<std::uint64_t>(counts[pixel]) - 64;
            if (more == 0) continue;
            const Estimate::Plane sums =
                job.render_pixels({1 << 20, (1 << 20) + more}, {&pixel, 1}, {}).estimate.totals();
            for (std::size_t c = 0; c < channel_count; ++c) film.moments[pixel * channel_count + c].sum += sums[c].sum;
            film.counts[pixel] += more;
        }
        return film;
    });
    CHECK(standard_errors_off(naive) < -10.0);
    CHECK(naive.mean < 0.9);
}

TEST_CASE("a pixel's count does not depend on its own samples, nor on those of any pixel of its colour") {
    const std::vector<std::uint64_t> counts = grown(adaptive(9), mixed, {64, 256, 512}).counts;
    const auto changed = [](std::uint32_t x, std::uint32_t y, SampleRandom& random) {
        return (x + y) % 2 == 0 ? rarely_lit(x, y, random) : mixed(x, y, random);
    };
    const std::vector<std::uint64_t> others = grown(adaptive(9), changed, {64, 256, 512}).counts;
    std::size_t same = 0, moved = 0;
    for (std::size_t i = 0; i < counts.size(); ++i) {
        const bool of_changed = (i % 9 + i / 9) % 2 == 0;
        if (of_changed) CHECK(counts[i] == others[i]);
        (of_changed ? same : moved) += counts[i] != others[i];
    }
    CHECK(same == 0);
    CHECK(moved > 20);  // they matter to their neighbours
}

TEST_CASE("counts are the best for known deviations: as those, but for the least, and none could be moved") {
    std::vector<double> deviations, least;
    SampleRandom random(1, 2, 3);
    for (int i = 0; i < 500; ++i) {
        deviations.push_back(i % 7 == 0 ? 0.0 : random.exponential() * random.exponential());
        least.push_back(i % 5 == 0 ? 200.0 : 25.0);
    }
    const std::vector<double> counts = allocate(deviations, least, 500.0 * 100.0);
    CHECK(sum_of(counts) == doctest::Approx(500.0 * 100.0));
    // What the last sample of a pixel is worth, deviation^2 / n^2, is the same wherever one could be taken away, and
    // nowhere more.
    double worth = 0.0;
    for (std::size_t i = 0; i < counts.size(); ++i)
        if (counts[i] > least[i]) worth = std::pow(deviations[i] / counts[i], 2.0);
    for (std::size_t i = 0; i < counts.size(); ++i) {
        CHECK(counts[i] >= least[i]);
        const double own = std::pow(deviations[i] / counts[i], 2.0);
        CHECK(own <= worth * (1.0 + 1e-12));
        if (counts[i] > least[i]) CHECK(own == doctest::Approx(worth));
    }
    const std::vector<double> even = allocate(std::vector<double>(4, 0.0), std::vector<double>{1, 2, 3, 4}, 18.0);
    CHECK(even == std::vector<double>{3, 4, 5, 6});
}

TEST_CASE("the mean number of samples is what was asked for, and every pixel has its part of it") {
    for (const std::uint64_t samples : {1, 40, 64, 128, 130, 500, 1000, 1024}) {
        CAPTURE(samples);
        const FilmMoments film = grown(adaptive(15), mixed, {samples});
        CHECK(film.count() == doctest::Approx(static_cast<double>(samples)).epsilon(1e-3));
        const auto [least, most] = std::ranges::minmax(film.counts);
        CHECK(static_cast<double>(least) >= uniform_share * static_cast<double>(samples));
        CHECK((most > least) == (samples > 128));
    }
}

TEST_CASE("the error is as small as the best counts for the true deviations make it, and as was foretold") {
    const FilmMoments film = grown(adaptive(32), uneven, {64, 128, 256, 512, 1024});
    std::vector<double> deviations;
    for (std::uint32_t i = 0; i < film.counts.size(); ++i) deviations.push_back(deviation_at(i % 32, i / 32));
    const std::vector<double> best =
        allocate(deviations, std::vector<double>(deviations.size(), uniform_share * 1024.0),
            1024.0 * static_cast<double>(deviations.size()));
    double ours = 0.0, least = 0.0, uniform = 0.0;
    for (std::size_t i = 0; i < deviations.size(); ++i) {
        const double square = deviations[i] * deviations[i];
        ours += square / static_cast<double>(film.counts[i]);
        least += square / best[i];
        uniform += square / 1024.0;
    }
    CHECK(ours >= least * (1.0 - 1e-9));
    CHECK(ours < 1.15 * least);  // the neighbours blur the edge between noisy and quiet
    CHECK(ours < 0.45 * uniform);
    SyntheticJob job(adaptive(32), uneven);
    const auto foretold = foretell(job.render({0, 64}, {}).estimate);
    REQUIRE(foretold.has_value());
    CHECK(foretold->squared_error == doctest::Approx(ours / uniform).epsilon(0.15));
}

TEST_CASE("where noise is the same everywhere nothing is gained, and little lost") {
    SyntheticJob job(adaptive(24), [](std::uint32_t, std::uint32_t, SampleRandom& random) {
        const double value = random.exponential();
        return Radiance{value, value, value};
    });
    const auto foretold = foretell(job.render({0, 256}, {}).estimate);
    REQUIRE(foretold.has_value());
    CHECK(foretold->squared_error > 0.99);
    CHECK(foretold->squared_error < 1.05);
    SyntheticJob black(adaptive(8), [](std::uint32_t, std::uint32_t, SampleRandom&) { return Radiance{}; });
    CHECK_FALSE(foretell(black.render({0, 64}, {}).estimate).has_value());
}

TEST_CASE("passes have numbers of their own, beyond all samples that a render may be asked for") {
    struct Recording : SyntheticJob {
        using SyntheticJob::SyntheticJob;
        RenderResult render_pixels(
            SampleRange range, std::span<const std::uint32_t> pixels, const RenderControl& control) override {
            passes.push_back(range);
            return SyntheticJob::render_pixels(range, pixels, control);
        }
        std::vector<SampleRange> passes;
    };
    Recording job(adaptive(16), uneven);
    constexpr std::uint64_t first = 3 * film_numbers;
    GrowingFilm film(job, Sampling::adaptive, first);
    for (const std::uint64_t samples : {64, 256, 1024}) CHECK(film.grow_to(samples, {}).complete);
    REQUIRE(job.passes.size() > 4);
    std::uint64_t end = first + (std::uint64_t{1} << 40);  // what --samples takes at most
    for (const SampleRange& pass : job.passes) {
        CHECK(pass.begin >= end);
        end = pass.end;
    }
    CHECK(end <= first + film_numbers);
}

TEST_CASE("a film that ends within a block goes on to passes with whole blocks") {
    SyntheticJob job(adaptive(16), uneven);
    GrowingFilm film(job, Sampling::adaptive);
    for (const std::uint64_t samples : {40, 100, 153, 260}) {
        CAPTURE(samples);
        double told = 0.0;
        const double before = film.samples();
        CHECK(film.grow_to(samples, {.stop = {}, .progress = [&](double more) { told = more; }}).complete);
        CHECK(film.samples() == doctest::Approx(static_cast<double>(samples)).epsilon(0.01));
        CHECK(before + told == doctest::Approx(film.samples()));
        const FilmMoments now = film.film();
        CHECK(now.count() == doctest::Approx(film.samples()));
        CHECK(*std::ranges::min_element(now.counts) >= std::min<std::uint64_t>(samples, least_alike));
        for (const double mean : mean_of(now)) CHECK(mean == doctest::Approx(1.0).epsilon(0.4));
    }
}

TEST_CASE("a stop keeps the passes that were done, in the mean and in the counts") {
    std::stop_source source;
    std::uint64_t drawn = 0;
    const auto sampler = [&](std::uint32_t x, std::uint32_t y, SampleRandom& random) {
        if (++drawn == 150 * 256) source.request_stop();  // in a pass
        return uneven(x, y, random);
    };
    SyntheticJob job(adaptive(16), sampler);
    GrowingFilm film(job, Sampling::adaptive);
    CHECK_FALSE(film.grow_to(512, {.stop = source.get_token(), .progress = {}}).complete);
    const FilmMoments kept = film.film();
    CHECK(kept.paths() == drawn);  // of this job all: it looks for a stop between blocks
    CHECK(film.samples() == doctest::Approx(kept.count()));
    for (const double mean : mean_of(kept)) CHECK(mean == doctest::Approx(1.0).epsilon(0.3));
}

TEST_CASE("progress tells the samples of a pixel in the mean") {
    SyntheticJob job(adaptive(16), uneven);
    GrowingFilm film(job, Sampling::adaptive);
    double told = 0.0;
    const RenderControl control{.stop = {}, .progress = [&](double samples) {
                                    CHECK(samples >= told);
                                    told = samples;
                                }};
    REQUIRE(film.grow_to(256, control).complete);
    CHECK(told == doctest::Approx(256.0).epsilon(1e-3));
}

TEST_CASE("settings that hide the scatter of a pixel's samples are refused with the reason") {
    const auto refusal = [](auto change) -> std::string {
        RenderSettings settings = adaptive(8);
        change(settings);
        try {
            check_sampling(settings);
        } catch (const UnsupportedError& error) {
            return error.what();
        }
        return "";
    };
    const auto mentions = [](const std::string& text, const char* word) { return text.find(word) != text.npos; };
    CHECK(refusal([](RenderSettings&) {}).empty());
    CHECK(mentions(refusal([](RenderSettings& s) { s.generator = Generator::sobol; }), "Sobol"));
    CHECK(mentions(refusal([](RenderSettings& s) { s.integrator = Integrator::bidirectional; }), "bidirectional"));
    CHECK(mentions(refusal([](RenderSettings& s) { s.accumulation = Accumulation::plain; }), "plain"));
    RenderSettings uniform = adaptive(8);
    uniform.sampling = Sampling::uniform;
    SyntheticJob job(uniform, mixed);
    GrowingFilm film(job, Sampling::adaptive);
    CHECK_THROWS_AS(film.grow_to(256, {}), UnsupportedError);
}

}  // namespace tandem
