// What a film is forecast to take, by how it is held.
#include <doctest/doctest.h>

#include "common/commands/memory.h"

using namespace tandem;

namespace {

struct ForecastJobs : Renderer, ForecastingRenderer {
    std::unique_ptr<RenderJob> prepare(const Scene&, const RenderSettings&) override { return nullptr; }
    [[nodiscard]] RendererInfo info() const override { return {}; }
    [[nodiscard]] MemoryForecast forecast(const Scene&, const RenderSettings&, std::uint64_t) const override {
        MemoryForecast forecast;
        forecast.job_pixel = 1000;
        return forecast;
    }
};

}  // namespace

TEST_CASE("a film by error is forecast with the trials before it, which hold two jobs") {
    const ForecastJobs renderer;
    RenderSettings settings;
    settings.width = settings.height = 100;
    const auto bytes_a_pixel = [&](const StoppingRule& rule) {
        return static_cast<double>(memory_need(renderer, Scene{}, settings, film_use(settings, rule)).film) / 1e4;
    };
    StoppingRule by_samples, by_error;
    by_samples.samples = samples_per_block;
    by_error.relative_error = 0.01;
    CHECK(bytes_a_pixel(by_samples) < 1500.0);
    CHECK(bytes_a_pixel(by_error) > 2000.0 + 5.0 * channel_count * sizeof(Moments) - 1.0);
    CHECK(bytes_a_pixel(by_error) < 2500.0);
}
