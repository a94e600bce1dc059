// The bodies that a ray is in (MODEL.md section 9.4): up to four indices of tracked materials, sixteen bits each, the
// earliest first.
#ifndef INTERIORS_GLSL
#define INTERIORS_GLSL

const uint no_body = 0xffffu;
const uint most_bodies = 4;
const uvec2 in_no_body = uvec2(0xffffffffu);

uint body_at(uvec2 bodies, uint i) { return (i < 2 ? bodies.x : bodies.y) >> (16 * (i & 1u)) & no_body; }

uvec2 with_body(uvec2 bodies, uint i, uint body) {
    const uint shift = 16 * (i & 1u), kept = ~(no_body << shift);
    if (i < 2) return uvec2((bodies.x & kept) | body << shift, bodies.y);
    return uvec2(bodies.x, (bodies.y & kept) | body << shift);
}

// Of greatest priority, of equal ones the latest; no_body if there is none.
uint uppermost(uvec2 bodies) {
    uint best = no_body;
    int priority = 0;
    for (uint i = 0; i < most_bodies; ++i) {
        const uint body = body_at(bodies, i);
        if (body == no_body) break;
        const int own = materials[body].priority;
        if (best != no_body && own < priority) continue;
        best = body;
        priority = own;
    }
    return best;
}

// False: there is no room for a fifth.
bool append(inout uvec2 bodies, uint body) {
    for (uint i = 0; i < most_bodies; ++i)
        if (body_at(bodies, i) == no_body) {
            bodies = with_body(bodies, i, body);
            return true;
        }
    return false;
}

uvec2 without_latest(uvec2 bodies, uint body) {
    if (PLANTED(body_not_left)) return bodies;
    uint found = most_bodies;
    for (uint i = 0; i < most_bodies; ++i)
        if (body_at(bodies, i) == body) found = i;
    for (uint i = found; i < most_bodies; ++i)
        bodies = with_body(bodies, i, i + 1 < most_bodies ? body_at(bodies, i + 1) : no_body);
    return bodies;
}

// The medium of a ray in these bodies, or no_index.
uint medium_in(uvec2 bodies) {
    if (!has_interiors || body_at(bodies, 0) == no_body) return scene.medium;
    return materials[uppermost(bodies)].interior;
}

#endif
