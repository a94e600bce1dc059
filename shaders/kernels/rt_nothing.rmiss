// Where a ray meets nothing: the payload says so already.
#version 460
#extension GL_EXT_ray_tracing : require

void main() {}
