// All of a pixel's samples in one invocation, with the path and the sums in registers. When a path ends, the path of the next
// sample begins in the same iteration of the loop. After a pixel's last sample comes the first sample of a pixel that no
// invocation has begun.
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
#include "kernels/counters.glsl"

const uint samples_per_block = 64;  // MODEL.md section 11

// Sums and position of the pixel that an invocation has begun.
Sums sums[3];
uvec2 position;  // in the image

const uint no_place = 0xffffffffu;  // in place of one in the tile: none is left

void begin_pixel(uint place) {
    if (place == no_place) return;
    position = pixel_position(pixel_at(place));
    const bool begins = settings.sample_index.x % samples_per_block == 0 && settings.keeps_sums == 0;
    for (uint channel = 0; channel < 3; ++channel)
        sums[channel] = begins ? Sums(0.0) : sums_in[channel * settings.pixel_count + place];
}

void add_radiance(shading_real3 radiance) {
    for (uint channel = 0; channel < 3; ++channel) sums[channel] = add_sample(sums[channel], radiance[channel]);
}

void end_pixel(uint place) {
    for (uint channel = 0; channel < 3; ++channel) sums_out[channel * settings.pixel_count + place] = sums[channel];
}

// A sample of the dispatch. Within its blocks the low word never overflows.
uvec2 sample_at(uint place, uint done) {
    return uvec2(settings.sample_index.x + samples_per_block * block_at(place) + done, settings.sample_index.y);
}

vec4 camera_numbers(uint place, uint done) {
    return random_block(settings.seed, pixel_at(place), sample_at(place, done), block_film_and_lens);
}

// u: its camera_numbers.
Path begin_path(uint place, uint done, vec4 u) {
    const uint pixel = pixel_at(place);
    const uvec2 sample_index = sample_at(place, done);
    if (has_entity_motion || has_camera_motion) ray_time = path_time(pixel, sample_index);
    const Ray ray = camera_ray(position, u, ray_time);
    return Path(pixel, sample_index, 0, vec3(1.0), vec3(0.0), ray.origin, no_slot, ray.direction, 0.0, in_no_body, no_index);
}

// One segment and the vertex at its end; false: the path has ended. If `ended_early`, next_numbers are those of the camera ray of
// the pixel's next sample. So threads that scatter and threads that begin a path compute their numbers together.
bool advance(uint place, uint done, inout Path path, out bool ended_early, out vec4 next_numbers) {
    path.pixel = pixel_at(place);
    path.sample_index = sample_at(place, done);
    const Hit hit = closest_hit(
        Ray(path.origin, path.direction), path.word & slot_mask, (path.word & ray_inside) != 0u);
    const Arrival at = arrival(path, hit, ray_time);
    ended_early = ends_at(path, hit, at);
    next_numbers = random_block(settings.seed, path.pixel, sample_at(place, ended_early ? done + 1 : done),
        ended_early ? block_film_and_lens : block_scatter(path.segment));
    const Departure leaving = leave(path, hit, at, next_numbers);
    if (has_shadow(leaving) && is_lit(leaving.origin, leaving.word, leaving.shadow))
        path.radiance += leaving.contribution;
    path.origin = leaving.origin;
    path.word = leaving.word;
    path.direction = leaving.direction;
    path.density = leaving.density;
    ++path.segment;
    return goes_on(leaving);
}

// The place in the tile of a pixel of the dispatch that nobody has begun. Each of `claimants` invocations is turned away
// once; the last of them leaves the count as it was found.
uint claim_place(uint claimants) {
    const uint before = atomicAdd(counters[begun], 1);
    if (before == settings.invocations + claimants - 1) atomicExchange(counters[begun], 0);
    return before < settings.invocations ? place_of(settings.first_invocation + before) : no_place;
}

// The samples of the pixel at `place` of the tile; then, of dispatches with claimants, of pixels that they claim.
void render_pixels(uint place, uint claimants) {
    uint done = 0, invalid_here = 0;
    begin_pixel(place);
    Path path = begin_path(place, done, camera_numbers(place, done));
    while (true) {
        if (place == no_place) break;
        bool at_hand, invalid;
        vec4 u;
        if (advance(place, done, path, at_hand, u)) continue;
        add_radiance(summand(path.radiance, invalid));
        if (invalid) ++invalid_here;
        if (++done == settings.sample_count) {
            end_pixel(place);
            done = 0;
            place = claimants == 0 ? no_place : claim_place(claimants);
            begin_pixel(place);
            at_hand = false;
        }
        if (!at_hand) u = camera_numbers(place, done);
        path = begin_path(place, done, u);
    }
    // Mesa's lavapipe leaves all loops of an invocation after 65535 turns of them together; the host must hear of it. No
    // flag would do: compilers know that a loop is left by its break alone.
    if (place != no_place) atomicAdd(counters[unfinished], 1);
    if (invalid_here > 0) atomicAdd(counters[invalid_samples], invalid_here);
}

#endif
