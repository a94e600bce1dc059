// How samples are added up (MODEL.md section 11.2): what singles lose, and that pairs of them and doubles lose nothing
// to speak of.
#include <algorithm>
#include <array>
#include <filesystem>
#include <functional>
#include <span>

#include "common/scene/loader/scene_loader.h"
#include "tests/suite/tracers.h"

using namespace tandem;
using namespace tandem::test;

namespace {

constexpr double unit = 0x1p-24;  // roundoff of singles
const dvec3 radiance(1.0 / 3.0, 1.0, 0.1);

// Every sample is the wall's radiance, as single precision has it.
Scene glowing_room() {
    return SceneBuilder()
        .camera({0.1, 0.0, 0.2}, {0.0, 0.0, -1.0}, 60.0)
        .sphere(emitter(radiance), {0.0, 0.0, 0.0}, 4.0)
        .scene();
}

RenderSettings settings_with(Accumulation accumulation) {
    RenderSettings settings = settings_of(2, 0);
    settings.accumulation = accumulation;
    return settings;
}

// The oracle has but one way.
std::span<Tracer> choosing_tracers() {
    const std::span all(tracers());
    return all.first(all.size() - (all.back().name == "oracle" ? 1 : 0));
}

double in_singles(double x, std::uint64_t samples) {
    volatile float sum = 0.0F;
    for (std::uint64_t i = 0; i < samples; ++i) sum = sum + static_cast<float>(x);
    return double{sum} / static_cast<double>(samples);
}

// [Higham 2002, section 4.2]
double bound_of_singles(std::uint64_t samples) {
    const double n = static_cast<double>(samples);
    return (n - 1.0) * unit / (1.0 - (n - 1.0) * unit);
}

bool same(const std::vector<double>& a, const std::vector<double>& b) { return a == b; }

}  // namespace

TEST_CASE("sums in singles refuse light whose squares they do not hold, and doubles take it") {
    const auto image_sky = [](float radiance) {
        SceneBuilder builder;
        builder.background(black);
        Scene scene = builder.scene();
        scene.background.image = std::make_shared<Pixels>(Pixels{2, 1, {0.0F, 0.0F, 0.0F, 0.0F, radiance, 0.0F}});
        return scene;
    };
    for (Tracer& tracer : choosing_tracers()) {
        CAPTURE(tracer.name);
        const auto lit = [&](double radiance) {
            const dvec3 light(0.0, radiance, 0.0);
            return std::array{SceneBuilder().sphere(emitter(light), dvec3(0.0), 1.0).scene(),
                SceneBuilder().background(black, light).scene(), image_sky(static_cast<float>(radiance))};
        };
        const auto prepare = [&](Accumulation accumulation, const Scene& scene) {
            return tracer.renderer->prepare(scene, settings_with(accumulation));
        };
        for (const Accumulation accumulation : {Accumulation::plain, Accumulation::compensated}) {
            const auto bright = lit(1e16);
            CHECK_THROWS_WITH_AS(
                (void)prepare(accumulation, bright[0]), doctest::Contains("material"), UnsupportedError);
            for (const Scene& scene : {bright[1], bright[2]})
                CHECK_THROWS_WITH_AS(
                    (void)prepare(accumulation, scene), doctest::Contains("the background"), UnsupportedError);
            for (const Scene& scene : lit(0.9e15)) CHECK_NOTHROW((void)prepare(accumulation, scene));
        }
        for (const Scene& scene : lit(1e18)) CHECK_NOTHROW((void)prepare(Accumulation::in_double, scene));
    }
}

TEST_CASE(
    "plain sums of equal samples are the sums of singles, and drift within their bound" * doctest::test_suite("full")) {
    for (Tracer& tracer : choosing_tracers()) {
        CAPTURE(tracer.name);
        std::vector<double> errors;
        for (const std::uint64_t samples : {std::uint64_t{64}, std::uint64_t{4096}, std::uint64_t{1} << 18}) {
            CAPTURE(samples);
            const Estimate estimate = render(tracer, glowing_room(), settings_with(Accumulation::plain), samples);
            const std::vector<double> mean = mean_of(estimate);
            for (std::size_t i = 0; i < mean.size(); ++i) {
                const double x = radiance[static_cast<int>(i % 3)], single = static_cast<float>(x);
                CHECK(mean[i] == in_singles(x, samples));
                CHECK(std::abs(mean[i] - single) <= bound_of_singles(samples) * single);
            }
            CHECK(mean[1] == 1.0);  // whole numbers below 2^24 lose nothing
            errors.push_back(std::abs(mean[0] * 3.0 - 1.0));
        }
        // Where compensated sums are off by 1e-8, the rounding of 1/3 itself.
        CHECK(errors[2] > 1e-5);
        CHECK(errors[2] > 20.0 * errors[0]);
    }
}

