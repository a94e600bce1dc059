// A renderer whose paths a test makes: each scatters once.
#pragma once

#include <functional>
#include <vector>

#include "tests/common/synthetic_renderer.h"

namespace tandem::test {

inline PathTrace scattered_once(const glm::dvec3& direction, const glm::dvec3& throughput = glm::dvec3(1.0)) {
    TracedVertex vertex;
    vertex.direction = {0.0, 0.0, -1.0};
    vertex.t = 1.0;
    vertex.normal = vertex.shading_normal = {0.0, 0.0, 1.0};
    vertex.primitive = vertex.material = 0;
    vertex.next_direction = direction;
    vertex.next_throughput = throughput;
    vertex.pdf = 0.3;
    TracedVertex last;
    last.direction = vertex.next_direction;
    last.throughput = throughput;
    last.end = PathEnd::left_scene;
    return {{vertex, last}, {}};
}

class TracedRenderer : public Renderer {
public:
    using Path = std::function<PathTrace(const Scene& scene, std::uint64_t sample)>;
    explicit TracedRenderer(Path path) : path_(std::move(path)) {}
    RendererInfo info() const override { return {"traced", "no device", "no driver", "C++", true}; }
    std::unique_ptr<RenderJob> prepare(const Scene& scene, const RenderSettings& settings) override {
        return std::make_unique<Job>(scene, settings, path_);
    }

private:
    struct Job : SyntheticJob {
        Job(const Scene& scene, const RenderSettings& settings, const Path& path)
            : SyntheticJob(settings, mixed), scene_(scene), path_(path) {}
        std::vector<PathTrace> trace(std::uint32_t, std::uint32_t, SampleRange samples) override {
            std::vector<PathTrace> paths;
            for (std::uint64_t sample = samples.begin; sample < samples.end; ++sample)
                paths.push_back(path_(scene_, sample));
            return paths;
        }
        const Scene scene_;
        const Path& path_;
    };
    Path path_;
};

}  // namespace tandem::test
