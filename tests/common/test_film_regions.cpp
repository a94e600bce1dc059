// Films in regions: every pixel once, with the bits of the whole film; files of tiles; images as squares of pixels.
#include <doctest/doctest.h>

#include <algorithm>
#include <bit>

#include "common/image/image_io_parts.h"
#include "common/image/tiled_image.h"
#include "common/render/film_regions.h"
#include "common/render/stopping.h"
#include "common/validation/compare/binned_image.h"
#include "tests/common/synthetic_renderer.h"
#include "tests/refusal.h"
#include "tests/temporary_folder.h"

using namespace tandem;

namespace {

constexpr std::uint32_t width = 300, height = 200;

SyntheticJob job_of_film() {
    RenderSettings settings;
    settings.width = width;
    settings.height = height;
    settings.sampling = Sampling::adaptive;  // lists of pixels
    return {settings, [](std::uint32_t x, std::uint32_t y, SampleRandom& random) {
                const double value = 1.0 + 0.01 * x + 0.02 * y + random.uniform();
                return Radiance{value, 2.0 * value, 0.1 * random.uniform()};
            }};
}

bool same_floats(const std::vector<float>& a, const std::vector<float>& b) {
    return std::ranges::equal(
        a, b, [](float x, float y) { return std::bit_cast<std::uint32_t>(x) == std::bit_cast<std::uint32_t>(y); });
}

// As read: an .exr file has an order of channels of its own.
Image written(const Image& image, const std::filesystem::path& path) {
    write_image(path, image);
    return read_image(path);
}

std::vector<float> values_of(const Image& image, const std::string& channel) {
    const auto place = static_cast<std::size_t>(std::ranges::find(image.channels, channel) - image.channels.begin());
    std::vector<float> values;
    for (std::size_t i = place; i < image.pixels.size(); i += image.channels.size()) values.push_back(image.pixels[i]);
    return values;
}

Image header_of(const Image& image) {
    Image header = image;
    header.pixels.clear();
    return header;
}

// In regions, as the command does it.
RegionsRender write_in_regions(
    const std::filesystem::path& path, const Image& whole, std::uint64_t tiles, const RenderControl& control = {}) {
    SyntheticJob job = job_of_film();
    TiledImageWriter file(path, header_of(whole));
    const RegionsRender done =
        render_regions(job, width, film_regions(width, height, image_tile_edge, tiles), 16, control,
            [&](const PixelRectangle& region, FilmMoments film) { file.write(region, image_of(film, {}).pixels); });
    if (done.samples_done > 0.0) file.commit();
    return done;
}

}  // namespace

TEST_CASE("regions hold every pixel once, whole tiles each, in the order of the file") {
    for (const std::uint64_t tiles : {1, 2, 3, 5, 6, 9, 1000}) {
        CAPTURE(tiles);
        std::vector<int> times(std::size_t{width} * height, 0);
        std::uint64_t last = 0;
        for (const PixelRectangle& region : film_regions(width, height, 64, tiles)) {
            CHECK(region.x0 % 64 == 0);
            CHECK(region.y0 % 64 == 0);
            CHECK((region.x1 % 64 == 0 || region.x1 == width));
            CHECK((region.y1 % 64 == 0 || region.y1 == height));
            const std::uint64_t columns = (region.x1 - region.x0 + 63) / 64, rows = (region.y1 - region.y0 + 63) / 64;
            CHECK(columns * rows <= tiles);
            CHECK((rows == 1 || columns == 5));  // else tiles would not come in order
            const std::uint64_t place = region.y0 / 64 * 5 + region.x0 / 64;
            CHECK((region.x0 + region.y0 == 0 || place > last));
            last = place;
            for (std::uint32_t y = region.y0; y < region.y1; ++y)
                for (std::uint32_t x = region.x0; x < region.x1; ++x) ++times[y * width + x];
        }
        CHECK(std::ranges::all_of(times, [](int n) { return n == 1; }));
    }
}

