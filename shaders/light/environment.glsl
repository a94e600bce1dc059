// The image that surrounds a scene: its radiance, and directions in proportion to what each texel can give (MODEL.md
// sections 8.1 and 8.2).
#ifndef ENVIRONMENT_GLSL
#define ENVIRONMENT_GLSL

// As the image lies, before its rotation about +y.
vec3 to_environment(Environment image, vec3 d) {
    const float c = image.rotation.x, s = image.rotation.y;
    return vec3(c * d.x - s * d.z, d.y, s * d.x + c * d.z);
}

vec3 from_environment(Environment image, vec3 d) {
    const float c = image.rotation.x, s = image.rotation.y;
    return vec3(c * d.x + s * d.z, d.y, c * d.z - s * d.x);
}

vec2 environment_coordinates(vec3 d) {
    return vec2(0.5 + turn_of(-d.z, d.x), 2.0 * turn_of(length(d.xz), -d.y));
}

vec3 environment_radiance(Environment image, vec3 direction) {
    const vec2 uv = environment_coordinates(to_environment(image, direction));
    return table_image(image.texels, image.size, uv, true);
}

float environment_density(Environment image, vec3 direction) {
    const vec2 uv = environment_coordinates(to_environment(image, direction));
    const uvec2 cell = min(uvec2(vec2(uv.x, 1.0 - uv.y) * vec2(image.size)), image.size - 1);
    const float density = tables[image.density + cell.y * image.size.x + cell.x];
    return PLANT(sky_sine_missing, density * sin(pi * (float(cell.y) + 0.5) / float(image.size.y)), density);
}

vec3 sample_environment(Environment image, vec2 v) {
    const uint row = table_choice(image.rows, image.size.y, v.x);
    const uint columns = image.columns + row * image.size.x;
    const uint column = table_choice(columns, image.size.x, v.y);
    const vec2 part = vec2(table_place(columns, column, v.y), table_place(image.rows, row, v.x));
    // Cosines of the row's rims: half a turn is the whole of the polar angle.
    const float step = 0.5 / float(image.size.y);
    const float upper = cos_sin_turn(float(row) * step).x, lower = cos_sin_turn(float(row + 1) * step).x;
    const float y = mix(upper, lower, part.y);
    const vec2 azimuth = cos_sin_turn(fract((float(column) + part.x) / float(image.size.x) + 0.5));
    const float sine = sqrt(max(0.0, (1.0 - y) * (1.0 + y)));
    return from_environment(image, vec3(sine * azimuth.x, y, -sine * azimuth.y));
}

// The mix of two radiances, of sums `down` and `up` of their channels, as a density linear in y.
float gradient_density(float down, float up, float y) {
    return (down + (up - down) * (0.5 * (y + 1.0))) / (2.0 * pi * (down + up));
}

vec3 sample_gradient(float down, float up, vec2 v) {
    const float divisor = down + sqrt(down * down + v.x * (up * up - down * down));
    const float a = divisor > 0.0 ? v.x * (down + up) / divisor : 0.0;
    const float y = min(1.0, 2.0 * a - 1.0);
    return vec3(sqrt(max(0.0, (1.0 - y) * (1.0 + y))) * cos_sin_turn(v.y), y).xzy;
}

#endif
