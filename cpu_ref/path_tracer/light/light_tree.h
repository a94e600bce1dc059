// The choice of a near light by the light tree, and its probability (MODEL.md section 9.2, rules 31 to 39). Each lane
// is a path.
#pragma once

#include "cpu_ref/path_tracer/arithmetic/vec3.h"
#include "cpu_ref/path_tracer/tables.h"

namespace tandem::cpu {

// Whom the lights are chosen for.
template <class Real>
struct TreeReceiver {
    Vec3<Lanes<Real>> point, normal;  // normal: unit, of the lit side
    Mask<Real> in_medium;             // whatever `normal` is, light from everywhere counts
};

// Cosine of the difference of two angles by their cosines, 1 where the first angle is the smaller.
template <class V>
TANDEM_INLINE V cosine_beyond(V angle, V less) {
    const V one(RealOf<V>(1)), zero(RealOf<V>(0));
    const V sines = greatest(V((one - angle * angle) * (one - less * less)), zero);
    return select(angle >= less, one, V(angle * less + sqrt(sines)));
}

// Importance of a node as a fraction: strength and cosines over the square of the distance.
template <class Real>
struct NodeImportance {
    Lanes<Real> share, square;
};

template <class Real>
TANDEM_INLINE NodeImportance<Real> importance(
    const LightTree<Real>& tree, const TreeReceiver<Real>& from, Ints<Real> node) {
    using V = Lanes<Real>;
    const V zero(Real(0)), one(Real(1)), slack(static_cast<Real>(light_tree_slack));
    const Vec3<V> to_centre = tree.centre[node] - from.point;
    const V radius = tree.radius[node], ball = radius * radius, square = dot(to_centre, to_centre);
    const Mask<Real> outside = square > ball;
    const V distance = sqrt(square);
    const V ball_cosine = sqrt(greatest(V(one - ball / square), zero));
    const V leaving = -dot(tree.axis[node], to_centre) / distance;
    const V light = cosine_beyond(cosine_beyond(leaving, tree.cone_cosine[node]), ball_cosine);
    const V arriving = cosine_beyond(V(dot(from.normal, to_centre) / distance), ball_cosine);
    const V sent = greatest(V(select(outside, light, one) + slack), zero);
    const V received = greatest(V(select(outside & !from.in_medium, arriving, one) + slack), zero);
    return {tree.strength[node] * sent * received, select(outside, square, ball)};
}

template <class Real>
struct TreeChoice {
    Ints<Real> light;
    Lanes<Real> chance;  // among near lights
};

// Down the tree by the number v, or to the light that is `given`.
template <bool given, class Real>
TANDEM_INLINE TreeChoice<Real> descend(
    const LightTree<Real>& tree, const TreeReceiver<Real>& from, Mask<Real> lanes, Lanes<Real> v, Ints<Real> light) {
    using V = Lanes<Real>;
    using U = UnsignedOf<Real>;
    using I = Ints<Real>;
    const V zero(Real(0)), one(Real(1)), least_chance(static_cast<Real>(light_tree_least_chance));
    const V last_number(static_cast<Real>(1.0 - 0x1p-24));
    const I two(U{2}), none_yet(U{0});
    I node = none_yet, begin = none_yet, count(static_cast<U>(tree.count));
    V chance = one;
    for (;;) {
        const Mask<Real> inner = lanes & !(count < two);
        if (none(inner)) return {begin, chance};
        const I half = count >> 1;
        const I first = select(inner, node + I(U{1}), none_yet), second = select(inner, node + half + half, none_yet);
        const NodeImportance<Real> one_side = importance(tree, from, first), other = importance(tree, from, second);
        const V a = one_side.share * other.square, b = other.share * one_side.square, sum = a + b;
        V q = select(sum > zero, a / sum, V(Real(0.5)));
        q = select((a > zero) & (b > zero), greatest(least(q, V(one - least_chance)), least_chance), q);
        const Mask<Real> to_first = given ? light < begin + half : v < q;
        const V before = planted(PlantedBug::light_tree_parents_forgotten) ? one : chance;
        chance = select(inner, before * select(to_first, q, one - q), chance);
        if (!given && !planted(PlantedBug::light_tree_number_reused))
            v = least(select(to_first, v / q, (v - q) / (one - q)), last_number);
        node = select(inner, select(to_first, first, second), node);
        begin = select(inner & !to_first, begin + half, begin);
        count = select(inner, select(to_first, half, count - half), count);
    }
}

template <class Real>
[[gnu::noinline]] TreeChoice<Real> choose_by_tree(
    const LightTree<Real>& tree, const TreeReceiver<Real>& from, Mask<Real> lanes, Lanes<Real> v) {
    return descend<false>(tree, from, lanes, v, Ints<Real>(UnsignedOf<Real>{0}));
}

template <class Real>
[[gnu::noinline]] Lanes<Real> chance_by_tree(
    const LightTree<Real>& tree, const TreeReceiver<Real>& from, Mask<Real> lanes, Ints<Real> light) {
    TreeReceiver<Real> receiver = from;
    if (planted(PlantedBug::light_tree_normal_forgotten)) receiver.in_medium = lanes;
    return descend<true>(tree, receiver, lanes, Lanes<Real>(Real(0)), light).chance;
}

}  // namespace tandem::cpu
