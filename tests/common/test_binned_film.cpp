// Films beyond memory: samples of bins are those of pixels of the film, and verdicts on bins hold.
#include <doctest/doctest.h>

#include <bit>
#include <numeric>

#include "common/render/binned_film.h"
#include "common/validation/verify/verify_in_bins.h"
#include "tests/common/synthetic_renderer.h"
#include "tests/thorough.h"

using namespace tandem;

namespace {

constexpr FilmSize large{16384, 16384}, largest{65535, 65535};

Radiance gradient(std::uint32_t x, std::uint32_t y, SampleRandom& random) {
    const double value = (1.0 + 4e-5 * x + 2e-5 * y) * random.exponential();
    return {value, 0.8 * value, 0.6 * value};
}

RenderSettings bins_of(std::uint32_t width, std::uint32_t height, std::uint64_t seed = 7) {
    RenderSettings settings;
    settings.width = width;
    settings.height = height;
    settings.seed = seed;
    return settings;
}

Estimate rendered(const Sampler& sampler, FilmSize film, const RenderSettings& bins, SampleRange range) {
    SyntheticRenderer whole(sampler);
    const auto renderer = binned_renderer(whole, film);
    return renderer->prepare(Scene{}, bins)->render(range).estimate;
}

bool same_bits(const Estimate& a, const Estimate& b) {
    const Estimate::Plane x = a.totals(), y = b.totals();
    return std::ranges::equal(x, y, [](const Moments& m, const Moments& n) {
        return std::bit_cast<std::uint64_t>(m.sum) == std::bit_cast<std::uint64_t>(n.sum) &&
               std::bit_cast<std::uint64_t>(m.sum_of_squares) == std::bit_cast<std::uint64_t>(n.sum_of_squares);
    });
}

SceneVerdict verdict_of(const Sampler& reference, const Sampler& candidate, FilmSize film, VerifyOptions options) {
    SyntheticRenderer a(reference, "cpu", Strays{}), b(candidate, "vulkan", Strays{});
    Scene scene;
    scene.name = "synthetic";
    return verify_in_bins(scene, a, b, std::move(options), film);
}

VerifyOptions options_of(std::uint32_t bins, std::uint64_t samples) {
    VerifyOptions options;
    options.settings = bins_of(bins, bins);
    options.max_samples = samples;
    return options;
}

// A fault: of the pixel's number, the low `bits` alone are used.
Sampler numbered_by(unsigned bits, FilmSize film) {
    return [=](std::uint32_t x, std::uint32_t y, SampleRandom& random) {
        const std::uint64_t number = (std::uint64_t{y} * film.width + x) & ((std::uint64_t{1} << bits) - 1);
        return gradient(
            static_cast<std::uint32_t>(number % film.width), static_cast<std::uint32_t>(number / film.width), random);
    };
}

}  // namespace

TEST_CASE("every pixel of a bin is chosen, equally often, and none beyond it") {
    constexpr FilmSize film{10, 7}, bins{3, 2};  // bins of 3 or 4 times 3 or 4 pixels
    constexpr std::uint64_t samples = 4000;
    std::vector<double> counts(film.pixel_count());
    for (std::uint32_t y = 0; y < bins.height; ++y)
        for (std::uint32_t x = 0; x < bins.width; ++x)
            for (std::uint64_t sample = 0; sample < samples; ++sample) {
                const FilmSample at = film_sample(film, bins, x, y, sample, 3);
                REQUIRE(at.x >= x * film.width / bins.width);
                REQUIRE(at.x < (x + 1) * film.width / bins.width);
                REQUIRE(at.y >= y * film.height / bins.height);
                REQUIRE(at.y < (y + 1) * film.height / bins.height);
                REQUIRE(at.sample == sample * samples_per_block);
                const double pixels = ((x + 1) * film.width / bins.width - x * film.width / bins.width) *
                                      ((y + 1) * film.height / bins.height - y * film.height / bins.height);
                counts[at.y * film.width + at.x] += pixels / samples;
            }
    for (const double count : counts) CHECK(count == doctest::Approx(1.0).epsilon(0.35));  // 5 standard deviations
}

TEST_CASE("the last pixels of the largest film are chosen, by numbers of 32 bits") {
    std::uint64_t most = 0;
    for (std::uint64_t sample = 0; sample < 3000; ++sample) {
        const FilmSample at = film_sample(largest, {32768, 32768}, 32767, 32767, sample, 3);
        most = std::max(most, std::uint64_t{at.y} * largest.width + at.x);
    }
    CHECK(most == largest.pixel_count() - 1);
}

