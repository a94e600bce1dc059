// The judgement on two images at one look, level by level, and the parts that it is made of.
#include <doctest/doctest.h>

#include <numeric>
#include <random>

#include "common/statistics/multiple_tests.h"
#include "common/text.h"
#include "common/validation/verdict/closed_form.h"
#include "common/validation/verdict/levels.h"
#include "common/validation/verdict/verdict.h"
#include "common/validation/verify/schedule.h"

using namespace tandem;

namespace {

// Independent normal pixel means about `level`, each known from `count` samples of variance `variance`.
SampledImage normal_image(
    std::uint32_t width, std::uint32_t height, double level, double variance, double count, std::uint64_t seed) {
    std::mt19937_64 random(seed);
    std::normal_distribution<double> noise;
    const double deviation = std::sqrt(variance / count);
    SampledImage image;
    image.width = width;
    image.height = height;
    image.samples = static_cast<std::uint64_t>(count);
    for (std::size_t i = 0; i < std::size_t{width} * height * channel_count; ++i)
        image.pixels.push_back({level + deviation * noise(random), variance, count});
    return image;
}

std::uint64_t area(const Rectangle& r) { return std::uint64_t{r.x1 - r.x0} * (r.y1 - r.y0); }

}  // namespace

TEST_CASE("equal rare hits of a small lamp are no difference of variances, whatever two batches say") {
    // A hit has one value, so that two batches of as many hits have one variance: a scatter of zero.
    const auto side = [](double share, double hit, std::uint64_t seed) {
        constexpr std::uint32_t edge = 32;
        std::mt19937_64 random(seed);
        std::uniform_real_distribution<double> uniform;
        Estimate all(edge, edge);
        std::vector<Batch> batches;
        for (std::uint64_t batch = 0; batch < 2; ++batch) {
            Estimate::Plane plane(std::size_t{edge} * edge * channel_count);
            for (std::size_t pixel = 0; pixel < plane.size() / channel_count; ++pixel)
                for (std::uint64_t sample = 0; sample < samples_per_block; ++sample) {
                    const double value = uniform(random) < share ? hit : 0.0;
                    for (std::size_t c = 0; c < channel_count; ++c) {
                        plane[pixel * channel_count + c].sum += value;
                        plane[pixel * channel_count + c].sum_of_squares += value * value;
                    }
                }
            Estimate one(edge, edge);
            one.add_block({batch * samples_per_block, (batch + 1) * samples_per_block}, std::move(plane));
            batches.push_back(batch_of(one, TileGrid(edge, edge, 16)));
            all.merge(std::move(one));
        }
        return sampled_image_of(all, std::move(batches));
    };
    const auto p = [](const SampledImage& a, const SampledImage& b) {
        return compare_variances("variance of tiles 16x16", a, b, false, 1.25, 1e-6, 0.05).p;
    };
    constexpr double rare = 1.2e-4;  // two hits a tile and batch
    double least = 1.0;
    for (std::uint64_t seed = 0; seed < 100; ++seed)
        least = std::min(least, p(side(rare, 20.0, 2 * seed), side(rare, 20.0, 2 * seed + 1)));
    CHECK(least > 1e-3);
    // Half as many hits of twice the value: the mean is the same, the variance twice as great.
    CHECK(p(side(0.2, 1.0, 1), side(0.1, 2.0, 2)) < 0.05);
}

TEST_CASE("tiles cover the image once, without slivers") {
    for (const std::uint32_t width : {1u, 7u, 16u, 100u, 130u}) {
        const TileGrid grid(width, 33, 16);
        std::uint64_t total = 0;
        for (std::size_t tile = 0; tile < grid.size(); ++tile) {
            total += area(grid.rectangle(tile));
            CHECK(grid.rectangle(tile).x1 - grid.rectangle(tile).x0 >= std::min(width, 11u));
        }
        CHECK(total == 33u * width);
        CHECK(grid.tile_of_pixel().back() == grid.size() - 1);
    }
}

TEST_CASE("a tile darker than the floor is judged against the image, a brighter one against itself") {
    SampledImage a = normal_image(32, 16, 1.0, 1e-4, 100, 1), b = a;
    // The right tile: a hundredth of the left one, and the candidate 50 % brighter there.
    for (std::size_t i = 0; i < a.pixels.size(); ++i)
        if (i / channel_count % 32 >= 16) {
            a.pixels[i].mean = 0.01;
            b.pixels[i].mean = 0.015;
        }
    const Criteria criteria;
    const Judgement judgement = judge(a, b, nullptr, criteria, {});
    const RegionComparison& dark = judgement.level("tiles 16x16").regions[3];
    // 0.005 over a quarter of the image's mean, 0.505.
    CHECK(dark.relative == doctest::Approx(0.005 / (0.25 * 0.505)).epsilon(1e-3));
}

