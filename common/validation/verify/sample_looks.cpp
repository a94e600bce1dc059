#include "common/validation/verify/sample_looks.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>

#include "common/error.h"
#include "common/render/tiled_renderer.h"
#include "common/stopwatch.h"

namespace tandem {

namespace {

using Plane = Estimate::Plane;

// Two, as a range's first number alone may be right where the next is not.
constexpr std::uint64_t samples_a_look = 2;
// Every power of two at which a narrower number of samples would end or lose its lowest bit. These are 8, 16, 24
// (singles), 31, 32 bits, and the last block before 2^32.
constexpr std::array<std::uint64_t, 9> counters{0, 1u << 8, 1u << 16, 1u << 24, (1u << 24) + 64, 1u << 31,
    (std::uint64_t{1} << 32) - 64, std::uint64_t{1} << 32, (std::uint64_t{1} << 40) + 64};
constexpr std::array<std::uint64_t, 4> arithmetic_counters{64, 1u << 10, 1u << 20, std::uint64_t{3} << 32};
// Primes, so that no workgroup or tile is whole at an edge; and more pixels than 16 bits count.
constexpr std::array<std::array<std::uint32_t, 2>, 2> sizes{{{127, 83}, {307, 263}}};
constexpr std::uint32_t small_tile = 1009;  // pixels, a prime
constexpr std::uint32_t run_pixels = 64;    // consecutive pixels that are counted together
constexpr std::uint32_t most_limits = 16;   // bounce limits

class Looks {
public:
    explicit Looks(const SampleLooksRequest& request) : request_(request) {}

    SampleLooks run() {
        look_at_counters();
        last_step_ = watch_.seconds();
        look_at_sizes();
        if (request_.other_precision != nullptr) {
            look_at_bounces();
            look_at_arithmetic();
        }
        return std::move(result_);
    }

private:
    enum Who : std::size_t { reference, candidate, other };
    static constexpr std::array who_names{"reference", "candidate", "reference in another precision"};
    using Jobs = std::array<std::unique_ptr<RenderJob>, 3>;

    [[nodiscard]] Jobs prepare(const RenderSettings& settings, bool with_other);
    [[nodiscard]] std::optional<Plane> samples(Jobs& jobs, Who who, std::uint64_t begin);
    [[nodiscard]] RenderSettings short_paths() const {
        RenderSettings settings = request_.settings;
        settings.bounces = std::min(settings.bounces, short_path_bounces);
        return settings;
    }
    // Whether another step would end in time, if it takes as long as the last one did.
    [[nodiscard]] bool in_time() const { return watch_.seconds() + last_step_ <= request_.budget_seconds; }
    [[nodiscard]] bool begins(const char* level) {
        if (result_.stopped) return false;
        if (!in_time()) result_.left_out.emplace_back(level);
        return in_time();
    }
    void look_at_counters();
    void look_at_sizes();
    bool look_at_size(std::uint32_t width, std::uint32_t height, bool tiles, std::vector<SampleRegion>& regions);
    void look_at_bounces();
    void look_at_arithmetic();

