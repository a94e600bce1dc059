// Stage 2: places every primitive in the world through the indices that it holds (MODEL.md sections 5 and 6). One
// invocation a primitive, in slot order.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "kernels/settings.glsl"
#define WRITES_SCENE
#include "scene/scene_set.glsl"
#include "geometry/placing.glsl"

// The map of the cube or sphere with `centre` and half-axes `half_size` along the object axes.
Convex placed_convex(EntityTransform m, vec3 centre, vec3 half_size) {
    const vec3 c = transformed(m, centre);
    const vec3 extent = vec3(notEqual(half_size, vec3(0.0)));
    const vec3 scale = mix(vec3(1.0), half_size, extent);  // seen from the world a flat axis has the object's unit
    Convex shape;
    shape.to_unit0 = vec4(m.to_object0 / scale.x, c.x);
    shape.to_unit1 = vec4(m.to_object1 / scale.y, c.y);
    shape.to_unit2 = vec4(m.to_object2 / scale.z, c.z);
    shape.to_world0 = vec4(m.to_world0.xyz * half_size, extent.x);
    shape.to_world1 = vec4(m.to_world1.xyz * half_size, extent.y);
    shape.to_world2 = vec4(m.to_world2.xyz * half_size, extent.z);
    return shape;
}

void main() {
    uint slot = gl_GlobalInvocationID.x;
    if (slot >= settings.triangle_count + settings.sphere_count + settings.cuboid_count) return;
    const PrimitiveSource source = sources[slot];
    const EntityTransform m = transforms[source.entity];
    const vec3 a = vertices[source.index0].xyz;
    if (source.kind == kind_triangle) {
        triangles[slot] = placed_triangle(m, a, vertices[source.index1].xyz, vertices[source.index2].xyz);
        return;
    }
    slot -= settings.triangle_count;
    if (source.kind == kind_sphere) {
        spheres[slot] = placed_convex(m, a, vec3(source.radius));
        return;
    }
    const vec3 b = vertices[source.index1].xyz;
    cuboids[slot - settings.sphere_count] = placed_convex(m, 0.5 * a + 0.5 * b, 0.5 * (b - a));
}
