// Pixel filters (MODEL.md section 4.1): where samples lie on the film, and images with closed forms.
#include <array>

#include "tests/suite/effects.h"
#include "tests/suite/samplers.h"

using namespace tandem;
using namespace tandem::test;
using namespace tandem::test::samplers;

namespace {

const dvec3 glow(1.0, 2.0, 4.0);
constexpr std::array wide_filters{PixelFilter::tent, PixelFilter::gaussian};
constexpr std::array all_filters{PixelFilter::box, PixelFilter::tent, PixelFilter::gaussian};

std::string name_of(PixelFilter filter) { return std::string(pixel_filter_names[static_cast<std::size_t>(filter)]); }

double reach(PixelFilter filter) { return filter == PixelFilter::box ? 0.5 : filter == PixelFilter::tent ? 1.0 : 1.5; }

// The share of the filter below t pixels from its middle.
double below(PixelFilter filter, double t) {
    if (t <= -reach(filter)) return 0.0;
    if (t >= reach(filter)) return 1.0;
    if (filter == PixelFilter::box) return t + 0.5;
    if (filter == PixelFilter::tent) return t < 0.0 ? 0.5 * (1.0 + t) * (1.0 + t) : 1.0 - 0.5 * (1.0 - t) * (1.0 - t);
    return 0.5 + 0.5 * std::erf(std::sqrt(2.0) * t) / std::erf(3.0 / std::sqrt(2.0));
}

// The t of which `share` lies below, by halving.
double place_of(PixelFilter filter, double share) {
    double low = -reach(filter), high = reach(filter);
    for (int i = 0; i < 80; ++i) {
        const double middle = 0.5 * (low + high);
        (below(filter, middle) < share ? low : high) = middle;
    }
    return 0.5 * (low + high);
}

// Looks along -z with a field of 90 degrees, so that the film is the square |x|, |y| < 1 of the plane z = -1.
SceneBuilder square_view() { return SceneBuilder().camera(black, {0.0, 0.0, -1.0}, 90.0); }

constexpr std::uint32_t side = 6;  // pixels

// A rectangle in the film's plane, given in pixels from its upper left corner.
struct Rectangle {
    double left, right, top, bottom;
};
SceneBuilder& add(SceneBuilder& builder, const Material& material, const Rectangle& r) {
    const auto corner = [](double x, double y) { return dvec3(2.0 * x / side - 1.0, 1.0 - 2.0 * y / side, -1.0); };
    return builder.quad(
        material, corner(r.left, r.bottom), corner(r.right, r.bottom), corner(r.right, r.top), corner(r.left, r.top));
}

double seen(PixelFilter filter, const Rectangle& r, std::uint32_t pixel) {
    const double x = pixel % side + 0.5, y = pixel / side + 0.5;
    return (below(filter, r.right - x) - below(filter, r.left - x)) *
           (below(filter, r.bottom - y) - below(filter, r.top - y));
}

// One over several pixels, one beyond the left rim that two of the filters reach, half a plane beyond the lower right.
constexpr std::array<Rectangle, 3> rectangles{{{1.3, 3.9, 2.2, 2.9}, {-0.9, -0.2, 4.0, 5.0}, {5.25, 20.0, 5.5, 20.0}}};

// Where a sample lies from its pixel's middle, from the direction of its camera ray.
glm::dvec2 place_in_film(const dvec3& d, std::uint32_t size) {
    return 0.5 * size * glm::dvec2(d.x / -d.z + 1.0, 1.0 - d.y / -d.z);
}

std::vector<Tracer> precise_tracers() {
    std::vector<Tracer> made;
    for (const Precision precision : {Precision::double_precision, Precision::mixed}) {
        BackendOptions options;
        options.precision = precision;
        made.push_back({"vulkan " + std::string(precision_names[static_cast<std::size_t>(precision)]),
            vulkan_backend().create(options), precision == Precision::mixed ? 0x1p-24 : 0x1p-53, true});
    }
    return made;
}

// Chi-square over cells of equal share. Every place is also compared with the distribution's inverse at the sample's
// own numbers. So all tracers have the same places, sample by sample.
void check_places(Tracer& tracer, PixelFilter filter, Generator generator) {
    CAPTURE(tracer.name);
    CAPTURE(name_of(filter));
    constexpr int parts = 12;
    std::vector<double> counts(parts * parts, 0.0),
        expected(parts * parts, static_cast<double>(samples) / (parts * parts));
    RenderSettings settings = settings_of(2, 1);  // the upper left pixel, whose filter goes beyond the film's rim
    settings.filter = filter;
    settings.generator = generator;
    double worst = 0.0;
    std::uint64_t index = 0;
    const Scene scene = square_view().background(white).scene();
    for (const PathTrace& trace : traces_of(tracer, scene, settings)) {
        const glm::dvec2 from_middle = place_in_film(trace.vertices.front().direction, 2) - 0.5;
        const RandomBlock numbers = random_block(generator, settings.seed, 0, index++, dimension::film_and_lens);
        std::array<std::size_t, 2> cell{};
        for (std::size_t axis = 0; axis < 2; ++axis) {
            const double t = from_middle[static_cast<int>(axis)];
            worst = std::max(worst, std::abs(t - place_of(filter, to_unit<double>(numbers[axis]))));
            cell[axis] = static_cast<std::size_t>(std::min(parts - 1.0, std::floor(parts * below(filter, t))));
        }
        counts[parts * cell[1] + cell[0]] += 1.0;
    }
    // In single precision that of rule 4 and a direction's rounding, some units in the last place; in double rule 4.
    // The device tells traces in single precision alone (tests/vulkan/test_pixel_filter.cpp).
    CAPTURE(worst);
    CHECK(worst < (tracer.unit_roundoff > 1e-10 ? 5e-6 : tracer.name == "vulkan double" ? 1e-6 : 1e-11));
    const GoodnessOfFit fit = goodness_of_fit(counts, expected);
    CAPTURE(fit.p);
    // Sobol points are more even than chance, which a small statistic shows.
    CHECK((generator == Generator::sobol ? fit.p > 0.999 : fit.p > least_p));
}

}  // namespace