TEST_CASE("compensated sums and doubles lose less than their bounds") {
    // A single that adds up in place is off by more within its first block of 64.
    const std::uint64_t samples = std::uint64_t{1} << (thorough() ? 16 : 12);
    for (Tracer& tracer : choosing_tracers()) {
        CAPTURE(tracer.name);
        // 64 additions a block, then blocks in pairs, in double, 10 levels of them at most.
        for (const auto& [accumulation, error_of_addition] :
            {std::pair{Accumulation::compensated, 0x1p-46}, std::pair{Accumulation::in_double, 0x1p-53}}) {
            CAPTURE(static_cast<int>(accumulation));
            const Estimate estimate = render(tracer, glowing_room(), settings_with(accumulation), samples);
            const std::vector<double> mean = mean_of(estimate), variance = variance_of(estimate);
            const double lost = 64.0 * error_of_addition + 16.0 * 0x1p-53;
            for (std::size_t i = 0; i < mean.size(); ++i) {
                const double x = radiance[static_cast<int>(i % 3)];
                const double sample = tracer.unit_roundoff == unit ? double{static_cast<float>(x)} : x;
                CHECK(std::abs(mean[i] - sample) <= lost * sample);
                CHECK(variance[i] <= 4.0 * lost * sample * sample);
            }
        }
    }
}

TEST_CASE("all ways of adding up have one image but for rounding") {
    const Scene scene = load_scene(std::filesystem::path(TANDEM_SOURCE_DIR) / "scenes" / "cornell-classic.json");
    constexpr std::uint64_t samples = 192;
    for (Tracer& tracer : choosing_tracers()) {
        CAPTURE(tracer.name);
        RenderSettings settings = with_longer_side(default_settings(scene), 12);
        const auto means = [&](Accumulation accumulation) {
            settings.accumulation = accumulation;
            return mean_of(render(tracer, scene, settings, samples));
        };
        const std::vector<double> exact = means(Accumulation::in_double), pairs = means(Accumulation::compensated),
                                  plain = means(Accumulation::plain);
        bool rounds = false;
        for (std::size_t i = 0; i < exact.size(); ++i) {
            CHECK(std::abs(pairs[i] - exact[i]) <= 64.0 * 0x1p-45 * exact[i]);
            CHECK(std::abs(plain[i] - exact[i]) <= (bound_of_singles(samples) + unit) * exact[i]);
            rounds = rounds || plain[i] != exact[i];
        }
        CHECK(rounds);
        settings.accumulation.reset();
        const bool in_double = tracer.renderer->info().accumulation == Accumulation::in_double;
        CHECK(same(mean_of(render(tracer, scene, settings, samples)), in_double ? exact : pairs));
    }
}

TEST_CASE("plain sums go on where the render before ended, and begin anew elsewhere") {
    for (Tracer& tracer : choosing_tracers()) {
        CAPTURE(tracer.name);
        const auto job = tracer.renderer->prepare(glowing_room(), settings_with(Accumulation::plain));
        const std::vector<double> whole = mean_of(job->render({0, 4096}).estimate);
        Estimate parts = job->render({0, 64}).estimate;
        parts.merge(job->render({64, 1024}).estimate);
        parts.merge(job->render({1024, 4096}).estimate);
        CHECK(same(mean_of(parts), whole));
        const double block = in_singles(radiance.x, 64);
        CHECK(mean_of(job->render({64, 128}).estimate)[0] == block);
        CHECK(mean_of(job->render({64, 128}).estimate)[0] == block);
        CHECK(mean_of(job->render({128, 192}).estimate)[0] != block);
    }
}