    const SampleLooksRequest& request_;
    Stopwatch watch_;
    double last_step_ = 0.0;  // seconds
    SampleLooks result_;
};

Looks::Jobs Looks::prepare(const RenderSettings& settings, bool with_other) {
    return {request_.reference.prepare(request_.scene, settings), request_.candidate.prepare(request_.scene, settings),
        with_other ? request_.other_precision->prepare(request_.scene, settings) : nullptr};
}

// The sums of a few samples, or nothing once stopped.
std::optional<Plane> Looks::samples(Jobs& jobs, Who who, std::uint64_t begin) {
    RenderControl control;
    control.stop = request_.stop;
    if (request_.progress) request_.progress(fmt::format("single samples, {}", who_names[who]));
    const RenderResult rendered = jobs[who]->render({begin, begin + samples_a_look}, control);
    if (rendered.estimate.count() != samples_a_look) {
        result_.stopped = true;
        return std::nullopt;
    }
    if (who == reference) result_.reference_seconds += rendered.seconds;
    if (who == candidate) result_.candidate_seconds += rendered.seconds;
    if (who == reference) result_.invalid_reference += rendered.estimate.invalid();
    if (who == candidate) result_.invalid_candidate += rendered.estimate.invalid();
    return rendered.estimate.totals();
}

void Looks::look_at_counters() {
    RenderSettings settings = short_paths();
    settings.seed = high_seed(settings.seed);
    Jobs jobs = prepare(settings, false);
    std::vector<SampleRegion> regions;
    for (const std::uint64_t counter : counters) {
        const std::optional<Plane> a = samples(jobs, reference, counter);
        const std::optional<Plane> b = a ? samples(jobs, candidate, counter) : std::nullopt;
        if (!b) return;
        regions.push_back({fmt::format("number {} on, with seed {}", counter, settings.seed),
            count(compare_samples(*a, *b, gone_elsewhere))});
    }
    result_.levels.push_back(sample_level(counter_level, regions));
}

// Rows, columns and runs of consecutive pixels.
void add_regions(const std::vector<SampleState>& states, std::uint32_t width, std::uint32_t height,
    const std::string& film, std::vector<SampleRegion>& regions) {
    std::vector<SampleRegion> rows(height), columns(width), runs((states.size() + run_pixels - 1) / run_pixels);
    for (std::uint32_t y = 0; y < height; ++y) rows[y].place = fmt::format("row {} of {}", y, film);
    for (std::uint32_t x = 0; x < width; ++x) columns[x].place = fmt::format("column {} of {}", x, film);
    for (std::size_t i = 0; i < runs.size(); ++i)
        runs[i].place = fmt::format("pixels {} to {} of {}", i * run_pixels,
            std::min<std::size_t>((i + 1) * run_pixels, states.size()) - 1, film);
    for (std::size_t i = 0; i < states.size(); ++i) {
        rows[i / width].count.add(states[i]);
        columns[i % width].count.add(states[i]);
        runs[i / run_pixels].count.add(states[i]);
    }
    for (std::vector<SampleRegion>* part : {&rows, &columns, &runs})
        regions.insert(regions.end(), part->begin(), part->end());
}

bool Looks::look_at_size(std::uint32_t width, std::uint32_t height, bool tiles, std::vector<SampleRegion>& regions) {
    RenderSettings settings = short_paths();
    settings.width = width;
    settings.height = height;
    std::string film = fmt::format("{}x{} pixels", width, height);
    Jobs jobs{request_.reference.prepare(request_.scene, settings), nullptr, nullptr};
    auto* tiled = tiles ? dynamic_cast<TiledRenderer*>(&request_.candidate) : nullptr;
    if (tiled != nullptr) {
        film += fmt::format(" in tiles of {}", small_tile);
        jobs[candidate] = tiled->prepare_tiled(request_.scene, settings, small_tile);
    } else
        jobs[candidate] = request_.candidate.prepare(request_.scene, settings);
    const std::optional<Plane> a = samples(jobs, reference, 0);
    const std::optional<Plane> b = a ? samples(jobs, candidate, 0) : std::nullopt;
    if (!b) return false;
    add_regions(compare_samples(*a, *b, gone_elsewhere), width, height, film, regions);
    return true;
}

// The smaller film is cut into tiles as well, where sums do not run on from block to block.
void Looks::look_at_sizes() {
    if (!begins(size_level)) return;
    std::vector<SampleRegion> regions;
    const bool tiles = request_.settings.accumulation != Accumulation::plain &&
                       dynamic_cast<TiledRenderer*>(&request_.candidate) != nullptr;
    std::size_t step = 0;
    for (const auto& [width, height, cut] : {std::tuple{sizes[0][0], sizes[0][1], false},
             {sizes[1][0], sizes[1][1], false}, {sizes[0][0], sizes[0][1], true}}) {
        if (cut && !tiles) continue;
        if (step++ > 0 && !begins(size_level)) break;
        const Stopwatch watch;
        if (!look_at_size(width, height, cut, regions)) return;
        last_step_ = watch.seconds();
    }
    result_.levels.push_back(sample_level(size_level, regions));
}

// What one more bounce brings, of paths that have not parted before. Where single precision parts many, more may.
class BouncePairs {
public:
    BouncePairs(const Plane& a, const Plane& b) : a_(a), b_(b), parted_(a.size() / channel_count, false) {
        mark(compare_samples(a, b, gone_elsewhere));
    }

    SampleCount add(const Plane& a, const Plane& b) {
        const std::vector<SampleState> states = compare_samples(brought(a_, a, b), brought(b_, b, a), gone_elsewhere);
        SampleCount result;
        for (std::size_t i = 0; i < states.size(); ++i)
            if (!parted_[i]) result.add(states[i]);
        mark(states);
        a_ = a;
        b_ = b;
        return result;
    }

private:
    // Both sums are rounded: less than 2^-10 of either says nothing, 2^-4 of which is the sums' own 2^-14.
    static Plane brought(const Plane& before, const Plane& now, const Plane& others) {
        Plane result(now.size());
        for (std::size_t i = 0; i < now.size(); ++i) {
            const double more = now[i].sum - before[i].sum;
            result[i].sum =
                std::abs(more) > 0x1p-10 * std::max(std::abs(now[i].sum), std::abs(others[i].sum)) ? more : 0.0;
        }
        return result;
    }
    void mark(const std::vector<SampleState>& states) {
        for (std::size_t i = 0; i < states.size(); ++i)
            if (states[i] == SampleState::parted) parted_[i] = true;
    }

