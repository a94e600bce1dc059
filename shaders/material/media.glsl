// Participating media (MODEL.md section 10): distances and transmittance, and the phase function.
#ifndef MEDIA_GLSL
#define MEDIA_GLSL
#include "geometry/geometry_types.glsl"

// How far a ray goes until the integral of the density along it is `depth`: `reached` if that was asked for and found.
struct Passage {
    float distance;
    float depth;
    bool reached;
};

const float no_depth = 3.0e38;  // is never reached

float density_at(Medium medium, ivec3 cell) {
    return tables[medium.densities + uint((cell.z * int(medium.cells_y) + cell.y) * int(medium.cells_x) + cell.x)];
}

// Where the ray is in the box of the grid, within [0, end].
vec2 span_in_box(Medium medium, Ray ray, float end) {
    vec2 span = vec2(0.0, end);
    for (uint axis = 0; axis < 3; ++axis) {
        const float o = ray.origin[axis], d = ray.direction[axis], low = medium.low[axis], high = medium.high[axis];
        if (abs(d) < 1.0e-37) {
            if (o < low || o > high) return vec2(0.0);
        } else {
            const float a = (low - o) / d, b = (high - o) / d;
            span = vec2(max(span.x, min(a, b)), min(span.y, max(a, b)));
        }
    }
    return span;
}

// From cell to cell; a cell's far rim on each axis comes from its index, so that errors do not pile up.
Passage walk_grid(Medium medium, Ray ray, float end, float wanted) {
    Passage way = Passage(0.0, 0.0, false);
    const vec2 span = span_in_box(medium, ray, end);
    if (!(span.x < span.y)) return way;
    const ivec3 cells = ivec3(medium.cells_x, medium.cells_y, medium.cells_z);
    const vec3 size = (medium.high - medium.low) / vec3(cells);
    const vec3 d = mix(ray.direction, vec3(1.0e-37), lessThan(abs(ray.direction), vec3(1.0e-37)));
    const ivec3 ahead = ivec3(greaterThan(d, vec3(0.0)));
    ivec3 cell = clamp(ivec3(floor((ray.origin + span.x * ray.direction - medium.low) / size)), ivec3(0), cells - 1);
    way.distance = span.x;
    for (int steps = cells.x + cells.y + cells.z + 3; steps > 0; --steps) {
        const vec3 rims = (medium.low + vec3(cell + ahead) * size - ray.origin) / d;
        const float rim = min(rims.x, min(rims.y, rims.z)), next = clamp(rim, way.distance, span.y);
        const float density = density_at(medium, cell), through = density * (next - way.distance);
        if (way.depth + through > wanted) {
            way.distance += (wanted - way.depth) / density;
            return Passage(min(way.distance, next), wanted, true);
        }
        way.depth += through;
        way.distance = next;
        if (next >= span.y) break;
        if (rims.x == rim)
            cell.x += 2 * ahead.x - 1;
        else if (rims.y == rim)
            cell.y += 2 * ahead.y - 1;
        else
            cell.z += 2 * ahead.z - 1;
        if (any(lessThan(cell, ivec3(0))) || any(greaterThanEqual(cell, cells))) break;
    }
    return way;
}

Passage walk(Medium medium, Ray ray, float end, float wanted) {
    if (has_density_grid && medium.densities != no_index) return walk_grid(medium, ray, end, wanted);
    return wanted < end && wanted < no_depth ? Passage(wanted, wanted, true) : Passage(end, end, false);
}

#include "arithmetic/shading_types.glsl"

vec3 transmittance_of(Medium medium, float depth) {
    return exp_minus(shaded(medium.absorption + medium.scattering) * depth);
}

vec3 transmittance(Medium medium, Ray ray, real end) {
    return transmittance_of(medium, shaded(walk(medium, ray, end, no_depth).depth));
}

// Takes the ray to its end, or to where the medium scatters it (true, at `distance`), and weighs it for that.
bool is_scattered(Medium medium, Ray ray, real end, vec2 m, inout vec3 throughput, out real distance) {
    distance = end;
    if (!has_medium_scattering || medium.scattering == vec3(0.0)) {
        throughput *= transmittance(medium, ray, end);
        return false;
    }
    const vec3 extinction = shaded(medium.absorption + medium.scattering);
    const float chosen = extinction[min(2, int(3.0 * m.x))];
    const Passage way = walk(medium, ray, end, chosen > 0.0 ? min(no_depth, minus_log(1.0 - m.y) / chosen) : no_depth);
    distance = way.distance;
    const vec3 through = transmittance_of(medium, shaded(way.depth));
    if (way.reached) {
        const vec3 scattering = shaded(medium.scattering);
        if (!PLANTED(free_path_unweighted)) throughput *= scattering * through / (dot(extinction * through, vec3(1.0)) / 3.0);
        return true;
    }
    throughput *= through / (dot(through, vec3(1.0)) / 3.0);
    return false;
}

// Henyey and Greenstein [1941]; mu: cosine between the old and the new direction.
float phase(float g, float mu) {
    if (!has_anisotropic_phase || g == 0.0) return 1.0 / (4.0 * pi);
    const float x = 1.0 + g * g - 2.0 * g * mu;
    return (1.0 - g * g) / (4.0 * pi * x * sqrt(x));
}

vec3 sample_phase(float g, vec3 d, vec2 u) {
    float mu = 1.0 - 2.0 * u.x;
    if (has_anisotropic_phase && g != 0.0) {
        const float s = (1.0 - g * g) / (1.0 - g + 2.0 * g * u.x);
        mu = clamp((1.0 + g * g - s * s) / (2.0 * g), -1.0, 1.0);
    }
    return frame_of(d) * vec3(sqrt(max(0.0, (1.0 - mu) * (1.0 + mu))) * cos_sin_turn(u.y), mu);
}

#endif
