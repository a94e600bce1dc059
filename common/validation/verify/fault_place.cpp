#include "common/validation/verify/fault_place.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/vector_relational.hpp>
#include <limits>
#include <numeric>

#include "common/error.h"
#include "common/render/path_trace.h"
#include "common/text.h"
#include "common/validation/explanation/pixel_pattern.h"

namespace tandem {

namespace {

constexpr std::size_t most_pixels = 3;  // traced before it is said that no path parts

// Sums of 64 samples in single precision are off by at most 64 ulp, 2^-18. A path that rounding sends elsewhere changes
// its pixel's by some part of a sample.
constexpr double same_sum = 0x1p-12;

struct Sums {
    Estimate::Plane plane;
    [[nodiscard]] glm::dvec3 at(std::size_t pixel) const {
        const Moments* m = &plane[pixel * channel_count];
        return {m[0].sum, m[1].sum, m[2].sum};
    }
};

// The radiance of the paths that a side traces in a pixel, as its film should have them.
std::vector<glm::dvec3> radiances_of(
    RenderJob& job, const RenderSettings& settings, std::size_t pixel, SampleRange samples) {
    std::vector<glm::dvec3> result;
    const auto x = static_cast<std::uint32_t>(pixel % settings.width),
               y = static_cast<std::uint32_t>(pixel / settings.width);
    for (const PathTrace& trace : job.trace(x, y, samples)) {
        const glm::dvec3& r = trace.radiance;
        if (!std::isfinite(r.x + r.y + r.z) || std::min({r.x, r.y, r.z}) < 0.0) continue;  // MODEL.md 12
        result.push_back(glm::min(r, glm::dvec3(settings.clamp)));
    }
    return result;
}

struct ClampedSum {
    double at = 0.0, within = 0.0;  // the clamp, and how well the sum tells it
};

// The clamp with which the values have this sum; nothing where none has.
std::optional<ClampedSum> clamp_of(std::vector<double> values, double sum) {
    std::ranges::sort(values);
    double below = 0.0;  // the sum of the values that the clamp leaves as they are
    for (std::size_t k = 0; k < values.size(); ++k) {
        const auto cut = static_cast<double>(values.size() - k);
        const double clamp = (sum - below) / cut;
        if (clamp <= values[k]) {
            if (clamp < (k == 0 ? 0.0 : values[k - 1])) return std::nullopt;
            return ClampedSum{clamp, same_sum * sum / cut};
        }
        below += values[k];
    }
    return std::nullopt;
}

class FaultSearch {
public:
    FaultSearch(WorstPixel& pixel, const FaultQuestion& question)
        : pixel_(pixel),
          question_(question),
          width_(question.settings.width),
          height_(question.settings.height),
          reference_job_(question.reference.prepare(question.scene, question.settings)),
          candidate_job_(question.candidate.prepare(question.scene, question.settings)) {}

    FaultPlace run() {
        look();
        return std::move(place_);
    }

private:
    void look() {
        const std::optional<Sums> reference = sums_of(*reference_job_);
        const std::optional<Sums> candidate = reference ? sums_of(*candidate_job_) : std::nullopt;
        if (!candidate) return;
        const std::vector<std::size_t> pixels = worst_pixels(*reference, *candidate);
        bool traced = true;
        for (std::size_t k = 0; k < pixels.size() && traced; ++k) {
            WorstPixel one = pixel_;
            one.x = static_cast<std::uint32_t>(pixels[k] % width_);
            one.y = static_cast<std::uint32_t>(pixels[k] / width_);
            one.reason.clear();
            choose_sample(one, *reference_job_, *candidate_job_);
            if (one.reason.empty()) return;  // it cannot be traced
            if (k == 0 || one.parts) pixel_ = one;
            traced = !one.parts;
        }
        if (pixel_.parts || question_.stop.stop_requested()) return;
        say_what_lies_outside(*reference, *candidate, pixels);
    }

