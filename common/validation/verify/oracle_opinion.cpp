#include "common/validation/verify/oracle_opinion.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/error.h"
#include "common/statistics/multiple_tests.h"
#include "common/stopwatch.h"
#include "common/text.h"
#include "common/validation/verdict/greatest_sample.h"
#include "common/validation/verify/foreign_side.h"

namespace tandem {

namespace {

constexpr std::uint32_t probe_side = 16;  // longer side of the film that the oracle's speed is measured on
constexpr std::uint32_t least_side = 8;   // below, an image says too little of where a fault is
constexpr std::uint64_t least_samples = 2 * samples_per_block;   // two blocks have a variance
constexpr std::uint64_t wanted_samples = 8 * samples_per_block;  // that a size must allow for
constexpr std::uint64_t most_oracle_batches = 64;
constexpr std::uint64_t seed_of_tile = 3;  // beside the sides' own (verify.h) and a measurement of convergence
constexpr double part_to_plan = 0.8;       // speeds differ from what a tiny film foretells

// Never enlarged.
RenderSettings scaled_to(const RenderSettings& settings, std::uint32_t longer_side) {
    return with_longer_side(settings, std::min(longer_side, std::max(settings.width, settings.height)));
}

double pixels_of(const RenderSettings& settings) { return double{1.0} * settings.width * settings.height; }

// One renderer at work, and what it has gathered.
struct SampledRenderer {
    std::unique_ptr<RenderJob> job;
    Estimate estimate;
    std::vector<Batch> batches;

    SampledRenderer(Renderer& renderer, const Scene& scene, const RenderSettings& settings)
        : job(renderer.prepare(scene, settings)), estimate(settings.width, settings.height) {}

    void take(const Estimate& batch) {
        batches.push_back(batch_of(batch, TileGrid(batch.width(), batch.height(), standard_tile_edge)));
        estimate.merge(batch);
    }
    [[nodiscard]] SampledImage sampled() const { return sampled_by(*job, estimate, batches); }
};

class Arbitration {
public:
    explicit Arbitration(const OracleQuestion& request) : request_(request) {
        report_.info = request.oracle.info();
        report_.name = report_.info.backend;
        report_.settings = request.settings;
        report_.settings.accumulation.reset();  // the sides' own affair: an oracle loses no samples
        report_.budget_seconds = request.budget_seconds;
    }
    OracleOpinion run();

private:
    [[nodiscard]] std::optional<Estimate> render(
        RenderJob& job, SampleRange range, const std::vector<std::uint32_t>* pixels = nullptr);
    void choose_integrator();
    [[nodiscard]] bool choose_size();
    void ask_about_the_tile(const Rectangle& tile);
    void ask();
    [[nodiscard]] bool draw_to(std::uint64_t samples);
    void judge_look(const LookShare& share);
    void judge_sides(const std::vector<SampledRenderer>& renderers, const std::vector<PairedDifferences>& differences,
        const Criteria& criteria, const LookShare& share);
    [[nodiscard]] Criteria criteria_of_tile(const Estimate& tile, const Estimate& film) const;
    [[nodiscard]] std::optional<LevelResult> miss_of_closed_form(double false_alarm) const;
    [[nodiscard]] std::string off(const Judgement& judgement) const;
    void say_that_it_cannot_tell();
    void say_what_it_found();