TEST_CASE("the threshold of each level is Holm's") {
    const SampledImage a = normal_image(32, 32, 1.0, 1.0, 64, 1), b = normal_image(32, 32, 1.0, 1.0, 64, 2);
    const Judgement judgement = judge(a, b, nullptr, Criteria{}, {.false_alarm = 0.01, .doubt = 0.05});
    std::vector<double> p, thresholds;
    for (const LevelResult& level : judgement.levels) p.push_back(level.p);
    const std::vector<double> expected = holm_thresholds(p, 0.01);
    for (std::size_t i = 0; i < p.size(); ++i) CHECK(judgement.levels[i].threshold == expected[i]);
}

TEST_CASE("an agreement is never given where the margin is not inside what is known") {
    Criteria criteria;
    for (std::uint64_t seed = 1; seed <= 20; ++seed) {
        // A true difference right at the margin of the image.
        const SampledImage a = normal_image(32, 32, 1.0, 1.0, 4096, 2 * seed);
        const SampledImage b = normal_image(32, 32, 1.0 + criteria.margins.image, 1.0, 4096, 2 * seed + 1);
        CHECK(judge(a, b, nullptr, criteria, {}).verdict != Verdict::agree);
    }
}

TEST_CASE("agreement turns where the margin leaves the interval of one region") {
    const SampledImage a = normal_image(32, 32, 1.0, 1.0, 4096, 1), b = normal_image(32, 32, 1.0, 1.0, 4096, 2);
    const Criteria defaults;
    const Judgement first = judge(a, b, nullptr, defaults, {});
    REQUIRE(first.verdict == Verdict::agree);
    const double image = widest(first.level("image")).bound(), tile = widest(first.level("tiles 16x16")).bound();
    const auto verdict_with = [&](double image_margin, double tile_margin) {
        Criteria criteria;
        criteria.margins.image = image_margin;
        criteria.margins.tile = tile_margin;
        return judge(a, b, nullptr, criteria, {}).verdict;
    };
    CHECK(verdict_with(1.001 * image, 1.001 * tile) == Verdict::agree);
    CHECK(verdict_with(image, 1.001 * tile) == Verdict::undecided);
    CHECK(verdict_with(1.001 * image, tile) == Verdict::undecided);
}

TEST_CASE("tied pixels widen the interval of the image by the root of their correlation") {
    SampledImage a = normal_image(32, 32, 1.0, 1.0, 64, 1), b = normal_image(32, 32, 1.0, 1.0, 64, 2);
    const double independent = judge(a, b, nullptr, Criteria{}, {}).level("image").regions[0].relative_error;
    a.correlation = b.correlation = 4.0;
    const double tied = judge(a, b, nullptr, Criteria{}, {}).level("image").regions[0].relative_error;
    CHECK(tied == doctest::Approx(2.0 * independent));
    ClosedForm form;
    form.radiance = form.greatest = {1.0, 1.0, 1.0};
    const auto against_form = [&](double correlation) {
        a.correlation = correlation;
        return compare_closed_form("", form, a, Criteria{}, 0.05).regions[0].relative_error;
    };
    CHECK(against_form(4.0) == doctest::Approx(2.0 * against_form(1.0)));
}

TEST_CASE("a side with few samples that saw no light does not accuse a side with many that did") {
    // One sample of a hundred is lit: 4096 samples saw some, 64 saw none, as happens every other time.
    SampledImage many = normal_image(1, 1, 1.0, 1.0, 4096, 1), few = many;
    const double lit = 1e-2;
    for (std::size_t c = 0; c < channel_count; ++c) {
        many.pixels[c] = {lit, lit * (1.0 - lit), 4096.0};
        few.pixels[c] = {0.0, 0.0, 64.0};
    }
    const Judgement judgement = judge(many, few, nullptr, Criteria{}, {});
    CHECK(judgement.level("image").worst.statistic > 6.0);  // Welch's t alone would be sure
    CHECK(judgement.verdict == Verdict::undecided);
}

TEST_CASE("percentages keep two figures") {
    CHECK(percent(0.0021) == "0.21 %");
    CHECK(percent(0.03) == "3.0 %");
    CHECK(percent(0.123) == "12 %");
    CHECK(percent(1.004) == "100 %");
    CHECK(percent(1.99) == "199 %");
    CHECK(percent(2.0) == "2 times");
    CHECK(percent(std::numeric_limits<double>::infinity()) == "∞ %");
}

