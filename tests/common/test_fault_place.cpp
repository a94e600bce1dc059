// Where a fault lies that no traced path shows. Which film is not the sum of its paths, which kernels have it, which
// pixels it touches.
#include <doctest/doctest.h>

#include "common/render/path_trace.h"
#include "common/validation/explanation/pixel_pattern.h"
#include "common/validation/verify/fault_place.h"
#include "tests/scene_builder.h"

using namespace tandem;

namespace {

constexpr std::uint32_t side = 32;

double value(std::uint32_t x, std::uint32_t y, std::uint64_t sample) {
    return 0.5 + 0.001 * static_cast<double>((x * 31 + y * 17 + sample * 7) % 101);
}

using Touch = std::function<double(std::uint32_t x, std::uint32_t y, double right)>;

// Radiance as `shade` has it; the film then as `film` leaves it.
class Job : public RenderJob {
public:
    Job(Touch shade, Touch film) : shade_(std::move(shade)), film_(std::move(film)) {}
    RenderResult render(SampleRange range, const RenderControl&) override {
        Estimate::Plane plane(side * side * channel_count);
        for (std::uint32_t i = 0; i < side * side; ++i)
            for (std::uint64_t s = range.begin; s < range.end; ++s)
                for (std::uint32_t c = 0; c < channel_count; ++c)
                    plane[i * channel_count + c].sum += film_(i % side, i / side, radiance(i % side, i / side, s));
        RenderResult result;
        result.estimate = Estimate(side, side);
        result.estimate.add_block(range, std::move(plane));
        return result;
    }
    std::vector<PathTrace> trace(std::uint32_t x, std::uint32_t y, SampleRange samples) override {
        std::vector<PathTrace> traces(samples.count());
        for (std::uint64_t s = samples.begin; s < samples.end; ++s) {
            PathTrace& one = traces[s - samples.begin];
            one.radiance = glm::dvec3(radiance(x, y, s));
            one.vertices.emplace_back().radiance = one.radiance;
            one.vertices.back().end = PathEnd::left_scene;
        }
        return traces;
    }

private:
    [[nodiscard]] double radiance(std::uint32_t x, std::uint32_t y, std::uint64_t s) const {
        return shade_(x, y, value(x, y, s));
    }
    Touch shade_, film_;
};

class Fake : public Renderer {
public:
    Fake(Touch shade, Touch film) : shade_(std::move(shade)), film_(std::move(film)) {}
    [[nodiscard]] RendererInfo info() const override { return {"fake", "", "", "", true}; }
    std::unique_ptr<RenderJob> prepare(const Scene&, const RenderSettings&) override {
        return std::make_unique<Job>(shade_, film_);
    }

private:
    Touch shade_, film_;
};

double right(std::uint32_t, std::uint32_t, double v) { return v; }

struct Found : WorstPixel {
    FaultPlace place;
};
Found found(Fake& reference, Fake& candidate, const Fake* megakernel = nullptr) {
    const Scene scene = test::SceneBuilder().scene();
    FaultQuestion question{.scene = scene,
        .settings = {},
        .reference = reference,
        .candidate = candidate,
        .reference_name = "CPU",
        .candidate_name = "Vulkan",
        .region = Rectangle{0, 16, 16, 32},
        .kernels = {},
        .with_kernel = {},
        .stop = {}};
    question.settings.width = question.settings.height = side;
    if (megakernel != nullptr) {
        question.kernels = {"stages", "megakernel"};
        question.with_kernel = [&, megakernel](const std::string& kernel) {
            return std::make_unique<Fake>(kernel == "megakernel" ? *megakernel : candidate);
        };
    }
    Found pixel;
    pixel.place = find_fault(pixel, question);
    return pixel;
}

bool says(const WorstPixel& pixel, const std::string& text) { return pixel.reason.find(text) != std::string::npos; }

std::string pattern(
    std::uint32_t width, std::uint32_t height, const std::function<bool(std::uint32_t, std::uint32_t)>& f) {
    std::vector<bool> touched;
    for (std::uint32_t y = 0; y < height; ++y)
        for (std::uint32_t x = 0; x < width; ++x) touched.push_back(f(x, y) || (x * 7 + y * 13) % 101 == 0);
    return pixel_pattern(touched, width, height);
}

}  // namespace

