// Numbers and shapes from numbers in lanes (MODEL.md section 3): Philox blocks, sine and cosine by polynomials, disc,
// sphere, cosine hemisphere, triangle, frame.
#pragma once

#include <array>

#include "common/render/renderer.h"
#include "cpu_ref/path_tracer/arithmetic/generators.h"
#include "cpu_ref/path_tracer/arithmetic/vec3.h"
#include "cpu_ref/path_tracer/planted_lanes.h"

namespace tandem::cpu {

// High and low half of the 32-bit products x * multiplier.
template <class Real>
struct WideProduct {
    Ints<Real> high, low;
};
TANDEM_INLINE WideProduct<float> multiply_wide(Ints<float> x, std::uint32_t multiplier) {
#ifdef TANDEM_LANES_AVX512
    const __m512i m = _mm512_set1_epi32(static_cast<int>(multiplier)), a = register_of(x);
    const __m512i even = _mm512_mul_epu32(a, m), odd = _mm512_mul_epu32(_mm512_srli_epi64(a, 32), m);
    return {ints_of<float>(_mm512_mask_mov_epi32(_mm512_srli_epi64(even, 32), 0xAAAA, odd)),
        ints_of<float>(_mm512_mask_mov_epi32(even, 0xAAAA, _mm512_slli_epi64(odd, 32)))};
#else
    WideProduct<float> result;
    for (int i = 0; i < lane_count<float>; ++i) {
        const std::uint64_t product = std::uint64_t{x.v[i]} * multiplier;
        result.high.v[i] = static_cast<std::uint32_t>(product >> 32);
        result.low.v[i] = static_cast<std::uint32_t>(product);
    }
    return result;
#endif
}
TANDEM_INLINE WideProduct<double> multiply_wide(Ints<double> x, std::uint32_t multiplier) {
#ifdef TANDEM_LANES_AVX512
    const Ints<double> product =
        ints_of<double>(_mm512_mul_epu32(register_of(x), _mm512_set1_epi64(static_cast<long long>(multiplier))));
#else
    const Ints<double> product = x * Ints<double>(std::uint64_t{multiplier});
#endif
    return {product >> 32, product & Ints<double>(0xFFFFFFFFull)};
}

template <class Real>
using RandomLanes = std::array<Lanes<Real>, 4>;

// Which sample a lane works on; integers below 2^32 in every lane.
template <class Real>
struct SampleId {
    Ints<Real> pixel, sample_low, sample_high;
};

// The four numbers of dimension block `block`: Philox4x32-10 in lanes (checked against common/render/random.h by the
// tests).
template <class Real>
TANDEM_INLINE RandomLanes<Real> random_numbers(std::uint64_t seed, const SampleId<Real>& id, Ints<Real> block) {
    std::array<Ints<Real>, 4> c{id.pixel, id.sample_low, block, id.sample_high};
    plant_in_counter<Real>(c);
    std::uint32_t key0 = static_cast<std::uint32_t>(seed), key1 = static_cast<std::uint32_t>(seed >> 32);
    for (int round = 0; round < 10; ++round) {
        const WideProduct<Real> p0 = multiply_wide(c[0], 0xD2511F53u), p1 = multiply_wide(c[2], 0xCD9E8D57u);
        c = {p1.high ^ c[1] ^ Ints<Real>(UnsignedOf<Real>{key0}), p1.low,
            p0.high ^ c[3] ^ Ints<Real>(UnsignedOf<Real>{key1}), p0.low};
        key0 += 0x9E3779B9u;
        key1 += 0xBB67AE85u;
    }
    if (planted(PlantedBug::random_short))
        for (Ints<Real>& word : c) word = word & Ints<Real>(UnsignedOf<Real>{0xFFFF0000u});
    RandomLanes<Real> numbers;
    for (std::size_t i = 0; i < 4; ++i) numbers[i] = to_real(c[i] >> 8) * Lanes<Real>(static_cast<Real>(0x1p-24));
    return numbers;
}

// Numbers of the generator that was chosen.
template <class Real>
TANDEM_INLINE RandomLanes<Real> random_numbers(
    const RenderSettings& settings, const SampleId<Real>& id, Ints<Real> block) {
    if (settings.generator == Generator::philox) [[likely]]
        return random_numbers<Real>(settings.seed, id, block);
    const WordBlock<Real> words =
        words_by<Real>(settings.generator, settings.seed, id.pixel, id.sample_low, id.sample_high, block);
    RandomLanes<Real> numbers;
    for (std::size_t i = 0; i < 4; ++i) numbers[i] = to_real(words[i] >> 8) * Lanes<Real>(static_cast<Real>(0x1p-24));
    return numbers;
}

template <class V>
struct CosineSine {
    V cosine, sine;
};

// (cos 2 pi u, sin 2 pi u), u in [0, 1). With the quadrant q = floor(4u + 1/2), |r| = |u - q/4| <= 1/8. Then follows
// the Taylor series of x = 2 pi r, |x| <= pi/4. The first neglected terms are below 3e-9 (float) and 4e-18 (double). So
// rounding of x and of the last steps rules: below 2 ulp of 1.
template <class Real>
TANDEM_INLINE CosineSine<Lanes<Real>> cosine_sine_turns(Lanes<Real> u) {
    using V = Lanes<Real>;
    const V quarter = V(Real(4)) * u + V(Real(0.5));
    Ints<Real> q{};
#ifdef TANDEM_LANES_AVX512
    if constexpr (sizeof(Real) == 4)
        q = ints_of<Real>(_mm512_cvttps_epi32(quarter.v));
    else
        q = ints_of<Real>(_mm512_cvttpd_epi64(quarter.v));
#else
    q.v = __builtin_convertvector(quarter.v, typename LaneTypes<Real>::UnsignedVector);
#endif
    const V r = u - to_real(q) * V(Real(0.25));  // exact
    const V x = r * V(static_cast<Real>(6.283185307179586476925286766559));
    const V z = x * x;
    V c, s;
    if constexpr (sizeof(Real) == 4) {
        c = fma(z, fma(z, fma(z, V(2.4801587e-5f), V(-1.3888889e-3f)), V(4.1666668e-2f)), V(-0.5f));
        s = fma(z, fma(z, fma(z, V(2.7557319e-6f), V(-1.9841270e-4f)), V(8.3333333e-3f)), V(-1.6666667e-1f));
    } else {
        c = V(1.0 / 20922789888000.0);
        for (double k :
            {-1.0 / 87178291200.0, 1.0 / 479001600.0, -1.0 / 3628800.0, 1.0 / 40320.0, -1.0 / 720.0, 1.0 / 24.0, -0.5})
            c = fma(c, z, V(k));
        s = V(1.0 / 355687428096000.0);
        for (double k : {-1.0 / 1307674368000.0, 1.0 / 6227020800.0, -1.0 / 39916800.0, 1.0 / 362880.0, -1.0 / 5040.0,
                 1.0 / 120.0, -1.0 / 6.0})
            s = fma(s, z, V(k));
    }
    c = fma(c, z, V(Real(1)));
    s = fma(V(s * z), x, x);
    using U = UnsignedOf<Real>;
    const Mask<Real> swap = has_bit(q, U{1});
    const V cosine = select(swap, s, c), sine = select(swap, c, s);
    return {select(has_bit(q + Ints<Real>(U{1}), U{2}), -cosine, cosine), select(has_bit(q, U{2}), -sine, sine)};
}

template <class V>
struct Point2 {
    V x, y;
};
template <class V>
TANDEM_INLINE Point2<V> sample_disc(V a, V b) {
    const V radius = sqrt(a);
    const auto [c, s] = cosine_sine_turns(b);
    return {radius * c, radius * s};
}
template <class V>
TANDEM_INLINE Vec3<V> sample_sphere(V a, V b) {
    using Real = RealOf<V>;
    const V z = fma(V(Real(-2)), a, V(Real(1))), rho = V(Real(2)) * sqrt(V(a * (V(Real(1)) - a)));
    const auto [c, s] = cosine_sine_turns(b);
    return {rho * c, rho * s, z};
}
template <class V>
TANDEM_INLINE Vec3<V> sample_cosine_hemisphere(V a, V b) {
    const auto [x, y] = sample_disc(a, b);
    return {x, y, sqrt(V(V(RealOf<V>(1)) - a))};
}
// Barycentric weights of corners 1 and 2.
template <class V>
TANDEM_INLINE Point2<V> sample_triangle(V a, V b) {
    const V s = sqrt(a);
    return {s * (V(RealOf<V>(1)) - b), s * b};
}

// The frame about unit n (section 3.1): local (x, y, z) to world.
template <class V>
struct Frame {
    Vec3<V> tangent, bitangent, normal;
    TANDEM_INLINE Vec3<V> to_world(Vec3<V> local) const {
        return along(along(normal * local.z, local.y, bitangent), local.x, tangent);
    }
    TANDEM_INLINE Vec3<V> to_local(Vec3<V> world) const {
        return {dot(tangent, world), dot(bitangent, world), dot(normal, world)};
    }
};
template <class V>
TANDEM_INLINE Frame<V> frame_about(Vec3<V> n) {
    using Real = RealOf<V>;
    const V sign = select(n.z >= V(Real(0)), V(Real(1)), V(Real(-1)));
    const V a = V(Real(-1)) / (sign + n.z), b = n.x * n.y * a;
    return {
        {fma(V(sign * n.x * n.x), a, V(Real(1))), sign * b, -(sign * n.x)}, {b, fma(V(n.y * n.y), a, sign), -n.y}, n};
}

}  // namespace tandem::cpu
