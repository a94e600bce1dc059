// Encodes means that an earlier sub-pass or pass drew.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shown/shown.glsl"

layout(input_attachment_index = 0, set = 0, binding = 2) uniform subpassInput drawn;
layout(location = 0) out vec4 colour;

void main() { colour = shown(subpassLoad(drawn).rgb); }
