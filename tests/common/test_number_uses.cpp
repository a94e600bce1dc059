// Numbers that only choose, and a side that also takes one for a coordinate.
#include <doctest/doctest.h>

#include <array>
#include <cmath>

#include "common/render/path_trace.h"
#include "common/validation/verify/number_uses.h"

namespace tandem {
namespace {

// One vertex, with one of four lights and a point on it.
class LightJob : public RenderJob {
public:
    explicit LightJob(bool reuses) : reuses_(reuses) {}
    RenderResult render(SampleRange, const RenderControl&) override { return {}; }
    std::vector<PathTrace> trace(std::uint32_t x, std::uint32_t y, SampleRange samples) override {
        return trace_with({}, x, y, samples);
    }
    std::vector<PathTrace> trace_with(
        ChangedNumber changed, std::uint32_t x, std::uint32_t y, SampleRange samples) override {
        std::vector<PathTrace> paths;
        for (std::uint64_t sample = samples.begin; sample < samples.end; ++sample) {
            constexpr std::uint32_t light_block = 5;
            std::array<double, 3> u{};
            for (std::uint32_t i = 0; i < 3; ++i) {
                auto word = static_cast<std::uint32_t>((sample + 64 * (x + 64 * y) + 1) * 2654435761u * (2 * i + 1));
                if (changed.block == light_block && changed.number == i) word ^= 1u << changed.bit;
                u.at(i) = word * 0x1p-32;
            }
            const double light = std::floor(4.0 * u[0]);
            TracedVertex vertex;
            vertex.light = glm::dvec3(1.0);
            vertex.next_event.direction = glm::dvec3(light, u[1], u.at(reuses_ ? 0 : 2));
            paths.push_back({{vertex}, glm::dvec3(0.0)});
        }
        return paths;
    }

private:
    bool reuses_;
};

TEST_CASE("a number that chooses the light and is a coordinate of the point on it, too, is told") {
    const std::array pixels{glm::uvec2(3, 4), glm::uvec2(7, 1)};
    LightJob sound(false), sound_too(false), reuses(true);
    CHECK(number_uses({sound, sound_too, pixels, 0}).use == NumberUse::same);
    const NumberUses candidate = number_uses({sound, reuses, pixels, 0});
    CHECK(candidate.use == NumberUse::foreign);
    CHECK(candidate.words ==
          "the light's first number, which only chooses, decides the point of the light of the candidate");
    CHECK(number_uses({reuses, sound, pixels, 0}).words ==
          "the light's first number, which only chooses, decides the point of the light of the reference");
}

}  // namespace
}  // namespace tandem
