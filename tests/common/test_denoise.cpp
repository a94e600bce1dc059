// The filter of MODEL.md section 11.6 on images whose answers are known.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>

#include "common/image/denoise.h"
#include "common/statistics/sample_moments.h"
#include "common/validation/compare/compare.h"
#include "tests/refusal.h"

using namespace tandem;

namespace {

// A wall seen head on, two units away: grey, without texture.
NoisyImage wall(std::uint32_t width, std::uint32_t height, double value, double variance) {
    NoisyImage image;
    image.width = width;
    image.height = height;
    const std::size_t pixels = std::size_t{width} * height;
    image.mean.assign(pixels * channel_count, value);
    image.variance.assign(pixels * channel_count, variance);
    image.albedo.assign(pixels, glm::dvec3(0.5));
    image.normal.assign(pixels, glm::dvec3(0.0, 0.0, 1.0));
    image.depth.assign(pixels, 2.0);
    return image;
}

// Normal noise of the image's own variance, alike in all channels.
void add_noise(NoisyImage& image, std::uint64_t seed) {
    std::mt19937_64 engine(seed);
    std::normal_distribution<double> normal;
    for (std::size_t i = 0; i < image.mean.size(); i += channel_count) {
        const double noise = normal(engine);
        for (std::size_t c = i; c < i + channel_count; ++c) image.mean[c] += noise * std::sqrt(image.variance[c]);
    }
}

std::vector<double> filtered(const NoisyImage& image, unsigned threads = 2) {
    const auto result = denoise(image, {.threads = threads, .stop = {}, .progress = {}});
    REQUIRE(result);
    REQUIRE(result->size() == image.mean.size());
    return *result;
}

SampleMoments moments_of_values(const std::vector<double>& values) {
    SampleMoments moments;
    for (const double value : values) moments.add(value);
    return moments;
}

// As a file of `render --aov albedo,normal,depth` has it.
Image file_image(std::uint32_t width, std::uint32_t height) {
    Image image;
    image.width = width;
    image.height = height;
    image.channels = {"R", "G", "B", "variance.R", "variance.G", "variance.B", "count", "albedo.R", "albedo.G",
        "albedo.B", "normal.X", "normal.Y", "normal.Z", "depth.Z"};
    for (std::uint32_t i = 0; i < width * height; ++i)
        for (const float value :
            {0.5f, 0.25f, 0.125f, 0.4f, 0.2f, 0.1f, 16.0f, 0.5f, 0.5f, 0.5f, 0.0f, 0.0f, 1.0f, 2.0f})
            image.pixels.push_back(value);
    image.metadata = {{"tandem:seed", "3"}, {"tandem:relative_error", "0.1"}};
    return image;
}

}  // namespace

TEST_CASE("denoise: an image without differences keeps its bits, whatever its variance is said to be") {
    for (const double value : {0.0, 0.1, 1.0 / 3.0, 1e30})
        for (const double variance : {0.0, 0.01, 1e20, std::numeric_limits<double>::infinity()}) {
            const NoisyImage image = wall(33, 18, value, variance);
            CHECK(filtered(image) == image.mean);
        }
}

TEST_CASE("denoise: on a flat image the variance falls by the number of pixels that are averaged") {
    NoisyImage image = wall(96, 96, 1.0, 0.04);
    add_noise(image, 1);
    const SampleMoments before = moments_of_values(image.mean), after = moments_of_values(filtered(image));
    CHECK(before.variance() == doctest::Approx(0.04).epsilon(0.1));
    // A window has 17x17 pixels. Weights are uneven, as differences of patches scatter: a third counts at least.
    CHECK(before.variance() / after.variance() > 289.0 / 3.0);
    CHECK(before.variance() / after.variance() < 289.0 * 1.3);
    CHECK(after.mean == doctest::Approx(1.0).epsilon(0.01));
}

