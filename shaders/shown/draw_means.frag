// Draws a frame's means into an attachment of floats.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shown/shown.glsl"
#include "shown/means.glsl"

layout(location = 0) out vec4 colour;

void main() {
    const uvec2 at = uvec2(gl_FragCoord.xy);
    colour = vec4(means_of(at.y * frame.width + at.x), 1.0);
}
