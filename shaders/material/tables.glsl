// Reads from `tables`, one array of floats for all large tables: texels, distributions, texture coordinates, densities. The
// structs that use a table hold the place where it begins. The stage (or a test) declares the array.
#ifndef TABLES_GLSL
#define TABLES_GLSL

vec3 table_rgb(uint at) { return vec3(tables[at], tables[at + 1], tables[at + 2]); }

// The least index below `count` whose cumulative share, from tables[first] on, exceeds v; the last if there is none.
uint table_choice(uint first, uint count, float v) {
    uint low = 0, high = count - 1;
    while (low < high) {
        const uint middle = (low + high) / 2;
        if (v < tables[first + middle])
            high = middle;
        else
            low = middle + 1;
    }
    return low;
}

// Where v lies within the share of that index, in [0, 1].
float table_place(uint first, uint index, float v) {
    const float before = index == 0 ? 0.0 : tables[first + index - 1], share = tables[first + index] - before;
    return share > 0.0 ? clamp((v - before) / share, 0.0, 1.0) : 0.0;
}

// Bilinear between the texels of an image (MODEL.md section 7.0): columns repeat, rows repeat or are held at the rims.
vec3 table_image(uint first, uvec2 size, vec2 uv, bool holds_rows) {
    const vec2 turned = uv - floor(uv), place = holds_rows ? vec2(turned.x, uv.y) : turned;
    const bool nearest = PLANT(sky_nearest, holds_rows, false) || PLANT(texture_nearest, !holds_rows, false);
    const float half_texel = PLANT(texture_half_texel, holds_rows ? 0.5 : 0.0, nearest ? 0.0 : 0.5);
    const vec2 at = vec2(place.x, 1.0 - place.y) * vec2(size) - half_texel, corner = floor(at);
    const vec2 within = at - corner;
    const vec2 part = nearest ? vec2(0.0) : PLANT(texture_weights_short, floor(within * 256.0 + 0.5) / 256.0, within);
    const ivec2 n = ivec2(size), near = ivec2(corner);
    const ivec2 columns = ivec2(near.x + n.x, near.x + 1 + n.x) % n.x;
    const ivec2 rows = holds_rows ? clamp(ivec2(near.y, near.y + 1), 0, n.y - 1) : ivec2(near.y + n.y, near.y + 1 + n.y) % n.y;
    const vec3 a = table_rgb(first + 3 * uint(rows.x * n.x + columns.x));
    const vec3 b = table_rgb(first + 3 * uint(rows.x * n.x + columns.y));
    const vec3 c = table_rgb(first + 3 * uint(rows.y * n.x + columns.x));
    const vec3 d = table_rgb(first + 3 * uint(rows.y * n.x + columns.y));
    return mix(mix(a, b, part.x), mix(c, d, part.x), part.y);
}

#endif
