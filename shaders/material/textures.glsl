// Colours that vary over a surface (MODEL.md sections 5.1 and 7.0).
#ifndef TEXTURES_GLSL
#define TEXTURES_GLSL

// Only the parity of the sum of the whole numbers counts, and each one's own is exact.
vec3 checker_colour(Texture pattern, vec3 q) {
    const vec3 cell = mix(floor(q), vec3(0.0), equal(pattern.frequency, vec3(0.0)));
    const vec3 parity = cell - 2.0 * floor(0.5 * cell);
    const float odd = parity.x + parity.y + parity.z;
    return odd == 0.0 || odd == 2.0 ? pattern.first : pattern.second;
}

vec3 noise_colour(Texture pattern, vec3 q) {
    float s;
    if (pattern.style == noise_smooth) {
        s = 0.5 * (1.0 + perlin_noise(q, pattern.seed));
    } else {
        s = turbulence(q, pattern.seed, pattern.octaves);
        if (pattern.style == noise_marble) {
            const float turns = q.z + pattern.amount * s;
            s = 0.5 * (1.0 + cos_sin_turn(turns - floor(turns)).y);
        }
    }
    return mix(pattern.first, pattern.second, clamp(s, 0.0, 1.0));
}

// 5.1; `local` is that of the hit (intersect.comp).
vec2 texture_coordinates(uint slot, uint face, vec3 local) {
    const uint kind = kind_of(slot);
    if (has_triangles && kind == kind_triangle) {
        const uint at = scene.texture_coordinates + 6 * table_row(slot);
        const vec2 a = vec2(tables[at], tables[at + 1]), b = vec2(tables[at + 2], tables[at + 3]);
        const vec2 c = vec2(tables[at + 4], tables[at + 5]);
        return (1.0 - local.x - local.y) * a + local.x * b + local.y * c;
    }
    // The object's axes: a sphere's map to unit space is one factor for all.
    if (has_spheres && kind == kind_sphere)
        return vec2(0.5 + turn_of(-local.z, local.x), 2.0 * turn_of(length(local.xz), -local.y));
    const vec3 extent = shaded(convex_extent(convex_at(slot)));
    const vec3 place = mix(vec3(0.0), 0.5 * local + 0.5, notEqual(extent, vec3(0.0)));
    return face < 2 ? place.yz : face < 4 ? place.xz : place.xy;
}

real3 object_point(uint slot, real3 rest) {
    const EntityTransform m = transforms[placed_at(slot).entity];
    const real3 p = rest - real3(m.to_world0.w, m.to_world1.w, m.to_world2.w);
    return real3(dot(m.to_object0, p), dot(m.to_object1, p), dot(m.to_object2, p));
}

// The colour of the texture `index` at a hit; `rest` is the hit point with the entity's motion taken out.
vec3 texture_colour(uint index, uint slot, uint face, vec3 local, real3 rest) {
    const Texture pattern = textures[index];
    const bool by_coordinates = has_texture_coordinates && pattern.space == texture_space_coordinates;
    vec2 uv = vec2(0.0);
    if (has_texture_coordinates && (by_coordinates || pattern.kind == texture_image))
        uv = texture_coordinates(slot, face, local);
    if (has_image_texture && pattern.kind == texture_image)
        return table_image(pattern.texels, uvec2(pattern.width, pattern.height), uv, false);
    const vec3 q = shaded(pattern.frequency * (by_coordinates ? real3(uv, 0.0) : object_point(slot, rest)));
    if (has_noise && pattern.kind == texture_noise) return noise_colour(pattern, q);
    return checker_colour(pattern, q);
}

#endif