    [[nodiscard]] std::optional<Sums> sums_of(RenderJob& job) const {
        RenderControl control;
        control.stop = question_.stop;
        RenderResult result = job.render(first_block, control);
        if (result.estimate.count() != first_block.count()) return std::nullopt;
        return Sums{result.estimate.totals()};
    }

    [[nodiscard]] std::vector<std::size_t> worst_pixels(const Sums& a, const Sums& b) const {
        const Rectangle r = question_.region.value_or(Rectangle{0, 0, width_, height_});
        std::vector<std::size_t> pixels;
        for (std::uint32_t y = r.y0; y < r.y1; ++y)
            for (std::uint32_t x = r.x0; x < r.x1; ++x) pixels.push_back(std::size_t{y} * width_ + x);
        const auto apart = [&](std::size_t i) { return largest_coordinate(a.at(i) - b.at(i)); };
        const auto count = std::min(most_pixels, pixels.size());
        std::ranges::partial_sort(pixels, pixels.begin() + static_cast<std::ptrdiff_t>(count), std::greater{}, apart);
        pixels.resize(count);
        return pixels;
    }

    [[nodiscard]] std::vector<bool> parted(const Sums& a, const Sums& b) const {
        std::vector<bool> result(std::size_t{width_} * height_);
        for (std::size_t i = 0; i < result.size(); ++i) result[i] = sums_differ(a.at(i), b.at(i));
        return result;
    }

    [[nodiscard]] std::vector<glm::dvec3> radiances(RenderJob& job, std::size_t i) const {
        return radiances_of(job, question_.settings, i, first_block);
    }

    // Whether a side's film is the sum of the paths that it traces, in each of the pixels.
    [[nodiscard]] bool adds_its_paths(RenderJob& job, const Sums& sums, const std::vector<std::size_t>& pixels) const {
        return std::ranges::all_of(pixels, [&](std::size_t i) {
            const std::vector<glm::dvec3> each = radiances(job, i);
            return !sums_differ(std::accumulate(each.begin(), each.end(), glm::dvec3(0.0)), sums.at(i));
        });
    }

    // The one clamp with which the paths add up to the film wherever they do not without.
    [[nodiscard]] std::optional<double> common_clamp(
        RenderJob& job, const Sums& sums, const std::vector<std::size_t>& pixels) const {
        double low = 0.0, high = std::numeric_limits<double>::infinity();
        std::size_t found = 0;
        for (const std::size_t i : pixels) {
            const std::vector<glm::dvec3> each = radiances(job, i);
            for (int c = 0; c < 3; ++c) {
                std::vector<double> values;
                for (const glm::dvec3& one : each) values.push_back(one[c]);
                const double sum = sums.at(i)[c], all = std::accumulate(values.begin(), values.end(), 0.0);
                if (std::abs(all - sum) <= same_sum * all) continue;
                const std::optional<ClampedSum> clamp = clamp_of(std::move(values), sum);
                if (!clamp) return std::nullopt;
                low = std::max(low, clamp->at - clamp->within);
                high = std::min(high, clamp->at + clamp->within);
                ++found;
            }
        }
        if (found < 2 || low > high || !(high > 0.0)) return std::nullopt;
        return 0.5 * (low + high);
    }

    // Light that lies in other pixels leaves the sum as it is, but for an edge: a row of 64 is 1.6 % of the pixels. A
    // factor leaves noise alone between regions. With 64 samples a pixel and 256 pixels a region, that is below a
    // hundredth of their light, and below a tenth of a difference of 10 %.
    void compare_films(const Sums& a, const Sums& b) {
        constexpr double lost = 0.02, unexplained = 0.1;
        constexpr std::uint32_t region = 16;
        const std::uint32_t across = (width_ + region - 1) / region, down = (height_ + region - 1) / region;
        std::vector<glm::dvec3> regions_a(std::size_t{across} * down), regions_b(regions_a.size());
        glm::dvec3 all_a(0.0), all_b(0.0), apart(0.0);
        for (std::size_t i = 0; i < std::size_t{width_} * height_; ++i) {
            const std::size_t at = i / width_ / region * across + i % width_ / region;
            regions_a[at] += a.at(i);
            regions_b[at] += b.at(i);
            all_a += a.at(i);
            all_b += b.at(i);
            apart += glm::abs(a.at(i) - b.at(i));
        }
        const glm::dvec3 factor = all_b / glm::max(all_a, glm::dvec3(std::numeric_limits<double>::min()));
        glm::dvec3 left(0.0), differences(0.0);
        for (std::size_t k = 0; k < regions_a.size(); ++k) {
            left += glm::abs(regions_b[k] - factor * regions_a[k]);
            differences += glm::abs(regions_b[k] - regions_a[k]);
        }
        const auto sum = [](const glm::dvec3& v) { return v.x + v.y + v.z; };
        place_.moved = sum(glm::abs(all_b - all_a)) <= lost * sum(apart);
        place_.scaled = !place_.moved && glm::all(glm::lessThanEqual(left, unexplained * differences));
    }

