// compare_images on images whose truth is known, and every mismatch that it must refuse.
#include <doctest/doctest.h>

#include <cmath>
#include <filesystem>
#include <limits>
#include <numbers>

#include "common/error.h"
#include "common/statistics/distributions.h"
#include "common/validation/compare/colour_space.h"
#include "common/validation/compare/compare.h"
#include "common/validation/compare/pixel_correlation.h"
#include "common/validation/report/verdict_json.h"
#include "tests/common/synthetic_renderer.h"
#include "tests/refusal.h"
#include "tests/temporary_folder.h"

using namespace tandem;

namespace {

constexpr std::uint32_t size = 96;

// Bright and dark squares of 12 pixels with soft edges, on a gradient.
double pattern(double x, double y) {
    const auto wave = [](double t) { return std::tanh(3.0 * std::sin(t * std::numbers::pi / 12.0)); };
    return 1.0 + 0.5 * wave(x) * wave(y) + 0.002 * x;
}

Sampler scene_of(double exposure, double shift) {
    return [=](std::uint32_t x, std::uint32_t y, SampleRandom& random) {
        const double value = exposure * pattern(x - shift, y) * (1.0 + 0.3 * random.triangular());
        return Radiance{value, 0.7 * value, 0.4 * value};
    };
}

NamedImage rendered(const Sampler& sampler, std::uint64_t seed, std::uint64_t samples = 256) {
    RenderSettings settings;
    settings.width = settings.height = size;
    settings.seed = seed;
    const RenderResult result = SyntheticJob(settings, sampler).render({0, samples}, {});
    return {"image " + std::to_string(seed), image_of(result.estimate, {})};
}

// The colours alone, as a renderer without variance channels writes them.
NamedImage plain(const Sampler& sampler, std::uint64_t seed) {
    NamedImage named = rendered(sampler, seed, 64);
    Image image = named.image;
    image.channels = {"R", "G", "B"};
    image.pixels.clear();
    for (std::size_t i = 0; i < named.image.pixels.size(); ++i)
        if (i % named.image.channels.size() < 3) image.pixels.push_back(named.image.pixels[i]);
    return {named.name, image};
}

std::string refusal(const std::vector<NamedImage>& reference, const std::vector<NamedImage>& candidate) {
    return tandem::refusal([&] { (void)compare_images(reference, candidate); });
}

}  // namespace

TEST_CASE("images with variance channels of one truth agree") {
    const SceneVerdict verdict = compare_images({rendered(scene_of(1.0, 0.0), 1)}, {rendered(scene_of(1.0, 0.0), 2)});
    CHECK(verdict.verdict == Verdict::agree);
    CHECK(verdict.reference.samples == 256);
}

TEST_CASE("layers of other renderers are found by their names, and refused where there are several") {
    const auto layered = [](NamedImage named, const std::string& layer, const std::string& other) {
        std::vector<std::string>& channels = named.image.channels;
        std::vector<float> pixels;
        for (std::size_t i = 0; i < named.image.pixels.size(); i += channels.size()) {
            for (std::size_t c = 0; c < 3; ++c) pixels.push_back(named.image.pixels[i + c]);
            pixels.push_back(1.0f);
            for (std::size_t c = 0; c < 3; ++c) pixels.push_back(9.0f);  // of the other layer
        }
        named.image.pixels = pixels;
        channels = {layer + "R", layer + "G", layer + "B", layer + "A", other + "R", other + "G", other + "B"};
        return named;
    };
    const auto side = [&](std::uint64_t first, const std::string& layer, const std::string& other) {
        std::vector<NamedImage> images;
        for (std::uint64_t k = 0; k < 6; ++k)
            images.push_back(layered(plain(scene_of(1.0, 0.0), first + k), layer, other));
        return images;
    };
    const auto named = side(1, "ViewLayer.Combined.", "ViewLayer.DiffCol."), bare = side(11, "", "albedo.");
    const SceneVerdict verdict = compare_images(named, bare);
    CHECK(verdict.verdict == Verdict::agree);
    CHECK(verdict.reference.pixels[0].mean == doctest::Approx(1.0).epsilon(0.2));
    CHECK(contains(refusal(side(21, "one.", "two."), bare), "2 layers"));
    CHECK(contains(refusal({rendered(scene_of(1.0, 0.0), 1)}, side(21, "one.", "two.")), "one.R"));
}