TEST_CASE("samplers: places on the film have the pixel filter's distribution, and are the same in all tracers") {
    for (const PixelFilter filter : wide_filters)
        for (const Generator generator : {Generator::philox, Generator::sobol})
            for (Tracer& tracer : tracers()) check_places(tracer, filter, generator);
}

TEST_CASE("samplers: places of the pixel filters in double and mixed precision on the device") {
    for (const PixelFilter filter : wide_filters)
        for (Tracer& tracer : precise_tracers()) check_places(tracer, filter, Generator::philox);
}

TEST_CASE("samplers: pixel filters keep Sobol points stratified: each of 16 x 16 cells of equal share has one of 256") {
    for (const PixelFilter filter : wide_filters)
        for (Tracer& tracer : tracers()) {
            if (tracer.unit_roundoff > 1e-10) continue;  // rounding takes points over the edges of cells
            CAPTURE(tracer.name);
            CAPTURE(name_of(filter));
            RenderSettings settings = settings_of(2, 1);
            settings.filter = filter;
            settings.generator = Generator::sobol;
            std::vector<int> counts(256, 0);
            for (const PathTrace& trace :
                traces_of(tracer, square_view().background(white).scene(), settings, counts.size())) {
                const glm::dvec2 t = place_in_film(trace.vertices.front().direction, 2) - 0.5;
                // Numbers are multiples of 2^-24, so that half of one keeps clear of the cells' edges.
                const auto cell = [&](double x) {
                    return static_cast<std::size_t>(std::floor(16.0 * (below(filter, x) + 0x1p-25)));
                };
                ++counts[16 * cell(t.y) + cell(t.x)];
            }
            CHECK(std::ranges::all_of(counts, [](int count) { return count == 1; }));
        }
}

