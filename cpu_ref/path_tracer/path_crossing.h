// How the path tracer goes on through surfaces: where its rays start (MODEL.md section 5.2), and the bodies that they
// are then in (section 9.4). Included by path_tracer.h alone.
#pragma once

#include "cpu_ref/path_tracer/path_tracer.h"

namespace tandem::cpu {

template <class Real>
[[nodiscard]] bool has_lane(Mask<Real> mask, int lane) {
    return ((mask.to_bits() >> lane) & 1u) != 0;
}
// Calls visit(lane) for the lanes of a mask.
template <class Real, class Visit>
void for_each_lane(Mask<Real> mask, Visit visit) {
    for (unsigned left = mask.to_bits(); left != 0; left &= left - 1) visit(std::countr_zero(left));
}

// Section 5.2: what lies where the face lay that the ray has gone on through.
template <class Real, std::uint64_t effects, class Recorder, class Shade>
TANDEM_INLINE void PathTracer<Real, effects, Recorder, Shade>::find_place(
    Vertex& at, std::uint32_t first, const Hit<Real>& hit, V projection) {
    const V zero(Real(0)), density = load<Real>(&paths_.density[first]);
    const M before = hit.found & (density < zero);
    const V start = select(before, -density, zero);
    at.place = {M{}, M{}, hit.t - start, hit.face};
    if (none(before)) return;
    const V reach = V(Real(1.5)) * start + V(Real(2)) * at.surface.error_bound / absolute(projection);
    const M other = !(at.surface.primitive == load_ints<Real>(&paths_.primitive[first]));
    const M near = before & other & (hit.t <= reach);
    if (none(near)) return;
    const I left = select(near, load_ints<Real>(&paths_.crossed.face[first]), I(U{0}));
    const M parallel = absolute(dot(at.surface.normal, tables_.faces.normal[left])) > V(Real(1) - Real(1) / Real(512));
    const M from_front = has_bit(load_ints<Real>(&paths_.inside[first]), U{1});
    const M same_side = (at.front & from_front) | !(at.front | from_front);
    at.place.same_face = near & same_side & (at.surface.material == tables_.faces.material[left]);
    at.place.same_place = near & (parallel | at.place.same_face);
    if constexpr (general)  // what is opaque turns all back, and lights are sampled there
        undo_crossing(first, at.place.same_place & !has_bit(at.bits, U{material_bits::transmits}));
}

// How far before a face a ray that leaves it starts; 0 for a ray that starts beyond it (section 5.2). `side` is the
// cosine between its direction and the front normal.
template <class Real, std::uint64_t effects, class Recorder, class Shade>
TANDEM_INLINE Lanes<Real> PathTracer<Real, effects, Recorder, Shade>::start_before(
    const Vertex& at, std::uint32_t first, M alive, M crossed, V side) const {
    const V zero(Real(0));
    if (tables_.settings.intersection.guard != SelfIntersectionGuard::error_bound) return zero;
    const V error = at.surface.error_bound, whole = V(Real(4)) * error / absolute(side);
    const M through = crossed & !at.place.same_place & !has_bit(at.bits, U{material_bits::ranked});
    V start = select(through, least(whole, V(V(Real(0.5)) * at.place.way)), zero);
    const M back = at.place.same_place & alive & !crossed & has_bit(at.bits, U{material_bits::transmits});
    if (any(back))
        start = select(back, least(whole, V(V(Real(256)) * error)) - load<Real>(&paths_.density[first]), start);
    return select((error > zero) & (start > zero), start, zero);
}

template <class Real, std::uint64_t effects, class Recorder, class Shade>
InteriorList PathTracer<Real, effects, Recorder, Shade>::interior_list(std::uint32_t slot) const {
    InteriorList list;
    list.count = static_cast<std::uint32_t>(paths_.interiors.count[slot]);
    for (std::uint32_t i = 0; i < list.count; ++i)
        list.material[i] = static_cast<std::uint32_t>(paths_.interiors.material[i][slot]);
    return list;
}

// Section 9.4: a surface that is not there is a boundary; else the index on its outside.
template <class Real, std::uint64_t effects, class Recorder, class Shade>
void PathTracer<Real, effects, Recorder, Shade>::meet_interfaces(Vertex& at, std::uint32_t first, M lanes) const {
    for_each_lane(lanes, [&](int lane) {
        const auto slot = first + static_cast<std::uint32_t>(lane);
        const Interface found = interface_at(interior_list(slot), tables_.bodies,
            static_cast<std::uint32_t>(at.surface.material[lane]), has_lane(at.front, lane));
        at.more.outside_index.v[lane] = static_cast<Shade>(found.outside_index);
        if (!found.present)
            at.bits.v[lane] =
                material_bits::boundary | material_bits::tracked | (at.bits.v[lane] & U{material_bits::ranked});
    });
}

template <class Real, std::uint64_t effects, class Recorder, class Shade>
void PathTracer<Real, effects, Recorder, Shade>::store_interiors(std::uint32_t slot, const InteriorList& list) {
    paths_.interiors.count[slot] = list.count;
    for (std::uint32_t i = 0; i < list.count; ++i) paths_.interiors.material[i][slot] = list.material[i];
    const std::uint32_t uppermost = list.uppermost(tables_.bodies);
    paths_.interiors.medium[slot] = uppermost == no_index ? tables_.medium : tables_.bodies[uppermost].medium;
}

// The list after paths went through surfaces, and the medium that they are in now.
template <class Real, std::uint64_t effects, class Recorder, class Shade>
void PathTracer<Real, effects, Recorder, Shade>::change_interiors(
    Vertex& at, std::uint32_t first, M crossed, M& alive) {
    for_each_lane(crossed, [&](int lane) {
        const auto slot = first + static_cast<std::uint32_t>(lane);
        const auto material = static_cast<std::uint32_t>(at.surface.material[lane]);
        InteriorList list = interior_list(slot);
        const bool entered = has_lane(at.front, lane);
        if (entered)
            list.remove_left_unseen(material, tables_.bodies[material].count);
        else
            list.remove(material);
        if (entered && !list.append(material)) {  // the sample is invalid
            at.radiance.x.v[lane] = std::numeric_limits<Shade>::quiet_NaN();
            alive = alive & !M::from_bits(1u << lane);
            return;
        }
        store_interiors(slot, list);
    });
}

// Undoes the crossing of paths that turn back after they went on through another surface (section 9.4): the list
// becomes what it was before.
template <class Real, std::uint64_t effects, class Recorder, class Shade>
void PathTracer<Real, effects, Recorder, Shade>::undo_crossing(std::uint32_t first, M lanes) {
    for_each_lane(lanes, [&](int lane) {
        const auto slot = first + static_cast<std::uint32_t>(lane);
        const auto material = static_cast<std::uint32_t>(
            tables_.faces.material.at(static_cast<std::uint32_t>(paths_.crossed.face[slot])));
        if (!tables_.bodies[material].tracked) return;
        InteriorList list = interior_list(slot);
        if (paths_.inside[slot] != 0)
            list.remove(material);
        else
            static_cast<void>(list.append(material));  // there is room: it was taken out
        store_interiors(slot, list);
    });
}

}  // namespace tandem::cpu
