#include "common/floating_origin.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <limits>
#include <utility>

#include "common/path_trace.h"

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

// A box around a primitive in the object space of its entity.
Box box_of(const Scene& scene, const Primitive& primitive) {
    Box box;
    const std::size_t points = primitive.kind == PrimitiveKind::triangle ? 3
                               : primitive.kind == PrimitiveKind::cuboid ? 2
                                                                         : 1;
    for (std::size_t i = 0; i < points; ++i) {
        const dvec3& point = scene.vertices[primitive.index[i]];
        box.add(point - primitive.radius);
        box.add(point + primitive.radius);
    }
    return box;
}

// Around all surfaces and the camera, wherever they are while the shutter is open.
Box box_of(const Scene& scene) {
    Box all;
    all.add(scene.camera.position);
    all.add(scene.camera.position + scene.camera.position_motion);
    for (const Entity& entity : scene.entities) {
        Box box;
        for (std::uint32_t i = 0; i < entity.primitive_count; ++i) {
            const Box own = box_of(scene, scene.primitives[entity.first_primitive + i]);
            box.add(own.low);
            box.add(own.high);
        }
        for (unsigned corner = 0; entity.primitive_count > 0 && corner < 8; ++corner) {
            const dvec3 point((corner & 1u) != 0 ? box.high.x : box.low.x, (corner & 2u) != 0 ? box.high.y : box.low.y,
                (corner & 4u) != 0 ? box.high.z : box.low.z);
            const dvec3 placed(entity.object_to_world * glm::dvec4(point, 1.0));
            all.add(placed);
            all.add(placed + entity.motion);
        }
    }
    return all;
}

class MovedJob final : public RenderJob {
public:
    MovedJob(std::unique_ptr<RenderJob> job, const dvec3& origin) : job_(std::move(job)), origin_(origin) {}

    [[nodiscard]] JobFacts facts() const override { return job_->facts(); }
    [[nodiscard]] RenderResult render(SampleRange range, const RenderControl& control) override {
        return job_->render(range, control);
    }
    [[nodiscard]] RenderResult render_pixels(
        SampleRange range, std::span<const std::uint32_t> pixels, const RenderControl& control) override {
        return job_->render_pixels(range, pixels, control);
    }
    [[nodiscard]] std::vector<PathTrace> trace(std::uint32_t x, std::uint32_t y, SampleRange samples) override {
        std::vector<PathTrace> traces = job_->trace(x, y, samples);
        for (PathTrace& trace : traces)
            for (TracedVertex& vertex : trace.vertices) {
                vertex.origin += origin_;
                if (vertex.end != PathEnd::left_scene) vertex.position += origin_;
            }
        return traces;
    }

private:
    std::unique_ptr<RenderJob> job_;
    dvec3 origin_;
};

}  // namespace

// Along an axis on which the middle lies beyond four times h, half the box's longest side, all coordinates are larger
// than 3 h; moved by the middle, which is rounded to a multiple of h at most, they are below 1.5 h. So the largest
// coordinate along the axis becomes less than half, and nearer than four times there would be little to gain.
std::optional<dvec3> floating_origin(const Scene& scene) {
    const Box box = box_of(scene);
    const dvec3 middle = 0.5 * box.low + 0.5 * box.high, half = 0.5 * (box.high - box.low);
    const double longest = std::max({half.x, half.y, half.z});
    if (!(longest > 0.0)) return std::nullopt;
    const double step = std::exp2(std::floor(std::log2(longest)));
    dvec3 origin(0.0);
    for (int axis = 0; axis < 3; ++axis)
        if (std::abs(middle[axis]) > 4.0 * longest) origin[axis] = step * std::round(middle[axis] / step);
    if (origin == dvec3(0.0)) return std::nullopt;
    return origin;
}

Scene seen_from(const Scene& scene, const dvec3& origin) {
    Scene moved = scene;
    moved.camera.position -= origin;
    moved.camera.target -= origin;
    for (Entity& entity : moved.entities) entity.object_to_world[3] -= glm::dvec4(origin, 0.0);
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

std::unique_ptr<RenderJob> prepare_near_origin(
    const Scene& scene, const std::function<std::unique_ptr<RenderJob>(const Scene&)>& prepare) {
    const std::optional<dvec3> origin = floating_origin(scene);
    if (!origin) return prepare(scene);
    return std::make_unique<MovedJob>(prepare(seen_from(scene, *origin)), *origin);
}

}  // namespace tandem