TEST_CASE("a film in regions has the bits and the error of the whole film") {
    if (!image_files::has_library()) return;
    const TemporaryFolder folder;
    const FilmMoments film = film_of(job_of_film().render({0, 16}, {}).estimate);
    const Image whole = image_of(film, {{"tandem:seed", "7"}}), lines = written(whole, folder / "lines.exr");
    for (const std::uint64_t tiles : {1, 4, 100}) {
        CAPTURE(tiles);
        const RegionsRender done = write_in_regions(folder / "tiles.exr", whole, tiles);
        CHECK(done.complete);
        CHECK(*done.relative_error == doctest::Approx(*relative_error_of(film)));
        const Image again = read_image(folder / "tiles.exr");
        CHECK(again.channels == lines.channels);
        CHECK(again.metadata.at("tandem:seed") == "7");
        CHECK(same_floats(again.pixels, lines.pixels));
    }
    CHECK(folder.file_count() == 2);
}

TEST_CASE("a film that is stopped keeps the regions that are done, and pixels without samples are not compared") {
    if (!image_files::has_library()) return;
    const TemporaryFolder folder;
    const Image image = image_of(job_of_film().render({0, 16}, {}).estimate, {});
    constexpr double two_tiles = 2.0 * 128 * 128 / (width * height);
    std::stop_source stop;
    const RegionsRender done =
        write_in_regions(folder / "tiles.exr", image, 1, {.stop = stop.get_token(), .progress = [&](double share) {
                                                              if (share > 0.9 * two_tiles) stop.request_stop();
                                                          }});
    CHECK_FALSE(done.complete);
    CHECK(done.done == doctest::Approx(two_tiles));
    CHECK(done.samples_done == 16.0 * 2 * 128 * 128);
    const Image whole = written(image, folder / "whole.exr"), kept = read_image(folder / "tiles.exr");
    const std::vector<float> red = values_of(whole, "R"), kept_red = values_of(kept, "R"),
                             counts = values_of(kept, "count");
    for (std::size_t i = 0; i < red.size(); ++i) {
        const bool is_done = i / width < 128 && i % width < 256;
        REQUIRE(counts[i] == (is_done ? 16.0f : 0.0f));
        REQUIRE(kept_red[i] == (is_done ? red[i] : 0.0f));
    }
    for (const std::uint32_t bin : {1, 4}) {
        CompareOptions options;
        options.bin = bin;
        CHECK(contains(refusal([&] { (void)compare_files({folder / "whole.exr"}, {folder / "tiles.exr"}, options); }),
            "tiles.exr: pixel (256, 0) has no samples; render the whole film"));
    }
}

TEST_CASE("a film that is stopped before anything is done leaves no file") {
    if (!image_files::has_library()) return;
    const TemporaryFolder folder;
    const Image image = image_of(job_of_film().render({0, 16}, {}).estimate, {});
    std::stop_source stop;
    stop.request_stop();
    CHECK(write_in_regions(folder / "tiles.exr", image, 1, {.stop = stop.get_token(), .progress = {}}).samples_done ==
          0.0);
    CHECK(folder.file_count() == 0);
    CHECK(contains(
        refusal([&] { const TiledImageWriter file(folder / "a.png", header_of(image)); }), "end the name in .exr"));
}

TEST_CASE("bands of rows hold what the file holds, in tiles or in lines") {
    if (!image_files::has_library()) return;
    const TemporaryFolder folder;
    const Image whole = image_of(job_of_film().render({0, 16}, {}).estimate, {});
    const Image lines = written(whole, folder / "lines.exr");
    (void)write_in_regions(folder / "tiles.exr", whole, 2);
    for (const char* name : {"lines.exr", "tiles.exr"}) {
        CAPTURE(name);
        BandedImage file(folder / name);
        CHECK(file.header().width == width);
        CHECK(file.header().pixels.empty());
        std::vector<float> pixels;
        for (std::uint32_t y = 0; y < height; y += file.band_height())
            for (const float value : file.read(y, std::min(height, y + file.band_height()))) pixels.push_back(value);
        CHECK(same_floats(pixels, lines.pixels));
    }
}