    const OracleQuestion& request_;
    Stopwatch watch_;
    OracleOpinion report_;
    Criteria criteria_ = request_.criteria;
    Integrator oracle_integrator_ = request_.settings.integrator;
    std::uint64_t affordable_ = 0, batch_ = samples_per_block;
    std::string of_tile_;                         // its place, where the tile alone was judged
    std::vector<SampledRenderer> renderers_;      // reference, candidate, oracle
    std::vector<PairedDifferences> differences_;  // reference and candidate against the oracle
};

// The samples of `range`, or nothing when stopped or when the budget has gone.
std::optional<Estimate> Arbitration::render(
    RenderJob& job, SampleRange range, const std::vector<std::uint32_t>* pixels) {
    std::stop_source source;
    const std::stop_callback forward(request_.stop, [&] { source.request_stop(); });
    RenderControl control;
    control.stop = source.get_token();
    control.progress = [&](double) {
        if (request_.progress) request_.progress("asking the " + report_.name);
        if (watch_.seconds() > request_.budget_seconds) source.request_stop();
    };
    RenderResult result = pixels != nullptr ? job.render_pixels(range, *pixels, control) : job.render(range, control);
    if (result.estimate.count() != range.count()) return std::nullopt;
    return std::move(result.estimate);
}

// Throws UnsupportedError where the oracle cannot do the scene at all.
void Arbitration::choose_integrator() {
    bool samples_otherwise = false;
    report_.settings.hierarchy = HierarchyQuality::high;  // the oracle has none
    try {
        (void)request_.oracle.prepare(request_.scene, scaled_to(report_.settings, probe_side));
    } catch (const UnsupportedError&) {
        // The mean of `path` is not that of `whitted`.
        if (oracle_integrator_ == Integrator::path || oracle_integrator_ == Integrator::whitted) throw;
        oracle_integrator_ = Integrator::path;
        samples_otherwise = true;
    }
    if (!same_estimator(report_.info, RendererInfo{}, oracle_integrator_)) samples_otherwise = true;
    report_.settings.integrator = oracle_integrator_;
    if (oracle_integrator_ != Integrator::next_event) report_.settings.mis = true;
    if (!chooses_lights(oracle_integrator_)) report_.settings.light_sampling = LightSampling::power;
    if (!samples_otherwise) return;
    criteria_.same_estimator = false;
    criteria_.greatest = {
        greatest_sample(request_.scene, report_.settings), greatest_sample(request_.scene, request_.settings)};
}

bool Arbitration::choose_size() {
    RenderSettings probe = scaled_to(report_.settings, probe_side);
    const std::unique_ptr<RenderJob> job = request_.oracle.prepare(request_.scene, probe);
    const Stopwatch watch;
    if (!render(*job, {0, samples_per_block})) return false;
    const double oracle_seconds = watch.seconds() / static_cast<double>(samples_per_block) / pixels_of(probe);
    const double budget = part_to_plan * (request_.budget_seconds - watch_.seconds());
    for (std::uint32_t side = std::max(request_.settings.width, request_.settings.height);; side /= 2) {
        report_.settings = scaled_to(report_.settings, side);
        // A smaller film is not sure to make the two sides faster.
        const double cost = oracle_seconds * pixels_of(report_.settings) + request_.seconds_per_sample;
        const double samples = std::min(budget / cost, static_cast<double>(request_.max_samples));
        affordable_ = samples > 0.0 ? static_cast<std::uint64_t>(samples) / samples_per_block * samples_per_block : 0;
        if (affordable_ >= std::min(wanted_samples, request_.max_samples) || side / 2 < least_side) break;
    }
    return affordable_ >= least_samples;
}

bool Arbitration::draw_to(std::uint64_t samples) {
    for (std::uint64_t begin = renderers_.front().estimate.count(); begin < samples; begin += batch_) {
        std::vector<Estimate> batches;
        for (SampledRenderer& renderer : renderers_) {
            std::optional<Estimate> batch = render(*renderer.job, {begin, begin + batch_});
            if (!batch) return false;
            batches.push_back(std::move(*batch));
        }
        for (std::size_t side = 0; side < differences_.size(); ++side)
            differences_[side].add(batches.back(), batches[side]);
        for (std::size_t i = 0; i < renderers_.size(); ++i) renderers_[i].take(batches[i]);
    }
    return true;
}

void Arbitration::judge_sides(const std::vector<SampledRenderer>& renderers,
    const std::vector<PairedDifferences>& differences, const Criteria& criteria, const LookShare& share) {
    const SampledImage oracle = renderers.back().sampled();
    const auto against = [&](std::size_t side) {
        const PairedResult paired = differences[side].result(criteria, share.doubt / 2.0);
        SampledImage by_oracle = oracle, by_side = renderers[side].sampled();
        count_alike(by_oracle, by_side);
        return judge(by_oracle, by_side, &paired, criteria, share);
    };
    report_.reference = against(0);
    report_.candidate = against(1);
    report_.samples = oracle.samples;
    const bool reference = report_.reference->verdict == Verdict::disagree;
    const bool candidate = report_.candidate->verdict == Verdict::disagree;
    report_.outvoted = reference && candidate ? Outvoted::both
                       : reference            ? Outvoted::reference
                       : candidate            ? Outvoted::candidate
                                              : Outvoted::nobody;
}

void Arbitration::judge_look(const LookShare& share) { judge_sides(renderers_, differences_, criteria_, share); }

void Arbitration::ask() {
    while (affordable_ > batch_ * most_oracle_batches) batch_ *= 2;
    std::vector<std::uint64_t> looks;
    for (std::uint64_t samples = affordable_ / batch_ * batch_; samples >= 2 * batch_;
         samples = samples / 2 / batch_ * batch_)
        looks.insert(looks.begin(), samples);
    RenderSettings of_sides = report_.settings;
    of_sides.integrator = request_.settings.integrator;
    of_sides.mis = request_.settings.mis;
    of_sides.light_sampling = request_.settings.light_sampling;
    of_sides.hierarchy = request_.settings.hierarchy;
    of_sides.accumulation = request_.settings.accumulation;
    renderers_.emplace_back(request_.reference, request_.scene, of_sides);
    renderers_.emplace_back(request_.candidate, request_.scene, of_sides);
    renderers_.emplace_back(request_.oracle, request_.scene, report_.settings);
    for (std::size_t side = 0; side < 2; ++side)
        differences_.emplace_back(of_sides.width, of_sides.height, criteria_.fixed_tolerance);
    const double looks_count = static_cast<double>(looks.size());
    const double alarms = (request_.tile ? 0.25 : 0.5) * criteria_.false_alarm;
    const LookShare share{alarms / looks_count, criteria_.doubt / looks_count};
    for (const std::uint64_t samples : looks) {
        if (!draw_to(samples)) return;
        judge_look(share);
        if (report_.outvoted != Outvoted::nobody) return;
        if (request_.both_miss_the_closed_form && miss_of_closed_form(share.false_alarm)) return;
    }
}

// What is negligible in a tile, of the tile's scale, is so in the image that it makes here, of its own mean.
Criteria Arbitration::criteria_of_tile(const Estimate& tile, const Estimate& film) const {
    Criteria criteria = criteria_;
    double darkest = std::numeric_limits<double>::infinity();  // the tile's mean in units of its scale
    const auto means = [](const Estimate& estimate) {
        std::array<double, channel_count> sums{};
        const std::vector<double> values = mean_of(estimate);
        for (std::size_t i = 0; i < values.size(); ++i) sums[i % channel_count] += values[i];
        for (double& sum : sums) sum /= static_cast<double>(estimate.pixel_count());
        return sums;
    };
    const auto of_tile = means(tile), of_film = means(film);
    for (std::size_t c = 0; c < channel_count; ++c) {
        const double scale = std::max(of_tile[c], criteria.margins.tile_floor * of_film[c]);
        if (of_tile[c] > 0.0) darkest = std::min(darkest, of_tile[c] / scale);
    }
    const double brighter = std::isfinite(darkest) ? 1.0 / darkest : 1.0;
    Negligible& n = criteria.negligible;
    n.image = n.tile *= brighter;
    n.paired_image = n.paired_tile *= brighter;
    n.pixel *= brighter;
    n.paired_pixel *= brighter;
    return criteria;
}

void Arbitration::ask_about_the_tile(const Rectangle& tile) {
    RenderSettings of_oracle = report_.settings, of_sides = request_.settings;
    of_oracle.seed = of_sides.seed = request_.settings.seed + seed_of_tile;
    std::vector<SampledRenderer> renderers;
    renderers.emplace_back(request_.reference, request_.scene, of_sides);
    renderers.emplace_back(request_.candidate, request_.scene, of_sides);
    renderers.emplace_back(request_.oracle, request_.scene, of_oracle);
    const std::uint32_t width = tile.x1 - tile.x0, height = tile.y1 - tile.y0;
    std::vector<std::uint32_t> pixels;
    for (std::uint32_t y = tile.y0; y < tile.y1; ++y)
        for (std::uint32_t x = tile.x0; x < tile.x1; ++x) pixels.push_back(y * of_sides.width + x);
    const auto cut = [&](const Estimate& estimate, SampleRange range, bool whole_film) {
        const Estimate::Plane all = estimate.totals();
        Estimate::Plane plane;
        for (std::size_t k = 0; k < pixels.size(); ++k)
            for (std::size_t c = 0; c < channel_count; ++c)
                plane.push_back(all[(whole_film ? pixels[k] : k) * channel_count + c]);
        Estimate part(width, height);
        part.add_block(range, std::move(plane));
        return part;
    };
    for (SampledRenderer& renderer : renderers) renderer.estimate = Estimate(width, height);
    std::vector<PairedDifferences> differences;
    std::optional<Criteria> criteria;
    std::uint64_t next_look = 2;
    double alarms = 0.25 * criteria_.false_alarm, doubt = criteria_.doubt;
    const std::uint64_t blocks = request_.max_samples / samples_per_block;
    for (std::uint64_t done = 0; done < blocks && watch_.seconds() < 0.5 * request_.budget_seconds;) {
        const SampleRange range{done * samples_per_block, (done + 1) * samples_per_block};
        std::vector<Estimate> parts;
        for (SampledRenderer& renderer : renderers) {
            const bool oracle = &renderer == &renderers.back();
            const std::optional<Estimate> block = render(*renderer.job, range, oracle ? &pixels : nullptr);
            if (!block) return;
            parts.push_back(cut(*block, range, !oracle));
            if (!criteria) criteria = criteria_of_tile(parts.front(), *block);
        }
        if (differences.empty())
            for (std::size_t side = 0; side < 2; ++side)
                differences.emplace_back(width, height, criteria->fixed_tolerance);
        for (std::size_t side = 0; side < 2; ++side) differences[side].add(parts.back(), parts[side]);
        for (std::size_t i = 0; i < renderers.size(); ++i) renderers[i].take(parts[i]);
        if (++done < next_look) continue;
        next_look *= 2;
        alarms *= 0.5, doubt *= 0.5;  // so many looks as there is time for
        judge_sides(renderers, differences, *criteria, {alarms, doubt});
        if (report_.outvoted == Outvoted::nobody) continue;
        report_.settings.seed = of_oracle.seed;
        of_tile_ = fmt::format("x {} to {}, y {} to {}", tile.x0, tile.x1 - 1, tile.y0, tile.y1 - 1);
        return;
    }
}

// The oracle's own miss of the closed form, if it is sure at that level.
std::optional<LevelResult> Arbitration::miss_of_closed_form(double false_alarm) const {
    const ClosedFormUse use = closed_form_of(request_.scene, report_.settings);
    if (!use.form || renderers_.empty() || renderers_.back().batches.empty()) return std::nullopt;
    LevelResult level =
        compare_closed_form("closed form", *use.form, renderers_.back().sampled(), criteria_, criteria_.doubt / 2.0);
    if (level.p > false_alarm) return std::nullopt;
    return level;
}

void Arbitration::say_that_it_cannot_tell() {
    const std::string seconds = fmt::format("{:.2g} s", request_.budget_seconds);
    if (request_.stop.stop_requested()) {
        report_.text = "the " + report_.name + " was stopped before it could tell";
    } else if (!report_.reference || !report_.candidate) {
        report_.text = fmt::format("the {} cannot tell which is right: {} are too few for it", report_.name, seconds);
    } else if (criteria_.greatest) {
        report_.text = fmt::format(
            "the {} cannot tell within {} which is right: it samples lights otherwise, and bright paths may be so rare "
            "that it has met none",
            report_.name, seconds);
    } else {
        const auto known = [](const Judgement& judgement) {
            return percent(widest(judgement.level("paired image")).bound());
        };
        report_.text = fmt::format("the {} cannot tell within {} which is right: {} is within ±{} of it, {} within ±{}",
            report_.name, seconds, request_.reference_name, known(*report_.reference), request_.candidate_name,
            known(*report_.candidate));
    }
}

// "+3 % (tiles 8x8, red, x 0 to 7, y 0 to 7)"; of a tile that was judged as an image, with its place.
std::string Arbitration::off(const Judgement& judgement) const {
    const std::string text = off_by(judgement);
    return of_tile_.empty() ? text : fmt::format("{}, within {}", text, of_tile_);
}

void Arbitration::say_what_it_found() {
    // A scene whose closed form even the oracle misses is more likely wrong itself.
    const std::optional<LevelResult> miss = miss_of_closed_form(criteria_.false_alarm);
    if (report_.outvoted == Outvoted::nobody && miss && request_.both_miss_the_closed_form) {
        report_.text = fmt::format(
            "the {} contradicts neither, and misses the closed form too, by {}: suspect the loader, MODEL.md or the "
            "formula",
            report_.name, off_by(*miss));
        return;
    }
    if (report_.outvoted == Outvoted::nobody)
        say_that_it_cannot_tell();
    else
        report_.text = vote_of("the " + report_.name, report_.outvoted, request_.reference_name,
            request_.candidate_name, off(*report_.reference), off(*report_.candidate));
    if (miss) report_.text += fmt::format("; the {} misses the closed form too, by {}", report_.name, off_by(*miss));
}

OracleOpinion Arbitration::run() {
    try {
        choose_integrator();
        try {
            if (request_.tile) ask_about_the_tile(*request_.tile);
        } catch (const UnsupportedError&) {  // this one renders whole films alone
        }
        if (report_.outvoted == Outvoted::nobody && choose_size()) ask();
        say_what_it_found();
    } catch (const Error& error) {  // a device lost, too: what the two have shown stands
        report_.text = "the " + report_.name + " was not asked: " + error.what();
    }
    report_.seconds = watch_.seconds();
    return std::move(report_);
}

}  // namespace

const char* name_of(Outvoted outvoted) {
    switch (outvoted) {
        case Outvoted::reference:
            return "reference";
        case Outvoted::candidate:
            return "candidate";
        case Outvoted::both:
            return "both";
        case Outvoted::nobody:
            break;
    }
    return "nobody";
}

Outvoted outvoted_by_closed_form(const Judgement& judgement) {
    const bool reference = judgement.significant(closed_form_reference_level);
    const bool candidate = judgement.significant(closed_form_candidate_level);
    if (reference && candidate) return Outvoted::both;
    if (reference) return Outvoted::reference;
    return candidate ? Outvoted::candidate : Outvoted::nobody;
}

std::string vote_of(const std::string& judge, Outvoted outvoted, const std::string& reference_name,
    const std::string& candidate_name, const std::string& reference_off, const std::string& candidate_off) {
    switch (outvoted) {
        case Outvoted::reference:
            return fmt::format(
                "{} sides with {}: {} is off by {}", judge, candidate_name, reference_name, reference_off);
        case Outvoted::candidate:
            return fmt::format(
                "{} sides with {}: {} is off by {}", judge, reference_name, candidate_name, candidate_off);
        case Outvoted::both:
            return fmt::format("{} sides with neither: {} is off by {}, {} by {}", judge, reference_name, reference_off,
                candidate_name, candidate_off);
        case Outvoted::nobody:
            break;
    }
    return judge + " contradicts neither";
}

OracleOpinion ask_oracle(const OracleQuestion& request) { return Arbitration(request).run(); }

}  // namespace tandem