TEST_CASE("beyond 100 % a difference is told as a factor") {
    CHECK(signed_percent(0.0123) == "+1.2 %");
    CHECK(signed_percent(-0.25) == "-25 %");
    CHECK(signed_percent(-1.0) == "-100 %");
    CHECK(signed_percent(76.83) == "78 times");
    CHECK(signed_percent(1.5) == "2.5 times");
    CHECK(signed_percent(1e9) == "over 10000 times");
    CHECK(signed_percent(-3.0) == "below -100 %");
    CHECK(percent(1.0) == "100 %");
    CHECK(percent(76.83) == "77 times");
    SampledImage a = normal_image(32, 32, 1.0, 1e-4, 100, 1), b = normal_image(32, 32, 78.0, 1e-4, 100, 2);
    const Judgement judgement = judge(a, b, nullptr, Criteria{}, {});
    CHECK(judgement.reasons.front().starts_with("image: "));
    CHECK(judgement.reasons.front().find("is 78 times as large (78 times to 78 times)") != std::string::npos);
}

TEST_CASE("two black images agree on nothing, unless black is the closed form") {
    const SampledImage black = normal_image(32, 32, 0.0, 0.0, 100, 1);
    const auto judged = [&](const SampledImage& a, const SampledImage& b, const ClosedForm* form) {
        return judge(a, b, nullptr, Criteria{}, {}, form);
    };
    const Judgement nothing = judged(black, black, nullptr);
    CHECK(nothing.verdict == Verdict::undecided);
    REQUIRE(nothing.reasons.size() == 1);
    CHECK(nothing.reasons.front().starts_with("no light reached any pixel"));
    CHECK(
        sentence_of(nothing, Criteria{}, "A", "B") == "A and B are undecided: both are black, so nothing was compared");
    ClosedForm dark;
    CHECK(judged(black, black, &dark).verdict == Verdict::agree);
    CHECK(sentence_of(judged(black, black, &dark), Criteria{}, "A", "B").ends_with("as the closed form says"));
    ClosedForm lit;
    lit.radiance = {0.5, 0.5, 0.5};
    lit.greatest = {1.0, 1.0, 1.0};
    CHECK(judged(black, black, &lit).verdict == Verdict::disagree);
    CHECK(judged(black, normal_image(32, 32, 1.0, 1e-4, 100, 2), nullptr).verdict == Verdict::disagree);
}

TEST_CASE("two images of one value without noise agree, and it is said that no more was compared") {
    const SampledImage grey = normal_image(32, 32, 0.5, 0.0, 100, 1);
    const Judgement judgement = judge(grey, grey, nullptr, Criteria{}, {});
    CHECK(judgement.verdict == Verdict::agree);
    CHECK(sentence_of(judgement, Criteria{}, "A", "B").find("that one value alone was compared") != std::string::npos);
    const SampledImage noisy = normal_image(32, 32, 0.5, 1e-4, 1000, 2),
                       other = normal_image(32, 32, 0.5, 1e-4, 1000, 3);
    CHECK_FALSE(judge(noisy, other, nullptr, Criteria{}, {}).constant);
}

TEST_CASE("where calls cost time, batches grow until that is a small part, as long as there are some") {
    ScheduleRequest request;
    request.seconds_per_sample_reference = request.seconds_per_sample_candidate = 0.005;
    request.max_samples = 1u << 20;
    request.paired = false;
    CHECK(make_schedule(request).batch_samples == 256);  // 64 batches of 108 s
    request.seconds_a_call = 4.0;
    const Schedule schedule = make_schedule(request);
    const std::uint64_t last = schedule.looks.back();
    CHECK(schedule.batch_samples == 256);  // twice that would leave fewer than 16 batches
    CHECK(0.01 * static_cast<double>(last) + 4.0 * static_cast<double>(last / 256) <= 108.0);
    request.budget_seconds = 1200.0;
    CHECK(make_schedule(request).batch_samples == 2048);  // 20 % of the samples' time
}

TEST_CASE("the schedule doubles up to what the budget affords, in whole batches") {
    ScheduleRequest request;
    request.seconds_per_sample_reference = 0.01;
    request.seconds_per_sample_candidate = 0.03;
    request.budget_seconds = 120.0;
    request.max_samples = 1u << 20;
    const Schedule schedule = make_schedule(request);
    CHECK(schedule.batch_samples == 64);
    CHECK(schedule.looks.size() <= 6);
    for (const std::uint64_t look : schedule.looks) CHECK(look % schedule.batch_samples == 0);
    const double cost = 0.04 * static_cast<double>(schedule.looks.back()) +
                        0.03 * static_cast<double>(schedule.paired_batches * schedule.batch_samples);
    CHECK(cost <= 120.0);
    CHECK(cost >= 0.8 * 120.0);
}