TEST_CASE("denoise: a step of albedo stays where it is") {
    NoisyImage image = wall(48, 48, 1.0, 0.01);
    for (std::size_t pixel = 0; pixel < image.albedo.size(); ++pixel) {
        const double albedo = pixel % image.width < 24 ? 0.8 : 0.2;
        image.albedo[pixel] = glm::dvec3(albedo);
        for (std::size_t c = 0; c < channel_count; ++c) {
            image.mean[pixel * channel_count + c] = albedo;
            image.variance[pixel * channel_count + c] = 0.01 * albedo * albedo;
        }
    }
    add_noise(image, 2);
    const std::vector<double> result = filtered(image);
    SampleMoments left, right;  // the columns beside the edge
    for (std::size_t y = 0; y < 48; ++y) {
        left.add(result[(y * 48 + 23) * channel_count]);
        right.add(result[(y * 48 + 24) * channel_count]);
    }
    CHECK(left.mean == doctest::Approx(0.8).epsilon(0.02));
    CHECK(right.mean == doctest::Approx(0.2).epsilon(0.02));
}

TEST_CASE("denoise: steps of light without noise, of normals and of depth stay where they are") {
    const auto step = [](const NoisyImage& image, const std::vector<double>& values) {
        double sum = 0.0;
        for (std::size_t y = 0; y < image.height; ++y)
            sum += values[(y * image.width + 24) * channel_count] - values[(y * image.width + 23) * channel_count];
        return sum / image.height;
    };
    const auto stepped = [](double variance) {
        NoisyImage image = wall(48, 48, 1.0, variance);
        for (std::size_t i = 0; i < image.mean.size(); ++i)
            if (i / channel_count % 48 >= 24) image.mean[i] += 0.1;
        return image;
    };
    const NoisyImage sharp = stepped(1e-6);
    CHECK(step(sharp, filtered(sharp)) == doctest::Approx(0.1).epsilon(1e-3));
    // As large as the noise: alone it is smoothed, by features it is kept.
    NoisyImage noisy = stepped(0.01);
    add_noise(noisy, 3);
    CHECK(std::abs(step(noisy, filtered(noisy))) < 0.05);
    NoisyImage turned = noisy, farther = noisy;
    for (std::size_t pixel = 0; pixel < noisy.depth.size(); ++pixel)
        if (pixel % 48 >= 24) {
            turned.normal[pixel] = {1.0, 0.0, 0.0};
            farther.depth[pixel] = 3.0;
        }
    CHECK(step(turned, filtered(turned)) == doctest::Approx(0.1).epsilon(0.3));
    CHECK(step(farther, filtered(farther)) == doctest::Approx(0.1).epsilon(0.3));
}

TEST_CASE("denoise: a slope in perspective is one surface") {
    NoisyImage image = wall(64, 64, 1.0, 0.04);
    for (std::size_t pixel = 0; pixel < image.depth.size(); ++pixel)
        image.depth[pixel] = 1.0 / (0.1 + 0.01 * static_cast<double>(pixel % 64));
    add_noise(image, 4);
    const double gain = moments_of_values(image.mean).variance() / moments_of_values(filtered(image)).variance();
    CHECK(gain > 289.0 / 3.0);
}

TEST_CASE("denoise: a firefly spreads neither itself nor what is no number") {
    NoisyImage image = wall(40, 40, 1.0, 0.01);
    add_noise(image, 5);
    const std::size_t place = (20 * 40 + 20) * channel_count;
    for (const double firefly : {1e3, 1e18, 3e38}) {
        for (std::size_t c = place; c < place + channel_count; ++c) {
            image.mean[c] = firefly;
            image.variance[c] = firefly < 1e30 ? firefly * firefly : std::numeric_limits<double>::infinity();
        }
        const std::vector<double> result = filtered(image);
        for (std::size_t i = 0; i < result.size(); ++i) {
            REQUIRE(std::isfinite(result[i]));
            REQUIRE(result[i] >= 0.0);
        }
        const std::size_t far = (5 * 40 + 5) * channel_count;
        CHECK(result[far] == doctest::Approx(1.0).epsilon(0.1));
    }
}

TEST_CASE("denoise: black pixels, and rays that hit nothing, make no number that is none") {
    NoisyImage image = wall(20, 20, 1.0, 0.01);
    add_noise(image, 6);
    for (std::size_t pixel = 0; pixel < 200; ++pixel) {
        image.albedo[pixel] = image.normal[pixel] = glm::dvec3(0.0);
        image.depth[pixel] = std::numeric_limits<double>::infinity();
        for (std::size_t c = 0; c < channel_count; ++c)
            image.mean[pixel * channel_count + c] = image.variance[pixel * channel_count + c] = 0.0;
    }
    const std::vector<double> result = filtered(image);
    for (std::size_t i = 0; i < result.size(); ++i) {
        REQUIRE(std::isfinite(result[i]));
        if (i < 200 * channel_count) REQUIRE(result[i] == 0.0);
    }
    const NoisyImage black = wall(20, 20, 0.0, 0.0);
    CHECK(filtered(black) == black.mean);
}