TEST_CASE("pixels that have not drawn their rare bright samples yet are no disagreement") {
    // One estimator finds a small light once in 250 samples, the other always: a third of the pixels of the first are
    // black.
    const Sampler rare = [](std::uint32_t, std::uint32_t, SampleRandom& random) {
        const double value = random.uniform() < 4e-3 ? 1.0 : 0.0;
        return Radiance{value, value, value};
    };
    const Sampler often = [](std::uint32_t, std::uint32_t, SampleRandom& random) {
        const double value = 4e-3 * (1.0 + 0.05 * random.triangular());
        return Radiance{value, value, value};
    };
    const SceneVerdict verdict = compare_images({rendered(rare, 1)}, {rendered(often, 2)});
    CAPTURE(verdict.sentence);
    CHECK(verdict.verdict != Verdict::disagree);
}

TEST_CASE("a light 1 % brighter is a disagreement and named an exposure factor") {
    const SceneVerdict verdict = compare_images({rendered(scene_of(1.0, 0.0), 1)}, {rendered(scene_of(1.01, 0.0), 2)});
    REQUIRE(verdict.verdict == Verdict::disagree);
    CHECK(contains(verdict.sentence, "constant exposure factor of 1.01"));
}

TEST_CASE("a half-pixel shift is a disagreement and named so") {
    const SceneVerdict verdict = compare_images({rendered(scene_of(1.0, 0.0), 1)}, {rendered(scene_of(1.0, 0.5), 2)});
    REQUIRE(verdict.verdict == Verdict::disagree);
    CHECK(contains(verdict.sentence, "about half a pixel"));
}

TEST_CASE("a few plain images of independent seeds a side are enough to agree") {
    const Sampler sampler = scene_of(1.0, 0.0);
    const SceneVerdict verdict = compare_images(
        {plain(sampler, 1), plain(sampler, 2), plain(sampler, 3)}, {plain(sampler, 4), plain(sampler, 5)});
    CHECK(verdict.verdict == Verdict::agree);
}

TEST_CASE("two plain images a side find a light 1 % brighter") {
    const SceneVerdict verdict = compare_images({plain(scene_of(1.0, 0.0), 1), plain(scene_of(1.0, 0.0), 2)},
        {plain(scene_of(1.01, 0.0), 3), plain(scene_of(1.01, 0.0), 4)});
    CHECK(verdict.verdict == Verdict::disagree);
}

TEST_CASE("images whose neighbouring pixels go together get wider intervals") {
    // Pairs of columns share their numbers: the variance of a tile's mean is twice what pixels say.
    const auto tied = [](std::uint64_t seed) {
        NamedImage named = plain(scene_of(1.0, 0.0), seed);
        for (std::size_t i = 0; i < named.image.pixels.size(); ++i)
            if (i / 3 % size % 2 == 1) named.image.pixels[i] = named.image.pixels[i - 3];
        return named;
    };
    const SampledImage side = sampled_image_of({tied(1), tied(2), tied(3), tied(4)}, VarianceOf::sample);
    CHECK(side.correlation == doctest::Approx(2.0).epsilon(0.25));
    const Sampler sampler = scene_of(1.0, 0.0);
    CHECK(sampled_image_of({plain(sampler, 1), plain(sampler, 2), plain(sampler, 3)}, VarianceOf::sample).correlation ==
          1.0);
}

