// The inverses of the pixel filters' distribution functions (MODEL.md section 4.1), against a library's.
#include <doctest/doctest.h>

#include <boost/math/special_functions/erf.hpp>
#include <cmath>

#include "common/render/random.h"
#include "cpu_ref/bidirectional/pixel_shares.h"
#include "cpu_ref/oracle/pixel_filter.h"
#include "cpu_ref/path_tracer/pixel_filter.h"

using namespace tandem;
using namespace tandem::cpu;

namespace {

double answer(PixelFilter filter, double u) {
    if (filter == PixelFilter::tent) return u < 0.5 ? std::sqrt(2.0 * u) - 0.5 : 1.5 - std::sqrt(2.0 - 2.0 * u);
    return 0.5 + boost::math::erf_inv((2.0 * u - 1.0) * boost::math::erf(3.0 / std::sqrt(2.0))) / std::sqrt(2.0);
}

// Every 997th of the 2^24 numbers, from 0 to the last.
template <class Visit>
void for_numbers(Visit visit) {
    for (std::uint32_t i = 0; i < (1u << 24); i += 997) visit(to_unit<double>(i << 8));
    visit(1.0 - 0x1p-24);
}

}  // namespace

TEST_CASE("pixel filters: numbers become places to 1e-12 in double and 1e-6 in float, rising, in lanes and alone") {
    for (const PixelFilter filter : {PixelFilter::tent, PixelFilter::gaussian}) {
        double worst_double = 0.0, worst_float = 0.0, worst_oracle = 0.0;
        double last_double = -2.0, last_float = -2.0, last_oracle = -2.0;
        bool rises = true, lanes_agree = true;
        for_numbers([&](double u) {
            const double right = answer(filter, u), precise = place_by_filter(filter, u);
            const double single = double{place_by_filter(filter, static_cast<float>(u))};
            const double solved = oracle::place_by_filter(filter, u);
            worst_double = std::max(worst_double, std::abs(precise - right));
            worst_float = std::max(worst_float, std::abs(single - right));
            worst_oracle = std::max(worst_oracle, std::abs(solved - right));
            rises = rises && precise > last_double && single >= last_float - 0x1p-23 && solved > last_oracle;
            last_double = precise;
            last_float = single;
            last_oracle = solved;
            const Lanes<double> lanes = place_by_filter(filter, Lanes<double>(u));
            const Lanes<float> narrow = place_by_filter(filter, Lanes<float>(static_cast<float>(u)));
            lanes_agree = lanes_agree && lanes[0] == precise && lanes[lane_count<double> - 1] == precise &&
                          double{narrow[0]} == single;
        });
        CAPTURE(pixel_filter_names[static_cast<std::size_t>(filter)]);
        CAPTURE(worst_double);
        CAPTURE(worst_float);
        CAPTURE(worst_oracle);
        CHECK(worst_double < 1e-12);
        CHECK(worst_float < 1e-6);
        CHECK(worst_oracle < 1e-12);
        CHECK(rises);
        CHECK(lanes_agree);
    }
}

TEST_CASE("pixel filters: lanes near the middle and far from it do not disturb each other") {
    Lanes<float> u;
    for (int i = 0; i < lane_count<float>; ++i) u.v[i] = i % 2 == 0 ? 0.5f - 0.01f * static_cast<float>(i) : 1e-3f;
    const Lanes<float> places = place_by_filter(PixelFilter::gaussian, u);
    for (int i = 0; i < lane_count<float>; ++i) CHECK(places[i] == place_by_filter(PixelFilter::gaussian, u[i]));
}

TEST_CASE("pixel filters: what pixels see of a place adds up to one, to what MODEL.md says of the gaussian") {
    for (const PixelFilter filter : {PixelFilter::box, PixelFilter::tent, PixelFilter::gaussian}) {
        CAPTURE(pixel_filter_names[static_cast<std::size_t>(filter)]);
        double least = 2.0, most = 0.0;
        for (int i = 0; i < 1000; ++i) {
            double sum = 0.0;
            const PixelShares shares(filter, 4.0 + i / 1000.0, 9);
            for (const PixelShare& share : shares.all()) sum += share.value;
            least = std::min(least, sum);
            most = std::max(most, sum);
        }
        const bool gaussian = filter == PixelFilter::gaussian;
        CHECK(least == doctest::Approx(gaussian ? 0.979 : 1.0).epsilon(gaussian ? 1e-3 : 1e-12));
        CHECK(most == doctest::Approx(gaussian ? 1.017 : 1.0).epsilon(gaussian ? 1e-3 : 1e-12));
    }
}

TEST_CASE("pixel filters: a place beyond the film's rim is seen by the pixels that reach it alone") {
    const auto seen_by = [](PixelFilter filter, double place) {
        std::vector<std::uint32_t> indices;
        const PixelShares shares(filter, place, 4);
        for (const PixelShare& share : shares.all())
            if (share.value > 0.0) indices.push_back(share.index);
        return indices;
    };
    using Indices = std::vector<std::uint32_t>;
    CHECK(seen_by(PixelFilter::box, -0.01) == Indices{});
    CHECK(seen_by(PixelFilter::box, 0.0) == Indices{0});
    CHECK(seen_by(PixelFilter::box, 4.0) == Indices{});
    CHECK(seen_by(PixelFilter::tent, -0.4) == Indices{0});
    CHECK(seen_by(PixelFilter::tent, -0.6) == Indices{});
    CHECK(seen_by(PixelFilter::tent, 1.6) == Indices{1, 2});
    CHECK(seen_by(PixelFilter::gaussian, -0.9) == Indices{0});
    CHECK(seen_by(PixelFilter::gaussian, 4.4) == Indices{3});
    CHECK(seen_by(PixelFilter::gaussian, 5.1) == Indices{});
    CHECK(seen_by(PixelFilter::gaussian, 2.0) == Indices{0, 1, 2, 3});  // both ends are its own
}
