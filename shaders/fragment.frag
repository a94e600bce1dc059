// Whole paths in fragments of a render pass without attachments: the rasteriser chooses which pixels are neighbours in a
// subgroup. What a fragment computes is what an invocation of the megakernel computes; sums go to the same buffers.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#define NOT_COMPUTE
#include "settings.glsl"
#define LOOPS_OVER_PRIMITIVES
#include "scene_set.glsl"
#include "random.glsl"
#include "time.glsl"
#include "sampling.glsl"
#include "shapes.glsl"
#include "camera.glsl"
#include "closest_hit.glsl"
#include "occlusion.glsl"
#include "surface.glsl"
#include "elementary.glsl"
#include "tables.glsl"
#include "noise.glsl"
#include "textures.glsl"
#include "materials.glsl"
#include "environment.glsl"
#include "background.glsl"
#include "media.glsl"
#include "interiors.glsl"
#include "lights.glsl"
#include "vertex_events.glsl"
#include "film.glsl"

layout(std430, set = 3, binding = 0) readonly restrict buffer SumsIn { vec4 sums_in[]; };
layout(std430, set = 3, binding = 1) writeonly restrict buffer SumsOut { vec4 sums_out[]; };
layout(std430, set = 3, binding = 2) restrict buffer Counters { uint invalid_samples, unfinished; };

const uint samples_per_block = 64;  // MODEL.md section 11

Path camera_path(uint pixel, uint later) {
    const uvec2 sample_index = uvec2(settings.sample_index.x + later, settings.sample_index.y);
    if (has_entity_motion || has_camera_motion) ray_time = path_time(pixel, sample_index);
    const Ray ray = first_ray(pixel, sample_index, ray_time);
    return Path(pixel, sample_index, 0, vec3(1.0), vec3(0.0), ray.origin, no_slot, ray.direction, 0.0, in_no_body,
        no_index);
}

// To the next vertex; whether the path goes on from there.
bool follow(inout Path path) {
    const Hit hit = closest_hit(
        Ray(path.origin, path.direction), path.word & slot_mask, (path.word & ray_inside) != 0u);
    const Departure leaving = arrive(path, hit, ray_time);
    if (has_shadow(leaving) && is_lit(leaving.origin, leaving.word, leaving.shadow))
        path.radiance += leaving.contribution;
    path.origin = leaving.origin;
    path.word = leaving.word;
    path.direction = leaving.direction;
    path.density = leaving.density;
    ++path.segment;
    return goes_on(leaving);
}

void main() {
    preload_primitives();
    const uvec2 at = uvec2(gl_FragCoord.xy);
    const uint place = at.y * settings.width + at.x - settings.first_pixel;
    // A share of the tile; a place before it or before the tile is beyond it too, since the difference wraps.
    if (place - settings.first_invocation >= settings.invocations || gl_HelperInvocation) return;
    vec4 sums[3];
    for (uint channel = 0; channel < 3; ++channel)
        sums[channel] = settings.sample_index.x % samples_per_block == 0
            ? vec4(0.0) : sums_in[channel * settings.pixel_count + place];
    uint done = 0, invalid_here = 0;
    Path path = camera_path(settings.first_pixel + place, done);
    while (true) {  // one loop over segments and samples: drivers that leave loops early leave this one (megakernel.comp)
        if (done == settings.sample_count) {
            ++done;
            break;
        }
        if (follow(path)) continue;
        bool invalid;
        const vec3 radiance = summand(path.radiance, invalid);
        if (invalid) ++invalid_here;
        for (uint channel = 0; channel < 3; ++channel) sums[channel] = add_sample(sums[channel], radiance[channel]);
        path = camera_path(path.pixel, ++done);
    }
    if (done != settings.sample_count + 1) atomicAdd(unfinished, 1);
    if (invalid_here > 0) atomicAdd(invalid_samples, invalid_here);
    for (uint channel = 0; channel < 3; ++channel) sums_out[channel * settings.pixel_count + place] = sums[channel];
}