namespace {

// Splats of a Gaussian of deviation `width` pixels, cut at 3 pixels, of sum 1.
std::vector<double> gaussian(double width) {
    std::vector<double> weights;
    double sum = 0.0;
    for (int y = -3; y <= 3; ++y)
        for (int x = -3; x <= 3; ++x) sum += weights.emplace_back(std::exp(-0.5 * (x * x + y * y) / (width * width)));
    for (double& weight : weights) weight /= sum;
    return weights;
}

// An image whose noise, of relative `deviation` in each pixel, went through a pixel filter, with the right variance of
// each pixel's mean.
NamedImage filtered(
    const std::vector<double>& weights, std::uint64_t seed, double exposure = 1.0, double deviation = 0.02) {
    constexpr std::uint32_t edge = 64, border = edge + 6;
    double squares = 0.0;
    for (const double weight : weights) squares += weight * weight;
    std::vector<double> noise;
    for (std::uint64_t i = 0; i < std::uint64_t{border} * border; ++i) {
        SampleRandom random(seed, i, 0);
        double sum = 0.0;
        for (int k = 0; k < 16; ++k) sum += random.triangular() / 4.0;
        noise.push_back(deviation / std::sqrt(squares) * sum);
    }
    Image image;
    image.width = image.height = edge;
    image.channels = {"R", "G", "B", "variance.R", "variance.G", "variance.B"};
    for (std::uint32_t y = 0; y < edge; ++y)
        for (std::uint32_t x = 0; x < edge; ++x) {
            double relative = 0.0;
            for (std::uint32_t k = 0; k < weights.size(); ++k)
                relative += weights[k] * noise[(y + k / 7) * border + x + k % 7];
            for (const bool variance : {false, true})
                for (const double channel : {1.0, 0.7, 0.4}) {
                    const double mean = exposure * channel * pattern(x, y);
                    image.pixels.push_back(
                        static_cast<float>(variance ? deviation * deviation * mean * mean : mean * (1.0 + relative)));
                }
        }
    return {"filtered " + std::to_string(seed), image};
}

// A binomial tail below this speaks against the rate that is claimed.
constexpr double unlikely = 0.001;

// How many of `runs` pairs of equal images are called different: with pixels taken as independent, and as compared.
struct FalseAlarms {
    unsigned before = 0, after = 0;
};
FalseAlarms false_alarms(const std::vector<double>& weights, unsigned runs, double declared) {
    CompareOptions options;
    options.variance_of_reference = options.variance_of_candidate = VarianceOf::mean;
    options.criteria.false_alarm = declared;
    FalseAlarms alarms;
    for (unsigned run = 0; run < runs; ++run) {
        const std::vector<NamedImage> a{filtered(weights, 2 * run + 1, 1.0, 0.15)},
            b{filtered(weights, 2 * run + 2, 1.0, 0.15)};
        const Judgement before = judge(sampled_image_of(a, VarianceOf::mean), sampled_image_of(b, VarianceOf::mean),
            nullptr, options.criteria, {declared, 0.05});
        if (before.verdict == Verdict::disagree) ++alarms.before;
        if (compare_images(a, b, options).verdict == Verdict::disagree) ++alarms.after;
    }
    return alarms;
}

}  // namespace

TEST_CASE("pixel filters raise no false alarms with one image a side" * doctest::test_suite("full")) {
    constexpr double declared = 0.05;
    for (const auto& [width, runs] : {std::pair{0.5, 200u}, {1.0, 40u}}) {  // a usual Gaussian filter, and a wide one
        const FalseAlarms alarms = false_alarms(gaussian(width), runs, declared);
        MESSAGE("deviation ", width, ": ", alarms.before, " of ", runs, " with pixels taken as independent, ",
            alarms.after, " as compared");
        CHECK(binomial_upper_tail(alarms.before, runs, declared) < unlikely);  // what this test is for
        CHECK(binomial_upper_tail(alarms.after, runs, declared) >= unlikely);
    }
}

