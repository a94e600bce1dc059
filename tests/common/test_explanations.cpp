// What a difference looks like: known kinds are named, unknown ones are not.
#include <doctest/doctest.h>

#include <algorithm>
#include <vector>

#include "common/validation/compare/colour_space.h"
#include "tests/common/painted_image.h"
#include "tests/refusal.h"

using namespace tandem;
using namespace tandem::test;

namespace {

// The sentence on a reference and a candidate that was painted otherwise, or the part of it that explains.
std::string explained(const Painting& candidate, Painting reference = {}, std::uint64_t seed = 1) {
    reference.size = candidate.size;
    reference.noise = candidate.noise;
    reference.samples = candidate.samples;
    const SceneVerdict verdict = compare_images({paint(reference, 2 * seed)}, {paint(candidate, 2 * seed + 1)});
    CHECK(verdict.verdict == Verdict::disagree);
    return told(verdict.explanations);
}

Painting afterwards(const Change& change) {
    Painting painting;
    painting.afterwards = change;
    return painting;
}

// candidate(x, y) = reference(source(x, y))
Painting moved(
    const std::function<std::pair<std::uint32_t, std::uint32_t>(std::uint32_t, std::uint32_t, std::uint32_t)>& source) {
    return afterwards([=](std::vector<Colour3>& pixels, std::uint32_t size) {
        const std::vector<Colour3> before = pixels;
        for (std::uint32_t y = 0; y < size; ++y)
            for (std::uint32_t x = 0; x < size; ++x) {
                const auto [u, v] = source(x, y, size - 1);
                pixels[y * size + x] = before[v * size + u];
            }
    });
}

Painting toned(const std::function<double(double)>& curve) {
    return afterwards([=](std::vector<Colour3>& pixels, std::uint32_t) {
        for (Colour3& pixel : pixels)
            for (double& channel : pixel) channel = curve(channel);
    });
}

Painting recoloured(const std::function<Colour3(const Colour3&)>& change) {
    return afterwards(
        [=](std::vector<Colour3>& pixels, std::uint32_t) { std::ranges::transform(pixels, pixels.begin(), change); });
}

Painting filled(std::uint32_t x0, std::uint32_t y0, std::uint32_t x1, std::uint32_t y1, const Colour3& colour) {
    return afterwards([=](std::vector<Colour3>& pixels, std::uint32_t size) {
        for (std::uint32_t y = y0; y < y1; ++y)
            for (std::uint32_t x = x0; x < x1; ++x) pixels[y * size + x] = colour;
    });
}

Painting shifted(double dx, double dy) {
    Painting painting;
    painting.picture = [=](double x, double y) { return painted(x - dx / 96.0, y - dy / 96.0); };
    return painting;
}

const Transfer srgb{Transfer::Curve::srgb, 1.0};

struct Kind {
    const char* name;  // part of the explanation
    Painting candidate;
};

std::vector<Kind> known_kinds() {
    using U = std::uint32_t;
    const auto scaled = [](double f) { return toned([=](double v) { return f * v; }); };
    return {
        {"a horizontal flip", moved([](U x, U y, U last) {
             return std::pair{last - x, y};
         })},
        {"a vertical flip", moved([](U x, U y, U last) {
             return std::pair{x, last - y};
         })},
        {"a half turn", moved([](U x, U y, U last) {
             return std::pair{last - x, last - y};
         })},
        {"a transpose, x for y", moved([](U x, U y, U) {
             return std::pair{y, x};
         })},
        {"a transpose about the other diagonal", moved([](U x, U y, U last) {
             return std::pair{last - y, last - x};
         })},
        // Turned clockwise, the top left corner becomes the top right one.
        {"a quarter turn clockwise", moved([](U x, U y, U last) {
             return std::pair{y, last - x};
         })},
        {"a quarter turn anticlockwise", moved([](U x, U y, U last) {
             return std::pair{last - y, x};
         })},
        {"are the reference's B, G, R", recoloured([](const Colour3& c) {
             return Colour3{c[2], c[1], c[0]};
         })},
        {"are the reference's G, R, B", recoloured([](const Colour3& c) {
             return Colour3{c[1], c[0], c[2]};
         })},
        {"are the reference's R, B, G", recoloured([](const Colour3& c) {
             return Colour3{c[0], c[2], c[1]};
         })},
        {"are the reference's G, B, R", recoloured([](const Colour3& c) {
             return Colour3{c[1], c[2], c[0]};
         })},
        {"are the reference's B, R, G", recoloured([](const Colour3& c) {
             return Colour3{c[2], c[0], c[1]};
         })},
        {"encoded in sRGB once more", toned([](double v) { return srgb.encoded(v); })},
        {"encoded in sRGB once more than the reference, and the candidate's values are cut off at 1",
            toned([](double v) { return std::min(1.0, srgb.encoded(v)); })},
        {"decoded from sRGB once more", toned([](double v) { return srgb.decoded(v); })},
        {"reference^0.45", toned([](double v) { return std::pow(v, 0.4545); })},
        {"a gamma: candidate = reference^1.", toned([](double v) { return std::pow(v, 1.2); })},
        {"a constant exposure factor of 2.7", scaled(2.7)},
        {"a constant exposure factor of 0.9", scaled(0.95)},
        {"as if the candidate lacked one of 64 samples", scaled(63.0 / 64.0)},
        {"added to the candidate", toned([](double v) { return v + 0.05; })},
        {"a gamma and a factor: candidate = 1.", toned([](double v) { return 1.5 * std::pow(v, 0.8); })},
        {"a factor for each channel: red 1.2", recoloured([](const Colour3& c) {
             return Colour3{1.2 * c[0], c[1], 0.9 * c[2]};
         })},
        {"(+0.5", shifted(0.5, 0.0)},
        {"(+1.0", shifted(1.0, 0.0)},
        {", -2.0", shifted(0.0, -2.0)},
        {"the candidate is black at x 30 to 49, y 40 to 49", filled(30, 40, 50, 50, {0.0, 0.0, 0.0})},
        {"the candidate is constant (1, 0, 1) at x 16 to 31, y 64 to 79", filled(16, 64, 32, 80, {1.0, 0.0, 1.0})},
        {"the candidate is black at x 0 to 95, y 50 to 50", filled(0, 50, 96, 51, {0.0, 0.0, 0.0})},
        {"the candidate is black everywhere", filled(0, 0, 96, 96, {0.0, 0.0, 0.0})},
        {"the candidate's blue is 0 everywhere", recoloured([](const Colour3& c) {
             return Colour3{c[0], c[1], 0.0};
         })},
        {"the candidate's values are cut off at 1", toned([](double v) { return std::min(v, 1.0); })},
        {"three channels are the same", recoloured([](const Colour3& c) {
             return Colour3{c[1], c[1], c[1]};
         })},
        {"a mixing of the channels", recoloured([](const Colour3& c) {
             const double grey = 0.2 * c[0] + 0.7 * c[1] + 0.1 * c[2];
             return Colour3{0.7 * c[0] + 0.3 * grey, 0.7 * c[1] + 0.3 * grey, 0.7 * c[2] + 0.3 * grey};
         })},
    };
}

// What is none of the known kinds, near as some come.
std::vector<Kind> other_kinds() {
    using U = std::uint32_t;
    const auto times = [](const Colour3& c, double f) { return Colour3{f * c[0], f * c[1], f * c[2]}; };
    const auto drawn = [](const Picture& picture) {
        Painting painting;
        painting.picture = picture;
        return painting;
    };
    return {
        {"zoom about a corner", drawn([](double x, double y) { return painted(x / 1.01, y / 1.01); })},
        {"turn of a degree", drawn([](double x, double y) {
             const double c = std::cos(0.0175), s = std::sin(0.0175), u = x - 0.5, v = y - 0.5;
             return painted(0.5 + c * u - s * v, 0.5 + s * u + c * v);
         })},
        {"vignette", drawn([=](double x, double y) {
             return times(painted(x, y), 1.0 - 0.5 * ((x - 0.5) * (x - 0.5) + (y - 0.5) * (y - 0.5)));
         })},
        {"dimmer floor", drawn([=](double x, double y) { return times(painted(x, y), y > 0.75 ? 0.9 : 1.0); })},
        {"all but the lamp dimmer", drawn([=](double x, double y) {
             const Colour3 c = painted(x, y);
             return times(c, c[0] > 3.9 ? 1.0 : 0.97);
         })},
        {"red shifted alone", drawn([](double x, double y) {
             const Colour3 c = painted(x, y);
             return Colour3{painted(x - 1.0 / 96.0, y)[0], c[1], c[2]};
         })},
        {"tone mapping", toned([](double v) { return v / (1.0 + v); })},
        {"steps", toned([](double v) { return std::round(v * 8.0) / 8.0; })},
        {"one half flipped", moved([](U x, U y, U last) {
             return std::pair{x > last / 2 ? last - x : x, y};
         })},
        {"odd lines shifted", moved([](U x, U y, U last) {
             return std::pair{y % 2 != 0 ? std::min(x + 1, last) : x, y};
         })},
        {"every fourth line brighter", afterwards([=](std::vector<Colour3>& pixels, U width) {
             for (std::size_t i = 0; i < pixels.size(); ++i)
                 if (i / width % 4 == 0) pixels[i] = times(pixels[i], 1.05);
         })},
        {"odd lines black", afterwards([](std::vector<Colour3>& pixels, U width) {
             for (std::size_t i = 0; i < pixels.size(); ++i)
                 if (i / width % 2 != 0) pixels[i] = {};
         })},
        {"hot pixels", afterwards([](std::vector<Colour3>& pixels, U) {
             for (std::size_t k = 0; k < 40; ++k) pixels[k * 7919 % pixels.size()] = {9.0, 9.0, 9.0};
         })},
    };
}

void check_no_name(double noise) {
    for (Kind& kind : other_kinds()) {
        kind.candidate.noise = noise;
        CAPTURE(std::string(kind.name));
        CAPTURE(noise);
        CHECK(explained(kind.candidate) == "");
    }
}

}  // namespace

TEST_CASE("known kinds of difference are named, and no other name beside them") {
    for (Kind& kind : known_kinds()) {
        kind.candidate.noise = 0.01;
        const std::string text = explained(kind.candidate);
        CAPTURE(std::string(kind.name));
        CAPTURE(text);
        CHECK(contains(text, kind.name));
        CHECK_FALSE(contains(text, ", or a"));
    }
}

TEST_CASE("differences of other kinds get no name") { check_no_name(0.03); }

TEST_CASE("differences of other kinds get no name with little noise" * doctest::test_suite("full")) {
    check_no_name(0.003);
}

TEST_CASE("a picture that is its own mirror image leaves open how it was turned, and both ways are named") {
    Painting reference, candidate;
    reference.picture = [](double x, double y) { return painted(std::abs(x - 0.5), y); };
    candidate.picture = [](double x, double y) { return painted(std::abs(x - 0.5), 1.0 - y); };
    const std::string text = explained(candidate, reference);
    CHECK(contains(text, "a vertical flip, or a half turn"));
}
