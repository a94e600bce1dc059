// All of a pixel's samples in one invocation, with the path and the sums in registers, for the kernels that do so: where a
// path ends, the next sample's begins in the same turn of the loop.
#ifndef PIXEL_SAMPLES_GLSL
#define PIXEL_SAMPLES_GLSL

#ifdef DOUBLE_SHADING
// The sum and that of squares, without rests; otherwise as film.glsl has it.
#undef Sums
#define Sums dvec2
dvec2 add_sample(dvec2 moments, double x) { return moments + dvec2(x, x * x); }
dvec3 summand(dvec3 radiance, out bool invalid) {
    summand(vec3(radiance), invalid);
    invalid = invalid || any(lessThan(radiance, dvec3(0.0)));
    if (invalid) return dvec3(0.0);
    return clamps ? min(radiance, dvec3(clamp_at)) : radiance;
}
#endif

layout(std430, set = 3, binding = 0) readonly restrict buffer SumsIn { Sums sums_in[]; };
layout(std430, set = 3, binding = 1) writeonly restrict buffer SumsOut { Sums sums_out[]; };
layout(std430, set = 3, binding = 2) restrict buffer Counters { uint invalid_samples, unfinished; };

const uint samples_per_block = 64;  // MODEL.md section 11

// The path of a pixel's sample that is `later` than the dispatch's first. Within its blocks the low word never overflows.
Path begin_path(uint pixel, uint later) {
    const uvec2 sample_index = uvec2(settings.sample_index.x + later, settings.sample_index.y);
    if (has_entity_motion || has_camera_motion) ray_time = path_time(pixel, sample_index);
    const Ray ray = first_ray(pixel, sample_index, ray_time);
    return Path(pixel, sample_index, 0, vec3(1.0), vec3(0.0), ray.origin, no_slot, ray.direction, 0.0, in_no_body,
        no_index);
}

// One segment and the vertex at its end; false: the path has ended.
bool advance(inout Path path) {
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

// The samples of the pixel at `place` of the tile.
void render_pixel(uint place) {
    Sums sums[3];
    const bool begins = settings.sample_index.x % samples_per_block == 0 && settings.keeps_sums == 0;
    for (uint channel = 0; channel < 3; ++channel)
        sums[channel] = begins ? Sums(0.0) : sums_in[channel * settings.pixel_count + place];
    uint done = 0, invalid_here = 0;
    const uint first = samples_per_block * block_at(place);
    Path path = begin_path(pixel_at(place), first);
    while (true) {
        if (done == settings.sample_count) {
            ++done;
            break;
        }
        if (advance(path)) continue;
        bool invalid;
        const shading_real3 radiance = summand(path.radiance, invalid);
        if (invalid) ++invalid_here;
        for (uint channel = 0; channel < 3; ++channel) sums[channel] = add_sample(sums[channel], radiance[channel]);
        path = begin_path(path.pixel, first + ++done);
    }
    // Mesa's lavapipe leaves all loops of an invocation after 65535 turns of them together; the host must hear of it. No
    // flag would do: compilers know that a loop is left by its break alone.
    if (done != settings.sample_count + 1) atomicAdd(unfinished, 1);
    if (invalid_here > 0) atomicAdd(invalid_samples, invalid_here);
    for (uint channel = 0; channel < 3; ++channel) sums_out[channel * settings.pixel_count + place] = sums[channel];
}

#endif
