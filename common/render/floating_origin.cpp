#include "common/render/floating_origin.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <limits>
#include <map>
#include <utility>

#include "common/render/contacts.h"
#include "common/render/path_trace.h"
#include "common/render/random.h"

namespace tandem {

namespace {

using glm::dvec3;

struct Box {
    dvec3 low{std::numeric_limits<double>::infinity()}, high{-std::numeric_limits<double>::infinity()};
    void add(const dvec3& point) {
        low = glm::min(low, point);
        high = glm::max(high, point);
    }
};

// The vertices that a primitive has.
std::size_t point_count(const Primitive& primitive) {
    return primitive.kind == PrimitiveKind::triangle ? 3 : primitive.kind == PrimitiveKind::cuboid ? 2 : 1;
}

// A box around a primitive in the object space of its entity.
Box box_of(const Scene& scene, const Primitive& primitive) {
    Box box;
    for (std::size_t i = 0; i < point_count(primitive); ++i) {
        const dvec3& point = scene.vertices[primitive.index[i]];
        box.add(point - primitive.radius);
        box.add(point + primitive.radius);
    }
    return box;
}

// The same around those of an entity.
Box box_of(const Scene& scene, const Entity& entity) {
    Box box;
    for (std::uint32_t i = 0; i < entity.primitive_count; ++i) {
        const Box own = box_of(scene, scene.primitives[entity.first_primitive + i]);
        box.add(own.low);
        box.add(own.high);
    }
    return box;
}

// Around all surfaces and the camera, wherever they are until `time`.
Box box_of(const Scene& scene, double time = 1.0) {
    Box all;
    all.add(scene.camera.position);
    all.add(scene.camera.position + time * scene.camera.position_motion);
    std::map<std::pair<std::uint32_t, std::uint32_t>, Box> known;  // by the primitives, which entities may share
    for (const Entity& entity : scene.entities) {
        const auto [found, is_new] = known.try_emplace({entity.first_primitive, entity.primitive_count});
        if (is_new) found->second = box_of(scene, entity);
        const Box& box = found->second;
        for (unsigned corner = 0; entity.primitive_count > 0 && corner < 8; ++corner) {
            const dvec3 point((corner & 1u) != 0 ? box.high.x : box.low.x, (corner & 2u) != 0 ? box.high.y : box.low.y,
                (corner & 4u) != 0 ? box.high.z : box.low.z);
            const dvec3 placed(entity.object_to_world * glm::dvec4(point, 1.0));
            all.add(placed);
            all.add(placed + time * entity.motion);
        }
    }
    return all;
}

// `offset`, rounded to few bits along the axes where it is larger than `least`, 0 along others; `extent`: what counts
// as small beside it.
dvec3 coarse(const dvec3& offset, double extent, double least) {
    const double step = std::exp2(std::floor(std::log2(extent)));
    dvec3 result(0.0);
    for (int axis = 0; axis < 3; ++axis)
        if (std::abs(offset[axis]) > least) result[axis] = step * std::round(offset[axis] / step);
    return result;
}

// Half the longest side of the box around the scene.
double half_extent(const Box& box) {
    const dvec3 half = 0.5 * (box.high - box.low);
    return std::max({half.x, half.y, half.z});
}

// What to subtract from an entity's own coordinates where it is they that are large, and not its place. They are the
// inverse map of a point within 5 h of the origin (floating_origin). So they are within 5 r of that of the origin
// itself, r being h times the inverse's greatest sum of a row. Beyond 16 r they are larger than 11 r, and below 5.5 r
// when moved.
dvec3 own_origin(const Entity& entity, const dvec3& origin, double half) {
    const glm::dmat3 to_object = glm::inverse(glm::dmat3(entity.object_to_world));
    const glm::dmat3 rows = glm::transpose(to_object);
    double largest = 0.0;
    for (int row = 0; row < 3; ++row)
        largest = std::max(largest, std::abs(rows[row].x) + std::abs(rows[row].y) + std::abs(rows[row].z));
    const double reach = half * largest;
    return coarse(to_object * (origin - dvec3(entity.object_to_world[3])), reach, 16.0 * reach);
}

// Whether the places of a material's points in their entity are what colours them.
bool is_coloured_by_place(const Scene& scene, const Material& material) {
    if (material.colour_texture == no_index) return false;
    const Texture& texture = scene.textures[material.colour_texture];
    return texture.kind != TextureKind::image && texture.space == TextureSpace::object;
}

// False: a vertex is of two entities that would move it otherwise, or one that must not move at all.
bool move_entities(const Scene& scene, const dvec3& origin, Scene& moved) {
    const double half = half_extent(box_of(scene));
    std::vector<std::optional<dvec3>> of_vertices(scene.vertices.size());
    for (Entity& entity : moved.entities) {
        const dvec3 own = own_origin(entity, origin, half);
        if (own != dvec3(0.0) && is_coloured_by_place(scene, scene.materials[entity.material])) return false;
        for (std::uint32_t i = 0; i < entity.primitive_count; ++i) {
            const Primitive& primitive = scene.primitives[entity.first_primitive + i];
            for (std::size_t corner = 0; corner < point_count(primitive); ++corner) {
                std::optional<dvec3>& of_vertex = of_vertices[primitive.index[corner]];
                if (of_vertex.value_or(own) != own) return false;
                of_vertex = own;
            }
        }
        const dvec3 place = dvec3(entity.object_to_world[3]) - origin + glm::dmat3(entity.object_to_world) * own;
        entity.object_to_world[3] = glm::dvec4(place, 1.0);
    }
    for (std::size_t i = 0; i < of_vertices.size(); ++i) moved.vertices[i] -= of_vertices[i].value_or(dvec3(0.0));
    return true;
}

// What stands still whatever the bodies do, and would have to move in a frame that does.
bool holds_places(const Scene& scene) {
    return std::ranges::any_of(scene.lights, [](const PunctualLight& l) { return l.kind != PunctualKind::sun; }) ||
           std::ranges::any_of(scene.media, [](const Medium& medium) { return medium.grid != nullptr; });
}

class MovedJob final : public RenderJob {
public:
    MovedJob(std::unique_ptr<RenderJob> job, const dvec3& origin, const dvec3& motion, const RenderSettings& settings)
        : job_(std::move(job)),
          origin_(origin),
          motion_(motion),
          width_(settings.width),
          seed_(settings.seed),
          generator_(settings.generator) {}

