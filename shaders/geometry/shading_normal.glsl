// Normals of meshes' vertices, interpolated (MODEL.md section 5.4).
#ifndef SHADING_NORMAL_GLSL
#define SHADING_NORMAL_GLSL

vec3 tabled_vector(uint at) { return vec3(tables[at], tables[at + 1], tables[at + 2]); }

// On the side of n_f, the surface's own normal on the side that d comes from; `weights` are those of corners 1 and 2.
vec3 shading_normal(uint slot, vec2 weights, vec3 n_f, vec3 d) {
    if (scene.shading_normals == no_index || kind_of(slot) != kind_triangle) return n_f;
    const uint at = scene.shading_normals + 9 * table_row(slot);
    vec3 sum = (1.0 - weights.x - weights.y) * tabled_vector(at) + weights.x * tabled_vector(at + 3) +
        weights.y * tabled_vector(at + 6);
    if (in_mesh(slot)) {  // whose normals are in object space
        const EntityTransform m = transforms[placed_at(slot).entity];
        sum = vec3(m.to_object0) * sum.x + vec3(m.to_object1) * sum.y + vec3(m.to_object2) * sum.z;
    }
    const float along = dot(sum, n_f);
    if (along == 0.0) return n_f;
    const vec3 normal = normalize(along < 0.0 ? -sum : sum);
    return dot(d, normal) < 0.0 ? normal : n_f;
}

// Whether a direction is above both normals or above neither.
bool is_on_one_side(vec3 direction, vec3 n_s, vec3 n_f) {
    return (dot(direction, n_s) > 0.0) == (dot(direction, n_f) > 0.0) || PLANTED(shading_guard_dropped);
}

#endif
