// The time of a path, from the shutter's opening to its closing (MODEL.md section 4). It is computed again wherever it is needed,
// and not stored with the path.
#ifndef TIME_GLSL
#define TIME_GLSL

float path_time(uint pixel, uvec2 sample_index) {
    if (PLANTED(time_dimension_shared)) return random_block(settings.seed, pixel, sample_index, block_film_and_lens).w;
    return random_block(settings.seed, pixel, sample_index, block_time).x;
}

#endif
