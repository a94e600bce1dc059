// Walks of rays through a grid of densities. Words 0 … 9 of the input: low and high corner, cells on each axis. Then 64
// densities at most. From word 80 on, eight a ray: origin, direction, end, wanted. Four words out.
#version 460
#extension GL_GOOGLE_include_directive : require
layout(local_size_x = 64) in;
layout(std430, set = 0, binding = 0) readonly buffer Input { float tables[]; };
layout(std430, set = 0, binding = 1) writeonly buffer Output { vec4 results[]; };
#include "kernels/effects.glsl"
#include "kernels/planted.glsl"
const float pi = 3.14159265358979;
#include "scene/scene_structs.glsl"
#include "arithmetic/sampling.glsl"
#include "geometry/shapes.glsl"
#include "arithmetic/elementary.glsl"
#include "material/tables.glsl"
#include "material/media.glsl"

vec3 three(uint at) { return vec3(tables[at], tables[at + 1], tables[at + 2]); }

void main() {
    const uint i = gl_GlobalInvocationID.x;
    const uint at = 80 + 8 * i;
    if (at + 7 >= tables.length()) return;
    Medium medium;
    medium.low = three(0);
    medium.high = three(3);
    medium.cells_x = uint(tables[6]);
    medium.cells_y = uint(tables[7]);
    medium.cells_z = uint(tables[8]);
    medium.densities = 16;
    const Ray ray = Ray(three(at), three(at + 3));
    const Passage way = walk(medium, ray, tables[at + 6], tables[at + 7]);
    results[i] = vec4(way.distance, way.depth, way.reached ? 1.0 : 0.0, 0.0);
}