    [[nodiscard]] JobFacts facts() const override { return job_->facts(); }
    [[nodiscard]] bool goes_on_in_blocks() const override { return job_->goes_on_in_blocks(); }
    [[nodiscard]] RenderResult render(SampleRange range, const RenderControl& control) override {
        return job_->render(range, control);
    }
    [[nodiscard]] RenderResult render_pixels(
        SampleRange range, std::span<const std::uint32_t> pixels, const RenderControl& control) override {
        return job_->render_pixels(range, pixels, control);
    }
    [[nodiscard]] std::vector<PathTrace> trace(std::uint32_t x, std::uint32_t y, SampleRange samples) override {
        return moved_back(job_->trace(x, y, samples), x, y, samples);
    }
    [[nodiscard]] std::vector<PathTrace> trace_with(
        ChangedNumber changed, std::uint32_t x, std::uint32_t y, SampleRange samples) override {
        return moved_back(job_->trace_with(changed, x, y, samples), x, y, samples);
    }
    [[nodiscard]] std::vector<PathTrace> moved_back(
        std::vector<PathTrace> traces, std::uint32_t x, std::uint32_t y, SampleRange samples) const {
        for (std::size_t i = 0; i < traces.size(); ++i) {
            const dvec3 place = origin_of(y * width_ + x, samples.begin + i);
            for (TracedVertex& vertex : traces[i].vertices) move_back(vertex, place);
        }
        return traces;
    }
    [[nodiscard]] bool first_vertices(
        FilmSize film, SampleRange samples, const RenderControl& control, const FirstVertexVisitor& visit) override {
        return job_->first_vertices(film, samples, control, [&](std::uint32_t pixel, std::span<TracedVertex> vertices) {
            for (std::size_t i = 0; i < vertices.size(); ++i)
                move_back(vertices[i], origin_of(pixel, samples.begin + i));
            visit(pixel, vertices);
        });
    }

private:
    static void move_back(TracedVertex& vertex, const dvec3& origin) {
        vertex.origin += origin;
        if (vertex.end != PathEnd::left_scene) vertex.position += origin;
    }
    [[nodiscard]] dvec3 origin_of(std::uint32_t pixel, std::uint64_t sample) const {
        return origin_ + time(pixel, sample) * motion_;
    }
    // MODEL.md section 4.
    [[nodiscard]] double time(std::uint32_t pixel, std::uint64_t sample) const {
        return to_unit<double>(random_block(generator_, seed_, pixel, sample, 1)[0]);
    }

