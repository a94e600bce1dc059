// SIMD lanes: as many floats or doubles as a vector register holds, with integers and masks of the same width. Element
// by element IEEE arithmetic, so that a path's bits do not depend on the lane that it runs in. On AVX-512 masks live in
// mask registers; elsewhere GCC/Clang vector extensions do it all. The same functions exist for single numbers (lane
// count 1).
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <type_traits>

#if defined(__AVX512F__) && defined(__AVX512DQ__) && defined(__AVX512VL__) && defined(__AVX512BW__)
#define TANDEM_LANES_AVX512 1
#include <immintrin.h>
#endif

#define TANDEM_INLINE [[gnu::always_inline]] inline

namespace tandem::cpu {

#ifdef TANDEM_LANES_AVX512
inline constexpr std::size_t lane_bytes = 64;
#else
inline constexpr std::size_t lane_bytes = __BIGGEST_ALIGNMENT__;  // GCC: 32 on AVX, 16 below. Clang: 16
#endif

template <class Real>
struct LaneTypes;
template <>
struct LaneTypes<float> {
    typedef float Vector __attribute__((vector_size(lane_bytes)));
    using Unsigned = std::uint32_t;
    typedef std::uint32_t UnsignedVector __attribute__((vector_size(lane_bytes)));
    typedef std::int32_t SignedVector __attribute__((vector_size(lane_bytes)));
};
template <>
struct LaneTypes<double> {
    typedef double Vector __attribute__((vector_size(lane_bytes)));
    using Unsigned = std::uint64_t;
    typedef std::uint64_t UnsignedVector __attribute__((vector_size(lane_bytes)));
    typedef std::int64_t SignedVector __attribute__((vector_size(lane_bytes)));
};
template <class Real>
using UnsignedOf = typename LaneTypes<Real>::Unsigned;

template <class Real>
inline constexpr int lane_count = static_cast<int>(lane_bytes / sizeof(Real));

// ---- Masks ----------------------------------------------------------------------------------------------------------

template <class Real>
struct Mask {
#ifdef TANDEM_LANES_AVX512
    using Bits = std::conditional_t<sizeof(Real) == 4, std::uint16_t, std::uint8_t>;
    Bits bits = 0;
    TANDEM_INLINE static Mask of(unsigned value) { return {static_cast<Bits>(value)}; }
    TANDEM_INLINE friend Mask operator&(Mask a, Mask b) { return of(unsigned{a.bits} & b.bits); }
    TANDEM_INLINE friend Mask operator|(Mask a, Mask b) { return of(unsigned{a.bits} | b.bits); }
    TANDEM_INLINE friend Mask operator^(Mask a, Mask b) { return of(unsigned{a.bits} ^ b.bits); }
    TANDEM_INLINE Mask operator!() const { return of(~unsigned{bits}); }
    TANDEM_INLINE unsigned to_bits() const { return bits; }
    TANDEM_INLINE static Mask from_bits(unsigned value) { return of(value); }
#else
    typename LaneTypes<Real>::SignedVector v{};
    TANDEM_INLINE friend Mask operator&(Mask a, Mask b) { return {a.v & b.v}; }
    TANDEM_INLINE friend Mask operator|(Mask a, Mask b) { return {a.v | b.v}; }
    TANDEM_INLINE friend Mask operator^(Mask a, Mask b) { return {a.v ^ b.v}; }
    TANDEM_INLINE Mask operator!() const { return {~v}; }
    TANDEM_INLINE unsigned to_bits() const {
        unsigned all_bits = 0;
        for (int i = 0; i < lane_count<Real>; ++i) all_bits |= (v[i] != 0 ? 1u : 0u) << i;
        return all_bits;
    }
    TANDEM_INLINE static Mask from_bits(unsigned value) {
        Mask mask;
        for (int i = 0; i < lane_count<Real>; ++i) mask.v[i] = ((value >> i) & 1u) != 0 ? -1 : 0;
        return mask;
    }
#endif
};

template <class Real>
inline constexpr unsigned all_lanes = (1u << lane_count<Real>)-1u;

template <class Real>
TANDEM_INLINE bool any(Mask<Real> mask) {
    return mask.to_bits() != 0;
}
template <class Real>
TANDEM_INLINE bool none(Mask<Real> mask) {
    return mask.to_bits() == 0;
}
template <class Real>
TANDEM_INLINE bool all(Mask<Real> mask) {
    return mask.to_bits() == all_lanes<Real>;
}
TANDEM_INLINE bool any(bool mask) { return mask; }
TANDEM_INLINE bool none(bool mask) { return !mask; }
TANDEM_INLINE bool all(bool mask) { return mask; }

// ---- Unsigned integers ----------------------------------------------------------------------------------------------

template <class Real>
struct Ints {
    using Element = UnsignedOf<Real>;
    using Vector = typename LaneTypes<Real>::UnsignedVector;
    Vector v{};
    Ints() = default;
    TANDEM_INLINE Ints(Vector vector) : v(vector) {}
    TANDEM_INLINE Ints(Element value) : v(Vector{} + value) {}
    TANDEM_INLINE Element operator[](int lane) const { return v[lane]; }
    TANDEM_INLINE friend Ints operator+(Ints a, Ints b) { return a.v + b.v; }
    TANDEM_INLINE friend Ints operator-(Ints a, Ints b) { return a.v - b.v; }
    TANDEM_INLINE friend Ints operator*(Ints a, Ints b) { return a.v * b.v; }
    TANDEM_INLINE friend Ints operator&(Ints a, Ints b) { return a.v & b.v; }
    TANDEM_INLINE friend Ints operator|(Ints a, Ints b) { return a.v | b.v; }
    TANDEM_INLINE friend Ints operator^(Ints a, Ints b) { return a.v ^ b.v; }
    TANDEM_INLINE friend Ints operator>>(Ints a, int count) { return a.v >> static_cast<Element>(count); }
    TANDEM_INLINE friend Ints operator<<(Ints a, int count) { return a.v << static_cast<Element>(count); }
};

// ---- Real numbers ---------------------------------------------------------------------------------------------------

template <class Real>
struct Lanes {
    using Vector = typename LaneTypes<Real>::Vector;
    Vector v{};
    Lanes() = default;
    TANDEM_INLINE Lanes(Vector vector) : v(vector) {}
    TANDEM_INLINE Lanes(Real value) : v(Vector{} + value) {}
    TANDEM_INLINE Real operator[](int lane) const { return v[lane]; }
    TANDEM_INLINE friend Lanes operator+(Lanes a, Lanes b) { return a.v + b.v; }
    TANDEM_INLINE friend Lanes operator-(Lanes a, Lanes b) { return a.v - b.v; }
    TANDEM_INLINE friend Lanes operator*(Lanes a, Lanes b) { return a.v * b.v; }
    TANDEM_INLINE friend Lanes operator/(Lanes a, Lanes b) { return a.v / b.v; }
    TANDEM_INLINE Lanes operator-() const { return -v; }
    TANDEM_INLINE Lanes& operator+=(Lanes b) { return *this = *this + b; }
    TANDEM_INLINE Lanes& operator*=(Lanes b) { return *this = *this * b; }
};

template <class V>
struct LaneTraits;
template <class R>
struct LaneTraits<Lanes<R>> {
    using Real = R;
    using Bool = Mask<R>;
    using Index = Ints<R>;
};
template <>
struct LaneTraits<float> {
    using Real = float;
    using Bool = bool;
    using Index = std::uint32_t;
};
template <>
struct LaneTraits<double> {
    using Real = double;
    using Bool = bool;
    using Index = std::uint64_t;
};
template <class V>
using RealOf = typename LaneTraits<V>::Real;
template <class V>
using BoolOf = typename LaneTraits<V>::Bool;
template <class V>
using IndexOf = typename LaneTraits<V>::Index;

template <class Real>
TANDEM_INLINE Lanes<Real> load(const Real* aligned) {
    return *reinterpret_cast<const typename LaneTypes<Real>::Vector*>(aligned);
}
template <class Real>
TANDEM_INLINE void store(Real* aligned, Lanes<Real> value) {
    *reinterpret_cast<typename LaneTypes<Real>::Vector*>(aligned) = value.v;
}
template <class Real>
TANDEM_INLINE Ints<Real> load_ints(const UnsignedOf<Real>* aligned) {
    return *reinterpret_cast<const typename LaneTypes<Real>::UnsignedVector*>(aligned);
}
template <class Real>
TANDEM_INLINE void store_ints(UnsignedOf<Real>* aligned, Ints<Real> value) {
    *reinterpret_cast<typename LaneTypes<Real>::UnsignedVector*>(aligned) = value.v;
}

// ---- Comparisons, choice, square root, fused multiply-add -----------------------------------------------------------

#ifdef TANDEM_LANES_AVX512
#define TANDEM_COMPARE(symbol, predicate)                                          \
    TANDEM_INLINE Mask<float> operator symbol(Lanes<float> a, Lanes<float> b) {    \
        return {_mm512_cmp_ps_mask(a.v, b.v, predicate)};                          \
    }                                                                              \
    TANDEM_INLINE Mask<double> operator symbol(Lanes<double> a, Lanes<double> b) { \
        return {_mm512_cmp_pd_mask(a.v, b.v, predicate)};                          \
    }
TANDEM_COMPARE(<, _CMP_LT_OQ)
TANDEM_COMPARE(<=, _CMP_LE_OQ)
TANDEM_COMPARE(>, _CMP_GT_OQ)
TANDEM_COMPARE(>=, _CMP_GE_OQ)
TANDEM_COMPARE(==, _CMP_EQ_OQ)
TANDEM_COMPARE(!=, _CMP_NEQ_UQ)
#undef TANDEM_COMPARE
TANDEM_INLINE __m512i register_of(Ints<float> a) { return reinterpret_cast<__m512i>(a.v); }
TANDEM_INLINE __m512i register_of(Ints<double> a) { return reinterpret_cast<__m512i>(a.v); }
template <class Real>
TANDEM_INLINE Ints<Real> ints_of(__m512i a) {
    return reinterpret_cast<typename LaneTypes<Real>::UnsignedVector>(a);
}
#define TANDEM_COMPARE(symbol, predicate)                                          \
    TANDEM_INLINE Mask<float> operator symbol(Ints<float> a, Ints<float> b) {      \
        return {_mm512_cmp_epu32_mask(register_of(a), register_of(b), predicate)}; \
    }                                                                              \
    TANDEM_INLINE Mask<double> operator symbol(Ints<double> a, Ints<double> b) {   \
        return {_mm512_cmp_epu64_mask(register_of(a), register_of(b), predicate)}; \
    }
TANDEM_COMPARE(<, _MM_CMPINT_LT)
TANDEM_COMPARE(==, _MM_CMPINT_EQ)
TANDEM_COMPARE(!=, _MM_CMPINT_NE)
#undef TANDEM_COMPARE
TANDEM_INLINE Lanes<float> select(Mask<float> m, Lanes<float> a, Lanes<float> b) {
    return {_mm512_mask_blend_ps(m.bits, b.v, a.v)};
}
TANDEM_INLINE Lanes<double> select(Mask<double> m, Lanes<double> a, Lanes<double> b) {
    return {_mm512_mask_blend_pd(m.bits, b.v, a.v)};
}
TANDEM_INLINE Ints<float> select(Mask<float> m, Ints<float> a, Ints<float> b) {
    return ints_of<float>(_mm512_mask_blend_epi32(m.bits, register_of(b), register_of(a)));
}
TANDEM_INLINE Ints<double> select(Mask<double> m, Ints<double> a, Ints<double> b) {
    return ints_of<double>(_mm512_mask_blend_epi64(m.bits, register_of(b), register_of(a)));
}
TANDEM_INLINE Lanes<float> sqrt(Lanes<float> a) { return {_mm512_sqrt_ps(a.v)}; }
TANDEM_INLINE Lanes<double> sqrt(Lanes<double> a) { return {_mm512_sqrt_pd(a.v)}; }
TANDEM_INLINE Lanes<float> fma(Lanes<float> a, Lanes<float> b, Lanes<float> c) {
    return {_mm512_fmadd_ps(a.v, b.v, c.v)};
}
TANDEM_INLINE Lanes<double> fma(Lanes<double> a, Lanes<double> b, Lanes<double> c) {
    return {_mm512_fmadd_pd(a.v, b.v, c.v)};
}
#else
#define TANDEM_COMPARE(symbol)                                                                         \
    template <class Real>                                                                              \
    TANDEM_INLINE Mask<Real> operator symbol(Lanes<Real> a, Lanes<Real> b) {                           \
        return {a.v symbol b.v};                                                                       \
    }                                                                                                  \
    template <class Real>                                                                              \
    TANDEM_INLINE Mask<Real> operator symbol(Lanes<Real> a, std::type_identity_t<Real> b) {            \
        return {a.v symbol Lanes<Real>(b).v};                                                          \
    }                                                                                                  \
    template <class Real>                                                                              \
    TANDEM_INLINE Mask<Real> operator symbol(Ints<Real> a, Ints<Real> b) {                             \
        return {a.v symbol b.v};                                                                       \
    }                                                                                                  \
    template <class Real>                                                                              \
    TANDEM_INLINE Mask<Real> operator symbol(Ints<Real> a, std::type_identity_t<UnsignedOf<Real>> b) { \
        return {a.v symbol Ints<Real>(b).v};                                                           \
    }
TANDEM_COMPARE(<)
TANDEM_COMPARE(<=)
TANDEM_COMPARE(>)
TANDEM_COMPARE(>=)
TANDEM_COMPARE(==)
TANDEM_COMPARE(!=)
#undef TANDEM_COMPARE
template <class Real>
TANDEM_INLINE Lanes<Real> select(
    Mask<Real> m, std::type_identity_t<Lanes<Real>> a, std::type_identity_t<Lanes<Real>> b) {
    return {m.v ? a.v : b.v};
}
template <class Real>
TANDEM_INLINE Ints<Real> select(Mask<Real> m, Ints<Real> a, Ints<Real> b) {
    return {m.v ? a.v : b.v};
}
template <class Real>
TANDEM_INLINE Lanes<Real> sqrt(Lanes<Real> a) {
    for (int i = 0; i < lane_count<Real>; ++i) a.v[i] = std::sqrt(a.v[i]);
    return a;
}
template <class Real>
TANDEM_INLINE Lanes<Real> fma(Lanes<Real> a, std::type_identity_t<Lanes<Real>> b, std::type_identity_t<Lanes<Real>> c) {
    for (int i = 0; i < lane_count<Real>; ++i) a.v[i] = std::fma(a.v[i], b.v[i], c.v[i]);
    return a;
}
#endif

template <class Real>
requires std::is_floating_point_v<Real> TANDEM_INLINE Real select(bool choice, Real a, Real b) {
    return choice ? a : b;
}
TANDEM_INLINE std::uint32_t select(bool choice, std::uint32_t a, std::uint32_t b) { return choice ? a : b; }
TANDEM_INLINE std::uint64_t select(bool choice, std::uint64_t a, std::uint64_t b) { return choice ? a : b; }
TANDEM_INLINE float sqrt(float a) { return std::sqrt(a); }
TANDEM_INLINE double sqrt(double a) { return std::sqrt(a); }
TANDEM_INLINE float fma(float a, float b, float c) { return std::fma(a, b, c); }
TANDEM_INLINE double fma(double a, double b, double c) { return std::fma(a, b, c); }

// The second operand wins where either is NaN.
template <class V>
TANDEM_INLINE V least(V a, std::type_identity_t<V> b) {
    return select(a < b, a, b);
}
template <class V>
TANDEM_INLINE V greatest(V a, std::type_identity_t<V> b) {
    return select(a > b, a, b);
}
template <class V>
TANDEM_INLINE V absolute(V a) {
    return greatest(a, V(-a));
}

// An integer below 2^24 as a real number, exactly.
TANDEM_INLINE Lanes<float> to_real(Ints<float> a) {
    return {__builtin_convertvector(reinterpret_cast<LaneTypes<float>::SignedVector>(a.v), LaneTypes<float>::Vector)};
}
TANDEM_INLINE Lanes<double> to_real(Ints<double> a) {
    return {__builtin_convertvector(reinterpret_cast<LaneTypes<double>::SignedVector>(a.v), LaneTypes<double>::Vector)};
}

template <class Real>
TANDEM_INLINE Mask<Real> has_bit(Ints<Real> flags, UnsignedOf<Real> bit) {
    return (flags & Ints<Real>(bit)) != Ints<Real>(UnsignedOf<Real>{0});
}

// 0, 1, 2, …
template <class Real>
TANDEM_INLINE Ints<Real> lane_numbers() {
    typename LaneTypes<Real>::UnsignedVector v{};
    for (int i = 0; i < lane_count<Real>; ++i) v[i] = static_cast<UnsignedOf<Real>>(i);
    return v;
}

}  // namespace tandem::cpu