TEST_CASE("how far pixels go together is seen in one image a side") {
    const auto seen = [](const std::vector<double>& a, const std::vector<double>& b, std::uint64_t seed,
                          double exposure) {
        return neighbour_correlation(sampled_image_of({filtered(a, seed)}, VarianceOf::mean),
            sampled_image_of({filtered(b, seed + 1, exposure)}, VarianceOf::mean));
    };
    const std::vector<double> box = gaussian(0.01);
    unsigned wider = 0;
    for (std::uint64_t seed = 1; seed <= 100; seed += 2)
        if (seen(box, box, seed, 1.0) > 1.0) ++wider;
    CHECK(wider <= 6);  // 2.3 % of 50
    for (const double width : {0.5, 0.7, 1.0}) {
        const std::vector<double> filter = gaussian(width);
        double squares = 0.0, sum = 0.0;
        for (const double weight : filter) squares += weight * weight;
        for (std::uint64_t seed = 1; seed <= 20; seed += 2) sum += seen(filter, filter, seed, 1.0) / 10.0;
        CAPTURE(width);
        CHECK(sum == doctest::Approx(1.0 / squares).epsilon(0.1));
        // Half of the variance goes together.
        double mixed = 0.0;
        for (std::uint64_t seed = 1; seed <= 20; seed += 2) mixed += seen(filter, box, seed, 1.0) / 10.0;
        CHECK(mixed == doctest::Approx(0.5 + 0.5 / squares).epsilon(0.1));
    }
    CHECK(seen(box, box, 7, 1.05) < 1.2);  // a true difference is no noise
}

TEST_CASE("a difference that is uneven within tiles is not taken for noise that goes together") {
    // As indirect light is, to 5 % at one side of the image. With less noise it is surer, and is never lost.
    const auto brighter_to_the_right = [](NamedImage named) {
        for (std::size_t i = 0; i < named.image.pixels.size(); i += 6)
            for (std::size_t c = 0; c < 3; ++c)
                named.image.pixels[i + c] *= 1.0f + 0.05f * static_cast<float>(i / 6 % 64) / 64.0f;
        return named;
    };
    CompareOptions options;
    options.variance_of_reference = options.variance_of_candidate = VarianceOf::mean;
    const std::vector<double> box = gaussian(0.01);
    for (const double deviation : {0.16, 0.04, 0.01, 0.0025}) {
        const SceneVerdict verdict = compare_images(
            {filtered(box, 1, 1.0, deviation)}, {brighter_to_the_right(filtered(box, 2, 1.0, deviation))}, options);
        CAPTURE(deviation);
        CHECK(verdict.verdict == Verdict::disagree);
        CHECK(verdict.reference.correlation < 1.2);
    }
}

TEST_CASE("a light 1 % brighter is found through a pixel filter") {
    CompareOptions options;
    options.variance_of_reference = options.variance_of_candidate = VarianceOf::mean;
    const std::vector<double> filter = gaussian(0.5);
    for (std::uint64_t seed = 1; seed <= 20; seed += 2) {
        const SceneVerdict verdict =
            compare_images({filtered(filter, seed)}, {filtered(filter, seed + 1, 1.01)}, options);
        CHECK(verdict.verdict == Verdict::disagree);
        CHECK(verdict.reference.correlation > 1.9);  // of 2.4 the nearest neighbours make 2.2
    }
}

TEST_CASE("a fault below what is negligible is found where less is called so") {
    // As much as one bounce fewer on the classic box, seen with noise of 0.003 % of the image.
    const auto quiet = [](std::uint64_t seed, double exposure) {
        NamedImage named = filtered(gaussian(0.01), seed, exposure);
        for (std::size_t i = 0; i < named.image.pixels.size(); i += 6) {
            const double x = static_cast<double>(i / 6 % 64), y = static_cast<double>(i / 6 / 64);
            for (std::size_t c = 0; c < 3; ++c) {
                const double mean = exposure * pattern(x, y) * std::array{1.0, 0.7, 0.4}.at(c);
                named.image.pixels[i + c] = static_cast<float>(mean + 0.1 * (named.image.pixels[i + c] - mean));
                named.image.pixels[i + 3 + c] *= 0.01f;
            }
        }
        return named;
    };
    CompareOptions options;
    options.variance_of_reference = options.variance_of_candidate = VarianceOf::mean;
    const std::vector<NamedImage> a{quiet(1, 1.0)}, b{quiet(2, 1.00034)};
    CHECK(compare_images(a, b, options).verdict == Verdict::agree);
    options.criteria.negligible.image = 1e-4;
    CHECK(compare_images(a, b, options).verdict == Verdict::disagree);
}