    std::unique_ptr<RenderJob> job_;
    dvec3 origin_, motion_;
    std::uint32_t width_;
    std::uint64_t seed_;
    Generator generator_;
};

}  // namespace

// Let h be half the box's longest side. Along an axis on which the middle lies beyond four times h, all coordinates are
// larger than 3 h. Moved by the middle, which is rounded to a multiple of h at most, they are below 1.5 h. So the
// largest coordinate along the axis becomes less than half, and nearer than four times there would be little to gain.
std::optional<dvec3> floating_origin(const Scene& scene) {
    const Box box = box_of(scene);
    const double half = half_extent(box);
    if (!(half > 0.0)) return std::nullopt;
    const dvec3 origin = coarse(0.5 * box.low + 0.5 * box.high, half, 4.0 * half);
    if (origin == dvec3(0.0)) return std::nullopt;
    return origin;
}

std::optional<Scene> seen_from(const Scene& scene, const dvec3& origin) {
    Scene moved = scene;
    if (!move_entities(scene, origin, moved)) return std::nullopt;
    moved.camera.position -= origin;
    moved.camera.target -= origin;
    for (PunctualLight& light : moved.lights) light.position -= origin;
    for (Medium& medium : moved.media) {
        if (!medium.grid) continue;
        DensityGrid grid = *medium.grid;
        grid.low -= origin;
        grid.high -= origin;
        medium.grid = std::make_shared<DensityGrid>(std::move(grid));
    }
    return moved;
}

// A displacement below four times h, half the longest side of the box at rest, leaves coordinates below 9 h. There
// would be little to gain, as above. A body that shares three quarters of it has a displacement of a quarter left, or
// less.
std::optional<dvec3> floating_motion(const Scene& scene) {
    const dvec3& motion = scene.camera.position_motion;
    if (motion == dvec3(0.0) || holds_places(scene)) return std::nullopt;
    if (!(largest_coordinate(motion) > 4.0 * half_extent(box_of(scene, 0.0)))) return std::nullopt;
    const bool shared = std::ranges::any_of(scene.entities, [&](const Entity& entity) {
        return entity.primitive_count > 0 &&
               largest_coordinate(entity.motion - motion) <= 0.25 * largest_coordinate(motion);
    });
    if (!shared) return std::nullopt;
    return motion;
}

Scene moving_along(const Scene& scene, const dvec3& motion) {
    Scene moved = scene;
    moved.camera.position_motion -= motion;
    moved.camera.target_motion -= motion;
    for (Entity& entity : moved.entities) entity.motion -= motion;
    return moved;
}

std::unique_ptr<RenderJob> prepare_near_origin(const Scene& given, const RenderSettings& settings,
    const std::function<std::unique_ptr<RenderJob>(const Scene&)>& prepare) {
    const std::optional<Scene> apart = with_contacts_apart(given);
    const Scene& scene = apart ? *apart : given;
    const std::optional<dvec3> motion = floating_motion(scene);
    const std::optional<Scene> along = motion ? std::optional(moving_along(scene, *motion)) : std::nullopt;
    const Scene& seen = along ? *along : scene;
    const std::optional<dvec3> origin = floating_origin(seen);
    const std::optional<Scene> moved = origin ? seen_from(seen, *origin) : std::nullopt;
    if (!along && !moved) return prepare(scene);
    return std::make_unique<MovedJob>(
        prepare(moved ? *moved : seen), moved ? *origin : dvec3(0.0), motion.value_or(dvec3(0.0)), settings);
}

}  // namespace tandem