TEST_CASE("a fault of the film is told from one of shading, with the side, the kernels and the pixels that have it") {
    Fake cpu(right, right);
    Fake vulkan(right, [](std::uint32_t, std::uint32_t y, double v) { return y >= 29 ? 0.0 : v; });
    const WorstPixel pixel = found(cpu, vulkan, &cpu);
    CHECK(pixel.y >= 29);
    CHECK(!pixel.parts);
    CHECK(says(pixel, "the traced paths agree, so the fault is outside shading: the film of Vulkan is not the sum"));
    CHECK(says(pixel, "the last 3 rows"));
    CHECK(says(pixel, "kernels with it: stages"));
    CHECK(says(pixel, "kernels without: megakernel"));
    CHECK(says(found(vulkan, cpu), "the film of CPU is not the sum"));
}

TEST_CASE("a film whose paths are cut at one radiance is told as such, one that loses a share of each is not") {
    Fake cpu(right, right);
    Fake clamped(right, [](std::uint32_t, std::uint32_t, double v) { return std::min(v, 0.55); });
    CHECK(says(found(cpu, clamped), "the film of Vulkan is not the sum"));
    CHECK(says(found(cpu, clamped), "it is that of paths cut at 0.55"));
    CHECK(says(found(clamped, cpu), "it is that of paths cut at 0.55"));
    Fake by_pixel(right,
        [](std::uint32_t x, std::uint32_t y, double v) { return std::min(v, 0.5 + 0.001 * (16.0 * (y % 16) + x)); });
    CHECK_FALSE(says(found(by_pixel, cpu), "paths cut at"));
    Fake scaled(right, [](std::uint32_t x, std::uint32_t, double v) { return (1.0 - 0.01 * x) * v; });
    CHECK_FALSE(says(found(cpu, scaled), "paths cut at"));
}

TEST_CASE("light in other pixels is told from light that is lost, and a factor from what differs by place") {
    Fake cpu(right, right);
    const auto place = [&](const Touch& film) {
        Fake vulkan(right, film);
        return found(cpu, vulkan).place;
    };
    // Each row begins a pixel early: the film has the same values elsewhere, but for an edge.
    Fake even([](std::uint32_t x, std::uint32_t, double) { return x % 2 == 0 ? 1.0 : 3.0; }, right);
    Fake shifted([](std::uint32_t x, std::uint32_t, double) { return x % 2 == 0 ? 1.0 : 3.0; },
        [](std::uint32_t, std::uint32_t, double v) { return 4.0 - v; });
    CHECK(found(even, shifted).place.moved);
    const FaultPlace factor = place([](std::uint32_t, std::uint32_t, double v) { return 0.75 * v; });
    CHECK(factor.scaled);
    CHECK_FALSE(factor.moved);
    const FaultPlace half = place([](std::uint32_t, std::uint32_t y, double v) { return y >= 16 ? 0.5 * v : v; });
    CHECK_FALSE(half.scaled);
    CHECK_FALSE(half.moved);
}

TEST_CASE("pixels that are black on both sides make no pattern of the others") {
    const auto lit = [](std::uint32_t x, std::uint32_t, double v) { return x >= 8 ? v : 0.0; };
    Fake cpu(lit, right);
    Fake darker(lit, [](std::uint32_t, std::uint32_t, double v) { return 0.75 * v; });
    CHECK(found(cpu, darker).place.pattern == every_pixel);
    Fake right_half(right, [](std::uint32_t x, std::uint32_t, double v) { return x >= 8 ? 0.75 * v : v; });
    Fake sound(right, right);
    CHECK(found(sound, right_half).place.pattern != every_pixel);
}

TEST_CASE("a fault of shading is told by the path that parts, at the pixel of the region that differs most") {
    Fake cpu(right, right);
    Fake vulkan(
        [](std::uint32_t x, std::uint32_t y, double v) { return x == 5 && y == 20 ? 1.5 * v : 1.2 * v; }, right);
    const WorstPixel pixel = found(cpu, vulkan);
    CHECK(pixel.x == 5);
    CHECK(pixel.y == 20);
    CHECK(pixel.parts);
    CHECK(says(pixel, "the paths part at vertex 0"));
    CHECK(!says(pixel, "outside shading"));
}

