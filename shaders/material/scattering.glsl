// What the materials have in common: what an event does to a path, and how a vertex answers to light (MODEL.md section 7).
#ifndef SCATTERING_GLSL
#define SCATTERING_GLSL
#include "kernels/planted.glsl"

bool has_flag(Material material, uint flag) { return (material.flags & flag) != 0u; }

// 7.1
vec3 absorbed(Material material, vec3 throughput) {
    if (has_translucent && has_flag(material, flag_translucent))
        return throughput * (1.0 - material.alpha * (1.0 - material.colour));
    return throughput * material.colour;
}

// What an event does to a path. The next direction is unit, or zero where the path ends. The weight is the factor on
// its throughput besides 7.1. The density is that of the direction, 0 where there is none.
struct Scattering {
    vec3 direction;
    vec3 weight;
    float density;
};
const Scattering no_scattering = Scattering(vec3(0.0), vec3(1.0), 0.0);

// How a vertex answers to light from a direction. colour times f_cosine is f |cos theta| (a phase function for a
// medium). density is that of scattering into the direction.
struct Response {
    vec3 colour;
    float f_cosine;
    float density;
};

#endif