TEST_CASE("where one side has several images the other's correlation is what is left") {
    CompareOptions options;
    options.variance_of_reference = options.variance_of_candidate = VarianceOf::mean;
    const std::vector<double> filter = gaussian(0.7), box = gaussian(0.01);
    double squares = 0.0;
    for (const double weight : filter) squares += weight * weight;
    double sum = 0.0;
    for (std::uint64_t seed = 1; seed <= 40; seed += 4) {
        const SceneVerdict verdict = compare_images({filtered(filter, seed)},
            {filtered(box, seed + 1), filtered(box, seed + 2), filtered(box, seed + 3)}, options);
        CHECK(verdict.candidate.correlation < 1.5);  // as its own images tell, 1 but for chance
        sum += verdict.reference.correlation / 10.0;
    }
    CHECK(sum == doctest::Approx(1.0 / squares).epsilon(0.15));
}

TEST_CASE("the variance of the mean is taken as such where asked for") {
    NamedImage image = rendered(scene_of(1.0, 0.0), 1);
    const SampledImage expected = sampled_image_of({image}, VarianceOf::sample);
    for (std::size_t i = 0; i < image.image.pixels.size(); ++i)
        if (i % 7 >= 3 && i % 7 < 6) image.image.pixels[i] /= 256.0f;
    const SampledImage side = sampled_image_of({image}, VarianceOf::mean);
    CHECK(side.pixels[100].variance == doctest::Approx(expected.pixels[100].variance));
}

TEST_CASE("variance channels are also read under pbrt-v4's names, with its sample count") {
    NamedImage image = rendered(scene_of(1.0, 0.0), 1);
    image.image.channels = {"R", "G", "B", "Variance.R", "Variance.G", "Variance.B", "depth"};
    image.image.metadata["samplesPerPixel"] = "256";
    CHECK(sampled_image_of({image}, VarianceOf::sample).pixels[0].count == 256.0);
}

TEST_CASE("pixels that are not numbers are a disagreement, are counted and located") {
    NamedImage faulty = rendered(scene_of(1.0, 0.0), 2);
    faulty.image.pixels[0] = std::nanf("");
    faulty.image.pixels[(5 * size + 7) * 7] = std::numeric_limits<float>::infinity();
    faulty.image.pixels[(5 * size + 7) * 7 + 1] = -1.0f;
    const SceneVerdict verdict = compare_images({rendered(scene_of(1.0, 0.0), 1)}, {faulty});
    CHECK(verdict.verdict == Verdict::disagree);
    CHECK(verdict.candidate.invalid == 3);
    CHECK(verdict.judgement.reasons.front() ==
          "3 values in 2 pixels of the candidate are NaN, infinite or negative: (0, 0), (7, 5)");
    CHECK(verdict.explanations.empty());  // they are all that differs
}