TEST_CASE("sides that have the same sums in their first samples differ later, or with another seed") {
    Fake cpu(right, right), vulkan(right, right);
    CHECK(says(found(cpu, vulkan), "it shows in later samples, or with another seed"));
}

TEST_CASE("a film that is not the mean of its own paths is told without another side") {
    const Scene scene = test::SceneBuilder().scene();
    RenderSettings settings;
    settings.width = settings.height = side;
    Fake sound(right, right);
    CHECK(film_against_paths(sound, scene, settings).empty());
    Fake dim(right, [](std::uint32_t x, std::uint32_t y, double v) { return x + y == 0 ? 0.5 * v : v; });
    CHECK(film_against_paths(dim, scene, settings).starts_with("the film has 0.27"));
    CHECK(film_against_paths(dim, scene, settings).find(" in red at (0, 0), and its traced paths have the mean 0.5") !=
          std::string::npos);
    Fake clamped(right, [](std::uint32_t, std::uint32_t, double v) { return std::min(v, 0.55); });
    CHECK_FALSE(film_against_paths(clamped, scene, settings).empty());
    settings.clamp = 0.55;  // as was asked for
    CHECK(film_against_paths(clamped, scene, settings).empty());
}

TEST_CASE("patterns of pixels are named, through what rounding touches beside them") {
    CHECK(pattern(127, 83, [](auto, auto y) { return y == 82; }) == "the last row");
    CHECK(pattern(127, 83, [](auto x, auto) { return x >= 120; }) == "the last 7 columns");
    CHECK(pattern(64, 64, [](auto x, auto) { return x % 8 == 7; }) == "column 7 of every 8, counted from 0");
    CHECK(pattern(64, 64, [](auto, auto y) { return y % 4 < 2; }) == "rows 0 to 1 of every 4, counted from 0");
    CHECK(pattern(300, 300, [](auto x, auto y) { return y * 300 + x >= 65536; }) ==
          "all pixels from number 65536 = 2^16 on, counted along rows");
    CHECK(pattern(100, 90, [](auto x, auto y) { return (y * 100 + x) % 64 >= 48; }) ==
          "pixels 48 to 63 of every 64, counted from 0");
    CHECK(pattern(64, 64, [](auto x, auto y) { return x >= 16 && x < 32 && y >= 32 && y < 48; }) ==
          "x 16 to 31, y 32 to 47");
    CHECK(pattern(64, 64, [](auto, auto) { return true; }) == "nearly every pixel");
    CHECK(pattern(64, 64, [](auto x, auto y) { return (x * x + 3 * y * y + x * y) % 7 == 1; }).empty());
    CHECK(pattern(64, 64, [](auto, auto) { return false; }).empty());
}

TEST_CASE("the region to look in is that of the paired level, if one fired, else of the most significant part") {
    const auto level = [](const char* name, double p, bool significant, Rectangle region) {
        LevelResult result;
        result.name = name;
        result.p = p;
        result.significant = significant;
        result.worst.region = region;
        return result;
    };
    Judgement judgement;
    judgement.levels = {level("image", 1e-9, true, {0, 0, 64, 64}), level("tiles 16x16", 1e-8, true, {16, 0, 32, 16}),
        level("paired tiles 16x16", 1e-5, true, {0, 32, 16, 48})};
    CHECK(fired_region(judgement).value().y0 == 32);
    judgement.levels.back().significant = false;
    CHECK(fired_region(judgement).value().x0 == 16);
    judgement.levels.resize(1);
    CHECK(!fired_region(judgement));
}

TEST_CASE("a place that leaves out most of the pixels that differ is no pattern") {
    std::vector<bool> touched(32 * 32);
    for (std::size_t i = 0; i < touched.size(); i += 37) touched[i] = true;  // scattered
    touched[32 * 9 + 9] = touched[32 * 9 + 10] = touched[32 * 10 + 10] = true;
    CHECK(pixel_pattern(touched, 32, 32).empty());
}