TEST_CASE("a bin's sums are those of the samples that it names") {
    const RenderSettings bins = bins_of(5, 3);
    constexpr FilmSize film{64, 50};
    const Estimate estimate = rendered(gradient, film, bins, {64, 64 + 20});
    RenderSettings whole = bins_of(film.width, film.height);
    whole.sampling = Sampling::adaptive;
    SyntheticJob job(whole, gradient);
    const Estimate::Plane sums = estimate.totals();
    for (std::uint32_t bin = 0; bin < 15; ++bin) {
        double sum = 0.0, squares = 0.0;
        for (std::uint64_t sample = 64; sample < 64 + 20; ++sample) {
            const FilmSample at = film_sample(film, {5, 3}, bin % 5, bin / 5, sample, bins.seed);
            const std::uint32_t pixel = at.y * film.width + at.x;
            const Moments one = job.render_pixels({at.sample, at.sample + 1}, {&pixel, 1}, {}).estimate.totals()[0];
            sum += one.sum;
            squares += one.sum_of_squares;
        }
        CHECK(sums[bin * channel_count].sum == sum);
        CHECK(sums[bin * channel_count].sum_of_squares == squares);
    }
}

TEST_CASE("samples of bins are the same in any cut, and in lists of bins") {
    const RenderSettings bins = bins_of(6, 4);
    Estimate parts = rendered(gradient, large, bins, {64, 192});
    parts.merge(rendered(gradient, large, bins, {0, 64}));
    const Estimate whole = rendered(gradient, large, bins, {0, 192});
    CHECK(same_bits(parts, whole));
    SyntheticRenderer of(gradient);
    const auto renderer = binned_renderer(of, large);
    const std::vector<std::uint32_t> some{3, 8, 21};
    const Estimate::Plane listed =
        renderer->prepare(Scene{}, bins)->render_pixels({0, 192}, some, {}).estimate.totals();
    for (std::size_t i = 0; i < some.size(); ++i)
        CHECK(listed[i * channel_count].sum == whole.totals()[some[i] * channel_count].sum);
}

TEST_CASE("renderers that are alike agree on a film beyond memory") {
    const SceneVerdict verdict = verdict_of(gradient, gradient, large, options_of(48, 8192));
    CHECK(verdict.verdict == Verdict::agree);
    REQUIRE(verdict.film);
    CHECK(*verdict.film == large);
    REQUIRE(verdict.notes.size() == 1);
    CHECK(verdict.notes[0].find("48x48 bins of the film of 16384x16384 pixels") != std::string::npos);
}

TEST_CASE("a number of a pixel that loses its high bits is a disagreement") {
    // 16384 x 16384 is 2^28: the lower half, or all but the first rows, are rendered in another place.
    for (const unsigned bits : {27u, 24u, 16u})
        CHECK(verdict_of(gradient, numbered_by(bits, large), large, options_of(48, 4096)).verdict == Verdict::disagree);
    CHECK(verdict_of(gradient, numbered_by(28, large), large, options_of(48, 4096)).verdict != Verdict::disagree);
    CHECK(verdict_of(gradient, numbered_by(31, largest), largest, options_of(48, 4096)).verdict == Verdict::disagree);
}

TEST_CASE("a fault in the last 64 rows of pixels is found, and its place is one of the film") {
    const Sampler faulty = [](std::uint32_t x, std::uint32_t y, SampleRandom& random) {
        Radiance radiance = gradient(x, y, random);
        if (y >= large.height - 64)
            for (double& value : radiance) value *= 20.0;
        return radiance;
    };
    const SceneVerdict verdict = verdict_of(gradient, faulty, large, options_of(128, 4096));
    REQUIRE(verdict.verdict == Verdict::disagree);
    REQUIRE(verdict.worst);
    CHECK(verdict.worst->y >= large.height - 128);  // the last row of bins
}

TEST_CASE("bins that are not equally large have no closed form, as a mean over them is not one over the film") {
    CHECK(bins_are_equal(large, {128, 128}));
    CHECK_FALSE(bins_are_equal({16000, 9001}, {128, 72}));
    Scene scene;
    scene.name = "furnace";
    scene.expect = Expectation{};
    SyntheticRenderer a(gradient, "cpu"), b(gradient, "vulkan");
    VerifyOptions options = options_of(16, 128);
    options.settings->bounces = scene.defaults.bounces;
    const SceneVerdict uneven = verify_in_bins(scene, a, b, options, {16001, 16001});
    CHECK_FALSE(uneven.closed_form.form);
    CHECK(uneven.closed_form.skipped.find("bins are not equally large") != std::string::npos);
}

TEST_CASE("false alarms on bins are no more than declared" * doctest::test_suite("full")) {
    const std::uint64_t runs = test::thorough() ? 400 : 60;
    std::uint64_t alarms = 0;
    for (std::uint64_t run = 0; run < runs; ++run) {
        VerifyOptions options = options_of(24, 256);
        options.seed = 1 + 2 * run;
        options.explain = false;
        alarms += verdict_of(mixed, mixed, {1000, 1000}, options).verdict == Verdict::disagree ? 1 : 0;
    }
    CHECK(alarms <= (runs == 400 ? 12 : 5));  // of 1 % each: more have a chance below a thousandth
}
