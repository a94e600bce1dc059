// Adaptive sampling (MODEL.md section 11.3) by real renderers. Both give the same counts and image, whatever the
// threads, and less noise than as many uniform samples leave.
#include <numeric>

#include "common/render/adaptive_sampling.h"
#include "common/scene/loader/scene_loader.h"
#include "tests/suite/tracers.h"

using namespace tandem;
using namespace tandem::test;

namespace {

FilmMoments grown(const Backend& backend, const BackendOptions& options, const Scene& scene, RenderSettings settings,
    std::uint64_t samples) {
    settings.sampling = Sampling::adaptive;
    const auto renderer = backend.create(options);
    const auto job = renderer->prepare(scene, settings);
    GrowingFilm film(*job, Sampling::adaptive);
    REQUIRE(film.grow_to(samples, {}).complete);
    return film.film();
}

Scene box() { return load_scene(TANDEM_SOURCE_DIR "/scenes/cornell-classic.json"); }

RenderSettings small(const Scene& scene, std::uint32_t size) {
    RenderSettings settings = with_longer_side(default_settings(scene), size);
    settings.integrator = Integrator::next_event;
    return settings;
}

double squared_error(const FilmMoments& film) {
    const std::vector<double> variances = variance_of(film);
    double sum = 0.0;
    for (std::size_t i = 0; i < variances.size(); ++i)
        sum += variances[i] / static_cast<double>(film.counts[i / channel_count]);
    return sum / static_cast<double>(variances.size());
}

}  // namespace

TEST_CASE("in double both backends give the pixels the same counts and the same means") {
    const Scene scene = box();
    BackendOptions options;
    options.precision = Precision::double_precision;
    const FilmMoments cpu = grown(cpu_backend(), options, scene, small(scene, 16), 192);
    const FilmMoments vulkan = grown(vulkan_backend(), options, scene, small(scene, 16), 192);
    CHECK(cpu.counts == vulkan.counts);
    const std::vector<double> a = mean_of(cpu), b = mean_of(vulkan);
    for (std::size_t i = 0; i < a.size(); ++i) CHECK(a[i] == doctest::Approx(b[i]).epsilon(1e-6));
}

TEST_CASE("neither threads nor kernels change a bit of an adaptive image") {
    const Scene scene = box();
    const auto same = [](const FilmMoments& a, const FilmMoments& b) {
        return a.counts == b.counts && std::ranges::equal(a.moments, b.moments, [](const Moments& x, const Moments& y) {
            return x.sum == y.sum && x.sum_of_squares == y.sum_of_squares;
        });
    };
    BackendOptions one, two;
    one.threads = 1;
    two.threads = 2;
    CHECK(same(grown(cpu_backend(), one, scene, small(scene, 24), 256),
        grown(cpu_backend(), two, scene, small(scene, 24), 256)));
    BackendOptions stages, megakernel;
    stages.kernel = "stages";
    megakernel.kernel = "megakernel";
    CHECK(same(grown(vulkan_backend(), stages, scene, small(scene, 16), 192),
        grown(vulkan_backend(), megakernel, scene, small(scene, 16), 192)));
}

TEST_CASE("adaptive samples leave less noise in the classic box than as many uniform ones, around the same mean") {
    const Scene scene = box();
    const RenderSettings settings = small(scene, 32);
    const FilmMoments adaptive = grown(cpu_backend(), {}, scene, settings, 1024);
    RenderSettings other = settings;
    other.seed = 2;
    const auto renderer = cpu_backend().create({});
    const FilmMoments uniform = film_of(renderer->prepare(scene, other)->render({0, 1024}).estimate);
    CHECK(adaptive.count() == doctest::Approx(1024.0).epsilon(1e-3));
    CHECK(squared_error(adaptive) < 0.9 * squared_error(uniform));
    const std::vector<double> a = mean_of(adaptive), u = mean_of(uniform);
    const double pixels = static_cast<double>(a.size());
    const double difference =
        (std::accumulate(a.begin(), a.end(), 0.0) - std::accumulate(u.begin(), u.end(), 0.0)) / pixels;
    // Channels share their paths, so three times the variance at most; four standard errors.
    CHECK(std::abs(difference) < 4.0 * std::sqrt(3.0 * (squared_error(adaptive) + squared_error(uniform)) / pixels));
}
