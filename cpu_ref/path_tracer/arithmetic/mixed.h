// Conversion between the lanes of geometry and those of shading, if their precisions differ (MODEL.md section 5.3,
// `mixed`). Packets are as wide as geometry's lanes. If there are more float lanes than double lanes, the float lanes
// repeat the doubles. So every lane computes a valid value.
#pragma once

#include "cpu_ref/path_tracer/arithmetic/vec3.h"

namespace tandem::cpu {

template <class To, class From>
TANDEM_INLINE Lanes<To> lanes_as(Lanes<From> a) {
    if constexpr (std::is_same_v<To, From>) {
        return a;
    } else {
#ifdef TANDEM_LANES_AVX512
        if constexpr (sizeof(To) < sizeof(From)) {
            const __m256 half = _mm512_cvtpd_ps(a.v);
            return {_mm512_insertf32x8(_mm512_castps256_ps512(half), half, 1)};
        } else {
            return {_mm512_cvtps_pd(_mm512_castps512_ps256(a.v))};
        }
#else
        Lanes<To> result;
        for (int i = 0; i < lane_count<To>; ++i) result.v[i] = static_cast<To>(a.v[i % lane_count<From>]);
        return result;
#endif
    }
}

template <class To, class From>
TANDEM_INLINE Vec3<Lanes<To>> lanes_as(const Vec3<Lanes<From>>& a) {
    return {lanes_as<To>(a.x), lanes_as<To>(a.y), lanes_as<To>(a.z)};
}

// Values below 2^32.
template <class To, class From>
TANDEM_INLINE Ints<To> lanes_as(Ints<From> a) {
    if constexpr (std::is_same_v<To, From>) {
        return a;
    } else {
        Ints<To> result;
        for (int i = 0; i < lane_count<To>; ++i) result.v[i] = static_cast<UnsignedOf<To>>(a.v[i % lane_count<From>]);
        return result;
    }
}

template <class To, class From>
TANDEM_INLINE Mask<To> lanes_as(Mask<From> a) {
    if constexpr (std::is_same_v<To, From>) {
        return a;
    } else {
        const unsigned bits = a.to_bits();
        return Mask<To>::from_bits(sizeof(To) < sizeof(From) ? bits | bits << lane_count<From> : bits & all_lanes<To>);
    }
}

}  // namespace tandem::cpu
