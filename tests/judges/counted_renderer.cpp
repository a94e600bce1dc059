#include "tests/judges/counted_renderer.h"

#include "cpu_ref/backend.h"
#include "cpu_ref/planted.h"
#include "tests/mutants/plant_data.h"

namespace tandem::test {

namespace {

class CountedJob : public RenderJob {
public:
    CountedJob(std::unique_ptr<RenderJob> job, const PlantedFault& in_code, RenderedSamples& rendered)
        : job_(std::move(job)), in_code_(in_code), rendered_(rendered) {}

    [[nodiscard]] JobFacts facts() const override { return job_->facts(); }
    [[nodiscard]] RenderResult render(SampleRange range, const RenderControl& control) override {
        cpu::planted_fault = in_code_;
        RenderResult result = job_->render(range, control);
        rendered_.count += result.estimate.count() * result.estimate.pixel_count();
        return result;
    }

private:
    std::unique_ptr<RenderJob> job_;
    PlantedFault in_code_;
    RenderedSamples& rendered_;
};

class CountedRenderer : public Renderer {
public:
    CountedRenderer(std::unique_ptr<Renderer> renderer, RenderedSamples& rendered)
        : renderer_(std::move(renderer)), rendered_(rendered) {}

    [[nodiscard]] RendererInfo info() const override { return renderer_->info(); }
    [[nodiscard]] std::unique_ptr<RenderJob> prepare(const Scene& scene, const RenderSettings& settings) override {
        std::unique_ptr<RenderJob> job = renderer_->prepare(scene, settings);
        return std::make_unique<CountedJob>(std::move(job), cpu::planted_fault, rendered_);  // which preparing has set
    }

private:
    std::unique_ptr<Renderer> renderer_;
    RenderedSamples& rendered_;
};

}  // namespace

std::unique_ptr<Renderer> counted_renderer(const PlantedFault& fault, Precision precision, RenderedSamples& rendered) {
    BackendOptions options;
    options.precision = precision;
    options.threads = 1;
    return std::make_unique<CountedRenderer>(renderer_with(cpu_backend(), fault, options), rendered);
}

}  // namespace tandem::test
