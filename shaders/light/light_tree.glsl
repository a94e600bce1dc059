// The choice of a near light by the light tree, and its probability (MODEL.md section 9.2, rules 31 to 39). A node is nine
// numbers of `tables` (vulkan/renderer/scene/light_tree.h).
#ifndef LIGHT_TREE_GLSL
#define LIGHT_TREE_GLSL

layout(constant_id = id_light_tree_leaves) const uint light_tree_leaves = 0;  // the first lights; 0: there is no tree
layout(constant_id = id_light_tree_first) const uint light_tree_first = 0;    // where the nodes begin in tables
const bool has_light_tree = light_tree_leaves > 0;

// Cosine of what remains of an angle less another, by their cosines; of 0 where nothing does.
float cosine_of_rest(float angle, float other) {
    if (angle >= other) return 1.0;
    return angle * other + sqrt(max(0.0, (1.0 - angle * angle) * (1.0 - other * other)));
}

// Above 0 wherever the exact cosine is, whatever was rounded.
float lifted(float cosine) { return max(0.0, cosine + 1.0 / 64.0); }

// An importance is the first over the second. normal: of the receiver's lit side; zero: light from everywhere counts.
vec2 node_importance(uint node, vec3 point, vec3 normal) {
    const uint at = light_tree_first + 9 * node;
    const vec3 offset = vec3(tables[at], tables[at + 1], tables[at + 2]) - point;
    const float radius = tables[at + 3], strength = tables[at + 8];
    const float distance2 = dot(offset, offset), radius2 = radius * radius;
    if (distance2 <= radius2) return vec2(strength * lifted(1.0) * lifted(1.0), radius2);
    const vec3 direction = offset / sqrt(distance2), axis = vec3(tables[at + 4], tables[at + 5], tables[at + 6]);
    const float ball = sqrt(max(0.0, 1.0 - radius2 / distance2));
    const float sent = cosine_of_rest(cosine_of_rest(-dot(axis, direction), tables[at + 7]), ball);
    const float received = normal == vec3(0.0) ? 1.0 : cosine_of_rest(dot(normal, direction), ball);
    return vec2(strength * lifted(sent) * lifted(received), distance2);
}

// q of rule 37.
float first_child_chance(uint first, uint second, vec3 point, vec3 normal) {
    const vec2 a = node_importance(first, point, normal), b = node_importance(second, point, normal);
    const float of_first = a.x * b.y, of_second = b.x * a.y;
    if (of_first + of_second <= 0.0) return 0.5;
    const float q = of_first / (of_first + of_second), least_chance = 1.0 / 1024.0;
    return of_first > 0.0 && of_second > 0.0 ? clamp(q, least_chance, 1.0 - least_chance) : q;
}

struct TreeChoice {
    uint light;
    float chance;  // among near lights
};

float chance_of_child(float parent, float q, bool first) {
    return PLANT(light_tree_parents_forgotten, 1.0, parent) * (first ? q : 1.0 - q);
}

TreeChoice choose_in_tree(float v, vec3 point, vec3 normal) {
    uint node = 0, first_light = 0, count = light_tree_leaves;
    float chance = 1.0;
    while (count > 1) {
        const uint half_count = count / 2;
        const float q = first_child_chance(node + 1, node + 2 * half_count, point, normal);
        const bool to_first = v < q;
        const float rescaled = to_first ? v / q : (v - q) / (1.0 - q);
        v = PLANT(light_tree_number_reused, v, min(rescaled, 1.0 - 1.0 / 16777216.0));
        chance = chance_of_child(chance, q, to_first);
        node += to_first ? 1 : 2 * half_count;
        first_light += to_first ? 0 : half_count;
        count = to_first ? half_count : count - half_count;
    }
    return TreeChoice(first_light, chance);
}

float chance_in_tree(uint light, vec3 point, vec3 normal) {
    if (PLANTED(light_tree_normal_forgotten)) normal = vec3(0.0);
    uint node = 0, first_light = 0, count = light_tree_leaves;
    float chance = 1.0;
    while (count > 1) {
        const uint half_count = count / 2;
        const float q = first_child_chance(node + 1, node + 2 * half_count, point, normal);
        const bool to_first = light < first_light + half_count;
        chance = chance_of_child(chance, q, to_first);
        node += to_first ? 1 : 2 * half_count;
        first_light += to_first ? 0 : half_count;
        count = to_first ? half_count : count - half_count;
    }
    return chance;
}

#endif
