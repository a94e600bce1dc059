// compare_images on images whose truth is known, and every mismatch that it must refuse.
#include <doctest/doctest.h>

#include <cmath>
#include <filesystem>
#include <numbers>

#include "common/error.h"
#include "common/validation/compare.h"
#include "common/validation/verdict_json.h"
#include "tests/common/synthetic_renderer.h"
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
    try {
        (void)compare_images(reference, candidate);
    } catch (const InputError& error) {
        return error.what();
    }
    return "accepted";
}

bool contains(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

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
    REQUIRE(verdict.registration);
    CHECK(verdict.registration->exposure_found);
    CHECK_FALSE(verdict.registration->shift_found);
    CHECK(std::abs(verdict.registration->exposure - 1.01) < 4.0 * verdict.registration->exposure_error);
    CHECK(contains(verdict.sentence, "constant exposure factor of 1.01"));
}

TEST_CASE("a half-pixel shift is a disagreement and named so") {
    const SceneVerdict verdict = compare_images({rendered(scene_of(1.0, 0.0), 1)}, {rendered(scene_of(1.0, 0.5), 2)});
    REQUIRE(verdict.verdict == Verdict::disagree);
    REQUIRE(verdict.registration);
    CHECK(verdict.registration->shift_found);
    CHECK(verdict.registration->shift_x == doctest::Approx(0.5).epsilon(0.1));
    CHECK(std::abs(verdict.registration->shift_y) < 0.05);
    CHECK(contains(verdict.sentence, "about half a pixel"));
}

TEST_CASE("neither exposure nor shift is found where there is none") {
    const Sampler sampler = scene_of(1.0, 0.0);
    for (std::uint64_t seed = 10; seed < 30; seed += 2) {
        const SampledImage a = sampled_image_of({rendered(sampler, seed, 64)}, VarianceOf::sample);
        const SampledImage b = sampled_image_of({rendered(sampler, seed + 1, 64)}, VarianceOf::sample);
        CHECK(register_images(a, b).text.empty());
    }
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

TEST_CASE("a pixel that is not a number is a disagreement") {
    NamedImage faulty = rendered(scene_of(1.0, 0.0), 2);
    faulty.image.pixels[0] = std::nanf("");
    const SceneVerdict verdict = compare_images({rendered(scene_of(1.0, 0.0), 1)}, {faulty});
    CHECK(verdict.verdict == Verdict::disagree);
    CHECK(verdict.candidate.invalid == 1);
}

TEST_CASE("mismatches are refused by name") {
    const NamedImage reference = rendered(scene_of(1.0, 0.0), 1, 64);
    NamedImage candidate = rendered(scene_of(1.0, 0.0), 2, 64);
    CHECK(refusal({reference}, {candidate}) == "accepted");

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
        candidate.image.colour_space = "sRGB";
        CHECK(contains(refusal({other}, {candidate}), "colour space 'sRGB'"));
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
    SUBCASE("an empty side") { CHECK(contains(refusal({reference}, {}), "a side has no images")); }
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