TEST_CASE("a square of pixels has their mean, and what is known of it") {
    if (!image_files::has_library()) return;
    const TemporaryFolder folder;
    Image image;
    image.width = 3;
    image.height = 2;
    image.channels = {"R", "G", "B", "variance.R", "variance.G", "variance.B", "count"};
    // Counts 4 and 16, variances of one sample 8 and 64; the third column is alone.
    for (const float x : {1.0f, 3.0f, 5.0f, 1.0f, 3.0f, 5.0f})
        for (const float value : {x, x, x, x == 1.0f ? 8.0f : 64.0f, 0.0f, 0.0f, x == 1.0f ? 4.0f : 16.0f})
            image.pixels.push_back(value);
    const Image whole = written(image, folder / "a.exr");
    const Image binned = read_binned_image(folder / "a.exr", 2, VarianceOf::sample);
    CHECK(binned.width == 2);
    CHECK(binned.height == 1);
    CHECK(values_of(binned, "R") == std::vector<float>{2, 5});
    CHECK(values_of(binned, "count") == std::vector<float>{40, 32});
    // The sum of v/n is 2 (8/4) + 2 (64/16) = 12 of four pixels, and 40 12/16 = 30.
    CHECK(values_of(binned, "variance.R") == std::vector<float>{30, 64});
    CHECK(values_of(binned, "variance.G") == std::vector<float>{0, 0});
    // Variances of means: 2 (8 + 64)/16 = 9.
    CHECK(values_of(read_binned_image(folder / "a.exr", 2, VarianceOf::mean), "variance.R")[0] == 9.0f);
    CHECK(same_floats(read_binned_image(folder / "a.exr", 1, VarianceOf::sample).pixels, whole.pixels));
}

TEST_CASE("images are compared within the memory that there is, or by squares of pixels") {
    if (!image_files::has_library()) return;
    const TemporaryFolder folder;
    const auto noisy = [](double exposure) {
        return [=](std::uint32_t x, std::uint32_t, SampleRandom& random) {
            const double value = exposure * (1.0 + 0.01 * x) * (1.0 + 0.5 * random.triangular());
            return Radiance{value, value, 0.5 * value};
        };
    };
    const auto put = [&](const char* name, double exposure, std::uint64_t seed) {
        RenderSettings settings;
        settings.width = settings.height = 128;
        settings.seed = seed;
        write_image(folder / name, image_of(SyntheticJob(settings, noisy(exposure)).render({0, 64}, {}).estimate, {}));
    };
    put("a.exr", 1.0, 1);
    put("b.exr", 1.0, 2);
    put("off.exr", 1.05, 3);
    const auto compared = [&](const char* with, std::uint32_t bin) {
        CompareOptions options;
        options.bin = bin;
        return compare_files({folder / "a.exr"}, {folder / with}, options);
    };
    // The image's mean is the same, and known as well.
    const SceneVerdict pixels = compared("b.exr", 1), squares = compared("b.exr", 4);
    CHECK(squares.judgement.verdict == Verdict::agree);
    const RegionComparison &of_pixels = widest(pixels.judgement.level("image")),
                           &of_squares = widest(squares.judgement.level("image"));
    CHECK(of_squares.relative == doctest::Approx(of_pixels.relative).epsilon(1e-4));
    CHECK(of_squares.bound() == doctest::Approx(of_pixels.bound()).epsilon(0.05));
    CHECK(compared("off.exr", 4).judgement.verdict == Verdict::disagree);
    CompareOptions small;
    small.memory = 4 << 20;
    const std::string line = refusal([&] { (void)compare_files({folder / "a.exr"}, {folder / "b.exr"}, small); });
    CAPTURE(line);
    CHECK(contains(line, "images of 128x128 pixels take"));
    CHECK(contains(line, "--bin 2"));
    small.bin = 2;
    CHECK(compare_files({folder / "a.exr"}, {folder / "b.exr"}, small).judgement.verdict == Verdict::agree);
}
