// The background, which rays that leave the scene meet, and its light sampling (MODEL.md sections 8.1 and 8.2).
#ifndef BACKGROUND_GLSL
#define BACKGROUND_GLSL

// coordinate: of a unit vector or square.
bool is_image(Environment environment, float coordinate) {
    return has_background_image && both(environment.size.x > 0, coordinate < 2.0);
}

vec3 background(vec3 direction) {
    if (is_image(scene.environment, direction.y))
        return environment_radiance(scene.environment, direction);
    const vec3 down = scene.background_down, up = scene.background_up;
    if (!has_background_gradient || both(down == up, direction.y < 2.0)) return down;
    return mix(down, up, 0.5 * (direction.y + 1.0));
}

float channel_sum(vec3 colour) { return colour.r + colour.g + colour.b; }

float background_density(vec3 direction) {
    if (is_image(scene.environment, direction.y)) return environment_density(scene.environment, direction);
    return gradient_density(channel_sum(scene.background_down), channel_sum(scene.background_up), direction.y);
}

vec3 sample_background(vec2 v) {
    if (is_image(scene.environment, v.x)) return sample_environment(scene.environment, v);
    return sample_gradient(channel_sum(scene.background_down), channel_sum(scene.background_up), v);
}

#endif
