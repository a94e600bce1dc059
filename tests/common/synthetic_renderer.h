// A Renderer whose samples are drawn from distributions that the test knows: the truth about every verdict is known.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <numeric>
#include <utility>

#include "common/render/renderer.h"

namespace tandem {

// SplitMix64 [Steele 2014], started from (seed, pixel, sample): one seed gives one set of samples, as a renderer does.
class SampleRandom {
public:
    SampleRandom(std::uint64_t seed, std::uint64_t pixel, std::uint64_t sample)
        : state_(mix(mix(mix(seed) + pixel) + sample)) {}
    double uniform() { return static_cast<double>(mix(state_ += 0x9e3779b97f4a7c15u) >> 11) * 0x1p-53; }
    double exponential() { return -std::log1p(-uniform()); }
    // Triangular around 0 with variance 1: light tails.
    double triangular() { return (uniform() - uniform()) * std::sqrt(6.0); }
    // Pareto on [1, inf) of index 2.2: mean 1.833, a variance of 7.6 that samples badly underestimate, no third moment.
    double pareto() { return std::pow(1.0 - uniform(), -1.0 / 2.2); }

private:
    static std::uint64_t mix(std::uint64_t z) {
        z += 0x9e3779b97f4a7c15u;
        z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
        z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
        return z ^ (z >> 31);
    }
    std::uint64_t state_;
};

using Radiance = std::array<double, channel_count>;
// One sample of pixel (x, y).
using Sampler = std::function<Radiance(std::uint32_t x, std::uint32_t y, SampleRandom& random)>;

// Which samples do not follow the numbers of their seed: with probability `share` a sample is drawn from other
// numbers. So with paired seeds two renderers part as real ones do where rounding sends a path
// elsewhere, and both stay right.
struct Strays {
    double share = 0.0;
};

class SyntheticJob : public RenderJob {
public:
    SyntheticJob(RenderSettings settings, Sampler sampler, Strays strays = {})
        : settings_(settings), sampler_(std::move(sampler)), strays_(strays) {}

    RenderResult render(SampleRange range, const RenderControl& control) override {
        std::vector<std::uint32_t> all(std::size_t{settings_.width} * settings_.height);
        std::iota(all.begin(), all.end(), 0u);
        return render_film(range, all, settings_.width, settings_.height, control);
    }
    RenderResult render_pixels(
        SampleRange range, std::span<const std::uint32_t> pixels, const RenderControl& control) override {
        if (settings_.sampling != Sampling::adaptive) return RenderJob::render_pixels(range, pixels, control);
        return render_film(range, pixels, static_cast<std::uint32_t>(pixels.size()), 1, control);
    }

private:
    RenderResult render_film(SampleRange range, std::span<const std::uint32_t> pixels, std::uint32_t width,
        std::uint32_t height, const RenderControl& control) const {
        RenderResult result;
        result.estimate = Estimate(width, height);
        for (std::uint64_t begin = range.begin; begin < range.end && !control.stop.stop_requested();
             begin += samples_per_block) {
            const SampleRange block{begin, std::min(range.end, begin + samples_per_block)};
            result.estimate.add_block(block, plane(block, pixels, result.estimate));
            if (control.progress) control.progress(static_cast<double>(block.end - range.begin));
        }
        result.seconds = 1e-6 * static_cast<double>(range.count());
        return result;
    }

    Estimate::Plane plane(SampleRange block, std::span<const std::uint32_t> pixels, Estimate& estimate) const {
        Estimate::Plane moments(estimate.pixel_count() * channel_count);
        for (std::size_t place = 0; place < pixels.size(); ++place)
            for (std::uint64_t sample = block.begin; sample < block.end; ++sample) {
                const std::uint32_t pixel = pixels[place];
                SampleRandom random = random_of(pixel, sample);
                const Radiance radiance = sampler_(pixel % settings_.width, pixel / settings_.width, random);
                bool valid = true;
                for (const double value : radiance) valid = valid && std::isfinite(value) && value >= 0.0;
                if (!valid) estimate.add_invalid(1);
                for (std::size_t c = 0; valid && c < channel_count; ++c) {
                    moments[place * channel_count + c].sum += radiance[c];
                    moments[place * channel_count + c].sum_of_squares += radiance[c] * radiance[c];
                }
            }
        return moments;
    }

    [[nodiscard]] SampleRandom random_of(std::uint64_t pixel, std::uint64_t sample) const {
        constexpr std::uint64_t elsewhere = std::uint64_t{1} << 63;  // no seed of a test is as large
        if (strays_.share > 0.0 &&
            SampleRandom(settings_.seed + elsewhere / 2, pixel, sample).uniform() < strays_.share)
            return {settings_.seed + elsewhere, pixel, sample};
        return {settings_.seed, pixel, sample};
    }

    RenderSettings settings_;
    Sampler sampler_;
    Strays strays_;
};

class SyntheticRenderer : public Renderer {
public:
    explicit SyntheticRenderer(Sampler sampler, std::string name = "synthetic")
        : sampler_(std::move(sampler)), name_(std::move(name)) {}
    // One that claims to follow the numbers, but for its strays.
    SyntheticRenderer(Sampler sampler, std::string name, Strays strays)
        : sampler_(std::move(sampler)), name_(std::move(name)), strays_(strays), follows_numbers_(true) {}
    RendererInfo info() const override { return {name_, "no device", "no driver", "C++", follows_numbers_}; }
    std::unique_ptr<RenderJob> prepare(const Scene&, const RenderSettings& settings) override {
        return std::make_unique<SyntheticJob>(settings, sampler_, strays_);
    }

private:
    Sampler sampler_;
    std::string name_;
    Strays strays_;
    bool follows_numbers_ = false;
};

// Every kind of pixel: noisy, heavy-tailed, rarely lit, constant and black.
inline Radiance mixed(std::uint32_t x, std::uint32_t y, SampleRandom& random) {
    const std::uint32_t kind = (x / 5 + y / 3) % 5;
    if (kind == 0) return {0.5, 0.25, 0.125};
    if (kind == 1) return {0.0, 0.0, 0.0};
    if (kind == 2) return random.uniform() < 0.02 ? Radiance{20.0, 10.0, 5.0} : Radiance{0.0, 0.0, 0.0};
    const double value = kind == 3 ? random.exponential() : 0.5 * random.pareto();
    return {value, 0.8 * value, 0.6 * value};
}

}  // namespace tandem
