// A triangle of the device's own that is the closest hit: the weights of its corners are the device's.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_ray_tracing : require
#include "geometry/traced_ray.glsl"

hitAttributeEXT vec2 weights;
layout(location = 0) rayPayloadInEXT TracedRay traced;

void main() { traced.hit = Hit(gl_HitTEXT, gl_PrimitiveID, 0, vec3(weights, 1.0)); }
