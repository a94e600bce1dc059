#include "common/external/program_renderer.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/processors.h"
#include "common/render/check_settings.h"
#include "common/render/foreign_job.h"
#include "common/stopwatch.h"
#include "common/validation/compare/compare.h"

namespace tandem {

namespace {

// Programs differ in how they begin their generators, and some add pixel and seed: no two requests get neighbouring
// seeds. The map is a bijection of 31 bits (odd factors, shifts), as many as fit everybody's seeds. So two requests of
// one render seed never share one, nor two of neighbouring render seeds within 8e9 samples.
std::uint64_t seed_of(std::uint64_t render_seed, std::uint64_t first_sample, std::uint64_t least_samples) {
    constexpr std::uint64_t mask = (std::uint64_t{1} << 31) - 1;
    std::uint64_t z = (render_seed * 0x9E3779B1u + first_sample / least_samples) & mask;
    z = ((z ^ z >> 16) * 0x21F0AAADu) & mask;
    z = ((z ^ z >> 15) * 0x735A2D97u) & mask;
    return z ^ z >> 15;
}

// Name of the channel in place of variance.R, .G, .B, and what makes the variance of one sample of it.
using ToVariance = double (*)(double value, double mean, double samples);
struct NoiseChannels {
    const char* prefix;
    ToVariance variance;
};
constexpr NoiseChannels other_noise[] = {
    {"second_moment.", [](double value, double mean,
                           double samples) { return std::max(0.0, value - mean * mean) * samples / (samples - 1.0); }},
    {"variance_of_mean.", [](double value, double /*mean*/, double samples) { return value * samples; }},
};

std::ptrdiff_t place_of(const Image& image, const std::string& channel) {
    const auto found = std::ranges::find(image.channels, channel);
    return found == image.channels.end() ? -1 : found - image.channels.begin();
}

bool tells_variance(const Image& image) {
    return std::ranges::any_of(image.channels,
        [](const std::string& name) { return name.ends_with("variance.R") || name.ends_with("Variance.R"); });
}

// Second moments and variances of the mean become variances of one sample, and the number of samples is told.
void make_plain(Image& image, std::uint64_t samples) {
    for (const NoiseChannels& kind : other_noise)
        for (const char* letter : {"R", "G", "B"}) {
            const std::ptrdiff_t noise = place_of(image, kind.prefix + std::string(letter)),
                                 mean = place_of(image, letter);
            if (noise < 0 || mean < 0) continue;
            const auto step = static_cast<std::ptrdiff_t>(image.channels.size());
            for (std::ptrdiff_t at = 0; at < static_cast<std::ptrdiff_t>(image.pixels.size()); at += step) {
                float* const pixel = &image.pixels[static_cast<std::size_t>(at)];
                pixel[noise] =
                    static_cast<float>(kind.variance(pixel[noise], pixel[mean], static_cast<double>(samples)));
            }
            image.channels[static_cast<std::size_t>(noise)] = std::string("variance.") + letter;
        }
    if (place_of(image, "count") < 0) image.metadata["samples"] = std::to_string(samples);
}

bool constant(const Image& image) {
    const std::size_t channels = image.channels.size();
    for (std::size_t i = channels; i < image.pixels.size(); ++i)
        if (image.pixels[i] != image.pixels[i - channels]) return false;
    return true;
}

class ProgramJob final : public RenderJob, public ForeignJob {
public:
    ProgramJob(ExternalProgram& program, std::filesystem::path scene, const RenderSettings& settings,
        bool follows_numbers, bool may_be_negative)
        : program_(program),
          scene_(std::move(scene)),
          settings_(settings),
          follows_numbers_(follows_numbers),
          may_be_negative_(may_be_negative) {}

    RenderResult render(SampleRange range, const RenderControl& control) override;
    double values_a_call() const override {
        return tells_variance_.value_or(true) ? 0.0 : static_cast<double>(ProgramRenderer::images_a_call - 1);
    }

private:
    [[nodiscard]] std::optional<NamedImage> image(SampleRange range, const RenderControl& control);
    [[nodiscard]] std::optional<SampledImage> sampled(SampleRange range, const RenderControl& control);
    [[nodiscard]] std::optional<SampledImage> without_variance(SampleRange range, const RenderControl& control);
    void check_new(const Image& image, std::uint64_t seed);
    [[nodiscard]] Estimate estimate_of(const SampledImage& sampled, SampleRange range) const;