    // Where both sides are black nothing can differ, so that no pattern is seen in what is left.
    [[nodiscard]] std::string pattern_of(std::vector<bool> touched, const Sums& a, const Sums& b) const {
        std::string pattern = pixel_pattern(touched, width_, height_);
        for (std::size_t i = 0; i < touched.size(); ++i)
            if (a.at(i) == glm::dvec3(0.0) && b.at(i) == glm::dvec3(0.0)) touched[i] = true;
        const bool everywhere = pixel_pattern(touched, width_, height_) == every_pixel;
        return everywhere ? std::string(every_pixel) : pattern;
    }

    void say_what_lies_outside(const Sums& a, const Sums& b, const std::vector<std::size_t>& pixels) {
        const std::vector<bool> touched = parted(a, b);
        const auto count = static_cast<std::size_t>(std::ranges::count(touched, true));
        std::string& text = pixel_.reason;
        text = fmt::format(
            "no path parts in the first {} samples of the {} worst pixels", first_block.count(), pixels.size());
        if (std::ranges::none_of(pixels, [&](std::size_t i) { return touched[i]; })) {
            text += ", and the films have the same sums there";
            if (question_.differ) text += ": it shows in later samples, or with another seed";
            return;
        }
        const bool reference = adds_its_paths(*reference_job_, a, pixels);
        const bool candidate = adds_its_paths(*candidate_job_, b, pixels);
        place_.outside_paths = true;
        place_.reference_adds = reference;
        place_.candidate_adds = candidate;
        text += ": the traced paths agree, so the fault is outside shading";
        if (reference != candidate)
            text += fmt::format(
                ": the film of {} is not the sum of its own paths (indexing, queues, film or "
                "post-processing)",
                reference ? question_.candidate_name : question_.reference_name);
        text += fmt::format(
            "; {} of the pixels differ", percent(static_cast<double>(count) / static_cast<double>(touched.size())));
        place_.pattern = pattern_of(touched, a, b);
        if (!place_.pattern.empty()) text += ", " + place_.pattern;
        if (!reference || !candidate) compare_films(a, b);
        if (reference != candidate) {
            place_.clamped_at =
                reference ? common_clamp(*candidate_job_, b, pixels) : common_clamp(*reference_job_, a, pixels);
            if (place_.clamped_at) text += fmt::format("; it is that of paths cut at {:.4g}", *place_.clamped_at);
        }
        if (!candidate) say_which_kernels(a);
    }

    void say_which_kernels(const Sums& reference) {
        std::vector<std::string>&with = place_.kernels_with, &without = place_.kernels_without;
        for (const std::string& kernel : question_.kernels) {
            if (question_.stop.stop_requested()) break;
            try {
                const std::unique_ptr<Renderer> renderer = question_.with_kernel(kernel);
                const auto sums = sums_of(*renderer->prepare(question_.scene, question_.settings));
                if (!sums) break;
                const auto apart = static_cast<double>(std::ranges::count(parted(reference, *sums), true));
                (apart > few * static_cast<double>(width_) * height_ ? with : without).push_back(kernel);
            } catch (const Error&) {  // not in this precision, or not on this device
            }
        }
        if (!with.empty()) pixel_.reason += fmt::format("; kernels with it: {}", fmt::join(with, ", "));
        if (!without.empty()) pixel_.reason += fmt::format("; kernels without: {}", fmt::join(without, ", "));
    }