TEST_CASE("denoise: images of one pixel, one row and one column") {
    for (const auto& [width, height] : {std::pair{1u, 1u}, {1u, 40u}, {40u, 1u}, {2u, 3u}}) {
        NoisyImage image = wall(width, height, 1.0, 0.01);
        add_noise(image, 7);
        const std::vector<double> result = filtered(image);
        if (width * height == 1) CHECK(result == image.mean);
        CHECK(moments_of_values(result).mean == doctest::Approx(moments_of_values(image.mean).mean).epsilon(0.1));
    }
}

TEST_CASE("denoise: the bits are those of one thread") {
    NoisyImage image = wall(50, 70, 1.0, 0.1);
    add_noise(image, 8);
    const std::vector<double> one = filtered(image, 1);
    for (const unsigned threads : {2u, 3u, 16u}) CHECK(filtered(image, threads) == one);
}

TEST_CASE("denoise: nothing is made after a stop, and progress ends at the whole") {
    std::stop_source source;
    source.request_stop();
    CHECK_FALSE(denoise(wall(8, 8, 1.0, 0.1), {.threads = 2, .stop = source.get_token(), .progress = {}}));
    double last = 0.0;
    CHECK(denoise(wall(8, 70, 1.0, 0.1), {.threads = 2, .stop = {}, .progress = [&](double fraction) {
                                              CHECK(fraction > last);
                                              last = fraction;
                                          }}));
    CHECK(last == 1.0);
}

TEST_CASE("denoise: a file's variances are of one sample, and what it lacks is told with the command that makes it") {
    const Image image = file_image(3, 2);
    const NoisyImage noisy = noisy_image_of(image, "a.exr");
    CHECK(noisy.mean[1] == 0.25);
    CHECK(noisy.variance[0] == doctest::Approx(0.4 / 16.0));
    CHECK(noisy.depth[5] == 2.0);
    for (const std::string missing : {"variance.G", "count", "albedo.R", "normal.Z", "depth.Z"}) {
        Image lacking = image;
        std::ranges::replace(lacking.channels, missing, std::string("other"));
        const std::string told = refusal([&] { (void)noisy_image_of(lacking, "a.exr"); });
        CHECK(told.find(missing) != std::string::npos);
        CHECK(told.find("--aov albedo,normal,depth") != std::string::npos);
    }
    for (const auto& [channel, value] :
        {std::pair{0, NAN}, {3, -1.0f}, {3, NAN}, {6, 1.0f}, {7, INFINITY}, {10, NAN}}) {
        Image bad = image;
        bad.pixels[14 * 4 + static_cast<std::size_t>(channel)] = value;
        CHECK(refusal([&] { (void)noisy_image_of(bad, "a.exr"); }).find("pixel (1, 1)") != std::string::npos);
    }
}

TEST_CASE("denoise: the result says that it is biased, and compare takes no such image") {
    const Image image = file_image(8, 8);
    const Image result = denoised_image(image, filtered(noisy_image_of(image, "a.exr")));
    CHECK(result.channels == std::vector<std::string>{"R", "G", "B"});
    CHECK(result.metadata.at(denoised_key).find("biased") != std::string::npos);
    CHECK(result.metadata.contains("tandem:seed"));
    CHECK_FALSE(result.metadata.contains("tandem:relative_error"));
    CHECK(refusal([&] { (void)noisy_image_of(result, "b.exr"); }).find("denoised already") != std::string::npos);
    Image other = image, another = image;
    other.metadata["tandem:seed"] = std::to_string(4);
    other.pixels[0] = 0.6f;
    another.metadata["tandem:seed"] = std::to_string(5);
    another.pixels[0] = 0.7f;
    Image second = result;
    second.metadata["tandem:seed"] = std::to_string(6);
    second.pixels[0] = 0.4f;
    const auto told = [&](const std::vector<NamedImage>& candidate) {
        return refusal([&] { (void)compare_images({{"a", other}, {"b", another}}, candidate); });
    };
    CHECK(told({{"c.exr", result}}).find("is denoised") != std::string::npos);
    CHECK(told({{"c.exr", result}, {"d.exr", second}}).find("is denoised") != std::string::npos);
}
