// Reads one block and writes another: two of these in a row without a barrier are the hazard that the layer must see.
#version 460
layout(local_size_x = 64) in;
layout(std430, set = 0, binding = 0) readonly buffer Input { uint from[]; };
layout(std430, set = 0, binding = 1) writeonly buffer Output { uint to[]; };
void main() {
    const uint i = gl_GlobalInvocationID.x;
    if (i < from.length()) to[i] = from[i];
}