    Plane a_, b_;
    std::vector<bool> parted_;
};

// What a candidate of the coarsest operations may part of a bounce, where single precision by itself parts this many. A
// path that holds against 17 errors, one after the other, holds against each. Below 1, so that a bounce that parts
// wholly is noticed where rounding parts some.
double tolerated_share(const SampleCount& expected) {
    return std::max(tolerated_parted_share, 1.0 - std::pow(1.0 - share_limit(expected), coarsest_operation));
}

void Looks::look_at_bounces() {
    if (!begins(bounce_level)) return;
    RenderSettings settings = request_.settings;
    settings.seed = high_seed(settings.seed) + 1;
    const std::uint32_t deepest = std::min(settings.bounces, most_limits);
    std::optional<BouncePairs> sides, precisions;
    std::vector<SampleRegion> regions;
    std::uint32_t before = 1;  // shorter paths are looked at above
    if (deepest <= before) return;
    std::vector<std::uint32_t> limits{before};
    for (std::size_t i = 0; i < limits.size(); ++i) {
        const std::uint32_t limit = limits[i];
        const double start = watch_.seconds();
        settings.bounces = limit;
        Jobs jobs = prepare(settings, true);
        std::array<Plane, 3> planes;
        for (const Who who : {reference, candidate, other}) {
            std::optional<Plane> plane = samples(jobs, who, 0);
            if (!plane) return;
            planes[who] = std::move(*plane);
        }
        if (!sides) {
            sides.emplace(planes[reference], planes[candidate]);
            precisions.emplace(planes[reference], planes[other]);
            // Scenes that take long to prepare have fewer limits.
            const double affordable = 0.25 * (request_.budget_seconds - watch_.seconds()) / (watch_.seconds() - start);
            for (const std::uint32_t later : later_limits(deepest, affordable)) limits.push_back(later);
            if (limits.size() == 1) result_.left_out.emplace_back(bounce_level);
            continue;
        }
        const SampleCount expected = precisions->add(planes[reference], planes[other]);
        regions.push_back(
            {fmt::format("bounce {}{}", limit - before > 1 ? fmt::format("{} to ", before + 1) : "", limit),
                sides->add(planes[reference], planes[candidate]), tolerated_share(expected)});
        before = limit;
    }
    if (!regions.empty()) result_.levels.push_back(sample_level(bounce_level, regions));
}

void Looks::look_at_arithmetic() {
    if (!begins(arithmetic_level)) return;
    RenderSettings settings = request_.settings;
    settings.seed = high_seed(settings.seed);
    Jobs jobs = prepare(settings, true);
    const double rounding = float_transport_tolerance(counted_bounces);
    Arithmetic arithmetic;
    SampleRegion all{"the image", {}, 0.0};
    for (const std::uint64_t counter : arithmetic_counters) {
        const std::optional<Plane> a = samples(jobs, reference, counter);
        const std::optional<Plane> b = a ? samples(jobs, candidate, counter) : std::nullopt;
        const std::optional<Plane> c = b ? samples(jobs, other, counter) : std::nullopt;
        if (!c) return;
        for (const SampleState state : compare_samples(*a, *b, coarsest_operation * rounding)) all.count.add(state);
        for (const SampleState state : compare_samples(*a, *c, rounding)) arithmetic.rounded.add(state);
        for (const SampleState state : compare_samples(*a, *c, coarsest_operation * rounding))
            arithmetic.expected.add(state);
    }
    // Differences that are proportional to the error grow beyond the limit; paths that part do so as often as errors
    // are large.
    arithmetic.allowed = all.tolerated =
        std::min(1.0, share_limit(arithmetic.rounded) + (coarsest_operation - 1.0) * share_limit(arithmetic.expected));
    arithmetic.level = sample_level(arithmetic_level, {all});
    arithmetic.level.place = arithmetic.text();
    result_.arithmetic = std::move(arithmetic);
}

}  // namespace

std::vector<std::uint32_t> later_limits(std::uint32_t deepest, double affordable) {
    std::vector<std::uint32_t> limits;
    if (affordable < 1.0) return limits;
    const auto stride = std::max(1u, static_cast<std::uint32_t>(std::ceil(deepest / affordable)));
    for (std::uint32_t limit = 1; limit < deepest;) limits.push_back(limit = std::min(limit + stride, deepest));
    return limits;
}

SampleLooks look_at_samples(const SampleLooksRequest& request) { return Looks(request).run(); }

}  // namespace tandem
