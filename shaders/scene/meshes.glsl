// Meshes that several entities place (common/render/instancing.h). Their triangles have slots after those of all other
// primitives, place after place, and are made where they are asked for. A place has a source and a Placed at first_mesh_slot +
// its number. The sources of the meshes' triangles, in object space, follow those of places.
#ifndef MESHES_GLSL
#define MESHES_GLSL

#include "made/constant_ids.glsl"
#ifdef DOUBLE_GEOMETRY  // has none
const bool mesh_tree = false;
bool in_mesh(uint slot) { return false; }
uint table_row(uint slot) { return slot; }
#else
#include "geometry/placing.glsl"

layout(constant_id = id_mesh_tree) const bool mesh_tree = false;  // there are any
layout(constant_id = id_mesh_root) const uint mesh_root = 0;      // of the tree over places
layout(constant_id = id_first_mesh_slot) const uint first_mesh_slot = 0;
layout(constant_id = id_place_count) const uint place_count = 0;

bool in_mesh(uint slot) { return mesh_tree && slot >= first_mesh_slot; }

// kind: the root of the mesh's tree. index0: the source of its first triangle. index1: the slot of that triangle at this place.
// radius: the greatest sum of terms in a coordinate of a corner in the world.
PrimitiveSource place_source(uint place) { return sources[first_mesh_slot + place]; }

// The place of a slot: the last that begins no later.
uint place_holding(uint slot) {
    uint low = 0, high = place_count - 1;
    while (low < high) {
        const uint middle = (low + high + 1) / 2;
        if (place_source(middle).index1 <= slot)
            low = middle;
        else
            high = middle - 1;
    }
    return low;
}

Triangle mesh_triangle(EntityTransform m, uint source) {
    const PrimitiveSource corners = sources[source];
    return placed_triangle(
        m, vertices[corners.index0].xyz, vertices[corners.index1].xyz, vertices[corners.index2].xyz);
}
Triangle mesh_triangle(uint slot) {
    const PrimitiveSource place = place_source(place_holding(slot));
    return mesh_triangle(transforms[place.entity], place.index0 + (slot - place.index1));
}

Placed placed_in_mesh(uint slot) {
    const uint place = place_holding(slot);
    Placed result = placed[first_mesh_slot + place];
    result.id += slot - place_source(place).index1;
    return result;
}

// The row of a triangle in tables of what triangles have in object space: the meshes' come after all others.
uint table_row(uint slot) {
    if (!in_mesh(slot)) return slot;
    const PrimitiveSource place = place_source(place_holding(slot));
    return place.index0 + (slot - place.index1) - first_mesh_slot - place_count + triangle_total();
}
#endif

#endif
