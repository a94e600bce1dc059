// Draws a frame into an attachment.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shown/shown.glsl"
#include "shown/means.glsl"

layout(location = 0) out vec4 colour;

void main() {
    const uvec2 at = uvec2(gl_FragCoord.xy);
    colour = shown(means_of(at.y * frame.width + at.x));
}
