// Every effect alone and with every other. A scene that needs it is refused without it, and its kernels give the bits
// of the general ones.
#include <doctest/doctest.h>
#include <malloc.h>

#include <algorithm>
#include <cstdint>
#include <limits>

#include "common/error.h"
#include "cpu_ref/backend.h"
#include "tests/effect_samples.h"
#include "tests/refusal.h"
#include "tests/thorough.h"
#include "vulkan/backend.h"

namespace tandem::test {
namespace {

std::string refusal(Renderer& renderer, const SampledScene& sample, EffectSet effects) {
    RenderSettings settings = sample.settings;
    settings.effects = effects;
    return tandem::refusal<UnsupportedError>([&] { (void)renderer.prepare(sample.scene, settings); });
}

bool same_bits(const Estimate& a, const Estimate& b) {
    return a.invalid() == b.invalid() &&
           std::ranges::equal(a.totals(), b.totals(), [](const Moments& x, const Moments& y) {
               return x.sum == y.sum && x.sum_of_squares == y.sum_of_squares;
           });
}

Estimate image(Renderer& renderer, const SampledScene& sample, std::optional<EffectSet> effects) {
    RenderSettings settings = sample.settings;
    settings.effects = effects;
    return renderer.prepare(sample.scene, settings)->render({0, 2}).estimate;
}

// Also lit: black images agree too easily.
void check_specialised_is_general(Renderer& renderer, const SampledScene& sample) {
    const Estimate own = image(renderer, sample, std::nullopt);
    double sum = 0.0;
    for (const Moments& moments : own.totals()) sum += moments.sum;
    CHECK(sum > 0.0);
    CHECK(own.invalid() == 0);
    CHECK(same_bits(own, image(renderer, sample, EffectSet::all())));
}

SampledScene alone(const EffectSample& sample) {
    SampledScene made;
    sample.add(made);
    return made;
}

// Kernels are kept, and drivers allow a process few instances in its life.
Renderer& vulkan_renderer() {
    static const std::unique_ptr<Renderer> renderer = vulkan_backend().create({});
    return *renderer;
}

// Every `parts`th pair; all parts together are all pairs.
template <class Check>
void for_each_pair(std::size_t part, std::size_t parts, Check check) {
    const std::vector<EffectSample> samples = effect_samples();
    std::size_t index = 0;
    for (std::size_t i = 0; i < samples.size(); ++i)
        for (std::size_t j = i + 1; j < samples.size(); ++j) {
            if (index++ % parts != part) continue;
            CAPTURE(effect_name(samples[i].effect));
            CAPTURE(effect_name(samples[j].effect));
            if (const std::optional<SampledScene> sample = scene_of_samples(samples[i], samples[j])) check(*sample);
        }
}

// In parts, each a process of its own under ctest: all kernels of all pairs are gigabytes.
void check_pairs_on_vulkan(std::size_t part) {
    for_each_pair(part, 8, [](const SampledScene& sample) { check_specialised_is_general(vulkan_renderer(), sample); });
}

// The heap's, and those of large blocks, which are mappings of their own.
std::int64_t bytes_in_use() {
    const auto info = mallinfo2();
    return static_cast<std::int64_t>(info.uordblks + info.hblkhd);
}

// Bytes in use that a render leaves more than it found, the least of three renders. One of them may add buffers for
// longer submissions: the machine's load decides that.
std::int64_t growth(RenderJob& job, std::uint64_t samples) {
    std::int64_t least = std::numeric_limits<std::int64_t>::max();
    for (int render = 0; render < 3; ++render) {
        const std::int64_t before = bytes_in_use();
        (void)job.render({0, samples});
        least = std::min(least, bytes_in_use() - before);
    }
    return least;
}

}  // namespace

TEST_CASE("samples: there is one for every effect, which needs it") {
    const std::vector<EffectSample> samples = effect_samples();
    REQUIRE(samples.size() == effect_count);
    for (std::uint32_t i = 0; i < effect_count; ++i) {
        CAPTURE(effect_name(samples[i].effect));
        CHECK(samples[i].effect == static_cast<Effect>(i));
        const SampledScene sample = alone(samples[i]);
        CHECK(needed_effects(sample.scene, sample.settings).has(samples[i].effect));
    }
}

TEST_CASE("samples: every effect that is cleared although it is needed is refused by name, by both tracers") {
    const std::unique_ptr<Renderer> cpu = cpu_backend().create({});
    for (const EffectSample& sample : effect_samples()) {
        CAPTURE(effect_name(sample.effect));
        const SampledScene made = alone(sample);
        const EffectSet needed = needed_effects(made.scene, made.settings);
        for (Renderer* renderer : {cpu.get(), &vulkan_renderer()}) {
            CAPTURE(renderer->info().backend);
            CHECK(refusal(*renderer, made, needed.without(sample.effect))
                      .find("leave out what the scene calls for: " + std::string(effect_name(sample.effect)) + ";") !=
                  std::string::npos);
            CHECK(refusal(*renderer, made, EffectSet::all().without(sample.effect)).find(effect_name(sample.effect)) !=
                  std::string::npos);
            if (renderer == cpu.get()) CHECK(refusal(*renderer, made, needed).empty());  // else rendered below
        }
    }
}

TEST_CASE("samples: every pair needs what either needs") {
    const std::vector<EffectSample> samples = effect_samples();
    std::size_t together = 0;
    for (const EffectSample& first : samples)
        for (const EffectSample& second : samples)
            if (const std::optional<SampledScene> made = scene_of_samples(first, second)) {
                CAPTURE(effect_name(first.effect));
                CAPTURE(effect_name(second.effect));
                CHECK(needed_effects(made->scene, made->settings).covers({first.effect, second.effect}));
                ++together;
            }
    // All 43 x 43 pairs but a boundary (two samples) with one of three lights, and the two skies.
    CHECK(together == samples.size() * samples.size() - 2 * (2 * 3 + 1));
}

TEST_CASE("samples: on the CPU every effect and every pair has the bits of the general variant") {
    const std::unique_ptr<Renderer> renderer = cpu_backend().create({});
    for (const EffectSample& sample : effect_samples()) {
        CAPTURE(effect_name(sample.effect));
        check_specialised_is_general(*renderer, alone(sample));
    }
    for_each_pair(0, 1, [&](const SampledScene& sample) { check_specialised_is_general(*renderer, sample); });
}

TEST_CASE("samples: on Vulkan every effect has the bits of the general kernels" * doctest::test_suite("full")) {
    for (const EffectSample& sample : effect_samples()) {
        CAPTURE(effect_name(sample.effect));
        check_specialised_is_general(vulkan_renderer(), alone(sample));
    }
}

// Mesa's lavapipe compiles a kernel anew in every dispatch where it branches on uniforms alone, and keeps what it made.
TEST_CASE("samples: on Vulkan rendering on takes no more memory") {
    constexpr std::uint64_t warm = 4, samples = 36;
    constexpr std::int64_t most = 1 << 17;  // bytes: lavapipe's kernels have twice that and more
    const std::vector<EffectSample> all = effect_samples();
    for (std::size_t i = 0; i < all.size(); i += thorough() ? 1 : 8) {
        const EffectSample& sample = all[i];
        CAPTURE(effect_name(sample.effect));
        const SampledScene made = alone(sample);
        const std::unique_ptr<RenderJob> job = vulkan_renderer().prepare(made.scene, made.settings);
        (void)job->render({0, warm});
        CHECK(growth(*job, samples) < most);
    }
}

#define TANDEM_PAIRS(part)                                                                           \
    TEST_CASE("samples: on Vulkan pairs have the bits of the general kernels, part " #part " of 8" * \
              doctest::test_suite("full")) {                                                         \
        check_pairs_on_vulkan(part - 1);                                                             \
    }

TANDEM_PAIRS(1)
TANDEM_PAIRS(2)
TANDEM_PAIRS(3)
TANDEM_PAIRS(4)
TANDEM_PAIRS(5)
TANDEM_PAIRS(6)
TANDEM_PAIRS(7)
TANDEM_PAIRS(8)

}  // namespace tandem::test