TEST_CASE("short budgets keep a fifth for what tells a disagreement apart, long ones a tenth") {
    CHECK(seconds_of_looks(6.0) == doctest::Approx(4.8));
    CHECK(seconds_of_looks(16.0) == doctest::Approx(14.0));
    CHECK(seconds_of_looks(120.0) == doctest::Approx(108.0));
    for (const double budget : {0.0, 6.0, 10.0, 16.0, 20.0, 120.0})
        CHECK(budget_of_looks(seconds_of_looks(budget)) == doctest::Approx(budget));
}

TEST_CASE("a budget of nothing still allows one look at two batches") {
    ScheduleRequest request;
    request.seconds_per_sample_reference = request.seconds_per_sample_candidate = 1.0;
    request.budget_seconds = 0.0;
    request.max_samples = 1u << 20;
    CHECK(make_schedule(request).looks == std::vector<std::uint64_t>{128});
}

TEST_CASE("spare looks double on, up to what is allowed") {
    ScheduleRequest request;
    request.seconds_per_sample_reference = request.seconds_per_sample_candidate = 0.01;
    request.max_samples = 1u << 20;
    const Schedule schedule = make_schedule(request);
    const std::uint64_t last = schedule.looks.back();
    CHECK(schedule.spare_looks == std::vector<std::uint64_t>{2 * last, 4 * last});
    request.max_samples = 3 * last;
    CHECK(make_schedule(request).spare_looks == std::vector<std::uint64_t>{2 * last});
}

TEST_CASE("fast renderers get longer batches, not more of them") {
    ScheduleRequest request;
    request.seconds_per_sample_reference = request.seconds_per_sample_candidate = 1e-6;
    request.max_samples = 1u << 20;
    const Schedule schedule = make_schedule(request);
    CHECK(schedule.looks.back() == (1u << 20));
    CHECK(schedule.looks.back() / schedule.batch_samples <= 64);
}

TEST_CASE("the rounding of float transport grows with the bounces") {
    CHECK(float_transport_tolerance(0) == 8 * 0x1p-23);
    CHECK(float_transport_tolerance(12) == 92 * 0x1p-23);
}

TEST_CASE("values that nearly are the same may differ by their own noise beyond the tolerance, and by no more") {
    constexpr double tolerance = 0x1p-10, variance = 2.5e-7;
    // The variances are estimates from the same number of values.
    const auto image = [&](double level, double count, std::uint64_t seed) {
        SampledImage result = normal_image(64, 64, level, variance, count, seed);
        std::mt19937_64 random(seed);
        std::chi_squared_distribution<double> squares(count - 1.0);
        for (PixelStatistics& pixel : result.pixels) pixel.variance *= squares(random) / (count - 1.0);
        return result;
    };
    for (const double count : {2.0, 4.0, 64.0}) {
        CAPTURE(count);
        const FixedPixels alike = compare_fixed_pixels(image(1.0, count, 1), image(1.0, count, 2), tolerance);
        CHECK(alike.count > 0);
        CHECK(alike.mismatches == 0);
        const FixedPixels other = compare_fixed_pixels(image(1.0, count, 1), image(1.02, count, 3), tolerance);
        CHECK(other.mismatches == other.count);
    }
}

TEST_CASE("equal values of a handful of images are fixed only where the neighbours' are too") {
    // Black with two lit columns; at (2, 2) both sides happen to have twice the same value, but not each other's.
    const auto image = [](double count, double lone) {
        SampledImage result = normal_image(8, 8, 0.0, 0.0, count, 1);
        for (std::size_t i = 0; i < result.pixels.size(); ++i) {
            const std::size_t pixel = i / channel_count, x = pixel % 8, y = pixel / 8;
            if (x < 5) result.pixels[i] = {1.0, 0.25, count};
            if (x == 2 && y == 2) result.pixels[i] = {lone, 0.0, count};
        }
        return result;
    };
    const double tolerance = float_transport_tolerance(4);
    const FixedPixels few = compare_fixed_pixels(image(2.0, 0.5), image(2.0, 0.6), tolerance);
    CHECK(few.mismatches == 0);
    CHECK(few.count == 2 * 8 * channel_count);  // columns 6 and 7: column 5 touches the noisy one
    // From 64 samples on, no chance: they are fixed and must be equal.
    const FixedPixels many = compare_fixed_pixels(image(64.0, 0.5), image(64.0, 0.6), tolerance);
    CHECK(many.count == (3 * 8 + 1) * channel_count);
    CHECK(many.mismatches == channel_count);
    CHECK(many.first_mismatch == (2 * 8 + 2) * channel_count);
}
