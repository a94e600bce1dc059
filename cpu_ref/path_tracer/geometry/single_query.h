// One ray that Embree traces. Embree passes its context to the callbacks.
#pragma once

#include "cpu_ref/path_tracer/geometry/embree.h"
#include "cpu_ref/path_tracer/tables.h"

namespace tandem::cpu {

template <class Real>
class MeshHierarchies;

template <class Real>
struct SingleQuery {
    embree::Context context;
    const Tables<Real>* tables;
    const std::vector<std::uint32_t>* native;
    const std::vector<std::uint32_t>* user;
    Ray<Real> ray;
    std::uint32_t departed;
    bool inside;
    std::uint32_t light;
    Real time;
    bool own_test;  // of native triangles, in place of Embree's
    double lead;    // by which Embree's ray starts earlier; negative: later
    double slack;   // by which it goes on behind a hit, whose t is rounded
    Real t;
    std::uint32_t face, primitive;
    bool found;
    const MeshHierarchies<Real>* meshes;  // or null

    // Takes a hit in if it is nearer, or as near with a lower id.
    bool accept(std::uint32_t slot, Real at, std::uint32_t within) {
        if (found && (at > t || (at == t && id_of(*tables, slot) > id_of(*tables, primitive)))) return false;
        found = true;
        t = at;
        primitive = slot;
        face = tables->meshes && tables->meshes->holds(slot)
                   ? static_cast<std::uint32_t>(tables->first_placed_face) + (slot - tables->meshes->first_slot)
                   : tables->primitives[slot].first_face + within;
        return true;
    }
};

}  // namespace tandem::cpu
