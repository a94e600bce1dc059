#include "tests/calibration/experiments.h"

#include <array>
#include <map>
#include <utility>

#include "common/error.h"
#include "common/scene/loader/scene_loader.h"
#include "cpu_ref/backend.h"
#include "tests/common/synthetic_renderer.h"
#include "vulkan/backend.h"

namespace tandem::test {

namespace {

Radiance exponential(std::uint32_t, std::uint32_t, SampleRandom& random) {
    return {random.exponential(), random.exponential(), random.exponential()};
}

MakeRenderer synthetic(Sampler sampler, Strays strays = {}) {
    return [=] { return std::make_unique<SyntheticRenderer>(sampler, "synthetic", strays); };
}

// Another seed is another range of samples of the one seed 0. With a counter-based generator (MODEL.md section 3)
// either gives other numbers. So the same kernels serve a thousand verdicts. One thread uses it at a time.
class SeedsAsRanges : public Renderer {
public:
    explicit SeedsAsRanges(std::unique_ptr<Renderer> renderer) : renderer_(std::move(renderer)) {}

    RendererInfo info() const override { return renderer_->info(); }

    std::unique_ptr<RenderJob> prepare(const Scene& scene, const RenderSettings& settings) override {
        // An experiment has one scene; single samples are looked at with fewer bounces and on other films.
        std::shared_ptr<RenderJob>& job = jobs_[{settings.width, settings.height, settings.bounces}];
        if (!job) {
            RenderSettings first = settings;
            first.seed = 0;
            job = renderer_->prepare(scene, first);
        }
        return std::make_unique<Job>(job, settings.seed * samples_per_seed);
    }

private:
    static constexpr std::uint64_t samples_per_seed = 1u << 20;

    class Job : public RenderJob {
    public:
        Job(std::shared_ptr<RenderJob> job, std::uint64_t offset) : job_(std::move(job)), offset_(offset) {}
        RenderResult render(SampleRange range, const RenderControl& control) override {
            // Samples far up are looked at one by one; they take the other samples' place in no mean.
            if (range.begin < samples_per_seed && range.end > samples_per_seed)
                throw Error("more samples than a seed has");
            return job_->render({range.begin + offset_, range.end + offset_}, control);
        }

    private:
        std::shared_ptr<RenderJob> job_;
        std::uint64_t offset_;
    };

    std::unique_ptr<Renderer> renderer_;
    std::map<std::array<std::uint32_t, 3>, std::shared_ptr<RenderJob>> jobs_;
};

MakeRenderer cpu(Precision precision = Precision::single_precision) {
    return [=] {
        BackendOptions options;
        options.precision = precision;
        options.threads = 1;
        return std::make_unique<SeedsAsRanges>(cpu_backend().create(options));
    };
}

MakeRenderer vulkan(Precision precision = Precision::single_precision) {
    return [=] {
        BackendOptions options;
        options.precision = precision;
        return std::make_unique<SeedsAsRanges>(vulkan_backend().create(options));
    };
}

std::vector<Experiment> synthetic_experiments() {
    const MakeRenderer smooth = synthetic(exponential), all_kinds = synthetic(mixed);
    // With a twentieth of the samples astray 24 % of the pixels part, just fewer than the 25 % that compare_paths
    // tolerates. So the level of short paths is tested where it is closest to an alarm.
    const MakeRenderer smooth_strays = synthetic(exponential, {0.05}), strays = synthetic(mixed, {0.05});
    constexpr Pair pair = Pair::synthetic;
    return {
        {"synthetic-exponential-1", "exponential, one look", pair, smooth, smooth, {}, 32, 128, 1},
        {"synthetic-exponential-3", "exponential, three looks", pair, smooth, smooth, {}, 32, 512, 3},
        {"synthetic-mixed-1", "all kinds of pixels, one look", pair, all_kinds, all_kinds, {}, 32, 128, 1},
        {"synthetic-mixed-3", "all kinds of pixels, three looks", pair, all_kinds, all_kinds, {}, 32, 512, 3},
        {"synthetic-mixed-3-default", "all kinds of pixels, three looks, default level", pair, all_kinds, all_kinds, {},
            32, 512, 3, 0.01},
        {"synthetic-exponential-paired", "exponential, paired, 5 % of the samples part", pair, smooth, smooth_strays,
            {}, 32, 512, 3, 0.05, true},
        {"synthetic-mixed-paired", "all kinds of pixels, paired, 5 % of the samples part", pair, all_kinds, strays, {},
            32, 512, 3, 0.05, true},
        {"synthetic-mixed-paired-beyond", "all kinds of pixels, pairs beyond the agreement", pair, all_kinds, strays,
            {}, 16, 2048, 3, 0.05, true, true},
    };
}

// The same list for each pair of renderers. Where both are of one kind the candidate rounds differently: in double
// precision, or with products and sums fused. So with paired seeds their samples are not the same bits.
void add_renderers(std::vector<Experiment>& all, Pair pair, const std::string& prefix, const MakeRenderer& reference,
    const MakeRenderer& equal, const MakeRenderer& rounding_otherwise) {
    const auto add = [&](const std::string& id, const std::string& name, const MakeRenderer& candidate,
                         const std::string& scene, std::uint32_t size, std::uint64_t samples, std::size_t looks,
                         double declared = 0.05, bool paired = false) {
        all.push_back({prefix + "-" + id, name, pair, reference, candidate, scene, size, samples, looks, declared,
            paired, false, paired && pair != Pair::vulkan_vulkan ? cpu(Precision::double_precision) : nullptr});
    };
    const std::string sky = "closed-forms/even-sky", light = "closed-forms/polygon-light";
    add("classic-1", "cornell-classic, one look", equal, "cornell-classic", 12, 128, 1);
    add("classic-3", "cornell-classic, three looks", equal, "cornell-classic", 12, 512, 3);
    add("classic-3-default", "cornell-classic, three looks, default level", equal, "cornell-classic", 12, 512, 3, 0.01);
    add("even-sky", "even-sky with its closed form, three looks", equal, sky, 8, 512, 3);
    add("classic-paired", "cornell-classic, paired, three looks", rounding_otherwise, "cornell-classic", 12, 512, 3,
        0.05, true);
    add("glass-paired", "glass, paired, three looks", rounding_otherwise, "glass", 16, 512, 3, 0.05, true);
    add("light-paired", "polygon-light with its closed form, paired, three looks", rounding_otherwise, light, 8, 512, 3,
        0.05, true);
}

}  // namespace

const char* name_of(Pair pair) {
    constexpr std::array names{"synthetic", "CPU/CPU", "Vulkan/Vulkan", "CPU/Vulkan"};
    return names.at(static_cast<std::size_t>(pair));
}

Scene Experiment::load(const std::filesystem::path& scenes) const {
    return scene.empty() ? Scene{} : load_scene(scenes / (scene + ".json"));
}

std::vector<Experiment> experiments() {
    std::vector<Experiment> all = synthetic_experiments();
    add_renderers(all, Pair::cpu_cpu, "cpu", cpu(), cpu(), cpu(Precision::double_precision));
    add_renderers(all, Pair::vulkan_vulkan, "vulkan", vulkan(), vulkan(), vulkan(Precision::contracted));
    add_renderers(all, Pair::cpu_vulkan, "cpu-vulkan", cpu(), vulkan(), vulkan());
    return all;
}

}  // namespace tandem::test