TEST_CASE("mismatches are refused by name") {
    const NamedImage reference = rendered(scene_of(1.0, 0.0), 1, 64);
    NamedImage candidate = rendered(scene_of(1.0, 0.0), 2, 64);
    CHECK(refusal({reference}, {candidate}) == "");

    SUBCASE("sizes") {
        candidate.image.width = 2 * size;
        candidate.image.height = size / 2;
        CHECK(contains(refusal({reference}, {candidate}), "size 192x48 is not that of image 1, 96x96"));
    }
    SUBCASE("data windows") {
        candidate.image.data_x = 3;
        CHECK(contains(refusal({reference}, {candidate}), "data window's origin (3, 0)"));
    }
    SUBCASE("display windows") {
        candidate.image.full_width = 2 * size;
        candidate.image.full_height = size;
        CHECK(contains(refusal({reference}, {candidate}), "display window 192x96"));
    }
    SUBCASE("colour spaces") {
        NamedImage other = reference;
        other.image.colour_space = "lin_rec709";
        candidate.image.colour_space = "ACEScg";
        CHECK(contains(refusal({other}, {candidate}), "colour space 'ACEScg'"));
        candidate.image.colour_space = "Linear, chromaticities 0.7, 0.3";
        CHECK(contains(refusal({other}, {candidate}), "colour space 'Linear, chromaticities"));
    }
    SUBCASE("variance beside encoded values") {
        candidate.image.colour_space = "sRGB";
        CHECK(contains(refusal({reference}, {candidate}), "encoded as 'sRGB'"));
    }
    SUBCASE("channels") {
        candidate.image.channels[0] = "Y";
        CHECK(contains(refusal({reference}, {candidate}), "no channels R, G and B (it has Y, G, B"));
    }
    SUBCASE("a single image without variance") {
        CHECK(contains(refusal({reference}, {plain(scene_of(1.0, 0.0), 3)}), "no channels variance.R"));
    }
    SUBCASE("variance without a count") {
        candidate.image.channels[6] = "depth";
        CHECK(contains(refusal({reference}, {candidate}), "how many samples"));
    }
    SUBCASE("one sample") {
        candidate.image.pixels[6] = 1.0f;
        CHECK(contains(refusal({reference}, {candidate}), "pixel (0, 0) has fewer than two samples"));
    }
    SUBCASE("the same image twice") {
        CHECK(contains(refusal({reference}, {reference}), "holds the same pixels"));
        CHECK(contains(refusal({reference}, {candidate, candidate}), "holds the same pixels"));
    }
    SUBCASE("one seed on both sides") {
        NamedImage other = reference;
        other.image.metadata["tandem:seed"] = candidate.image.metadata["tandem:seed"] = "7";
        CHECK(contains(refusal({other}, {candidate}), "was made with seed 7"));
    }
    SUBCASE("one seed twice on a side") {
        NamedImage first = candidate, second = reference;
        first.image.metadata["tandem:seed"] = second.image.metadata["tandem:seed"] = "7";
        second.image.pixels[0] += 0.25f;
        CHECK(contains(refusal({reference}, {first, second}), "was made with seed 7"));
    }
    SUBCASE("an empty side") { CHECK(contains(refusal({reference}, {}), "a side has no images")); }
}

TEST_CASE("one colour space under several names is one") {
    NamedImage a = rendered(scene_of(1.0, 0.0), 1, 64), b = rendered(scene_of(1.0, 0.0), 2, 64);
    for (const char* name : {"linear", "Linear", "scene_linear", "lin_rec709", "Linear Rec.709 (sRGB)", "lin_srgb"}) {
        a.image.colour_space = "Linear";
        b.image.colour_space = name;
        CHECK(refusal({a}, {b}) == "");
    }
}

TEST_CASE("sRGB and gamma decode to what they encoded, with their slope") {
    for (const Transfer& transfer :
        {Transfer{Transfer::Curve::srgb, 1.0}, Transfer{Transfer::Curve::power, 2.2}, Transfer{}})
        for (const double light : {0.0, 0.001, 0.2, 1.0, 3.0}) {
            const double value = transfer.encoded(light);
            CHECK(transfer.decoded(value) == doctest::Approx(light));
            const double h = 1e-6;
            if (value > h)
                CHECK(transfer.slope(value) ==
                      doctest::Approx((transfer.decoded(value + h) - transfer.decoded(value - h)) / (2.0 * h))
                          .epsilon(1e-4));
        }
    CHECK(Transfer{Transfer::Curve::srgb, 1.0}.decoded(0.5) == doctest::Approx(0.21404114));  // IEC 61966-2-1
}

