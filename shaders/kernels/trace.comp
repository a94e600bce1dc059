// Follows paths for `tandem trace` and feature images: an invocation a sample, each vertex written down. A pixel's samples
// follow each other. The arithmetic is that of the kernels that render. A path's record takes the place of sums: a head and
// fourteen words of four a vertex.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#define RECORDS_PATHS
#include "kernels/settings.glsl"
#include "kernels/noted.glsl"
#define LOOPS_OVER_PRIMITIVES
#include "scene/scene_set.glsl"
#include "arithmetic/random.glsl"
#include "geometry/time.glsl"
#include "geometry/geometry_types.glsl"
#include "arithmetic/sampling.glsl"
#include "geometry/shapes.glsl"
#include "geometry/camera.glsl"
#include "geometry/closest_hit.glsl"
#include "geometry/occlusion.glsl"
#include "geometry/surface.glsl"
#include "arithmetic/shading_types.glsl"
#if defined(DOUBLE_GEOMETRY) && !defined(DOUBLE_SHADING)
#include "arithmetic/sampling.glsl"
#endif
#include "arithmetic/elementary.glsl"
#include "material/tables.glsl"
#include "material/noise.glsl"
#include "material/textures.glsl"
#include "material/materials.glsl"
#include "light/environment.glsl"
#include "light/background.glsl"
#include "material/media.glsl"
#include "geometry/interiors.glsl"
#include "light/lights.glsl"
#include "kernels/vertex_events.glsl"

#include "arithmetic/single.glsl"
layout(std430, set = 3, binding = 1) writeonly restrict buffer Records { uvec4 records[]; };

// PathEnd of common/render/path_trace.h. `absorbed` also stands for what roulette chose to end: the host asks again without it.
const uint end_none = 0, end_left_scene = 1, end_emitter = 2, end_bounces = 3, end_absorbed = 5, end_direct_light = 6,
           end_invalid = 7;

uint end_of(Path path, Hit hit, Arrival at) {
    if (at.missed && !at.in_medium) return end_left_scene;
    bool receives = at.in_medium;
    if (!at.in_medium) {
        const Material material = material_at(placed_at(hit.slot).material);
        if (material.kind == material_emissive && !has_flag(material, flag_translucent)) return end_emitter;
        receives = receives_light(material);
    }
    if (path.segment == settings.bounces) return end_bounces;
    if (ends_here() && receives) return end_direct_light;
    return isnan(as_float(path.radiance).x) ? end_invalid : end_absorbed;
}

uvec4 word(vec3 v, uint w) { return uvec4(floatBitsToUint(v), w); }
uvec4 word(vec3 v, float w) { return word(v, floatBitsToUint(w)); }

// One segment and the vertex at its end; false: the path has ended. `at`: where its record begins.
bool advance(inout Path path, uint at_record) {
    const real3 origin = path.origin, direction = path.direction;
    const Hit hit = closest_hit(Ray(origin, direction), path.word & slot_mask, (path.word & ray_inside) != 0u);
    const Arrival at = arrival(path, hit, ray_time);
    const vec3 throughput = as_float(path.throughput);
    const bool on_surface = !at.missed && !at.in_medium;
    real3 position = real3(0.0), normal = real3(0.0);
    if (on_surface) position = at.surface.point;
    if (on_surface) normal = at.surface.normal;
    if (at.in_medium) position = medium_point(path, at);
    noted = Noted(vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), 0.0, 0.0, 0.0, 0.0);
    const Departure leaving = leave(path, hit, at, vec4(0.0));
    vec3 brought = vec3(0.0), towards_light = vec3(0.0);
    if (has_shadow(leaving)) towards_light = as_float(normalize(leaving.shadow.offset));
    if (has_shadow(leaving) && is_lit(leaving.origin, leaving.word, leaving.shadow)) {
        brought = as_float(leaving.contribution);
        path.radiance += leaving.contribution;
    }
    const uint end = goes_on(leaving) ? end_none : end_of(path, hit, at);
    records[at_record] = word(as_float(origin), as_float(at.in_medium ? at.distance : hit.t));
    records[at_record + 1] = word(as_float(direction), on_surface ? placed_at(hit.slot).id : no_index);
    records[at_record + 2] = word(as_float(position), on_surface ? placed_at(hit.slot).material : no_index);
    records[at_record + 3] = word(as_float(normal), end);
    records[at_record + 4] = word(throughput, at.in_medium ? 1u : 0u);
    records[at_record + 5] = word(as_float(path.radiance), as_float(max(leaving.density, 0.0)));
    records[at_record + 6] = word(as_float(leaving.direction), noted.found_weight);
    records[at_record + 7] = word(as_float(path.throughput), noted.survival);
    records[at_record + 8] = word(towards_light, noted.light_pdf);
    records[at_record + 9] = word(brought, noted.light_weight);
    records[at_record + 10] = word(noted.shading_normal, 0u);
    records[at_record + 11] = word(noted.light_radiance, 0u);
    records[at_record + 12] = word(noted.light_response, 0u);
    records[at_record + 13] = word(noted.light_transmittance, 0u);
    path.origin = leaving.origin;
    path.word = leaving.word;
    path.direction = leaving.direction;
    path.density = leaving.density;
    ++path.segment;
    return goes_on(leaving);
}

const uint words_per_vertex = 14;

void main() {
    preload_primitives();
    const uint i = gl_GlobalInvocationID.x;
    if (i >= settings.pixel_count * settings.sample_count) return;
    const uint pixel = settings.first_pixel + i / settings.sample_count;
    const uvec2 sample_index = uvec2(settings.sample_index.x + i % settings.sample_count, settings.sample_index.y);
    if (has_entity_motion || has_camera_motion) ray_time = path_time(pixel, sample_index);
    const Ray ray = camera_ray(
        pixel_position(pixel), camera_numbers(pixel, sample_index), has_camera_motion ? ray_time : 0.0);
    Path path = Path(pixel, sample_index, 0, vec3(1.0), vec3(0.0), ray.origin, no_slot, ray.direction, 0.0, in_no_body,
        no_index);
    const uint last = settings.segment;  // that is followed
    const uint head = i * (1 + words_per_vertex * (last + 1));
    while (advance(path, head + 1 + words_per_vertex * path.segment) && path.segment <= last) {}
    records[head] = word(as_float(path.radiance), path.segment);
}
