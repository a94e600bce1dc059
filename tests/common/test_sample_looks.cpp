// Looks at single samples: each finds a kind of fault that the looks at means never meet, on renderers that hold it.
#include <doctest/doctest.h>

#include <cmath>

#include "common/render/tiled_renderer.h"
#include "common/validation/report/verdict_json.h"
#include "common/validation/verify/sample_looks.h"
#include "common/validation/verify/verify.h"
#include "tests/common/synthetic_renderer.h"

using namespace tandem;

namespace {

// The light that paths of a room gather: half of it goes on at each bounce, and every bounce has a number of its own.
using Bounces = std::function<double(std::uint32_t bounce, std::array<double, 17>& numbers)>;
double sound(std::uint32_t bounce, std::array<double, 17>& numbers) { return numbers.at(bounce); }

struct Fault {
    Bounces bounce = sound;
    std::function<double(double)> rounding = [](double value) { return value; };
    std::function<std::uint64_t(std::uint64_t)> seed = [](std::uint64_t word) { return word; };
    std::function<std::uint64_t(std::uint64_t)> sample = [](std::uint64_t word) { return word; };
    // Is this one of `pixels` rendered, in an image so wide?
    std::function<bool(std::uint32_t pixel, std::uint32_t pixels, std::uint32_t width)> rendered =
        [](std::uint32_t, std::uint32_t, std::uint32_t) { return true; };
    std::function<bool(std::uint32_t pixel, std::uint32_t tile)> in_tile = [](std::uint32_t, std::uint32_t) {
        return true;
    };
};

class FaultyJob : public RenderJob {
public:
    FaultyJob(RenderSettings settings, const Fault& fault, std::uint32_t tile)
        : settings_(settings), fault_(fault), tile_(tile) {}
    RenderResult render(SampleRange range, const RenderControl& control) override {
        RenderResult result;
        result.estimate = Estimate(settings_.width, settings_.height);
        result.seconds = 1e-6 * static_cast<double>(range.count());
        for (std::uint64_t begin = range.begin; begin < range.end && !control.stop.stop_requested();
             begin += samples_per_block) {
            const SampleRange block{begin, std::min(range.end, begin + samples_per_block)};
            result.estimate.add_block(block, plane(block));
        }
        return result;
    }

private:
    Estimate::Plane plane(SampleRange block) const {
        const std::uint32_t pixels = settings_.width * settings_.height;
        Estimate::Plane moments(std::size_t{pixels} * channel_count);
        for (std::uint32_t pixel = 0; pixel < pixels; ++pixel) {
            if (!fault_.rendered(pixel, pixels, settings_.width)) continue;
            if (tile_ > 0 && !fault_.in_tile(pixel, tile_)) continue;
            for (std::uint64_t sample = block.begin; sample < block.end; ++sample) {
                SampleRandom random(fault_.seed(settings_.seed), pixel, fault_.sample(sample));
                std::array<double, 17> numbers{};
                for (double& number : numbers) number = random.exponential();
                double radiance = 0.0;
                for (std::uint32_t k = 0; k <= std::min(settings_.bounces, 16u); ++k)
                    radiance += std::ldexp(fault_.bounce(k, numbers), -static_cast<int>(k));
                radiance = fault_.rounding(radiance);
                for (std::size_t c = 0; c < channel_count; ++c) {
                    moments[pixel * channel_count + c].sum += radiance;
                    moments[pixel * channel_count + c].sum_of_squares += radiance * radiance;
                }
            }
        }
        return moments;
    }
    RenderSettings settings_;
    Fault fault_;
    std::uint32_t tile_;
};

class FaultyRenderer : public Renderer, public TiledRenderer {
public:
    explicit FaultyRenderer(Fault fault, std::string name) : fault_(std::move(fault)), name_(std::move(name)) {}
    RendererInfo info() const override { return {name_, "no device", "no driver", "C++", true}; }
    std::unique_ptr<RenderJob> prepare(const Scene&, const RenderSettings& settings) override {
        return std::make_unique<FaultyJob>(settings, fault_, 0);
    }
    std::unique_ptr<RenderJob> prepare_tiled(
        const Scene&, const RenderSettings& settings, std::uint32_t tile_pixels) override {
        return std::make_unique<FaultyJob>(settings, fault_, tile_pixels);
    }

private:
    Fault fault_;
    std::string name_;
};

// To so many bits, by cutting the rest off.
std::function<double(double)> bits(int count) {
    return [count](double value) {
        const double unit = std::ldexp(1.0, std::ilogb(value) - count + 1);
        return unit * std::floor(value / unit);
    };
}

struct Options {
    bool other_precision = true, strict = false;
    std::uint64_t samples = 1024;
};

SceneVerdict verify(const Fault& fault, Options given = {}) {
    Fault single;
    single.rounding = bits(24);
    FaultyRenderer reference(single, "cpu"), candidate(fault, "vulkan"), precise({}, "cpu");
    VerifyOptions options;
    RenderSettings settings;
    settings.width = settings.height = 32;
    options.settings = settings;
    options.max_samples = given.samples;
    options.seed = 7;
    options.criteria.strict = given.strict;
    options.criteria.margins.image = 0.05;  // few samples are enough
    if (given.other_precision) options.other_precision = &precise;
    Scene scene;
    return verify_scene(scene, reference, candidate, options);
}

// The level that calls the two different, and nothing but it.
std::string found_by(const SceneVerdict& verdict) {
    std::string names;
    for (const LevelResult& level : verdict.judgement.levels)
        if (level.significant) names += (names.empty() ? "" : "; ") + level.name;
    return names;
}

}  // namespace