TEST_CASE("pixel filters show lamps with the filter's share that they cover, those beyond the film's rim too") {
    SceneBuilder builder = square_view();
    for (const Rectangle& r : rectangles) add(builder, emitter(glow), r);
    const Scene scene = builder.scene();
    for (const PixelFilter filter : all_filters) {
        CAPTURE(name_of(filter));
        RenderSettings settings = settings_of(side, 1);
        settings.filter = filter;
        constexpr std::uint64_t count = 4096;
        for (Tracer& tracer : tracers()) {
            CAPTURE(tracer.name);
            const std::optional<Estimate> estimate = try_render(tracer, scene, settings, count);
            if (!estimate) continue;
            const std::vector<double> mean = mean_of(*estimate), variance = variance_of(*estimate);
            for (std::uint32_t pixel = 0; pixel < side * side; ++pixel) {
                CAPTURE(pixel);
                double share = 0.0;
                for (const Rectangle& r : rectangles) share += seen(filter, r, pixel);
                CAPTURE(share);
                CAPTURE(mean[3 * pixel]);
                // A share below 1e-3 may have had no sample; its variance is that of a hit or a miss.
                const double spread = std::max(variance[3 * pixel], share * (1.0 - share)) / static_cast<double>(count);
                CHECK(std::abs(mean[3 * pixel] - share) <= sigmas * std::sqrt(spread) + 1e-6);
                CHECK((share > 0.0 || mean[3 * pixel] == 0.0));
            }
        }
    }
}

TEST_CASE("pixel filters leave an even image as it is, its rim included") {
    const Scene scene = square_view().background(glow).scene();
    for (const PixelFilter filter : wide_filters) {
        RenderSettings settings = settings_of(4, 1);
        settings.filter = filter;
        check_every_pixel(tracers(), scene, settings, 64, glow, 8.0);
    }
}

TEST_CASE("bidirectional paths bring a light's subpath to all pixels whose filters reach it, as path does") {
    SceneBuilder builder = square_view();
    for (const Rectangle& r : rectangles) add(builder, diffuse(dvec3(0.8, 0.5, 0.2)), r);
    builder.quad(emitter(glow), {-0.5, 1.5, -0.2}, {0.5, 1.5, -0.2}, {0.5, 1.5, 0.8}, {-0.5, 1.5, 0.8});
    const Scene scene = builder.scene();
    const auto cpu = cpu_backend().create({});
    for (const PixelFilter filter : all_filters) {
        CAPTURE(name_of(filter));
        std::array<std::vector<double>, 2> means, variances;
        constexpr std::uint64_t count = 8192;
        for (std::size_t way = 0; way < 2; ++way) {
            RenderSettings settings =
                settings_of(side, 2, way == 0 ? Integrator::bidirectional : Integrator::next_event, 7 + way);
            settings.filter = filter;
            const Estimate estimate = cpu->prepare(scene, settings)->render({0, count}).estimate;
            CHECK(estimate.invalid() == 0);
            means[way] = mean_of(estimate);
            variances[way] = variance_of(estimate);
        }
        for (std::size_t i = 0; i < means[0].size(); ++i) {
            CAPTURE(i);
            CAPTURE(means[0][i]);
            CAPTURE(means[1][i]);
            const double spread = (variances[0][i] + variances[1][i]) / static_cast<double>(count);
            CHECK(std::abs(means[0][i] - means[1][i]) <= sigmas * std::sqrt(spread) + 1e-6);
        }
    }
}

TEST_CASE("pixel filters: a list of pixels has the bits of the whole image") {
    SceneBuilder builder = square_view();
    for (const Rectangle& r : rectangles) add(builder, emitter(glow), r);
    const std::vector<std::uint32_t> listed{0, 7, 14, 35};
    for (Tracer& tracer : tracers()) {
        if (tracer.name == "oracle") continue;  // it has no adaptive sampling
        CAPTURE(tracer.name);
        RenderSettings settings = settings_of(side, 1);
        settings.filter = PixelFilter::gaussian;
        settings.sampling = Sampling::adaptive;
        const auto job = tracer.renderer->prepare(builder.scene(), settings);
        const std::vector<double> whole = mean_of(job->render({0, 64}).estimate),
                                  some = mean_of(job->render_pixels({0, 64}, listed).estimate);
        for (std::size_t i = 0; i < listed.size(); ++i)
            for (std::size_t c = 0; c < 3; ++c) CHECK(some[3 * i + c] == whole[3 * listed[i] + c]);
    }
}
