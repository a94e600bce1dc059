// Settings that change the estimate: what every tracer makes of a clamp, a generator and a Fresnel term.
#include <algorithm>
#include <cmath>

#include "tests/suite/tracers.h"

namespace tandem::test {
namespace {

// A ball of radiance 10 before black: a sample is 0 or 10 in each channel.
Scene lamp() {
    return SceneBuilder()
        .camera({0.0, 0.0, 4.0}, {0.0, 0.0, 0.0}, 40.0)
        .sphere(emitter(dvec3(10.0, 5.0, 1.0)), {0.1, 0.2, 0.0}, 1.0)
        .scene();
}

RenderSettings small() {
    RenderSettings settings;
    settings.width = settings.height = 16;
    settings.bounces = 2;
    return settings;
}

std::vector<double> means(const Tracer& tracer, const Scene& scene, const RenderSettings& settings) {
    return mean_of(tracer.renderer->prepare(scene, settings)->render({0, 64}).estimate);
}

TEST_CASE("a clamp cuts off what is above it, and nothing else") {
    for (const Tracer& tracer : tracers()) {
        CAPTURE(tracer.name);
        RenderSettings settings = small();
        const std::vector<double> whole = means(tracer, lamp(), settings);
        settings.clamp = 2.0;
        const std::vector<double> cut = means(tracer, lamp(), settings);
        bool lit = false;
        for (std::size_t i = 0; i < whole.size(); i += 3) {
            CHECK(cut[i] == doctest::Approx(0.2 * whole[i]).epsilon(1e-6));
            CHECK(cut[i + 1] == doctest::Approx(0.4 * whole[i + 1]).epsilon(1e-6));
            CHECK(cut[i + 2] == whole[i + 2]);
            lit = lit || whole[i] > 0.0;
        }
        CHECK(lit);
        settings.clamp = 1e6;
        CHECK(means(tracer, lamp(), settings) == whole);
    }
}

TEST_CASE("with another generator all tracers take the same paths as each other, and others than by philox") {
    for (const Generator generator : {Generator::hash, Generator::sobol}) {
        std::vector<double> first;
        for (const Tracer& tracer : tracers()) {
            CAPTURE(tracer.name);
            RenderSettings settings = small();
            const std::vector<double> by_philox = means(tracer, lamp(), settings);
            settings.generator = generator;
            const std::vector<double> mean = means(tracer, lamp(), settings);
            CHECK(mean != by_philox);
            if (first.empty()) first = mean;
            // Rounding may decide otherwise at the very edge, of which a pixel in ten has a part.
            std::size_t apart = 0;
            for (std::size_t i = 0; i < mean.size(); ++i) apart += std::abs(mean[i] - first[i]) > 1e-6 ? 1 : 0;
            CHECK(apart <= 6);
        }
    }
}

TEST_CASE("Sobol points measure the lamp's share of the pixels better than independent numbers") {
    for (const Tracer& tracer : tracers()) {
        CAPTURE(tracer.name);
        std::array<double, 2> squares{};
        RenderSettings settings = small();
        settings.seed = 99;
        const std::vector<double> truth =
            mean_of(tracer.renderer->prepare(lamp(), settings)->render({0, 4096}).estimate);
        for (std::size_t g = 0; g < 2; ++g) {
            settings.seed = 1;
            settings.generator = g == 0 ? Generator::philox : Generator::sobol;
            const std::vector<double> mean = means(tracer, lamp(), settings);
            for (std::size_t i = 0; i < mean.size(); ++i) squares[g] += (mean[i] - truth[i]) * (mean[i] - truth[i]);
        }
        // An edge through a square is known to about n^-3/4 instead of n^-1/2: 8 in variance at 64 samples.
        CHECK(squares[1] < squares[0] / 4.0);
    }
}

TEST_CASE("the Fresnel term of all materials can be set, as if the scene said so") {
    const auto ball = [](Fresnel fresnel) {
        return SceneBuilder()
            .camera({0.0, 0.0, 4.0}, {0.0, 0.0, 0.0}, 40.0)
            .background(dvec3(0.2), dvec3(1.0))
            .sphere(glass(1.5, fresnel), {0.0, 0.0, 0.0}, 1.0)
            .scene();
    };
    for (const Tracer& tracer : tracers()) {
        CAPTURE(tracer.name);
        RenderSettings settings = small();
        const std::vector<double> exact = means(tracer, ball(Fresnel::exact), settings);
        const std::vector<double> schlick = means(tracer, ball(Fresnel::schlick), settings);
        CHECK(exact != schlick);
        settings.fresnel = Fresnel::schlick;
        CHECK(means(tracer, ball(Fresnel::exact), settings) == schlick);
        settings.fresnel = Fresnel::exact;
        CHECK(means(tracer, ball(Fresnel::schlick), settings) == exact);
    }
}

}  // namespace
}  // namespace tandem::test