TEST_CASE("no bounce is left out where several limits are looked at at a time") {
    using Limits = std::vector<std::uint32_t>;
    CHECK(later_limits(5, 100.0) == Limits{2, 3, 4, 5});
    CHECK(later_limits(12, 6.0) == Limits{3, 5, 7, 9, 11, 12});
    CHECK(later_limits(12, 1.0) == Limits{12});
    CHECK(later_limits(12, 0.99).empty());
    for (std::uint32_t deepest = 2; deepest <= 16; ++deepest)
        for (double affordable = 1.0; affordable < 20.0; affordable += 0.37) {
            const Limits limits = later_limits(deepest, affordable);
            REQUIRE_FALSE(limits.empty());
            CHECK(limits.back() == deepest);
            CHECK(static_cast<double>(limits.size()) <= affordable + 1.0);
        }
}

TEST_CASE("a sound candidate agrees at every look") {
    const SceneVerdict verdict = verify({});
    CHECK(verdict.verdict == Verdict::agree);
    for (const char* level : {counter_level, size_level, bounce_level, arithmetic_level}) {
        CAPTURE(level);
        CHECK(verdict.judgement.level(level).p == 1.0);
    }
    CHECK_FALSE(verdict.judgement.coarse_arithmetic);
}

TEST_CASE("without the reference's other precision only short paths are looked at one by one") {
    const SceneVerdict verdict = verify({}, {.other_precision = false});
    CHECK(verdict.verdict == Verdict::agree);
    CHECK(verdict.judgement.level(counter_level).p == 1.0);
    CHECK_THROWS((void)verdict.judgement.level(bounce_level));
    CHECK_FALSE(verdict.paired.arithmetic.has_value());
}

TEST_CASE("seeds and samples whose high words are lost are found") {
    std::vector<std::pair<std::string, Fault>> faults(5);
    faults[0].first = "seed of 32 bits";
    faults[0].second.seed = [](std::uint64_t word) { return word & 0xFFFFFFFFu; };
    for (std::size_t i = 1; i < faults.size(); ++i) {
        const std::uint64_t width = std::array{8, 16, 31, 32}.at(i - 1);
        faults[i].first = "sample of " + std::to_string(width) + " bits";
        faults[i].second.sample = [width](std::uint64_t word) { return word % (std::uint64_t{1} << width); };
    }
    faults.emplace_back("sample as a single", Fault{});
    faults.back().second.sample = [](std::uint64_t word) {
        return static_cast<std::uint64_t>(static_cast<float>(word));
    };
    for (const auto& [name, fault] : faults) {
        CAPTURE(name);
        const SceneVerdict verdict = verify(fault);
        CHECK(verdict.verdict == Verdict::disagree);
        CHECK(verdict.judgement.significant(counter_level));
    }
}