    // Pixels that rounding parts in a block (Arithmetic: 0.016 on the classic box), with room.
    static constexpr double few = 0.05;

    WorstPixel& pixel_;
    FaultPlace place_;
    const FaultQuestion& question_;
    std::uint32_t width_, height_;
    std::unique_ptr<RenderJob> reference_job_, candidate_job_;
};

}  // namespace

bool sums_differ(const glm::dvec3& a, const glm::dvec3& b) {
    return largest_coordinate(a - b) > same_sum * std::max(largest_coordinate(a), largest_coordinate(b));
}

std::optional<Rectangle> fired_region(const Judgement& judgement) {
    const LevelResult* most = nullptr;
    const auto area = [](const Rectangle& r) { return std::uint64_t{r.x1 - r.x0} * (r.y1 - r.y0); };
    const std::uint64_t whole = area(judgement.level("image").worst.region);
    const auto paired = [](const LevelResult& level) { return level.name.starts_with("paired"); };
    for (const LevelResult& level : judgement.levels) {
        const std::uint64_t part = area(level.worst.region);
        if (!level.significant || part == 0 || part >= whole) continue;
        const bool better =
            most == nullptr || paired(level) > paired(*most) || (paired(level) == paired(*most) && level.p < most->p);
        if (better) most = &level;
    }
    if (most == nullptr) return std::nullopt;
    return most->worst.region;
}

FaultPlace find_fault(WorstPixel& pixel, const FaultQuestion& question) { return FaultSearch(pixel, question).run(); }

std::string film_against_paths(
    Renderer& renderer, const Scene& scene, const RenderSettings& settings, std::stop_token stop) {
    constexpr std::array blocks{first_block, SampleRange{samples_per_block, 2 * samples_per_block}};
    const std::unique_ptr<RenderJob> job = renderer.prepare(scene, settings);
    const std::size_t middle = std::size_t{settings.height / 2} * settings.width + settings.width / 2;
    const std::array pixels{std::size_t{0}, middle, std::size_t{settings.width} * settings.height - 1};
    std::array<glm::dvec3, 3> of_paths{};
    Estimate film(settings.width, settings.height);
    RenderControl control;
    control.stop = std::move(stop);
    try {
        for (const SampleRange& samples : blocks)
            for (std::size_t k = 0; k < pixels.size(); ++k)
                for (const glm::dvec3& radiance : radiances_of(*job, settings, pixels[k], samples))
                    of_paths[k] += radiance;
    } catch (const UnsupportedError&) {
        return {};
    }
    for (const SampleRange& samples : blocks) {
        RenderResult part = job->render(samples, control);
        if (part.estimate.count() != samples.count()) return {};
        film.merge(std::move(part.estimate));
    }
    const std::vector<PixelStatistics> shown = pixel_statistics(film);
    constexpr std::array channel_names{"red", "green", "blue"};
    for (std::size_t k = 0; k < pixels.size(); ++k) {
        const PixelStatistics* const mean = &shown[pixels[k] * channel_count];
        const glm::dvec3 of_film(mean[0].mean, mean[1].mean, mean[2].mean),
            expected = of_paths[k] / static_cast<double>(film.count());
        if (!sums_differ(of_film, expected)) continue;
        const glm::dvec3 apart = glm::abs(of_film - expected);
        const int channel = apart.x >= std::max(apart.y, apart.z) ? 0 : apart.y >= apart.z ? 1 : 2;
        return fmt::format("the film has {:.6g} in {} at ({}, {}), and its traced paths have the mean {:.6g}",
            of_film[channel], channel_names.at(static_cast<std::size_t>(channel)), pixels[k] % settings.width,
            pixels[k] / settings.width, expected[channel]);
    }
    return {};
}

}  // namespace tandem
