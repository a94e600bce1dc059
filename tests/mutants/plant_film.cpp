#include "tests/mutants/plant_film.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "common/render/path_trace.h"
#include "common/render/tiled_renderer.h"

namespace tandem::test {

namespace {

using Bug = PlantedBug;
using Plane = Estimate::Plane;

constexpr std::array faults{Bug::sample_high_bits_lost, Bug::workgroup_lost, Bug::row_lost, Bug::pixel_index_short,
    Bug::tile_offset_wrong, Bug::accumulation_missing, Bug::film_half, Bug::lane_repeated, Bug::block_swizzled};

// Sums of a block in half precision.
double in_half(double value) {
    if (!(value > 0.0)) return value;
    const int exponent = std::max(std::ilogb(value), -14) - 10;
    return std::ldexp(std::nearbyint(std::ldexp(value, -exponent)), exponent);
}

struct Film {
    Plane& plane;
    std::size_t width, height, tile_pixels;  // of tiles; 0: there are none
    [[nodiscard]] std::size_t pixels() const { return width * height; }

    // Pixel i takes what `source_of(i)` had; a source of pixels(): nothing.
    template <class SourceOf>
    void take(SourceOf source_of) {
        const Plane before = plane;
        for (std::size_t i = 0; i < pixels(); ++i) {
            const std::size_t source = source_of(i);
            for (std::size_t c = 0; c < channel_count; ++c)
                plane[i * channel_count + c] = source < pixels() ? before[source * channel_count + c] : Moments{};
        }
    }
};

void spoil(Bug bug, Film film) {
    const std::size_t none = film.pixels();
    switch (bug) {
        case Bug::workgroup_lost:
            return film.take([&](std::size_t i) { return i < none / 64 * 64 ? i : none; });
        case Bug::row_lost:
            return film.take([&](std::size_t i) { return i + film.width < none ? i : none; });
        case Bug::pixel_index_short:  // the last to write pixel i was the last one with its lower bits
            return film.take([&](std::size_t i) { return i < 65536 ? i + (none - 1 - i) / 65536 * 65536 : none; });
        case Bug::tile_offset_wrong:
            return film.take([&](std::size_t i) { return film.tile_pixels > 0 && i >= film.tile_pixels ? i - 1 : i; });
        case Bug::lane_repeated:
            return film.take([](std::size_t i) { return i % 32 == 31 ? i - 1 : i; });
        case Bug::block_swizzled:
            return film.take([&](std::size_t i) {
                const std::size_t x = i % film.width, y = i / film.width;
                const std::size_t u = x / 8 * 8 + y % 8, v = y / 8 * 8 + x % 8;
                return u < film.width && v < film.height ? v * film.width + u : i;
            });
        case Bug::film_half:
            for (Moments& m : film.plane) m.sum = in_half(m.sum);
            return;
        default:
            return;
    }
}

class Job : public RenderJob {
public:
    Job(std::unique_ptr<RenderJob> job, Bug bug, const RenderSettings& settings, std::uint32_t tile_pixels)
        : job_(std::move(job)), bug_(bug), width_(settings.width), height_(settings.height), tile_(tile_pixels) {}

    [[nodiscard]] JobFacts facts() const override { return job_->facts(); }
    [[nodiscard]] std::vector<PathTrace> trace(std::uint32_t x, std::uint32_t y, SampleRange samples) override {
        return job_->trace(x, y, samples);
    }
    [[nodiscard]] std::vector<PathTrace> trace_with(
        ChangedNumber changed, std::uint32_t x, std::uint32_t y, SampleRange samples) override {
        return job_->trace_with(changed, x, y, samples);
    }
    [[nodiscard]] bool first_vertices(
        FilmSize film, SampleRange samples, const RenderControl& control, const FirstVertexVisitor& visit) override {
        return job_->first_vertices(film, samples, control, visit);
    }
    [[nodiscard]] RenderResult render(SampleRange range, const RenderControl& control) override {
        RenderResult result;
        result.estimate = Estimate(width_, height_);
        for (SampleRange block = range; block.begin < range.end; block.begin = block.end) {
            block.end = std::min(range.end, (block.begin / samples_per_block + 1) * samples_per_block);
            const RenderResult done = job_->render(drawn(block), control);
            result.seconds += done.seconds;
            if (done.estimate.count() != drawn(block).count()) break;
            Plane plane = done.estimate.totals();
            spoil(bug_, {plane, width_, height_, tile_});
            result.estimate.add_block(block, std::move(plane));
            result.estimate.add_invalid(done.estimate.invalid());
        }
        return result;
    }

private:
    // The samples that are added as those of `block`.
    [[nodiscard]] SampleRange drawn(SampleRange block) const {
        if (bug_ == Bug::sample_high_bits_lost) {
            const std::uint64_t begin = block.begin & 0xFFFFFFFFu;
            return {begin, begin + block.count()};
        }
        if (bug_ == Bug::accumulation_missing && block.count() > 1) --block.end;
        return block;
    }

    std::unique_ptr<RenderJob> job_;
    Bug bug_;
    std::uint32_t width_, height_, tile_;
};

class FilmRenderer : public Renderer, public TiledRenderer {
public:
    FilmRenderer(std::unique_ptr<Renderer> renderer, Bug bug) : renderer_(std::move(renderer)), bug_(bug) {}

    [[nodiscard]] RendererInfo info() const override { return renderer_->info(); }
    [[nodiscard]] std::unique_ptr<RenderJob> prepare(const Scene& scene, const RenderSettings& settings) override {
        return std::make_unique<Job>(renderer_->prepare(scene, settings), bug_, settings, 0);
    }
    [[nodiscard]] std::unique_ptr<RenderJob> prepare_tiled(
        const Scene& scene, const RenderSettings& settings, std::uint32_t tile_pixels) override {
        auto* const tiled = dynamic_cast<TiledRenderer*>(renderer_.get());
        return std::make_unique<Job>(
            tiled != nullptr ? tiled->prepare_tiled(scene, settings, tile_pixels) : renderer_->prepare(scene, settings),
            bug_, settings, tiled != nullptr ? tile_pixels : 0);
    }

private:
    std::unique_ptr<Renderer> renderer_;
    Bug bug_;
};

}  // namespace

bool is_fault_of_film(PlantedBug bug) { return std::ranges::find(faults, bug) != faults.end(); }

std::unique_ptr<Renderer> with_fault_of_film(std::unique_ptr<Renderer> renderer, PlantedBug bug) {
    return std::make_unique<FilmRenderer>(std::move(renderer), bug);
}

}  // namespace tandem::test
