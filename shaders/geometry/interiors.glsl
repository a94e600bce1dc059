// The bodies that a ray is inside (MODEL.md section 9.4): up to eight indices of tracked materials of sixteen bits each, in order
// of entry.
#ifndef INTERIORS_GLSL
#define INTERIORS_GLSL

const uint no_body = 0xffffu;
const uint most_bodies = 8;
const uvec4 in_no_body = uvec4(0xffffffffu);

uint body_at(uvec4 bodies, uint i) { return bodies[i >> 1] >> (16 * (i & 1u)) & no_body; }

uvec4 with_body(uvec4 bodies, uint i, uint body) {
    const uint shift = 16 * (i & 1u), kept = ~(no_body << shift);
    bodies[i >> 1] = (bodies[i >> 1] & kept) | body << shift;
    return bodies;
}

// The body of greatest priority, of equal ones the latest; no_body if there is none.
uint uppermost(uvec4 bodies) {
    uint best = no_body;
    int priority = 0;
    for (uint i = 0; i < most_bodies; ++i) {
        const uint body = body_at(bodies, i);
        if (body == no_body) break;
        const int own = material_at(body).priority;
        if (best != no_body && own < priority) continue;
        best = body;
        priority = own;
    }
    return best;
}

// False: there is no room for a ninth.
bool append(inout uvec4 bodies, uint body) {
    for (uint i = 0; i < most_bodies; ++i)
        if (body_at(bodies, i) == no_body) {
            bodies = with_body(bodies, i, body);
            return true;
        }
    return false;
}

// Without the entry at `place`, if there is one.
uvec4 without_entry(uvec4 bodies, uint place) {
    for (uint i = place; i < most_bodies; ++i)
        bodies = with_body(bodies, i, i + 1 < most_bodies ? body_at(bodies, i + 1) : no_body);
    return bodies;
}

uvec4 without_latest(uvec4 bodies, uint body) {
    if (PLANTED(body_not_left)) return bodies;
    uint latest = most_bodies;
    for (uint i = 0; i < most_bodies; ++i)
        if (body_at(bodies, i) == body) latest = i;
    return without_entry(bodies, latest);
}

// A ray that meets the front of `body` is outside of it: without the earliest, if as many are in the list as there are.
uvec4 without_left_unseen(uvec4 bodies, uint body) {
    uint earliest = most_bodies, count = 0;
    for (uint i = most_bodies; i > 0; --i)
        if (body_at(bodies, i - 1) == body) {
            earliest = i - 1;
            ++count;
        }
    return count >= material_at(body).bodies ? without_entry(bodies, earliest) : bodies;
}

// Those on the far side of the surface of `body`, but for itself.
uvec4 beside(uvec4 bodies, uint body, bool front) {
    return front ? without_left_unseen(bodies, body) : without_latest(bodies, body);
}

// The medium of a ray in these bodies, or no_index.
uint medium_in(uvec4 bodies) {
    if (!has_interiors || body_at(bodies, 0) == no_body) return scene.medium;
    return material_at(uppermost(bodies)).interior;
}

#endif
