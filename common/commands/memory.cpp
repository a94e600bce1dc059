#include "common/commands/memory.h"

#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <bit>
#include <charconv>
#include <fstream>

#include "common/commands/help.h"
#include "common/error.h"
#include "common/image/tiled_image.h"

namespace tandem {

namespace {

constexpr double mebibyte = 0x1p20;

// A number in a file of one, or nothing.
std::optional<std::uint64_t> number_in(const char* file) {
    std::uint64_t number = 0;
    if (std::ifstream(file) >> number) return number;
    return std::nullopt;
}

constexpr std::uint64_t plane = channel_count * sizeof(Moments);  // a pixel's sums

// The image of a film while it is made and written: its sums and counts, channels, and the file's bytes.
constexpr std::uint64_t film_bytes = plane + sizeof(std::uint64_t);
constexpr std::uint64_t channels_bytes = 7 * sizeof(float);
constexpr std::uint64_t means_bytes = 2 * channel_count * sizeof(double);  // and variances

std::uint64_t film_pixel_bytes(const FilmUse& film, const MemoryForecast& forecast) {
    const std::uint64_t blocks = std::max<std::uint64_t>(1, film.samples / samples_per_block);
    // Before the last block, runs of 1, 2, 4, ... blocks (estimate.h); after it, one for each bit of their number.
    const auto runs_before = static_cast<std::uint64_t>(std::bit_width(blocks)) - 1;
    const std::uint64_t runs = static_cast<std::uint64_t>(std::popcount(blocks)) +
                               (blocks > 1 && film.samples % samples_per_block != 0 ? 1 : 0);
    const std::uint64_t rest = film.by_error ? 2 * plane : 0;  // of two scramblings
    const std::uint64_t rendering = forecast.pass_pixel + plane * (1 + runs_before) + rest;
    // Whole films also tell their error (stopping.h): variances, and how they scatter. Files are made in memory.
    const std::uint64_t telling = plane * runs + film_bytes + (film.whole ? means_bytes + 16 : 0) + rest;
    const std::uint64_t writing =
        film_bytes + channels_bytes + (film.whole ? std::max(means_bytes, 3 * channels_bytes) : means_bytes);
    // Before it, trials of settings (choose_settings.h): a second job, the samples of the best two so far, and those of
    // two scramblings and their sum.
    const std::uint64_t trying = film.by_error ? forecast.job_pixel + forecast.pass_pixel + 5 * plane : 0;
    return forecast.job_pixel + std::max({trying, rendering, telling, writing}) +
           (film.whole ? 0 : sizeof(std::uint32_t));
}

}  // namespace

void add_memory_option(CLI::App& command, std::string& memory, const std::string& help) {
    command.add_option("--memory", memory, help)->type_name("SIZE")->group(rare_options);
}

std::uint64_t memory_limit(const std::string& memory) {
    if (memory.empty()) return free_bytes() / 4 * 3;
    double number = 0.0;
    const auto [end, error] = std::from_chars(memory.data(), memory.data() + memory.size(), number);
    std::string_view unit(end, static_cast<std::size_t>(memory.data() + memory.size() - end));
    while (unit.starts_with(' ')) unit.remove_prefix(1);
    for (const auto& [name, bytes] :
        {std::pair{"MiB", 0x1p20}, {"GiB", 0x1p30}, {"TiB", 0x1p40}, {"MB", 1e6}, {"GB", 1e9}, {"TB", 1e12}})
        if (error == std::errc{} && unit == name && number > 0.0 && number * bytes < 0x1p60)
            return static_cast<std::uint64_t>(number * bytes);
    throw InputError(fmt::format("--memory: '{}' is no amount of memory; write 512MiB or 2GiB, for example", memory));
}

std::uint64_t free_bytes() {
    std::uint64_t free =
        static_cast<std::uint64_t>(sysconf(_SC_PHYS_PAGES)) * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
    std::ifstream lines("/proc/meminfo");
    std::string key, unit;
    for (std::uint64_t kibibytes = 0; lines >> key >> kibibytes; std::getline(lines, unit))
        if (key == "MemAvailable:") free = kibibytes << 10;
    const auto most = number_in("/sys/fs/cgroup/memory.max"), taken = number_in("/sys/fs/cgroup/memory.current");
    if (most && taken) free = std::min(free, *most > *taken ? *most - *taken : 0);
    return free;
}

std::uint64_t resident_bytes() {
    std::uint64_t pages = 0, resident = 0;
    std::ifstream("/proc/self/statm") >> pages >> resident;
    return resident * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
}

std::uint64_t peak_resident_bytes() {
    rusage usage{};
    (void)getrusage(RUSAGE_SELF, &usage);
    return static_cast<std::uint64_t>(usage.ru_maxrss) << 10;
}

std::string beyond_memory(const Scene& scene, const RenderSettings& settings) {
    // The tables and trees of a primitive, where the leanest tracer places it; render forecasts its own to the end.
    constexpr std::uint64_t least_bytes = 256;
    const std::uint64_t needed = placed_counts(scene, placed_meshes(scene, settings)).all() * least_bytes;
    const std::uint64_t free = free_bytes();
    if (needed <= free) return {};
    return fmt::format("{} primitives, as placed, take more than {} of memory, and {} are free",
        placed_primitives(scene).size(), shown_bytes(needed), shown_bytes(free));
}

std::string shown_bytes(std::uint64_t bytes) {
    const double mebibytes = static_cast<double>(bytes) / mebibyte;
    if (mebibytes >= 10240.0) return fmt::format("{:.1f} GiB", mebibytes / 1024.0);
    return fmt::format("{:.0f} MiB", std::ceil(mebibytes));
}

std::uint64_t MemoryNeed::total() const { return scene() + std::max(building, film); }

std::string MemoryNeed::text() const {
    return fmt::format("{} (program and scene {}, tables {}, trees {}, film {})", shown_bytes(total()),
        shown_bytes(program), shown_bytes(tables), shown_bytes(trees), shown_bytes(film));
}

nlohmann::json MemoryNeed::json() const {
    const auto in_mebibytes = [](std::uint64_t bytes) { return static_cast<double>(bytes) / mebibyte; };
    return {{"program", in_mebibytes(program)}, {"tables", in_mebibytes(tables)}, {"trees", in_mebibytes(trees)},
        {"film", in_mebibytes(film)}, {"forecast", in_mebibytes(total())}};
}

FilmUse film_use(const RenderSettings& settings, const StoppingRule& rule) {
    constexpr std::uint64_t likely = 2 * samples_per_block;  // of a film by time that is large
    return {.pixels = std::uint64_t{settings.width} * settings.height,
        .samples = rule.samples.value_or(likely),
        .by_error = rule.relative_error.has_value()};
}

MemoryNeed memory_need(
    const Renderer& renderer, const Scene& scene, const RenderSettings& settings, const FilmUse& film) {
    MemoryForecast forecast;
    if (const auto* forecasting = dynamic_cast<const ForecastingRenderer*>(&renderer))
        forecast = forecasting->forecast(scene, settings, film.pixels);
    MemoryNeed need{.program = resident_bytes(),
        .tables = forecast.tables,
        .trees = forecast.trees,
        .building = forecast.building,
        .film = forecast.workers + film.pixels * film_pixel_bytes(film, forecast)};
    if (settings.sampling == Sampling::adaptive) need.film += film.pixels * plane;  // sums of its passes
    return need;
}

}  // namespace tandem