    ExternalProgram& program_;
    std::filesystem::path scene_;
    RenderSettings settings_;
    bool follows_numbers_, may_be_negative_;
    std::optional<bool> tells_variance_;  // empty: not one image yet
    std::vector<float> last_pixels_;
    std::optional<SampleRange> last_range_;
    std::uint64_t last_seed_ = 0;
    double unused_seconds_ = 0.0;
};

std::optional<NamedImage> ProgramJob::image(SampleRange range, const RenderControl& control) {
    ImageRequest request;
    request.scene = scene_;
    request.width = settings_.width;
    request.height = settings_.height;
    request.samples = range.count();
    request.first_sample = follows_numbers_ ? range.begin : 0;
    request.seed = follows_numbers_
                       ? settings_.seed
                       : seed_of(settings_.seed, range.begin, samples_per_block / ProgramRenderer::images_a_call);
    request.bounces = settings_.bounces;
    request.filter = settings_.filter;
    request.threads = usable_processors();
    const auto tick = [&] {
        if (control.progress) control.progress(0.0);
    };
    std::optional<Image> image = program_.render(request, control.stop, tick);
    if (!image) return std::nullopt;
    make_plain(*image, range.count());
    if (last_range_ != range) check_new(*image, request.seed);
    last_range_ = range;
    last_seed_ = request.seed;
    last_pixels_ = image->pixels;
    return NamedImage{"the image of " + program_.name(), std::move(*image), may_be_negative_};
}

// A program that does not heed its seed shows no noise between its images, and would look sure.
void ProgramJob::check_new(const Image& image, std::uint64_t seed) {
    if (image.pixels != last_pixels_ || constant(image)) return;
    throw ProgramFailure(
        fmt::format("exec: {} gave the same image for {}; let its random numbers depend on them", program_.name(),
            follows_numbers_ ? std::string("two ranges of samples")
                             : fmt::format("the seeds {} and {}", last_seed_, seed)));
}

// Few samples, looked at one by one: their sums are all that is asked of them.
std::optional<SampledImage> ProgramJob::without_variance(SampleRange range, const RenderControl& control) {
    const std::optional<NamedImage> one = image(range, control);
    if (!one) return std::nullopt;
    SampledImage twice = sampled_image_of({*one, *one}, VarianceOf::sample);
    twice.invalid /= 2;
    return twice;
}

std::optional<SampledImage> ProgramJob::sampled(SampleRange range, const RenderControl& control) {
    if (range.count() < ProgramRenderer::images_a_call) return without_variance(range, control);
    if (tells_variance_.value_or(true)) {
        const Stopwatch watch;
        std::optional<NamedImage> whole = image(range, control);
        if (!whole) return std::nullopt;
        const bool tells = tells_variance(whole->image);
        if (!tells && tells_variance_)
            throw ProgramFailure("exec: " + program_.name() + " wrote variance channels before, and none now");
        tells_variance_ = tells;
        if (tells) return sampled_image_of({*whole}, VarianceOf::sample);
        unused_seconds_ = watch.seconds();
    }
    if (range.count() % ProgramRenderer::images_a_call != 0) return without_variance(range, control);
    std::vector<NamedImage> images;
    const std::uint64_t part = range.count() / ProgramRenderer::images_a_call;
    for (std::uint64_t i = 0; i < ProgramRenderer::images_a_call; ++i) {
        const std::uint64_t begin = range.begin + i * part;
        std::optional<NamedImage> one = image({begin, begin + part}, control);
        if (!one) return std::nullopt;
        images.push_back(std::move(*one));
    }
    return sampled_image_of(images, VarianceOf::sample);
}

// Every block gets an equal part of the range's moments.
Estimate ProgramJob::estimate_of(const SampledImage& sampled, SampleRange range) const {
    const double samples = static_cast<double>(range.count());
    const auto plane = [&](double part) {
        Estimate::Plane moments;
        moments.reserve(sampled.pixels.size());
        for (const PixelStatistics& pixel : sampled.pixels) {
            const double variance = pixel.variance / pixel.count * samples;  // of one sample
            const double square = pixel.mean * pixel.mean + variance * (samples - 1.0) / samples;
            moments.push_back({part * pixel.mean, part * square});
        }
        return moments;
    };
    Estimate estimate(sampled.width, sampled.height);
    for (std::uint64_t begin = range.begin; begin < range.end; begin += samples_per_block) {
        const std::uint64_t end = std::min(begin + samples_per_block, range.end);
        estimate.add_block({begin, end}, plane(static_cast<double>(end - begin)));
    }
    estimate.add_invalid(sampled.invalid);
    return estimate;
}

RenderResult ProgramJob::render(SampleRange range, const RenderControl& control) {
    if (range.begin % samples_per_block != 0 || range.end <= range.begin)
        throw Error(fmt::format("exec: samples are asked for from the begin of a block of {}", samples_per_block));
    const Stopwatch watch;
    unused_seconds_ = 0.0;
    RenderResult result;
    result.estimate = Estimate(settings_.width, settings_.height);
    try {
        if (const std::optional<SampledImage> image = sampled(range, control))
            result.estimate = estimate_of(*image, range);
    } catch (const InputError& error) {
        throw ProgramFailure(std::string("exec: ") + error.what());
    }
    result.seconds = watch.seconds() - unused_seconds_;
    return result;
}

}  // namespace

ProgramRenderer::ProgramRenderer(const std::string& name, const ProgramOptions& options)
    : program_(name.substr(command_prefix.size()), options.limit_seconds),
      follows_numbers_(options.follows_numbers || program_.follows_numbers()),
      may_be_negative_(options.may_be_negative || program_.may_be_negative()) {
    if (!follows_numbers_) return;
    for (const char* needed : {"first_sample", "bounces"})
        if (!program_.is_told(needed))
            throw InputError(
                fmt::format("exec: the command '{}' has no {{{}}}; a program that draws the model's numbers "
                            "must be told it",
                    program_.command(), needed));
}

RendererInfo ProgramRenderer::info() const {
    RendererInfo info{program_.name(), "exec:" + program_.command(), program_.version(),
        program_.stays_up() ? "a process that stays up" : "a process for each image"};
    info.follows_numbers = follows_numbers_;
    return info;
}

void ProgramRenderer::check(const Scene& scene, const RenderSettings& settings) const {
    check_settings(scene, settings);
    const auto refuse = [&](const std::string& option, const std::string& mend) {
        throw UnsupportedError("exec: " + program_.name() + " is not told " + option + "; " + mend);
    };
    const char* const leave_out = "leave it out";
    const RenderSettings own = default_settings(scene);
    if (settings.bounces != own.bounces && !program_.is_told("bounces")) refuse("--bounces", "add {bounces}");
    const bool whitted = settings.integrator == Integrator::whitted;  // all others have one mean
    if (whitted != (own.integrator == Integrator::whitted)) refuse("--integrator", leave_out);
    if (std::isfinite(settings.clamp)) refuse("--clamp", leave_out);
    if (settings.fresnel) refuse("--fresnel", leave_out);
    if (settings.ray_min != own.ray_min || settings.ray_max != own.ray_max) refuse("the ray interval", leave_out);
    if (settings.filter != PixelFilter::box && (program_.stays_up() || !program_.is_told("filter")))
        refuse("--filter", program_.stays_up() ? leave_out : "add {filter}");
    if (settings.generator != Generator::philox) refuse("--generator", leave_out);
    if (settings.sampling == Sampling::adaptive) refuse("--sampling", leave_out);
}

std::unique_ptr<RenderJob> ProgramRenderer::prepare(const Scene& scene, const RenderSettings& settings) {
    check(scene, settings);
    if (scene_file_.empty()) throw UnsupportedError("exec: a scene that is in no file cannot be given to a program");
    return std::make_unique<ProgramJob>(program_, scene_file_, settings, follows_numbers_, may_be_negative_);
}

}  // namespace tandem
