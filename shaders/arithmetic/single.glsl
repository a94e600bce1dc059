// From here on float means float again (double.glsl).
#undef IN_DOUBLE
#undef float
#undef vec2
#undef vec3
#undef vec4
#undef mat3