TEST_CASE("pixels that are lost at odd sizes, beyond 16 bits or between tiles are found") {
    std::vector<std::pair<std::string, Fault>> faults(4);
    faults[0].first = "partial workgroup";
    faults[0].second.rendered = [](std::uint32_t pixel, std::uint32_t pixels, std::uint32_t) {
        return pixel < pixels / 128 * 128;
    };
    faults[1].first = "last row of an odd width";
    faults[1].second.rendered = [](std::uint32_t pixel, std::uint32_t pixels, std::uint32_t width) {
        return width % 2 == 0 || pixel < pixels - width;
    };
    faults[2].first = "16 bits";
    faults[2].second.rendered = [](std::uint32_t pixel, std::uint32_t, std::uint32_t) { return pixel < 65536; };
    faults[3].first = "tiles";
    faults[3].second.in_tile = [](std::uint32_t pixel, std::uint32_t tile) { return pixel % tile < tile - 100; };
    for (const auto& [name, fault] : faults) {
        CAPTURE(name);
        const SceneVerdict verdict = verify(fault);
        CHECK(verdict.verdict == Verdict::disagree);
        CHECK(found_by(verdict) == size_level);
    }
}

TEST_CASE("numbers used again at a deep bounce are found there, by no mean") {
    Fault fault;
    fault.bounce = [](std::uint32_t bounce, std::array<double, 17>& numbers) {
        return numbers.at(bounce == 9 ? 5 : bounce);
    };
    const SceneVerdict verdict = verify(fault);
    CHECK(verdict.verdict == Verdict::disagree);
    CHECK(verdict.judgement.significant(bounce_level));
    CHECK(verdict.judgement.level(bounce_level).place == "bounce 9");
    CHECK(verify(fault, {.other_precision = false}).verdict == Verdict::agree);
}

TEST_CASE("arithmetic coarser than single precision is told, and with strict criteria a disagreement") {
    for (const int coarse : {11, 8}) {
        CAPTURE(coarse);
        Fault fault;
        fault.rounding = [coarse](double value) { return bits(coarse)(value * (1.0 + std::ldexp(0.5, -coarse))); };
        const SceneVerdict told = verify(fault);
        REQUIRE(told.paired.arithmetic);
        CHECK(told.judgement.coarse_arithmetic);
        CHECK(to_json(told)["paired"]["arithmetic"]["coarser_than_single"] == true);
        if (told.verdict == Verdict::agree)
            CHECK(told.sentence.find("coarser than single precision: 9") != std::string::npos);
        const SceneVerdict strict = verify(fault, {.strict = true});
        CHECK(strict.verdict == Verdict::disagree);
        CHECK(strict.judgement.significant(arithmetic_level));
    }
}

TEST_CASE("a device that rounds as coarsely as Vulkan allows is no coarser than single precision") {
    Fault fault;
    fault.rounding = bits(20);  // 8 ulp of single precision
    CHECK_FALSE(verify(fault, {.strict = true}).judgement.coarse_arithmetic);
    CHECK(verify(fault, {.strict = true}).verdict == Verdict::agree);
}

TEST_CASE("a small fault among paths that part is found by pairs beyond the first agreement") {
    Fault fault;
    // A twentieth of the samples parts, evenly up and down but for 5 %: 0.25 % of what comes without a bounce.
    fault.bounce = [](std::uint32_t bounce, std::array<double, 17>& numbers) {
        const bool parts = bounce == 0 && numbers[16] > 3.0;
        return numbers.at(bounce) * (parts ? (numbers[15] > 0.6931 ? 2.05 : 0.05) : 1.0);
    };
    const SceneVerdict verdict = verify(fault, {.samples = 4096});
    CHECK(verdict.verdict == Verdict::disagree);
    REQUIRE(verdict.looks.size() > 1);
    CHECK(verdict.looks.front().verdict == Verdict::agree);
    CHECK(verdict.looks.back().paired_samples > verdict.looks.front().paired_samples);
    CHECK(found_by(verdict).starts_with("paired"));
}

TEST_CASE("pairs that resolve what is declared end with the agreement, and the sentence says what they resolve") {
    const SceneVerdict verdict = verify({}, {.samples = 4096});
    CHECK(verdict.looks.size() == 1);
    CHECK(pairs_resolve(verdict.judgement, verdict.criteria));
    CHECK(verdict.sentence.find("with paired seeds 0.02") != std::string::npos);
    CHECK(to_json(verdict)["paired"]["resolution_tile_relative"] <= verdict.criteria.paired_resolution.tile);
}