TEST_CASE("all kernel shapes add up to the same bits") {
    for (const Accumulation accumulation : {Accumulation::plain, Accumulation::compensated, Accumulation::in_double}) {
        CAPTURE(static_cast<int>(accumulation));
        const Scene scene = load_scene(std::filesystem::path(TANDEM_SOURCE_DIR) / "scenes" / "cornell-classic.json");
        RenderSettings settings = with_longer_side(default_settings(scene), 10);
        settings.accumulation = accumulation;
        std::vector<std::vector<double>> means;
        for (const char* kernel : {"stages", "megakernel", "image-stages", "fragment", "thesis"}) {
            BackendOptions options;
            options.kernel = kernel;
            const auto renderer = vulkan_backend().create(options);
            const auto job = renderer->prepare(scene, settings);
            Estimate estimate = job->render({0, 128}).estimate;
            estimate.merge(job->render({128, 200}).estimate);
            means.push_back(mean_of(estimate));
        }
        for (const std::vector<double>& mean : means) CHECK(same(means[0], mean));
    }
}

// Sums in double alone are those of the device, to the bit.
TEST_CASE("a render that goes on within a block has the bits of one that does not") {
    const auto same_sums = [](const Estimate& a, const Estimate& b) {
        return std::ranges::equal(a.totals(), b.totals(),
            [](const Moments& x, const Moments& y) { return x.sum == y.sum && x.sum_of_squares == y.sum_of_squares; });
    };
    const Scene scene = load_scene(std::filesystem::path(TANDEM_SOURCE_DIR) / "scenes" / "cornell-classic.json");
    for (const Accumulation accumulation : {Accumulation::in_double, Accumulation::compensated}) {
        RenderSettings settings = with_longer_side(default_settings(scene), 10);
        settings.accumulation = accumulation;
        const auto check = [&](const std::string& name, Renderer& renderer) {
            CAPTURE(name);
            const auto job = renderer.prepare(scene, settings);
            const Estimate whole = job->render({64, 264}).estimate;
            CHECK(job->goes_on_in_blocks() == (accumulation == Accumulation::in_double));
            Estimate begun = job->render({64, 74}).estimate;
            double least = 1e9, most = 0.0;
            RenderControl control;
            control.begun = &begun;
            control.progress = [&](double samples) {
                least = std::min(least, samples), most = std::max(most, samples);
            };
            Estimate more = job->render({64, 101}, control).estimate;  // the block is still not whole
            CHECK(more.count() == 37);
            CHECK(begun.count() == (job->goes_on_in_blocks() ? 0 : 10));
            if (job->goes_on_in_blocks()) CHECK(least >= 10.0);
            CHECK(most == 37.0);
            control.begun = &more;
            CHECK(same_sums(job->render({64, 264}, control).estimate, whole));
            // Others than those of the range's first block are none of its business.
            Estimate elsewhere = job->render({128, 138}).estimate;
            control.begun = &elsewhere;
            CHECK(same_sums(job->render({64, 264}, control).estimate, whole));
            CHECK(elsewhere.count() == 10);
            // Nor are more samples than are asked for.
            Estimate many = job->render({64, 104}).estimate;
            control.begun = &many;
            CHECK(same_sums(job->render({64, 94}, control).estimate, job->render({64, 94}).estimate));
            // A stop leaves them, there or in the result.
            std::stop_source at_once;
            at_once.request_stop();
            control.stop = at_once.get_token();
            CHECK(job->render({64, 264}, control).estimate.count() + many.count() == 40);
        };
        for (const Tracer& tracer : choosing_tracers()) check(tracer.name, *tracer.renderer);
        for (const char* kernel : {"stages", "megakernel", "image-stages", "fragment", "thesis"}) {
            BackendOptions options;
            options.kernel = kernel;
            check(kernel, *vulkan_backend().create(options));
        }
    }
}

TEST_CASE("ways of adding up that there are not are refused") {
    const auto refuses = [](const Backend& backend, const BackendOptions& options, Integrator integrator,
                             Accumulation accumulation) {
        RenderSettings settings = settings_with(accumulation);
        settings.integrator = integrator;
        const auto renderer = backend.create(options);
        CHECK_THROWS_AS((void)renderer->prepare(glowing_room(), settings), UnsupportedError);
    };
    BackendOptions mixed;
    mixed.precision = Precision::mixed;
    for (const Accumulation accumulation : {Accumulation::plain, Accumulation::compensated}) {
        refuses(vulkan_backend(), mixed, Integrator::path, accumulation);
        refuses(oracle_backend(), {}, Integrator::path, accumulation);
        refuses(cpu_backend(), {}, Integrator::bidirectional, accumulation);
    }
}