TEST_CASE("PNG files are compared in linear light, and a note says so") {
    const TemporaryFolder folder;
    const auto side = [&](const std::string& name, std::uint64_t seed, double exposure) {
        std::vector<std::filesystem::path> files;
        for (std::uint64_t k = 0; k < 3; ++k) {
            files.push_back(folder / (name + std::to_string(k) + ".png"));
            write_png(files.back(), plain(scene_of(0.4 * exposure, 0.0), seed + k).image);
        }
        return files;
    };
    const auto a = side("a", 1, 1.0);
    const SceneVerdict same = compare_files(a, side("b", 11, 1.0));
    CAPTURE(same.sentence);
    CHECK(same.verdict == Verdict::agree);
    REQUIRE(same.notes.size() == 2);  // one a side
    CHECK(contains(same.notes.front(), "a0.png and 2 more: values of 8 bits are decoded to linear light from sRGB"));
    // The picture's mean is 0.4 (1 + 0.001 x), of light and not of values.
    CHECK(channel_means(same.reference)[0] == doctest::Approx(0.438).epsilon(0.02));
    const SceneVerdict brighter = compare_files(a, side("c", 21, 1.2));
    CHECK(brighter.verdict == Verdict::disagree);
    CAPTURE(brighter.sentence);
    const std::string factor = "a constant exposure factor of ";
    REQUIRE(contains(brighter.sentence, factor));
    // Four of the errors that it states, 0.0004.
    CHECK(std::abs(std::stod(brighter.sentence.substr(brighter.sentence.find(factor) + factor.size())) - 1.2) < 0.0016);
}

TEST_CASE("the same file twice is refused, and equal images without noise are agreed on with a note") {
    const TemporaryFolder folder;
    NamedImage still = rendered(scene_of(1.0, 0.0), 1, 64);
    for (std::size_t i = 0; i < still.image.pixels.size(); ++i)
        if (i % 7 >= 3 && i % 7 < 6) still.image.pixels[i] = 0.0f;
    write_image(folder / "a.exr", still.image);
    write_image(folder / "b.exr", still.image);
    std::filesystem::create_hard_link(folder / "a.exr", folder / "c.exr");
    for (const char* other : {"a.exr", "c.exr"})
        CHECK_THROWS_WITH_AS((void)compare_files({folder / "a.exr"}, {folder / other}),
            doctest::Contains("is the same file as"), InputError);
    const SceneVerdict verdict = compare_files({folder / "a.exr"}, {folder / "b.exr"});
    CHECK(verdict.verdict == Verdict::agree);
    REQUIRE(verdict.notes.size() == 1);
    CHECK(contains(verdict.notes.front(), "a copy would look the same"));
}

TEST_CASE("each side says for itself what its variance channels hold") {
    NamedImage of_mean = rendered(scene_of(1.0, 0.0), 2);
    for (std::size_t i = 0; i < of_mean.image.pixels.size(); ++i)
        if (i % 7 >= 3 && i % 7 < 6) of_mean.image.pixels[i] /= 256.0f;
    CompareOptions options;
    options.variance_of_candidate = VarianceOf::mean;
    const SceneVerdict verdict = compare_images({rendered(scene_of(1.0, 0.0), 1)}, {of_mean}, options);
    CHECK(verdict.reference.pixels[9].variance == doctest::Approx(verdict.candidate.pixels[9].variance).epsilon(0.5));
    CHECK(verdict.verdict == Verdict::agree);
}

TEST_CASE("the number of samples is found under every name that renderers give it") {
    for (const char* key : {"samples", "samplesPerPixel", "tandem:samples", "cycles.ViewLayer.samples"}) {
        NamedImage image = rendered(scene_of(1.0, 0.0), 1);
        image.image.channels[6] = "depth";
        image.image.metadata[key] = "256";
        CHECK(sampled_image_of({image}, VarianceOf::sample).pixels[0].count == 256.0);
    }
}

TEST_CASE("compare reads files and reports one entry") {
    const TemporaryFolder folder;
    write_image(folder / "a.exr", rendered(scene_of(1.0, 0.0), 1).image);
    write_image(folder / "b.exr", rendered(scene_of(1.0, 0.0), 2).image);
    const std::vector<SceneVerdict> verdicts{compare_files({folder / "a.exr"}, {folder / "b.exr"})};
    const nlohmann::json json = to_json(verdicts);
    CHECK(json["verdict"] == "agree");
    CHECK(json["scenes"].size() == 1);
    CHECK(json["scenes"][0]["samples_candidate"] == 256);
}
