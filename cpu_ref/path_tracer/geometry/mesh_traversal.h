// Rays at meshes that several entities place. A ray is mapped to the mesh's object space to find triangles. These are
// then tested in world space, as all others are. So a hit has the bits that it would have if the place's triangles
// stood in tables.
#pragma once

#include "cpu_ref/path_tracer/geometry/mesh_hierarchies.h"
#include "cpu_ref/path_tracer/geometry/single_query.h"

namespace tandem::cpu {

template <class Real>
struct MeshTraversal {
    // A ray on its way through the hierarchy of one place's mesh, whose own space has `scale` times the world's lengths
    // along the ray. There it starts `begin` later; negative: earlier.
    struct Query {
        embree::Context context;
        SingleQuery<Real>* outer;
        const MeshTable::Place* place;
        const typename MeshHierarchies<Real>::Mesh* mesh;
        double begin, scale;
        bool found;

        [[nodiscard]] float last(Real t) const {
            return round_up((static_cast<double>(t) + outer->slack) * scale - begin + mesh->inflation);
        }
    };

    // False: it passes the mesh by, or what it has found is nearer.
    static bool start(Query& query, RTCRay& out) {
        const SingleQuery<Real>& outer = *query.outer;
        const EntityMap& map = query.place->map;
        const auto& mesh = *query.mesh;
        const Vec3<double> o = widened(outer.ray.origin), d = widened(outer.ray.direction);
        const glm::dvec3 origin = map.inverse * (glm::dvec3(o.x, o.y, o.z) - map.shift),
                         mapped = map.inverse * glm::dvec3(d.x, d.y, d.z);
        query.scale = glm::length(mapped);
        const glm::dvec3 direction = mapped / query.scale, way = mesh.middle - origin;
        const double along = glm::dot(way, direction), reach = mesh.radius + mesh.inflation;
        if (glm::length(way - along * direction) > reach || along < -reach) return false;
        query.begin = std::max(0.0, along - reach) - mesh.inflation;
        const glm::dvec3 at = query.begin * direction - way;
        out.org_x = static_cast<float>(at.x);
        out.org_y = static_cast<float>(at.y);
        out.org_z = static_cast<float>(at.z);
        out.dir_x = static_cast<float>(direction.x);
        out.dir_y = static_cast<float>(direction.y);
        out.dir_z = static_cast<float>(direction.z);
        const double t_min = static_cast<double>(outer.ray.t_min) * query.scale - std::max(query.begin, 0.0);
        out.tnear = t_min > 0.0 ? std::max(0.0f, std::nextafter(round_down(t_min), -1.0f)) : 0.0f;
        out.tfar = query.last(outer.found ? outer.t : outer.ray.limit);
        out.time = 0.0f;
        out.mask = 0xFFFFFFFFu;
        out.id = 0;
        out.flags = 0;
        embree::initialise(query.context);
        query.found = false;
        return out.tfar >= 0.0f;
    }

    static Query at_place(embree::Context* context, unsigned place) {
        auto& outer = *reinterpret_cast<SingleQuery<Real>*>(context);
        Query query;
        query.outer = &outer;
        query.place = &outer.meshes->table().places[place];
        query.mesh = &outer.meshes->mesh(query.place->mesh);
        return query;
    }

    // Tests a triangle of the mesh where it is placed.
    static bool hits(Query& query, std::uint32_t triangle, Real& t) {
        const SingleQuery<Real>& outer = *query.outer;
        const MeshTable& table = outer.meshes->table();
        const std::uint32_t slot = query.place->first_slot + triangle;
        const TriangleForm<Real> form =
            form_of<Real>(placed_triangle(query.place->map, table.corners_of(table.indices_of(*query.place, slot))));
        const Candidate<Real> candidate = intersect(form, outer.ray, slot == outer.departed, outer.inside);
        t = candidate.t;
        return candidate.hit;
    }
    static bool accept(Query& query, std::uint32_t triangle) {
        Real t = 0;
        if (!hits(query, triangle, t) || !query.outer->accept(query.place->first_slot + triangle, t, 0)) return false;
        return query.found = true;
    }

    static void place_closest(const RTCIntersectFunctionNArguments* arguments) {
        if (arguments->valid[0] == 0) return;
        Query query = at_place(arguments->context, arguments->primID);
        RTCRayHit one;
        if (!start(query, one.ray)) return;
        one.hit.geomID = RTC_INVALID_GEOMETRY_ID;
        embree::intersect(query.mesh->scene.get(), query.context, one);
        if (!query.found) return;
        const SingleQuery<Real>& outer = *query.outer;
        auto& ray = *reinterpret_cast<RTCRayHit*>(arguments->rayhit);
        ray.ray.tfar = std::min(ray.ray.tfar, round_up(static_cast<double>(outer.t) + outer.lead + outer.slack));
        ray.hit.geomID = arguments->geomID;
        ray.hit.primID = arguments->primID;
    }
    static void place_occluded(const RTCOccludedFunctionNArguments* arguments) {
        if (arguments->valid[0] == 0) return;
        Query query = at_place(arguments->context, arguments->primID);
        RTCRay one;
        if (!start(query, one)) return;
        embree::occluded(query.mesh->scene.get(), query.context, one);
        if (!query.found) return;
        query.outer->found = true;
        reinterpret_cast<RTCRay*>(arguments->ray)->tfar = -std::numeric_limits<float>::infinity();
    }

    static void user_closest(const RTCIntersectFunctionNArguments* arguments) {
        if (arguments->valid[0] == 0) return;
        auto& query = *reinterpret_cast<Query*>(arguments->context);
        if (!accept(query, query.mesh->user[arguments->primID])) return;
        auto& ray = *reinterpret_cast<RTCRayHit*>(arguments->rayhit);
        ray.ray.tfar = std::min(ray.ray.tfar, query.last(query.outer->t));
        ray.hit.geomID = arguments->geomID;
        ray.hit.primID = arguments->primID;
    }
    static void user_occluded(const RTCOccludedFunctionNArguments* arguments) {
        if (arguments->valid[0] == 0) return;
        auto& query = *reinterpret_cast<Query*>(arguments->context);
        Real t = 0;
        if (!hits(query, query.mesh->user[arguments->primID], t)) return;
        query.found = true;
        reinterpret_cast<RTCRay*>(arguments->ray)->tfar = -std::numeric_limits<float>::infinity();
    }
    // Turned down also where it is taken: by its own t Embree would pass over what is nearer by less than that is off.
    static void filter_closest(const RTCFilterFunctionNArguments* arguments) {
        auto& query = *reinterpret_cast<Query*>(arguments->context);
        arguments->valid[0] = 0;
        const float t = reinterpret_cast<RTCRay*>(arguments->ray)->tfar;
        if (query.outer->found && t > query.last(query.outer->t)) return;
        accept(query, query.mesh->native[reinterpret_cast<RTCHit*>(arguments->hit)->primID]);
    }
    static void filter_occluded(const RTCFilterFunctionNArguments* arguments) {
        auto& query = *reinterpret_cast<Query*>(arguments->context);
        Real t = 0;
        if (hits(query, query.mesh->native[reinterpret_cast<RTCHit*>(arguments->hit)->primID], t))
            query.found = true;
        else
            arguments->valid[0] = 0;
    }
};

template <class Real>
[[nodiscard]] MeshCallbacks mesh_callbacks() {
    using Rays = MeshTraversal<Real>;
    return {Rays::place_closest, Rays::user_closest, Rays::place_occluded, Rays::user_occluded, Rays::filter_closest,
        Rays::filter_occluded};
}

}  // namespace tandem::cpu
