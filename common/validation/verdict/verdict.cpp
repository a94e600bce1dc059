#include "common/validation/verdict/verdict.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/error.h"
#include "common/statistics/multiple_tests.h"
#include "common/text.h"

namespace tandem {

namespace {

constexpr std::array<const char*, channel_count> channel_names{"red", "green", "blue"};

std::string place(const RegionComparison& region) {
    const Rectangle& r = region.region;
    if (r.x1 == r.x0 + 1 && r.y1 == r.y0 + 1) return fmt::format("pixel ({}, {})", r.x0, r.y0);
    return fmt::format("x {} to {}, y {} to {}", r.x0, r.x1 - 1, r.y0, r.y1 - 1);
}

bool compares_means(const LevelResult& level) {
    return !level.name.starts_with("variance") && level.name != paired_paths_level &&
           level.name != paired_pixels_level && !level.name.starts_with(sample_level_prefix);
}

// "differs by +1.2 % (+0.9 % to +1.5 %)", or "is 78 times as large (76 times to 80 times)".
std::string how_much(const RegionComparison& region, const std::string& where) {
    const std::string interval =
        fmt::format(" ({} to {})", signed_percent(region.relative_low), signed_percent(region.relative_high));
    if (region.relative > 1.0)
        return fmt::format(
            "is{}{} as large{}", where.empty() ? " " : where + ": ", signed_percent(region.relative), interval);
    return fmt::format("differs{} by {}{}", where, signed_percent(region.relative), interval);
}

std::string reason_of(const LevelResult& level) {
    const RegionComparison& worst = level.worst;
    const char* channel = channel_names.at(worst.channel);
    const std::string p = level.p > 0.0 ? fmt::format("p = {:.1e}", level.p) : std::string("p below 1e-300");
    const std::string chance = fmt::format(", {} against {:.1e}", p, level.threshold);
    if (level.name == paired_paths_level)
        return fmt::format("{}: {} of the pixels of {} part although both sides draw the same random numbers{}",
            level.name, percent(worst.relative), place(worst), chance);
    if (level.name == arithmetic_level)
        return fmt::format("{}: coarser than single precision, {}{}", level.name, level.place, chance);
    if (level.name.starts_with(sample_level_prefix))
        return fmt::format("{}: {} of the samples of {} part although both sides draw the same random numbers{}",
            level.name, percent(worst.relative), level.place, chance);
    if (level.name == paired_pixels_level)
        return fmt::format("{}: {} differs by {} (root mean square) within {}{}", level.name, channel,
            percent(worst.relative), place(worst), chance);
    if (level.name.starts_with("closed form"))
        return fmt::format("{}: the mean in {} {}{}", level.name, channel, how_much(worst, ""), chance);
    const std::string where = level.regions.size() == channel_count ? "" : " most surely at " + place(worst);
    const char* what = level.name.starts_with("variance") ? " variance " : " ";
    return fmt::format("{}: {}{}{}{}", level.name, channel, what, how_much(worst, where), chance);
}

std::vector<LevelResult> mean_levels(const SampledImage& reference, const SampledImage& candidate, const Scales& scales,
    const Criteria& criteria, double alpha_each_side) {
    const Negligible& negligible = criteria.negligible;
    const double floor = criteria.margins.tile_floor;
    std::vector<LevelResult> levels;
    levels.push_back(compare_regions(
        "image", reference, candidate, 0, scales, negligible.image, floor, alpha_each_side, criteria.greatest));
    for (const std::uint32_t edge : {2 * standard_tile_edge, standard_tile_edge, standard_tile_edge / 2})
        levels.push_back(compare_regions(fmt::format("tiles {0}x{0}", edge), reference, candidate, edge, scales,
            negligible.tile, floor, alpha_each_side, criteria.greatest));
    return levels;
}

// What a test at this level's threshold could have seen: median over regions, and of the worst one.
void set_detectable(LevelResult& level, double negligible, double power) {
    if (level.regions.empty()) return;
    std::vector<double> differences;
    // A region's p is so many times that of the normal theory at least (symmetric_sum_tail).
    const double alpha = level.threshold / static_cast<double>(level.tests) / symmetric_sum_factor();
    for (const RegionComparison& region : level.regions)
        differences.push_back(negligible + minimum_detectable_difference(region.relative_error, alpha, power));
    const auto middle = differences.begin() + static_cast<std::ptrdiff_t>(differences.size() / 2);
    level.resolution_relative = *std::ranges::max_element(differences);
    std::ranges::nth_element(differences, middle);
    level.minimum_detectable_relative = *middle;
}

// Holm over the levels.
void set_significance(std::vector<LevelResult>& levels, double false_alarm) {
    std::vector<double> p_values;
    for (const LevelResult& level : levels) p_values.push_back(level.p);
    const std::vector<double> adjusted = holm_adjusted(p_values), thresholds = holm_thresholds(p_values, false_alarm);
    for (std::size_t i = 0; i < levels.size(); ++i) {
        levels[i].threshold = thresholds[i];
        levels[i].significant = adjusted[i] <= false_alarm;
    }
}

void set_detectable(std::vector<LevelResult>& levels, const Criteria& criteria) {
    for (LevelResult& level : levels) {
        if (!compares_means(level)) continue;
        const bool paired = level.name.starts_with("paired");
        const bool image = level.name.ends_with("image") || level.name.starts_with("closed form");
        const Negligible& n = criteria.negligible;
        const double negligible = paired ? (image ? n.paired_image : n.paired_tile) : (image ? n.image : n.tile);
        set_detectable(level, negligible, criteria.power);
    }
}

// Samples of a renderer, which tells their number alone; values of an image, with the first of their pixels.
std::string told_of_invalid(const std::string& name, const SampledImage& side) {
    constexpr std::size_t most_named = 4;
    const std::vector<std::uint32_t>& pixels = side.invalid_pixels;
    if (pixels.empty()) return fmt::format("{} samples of the {} are NaN, infinite or negative", side.invalid, name);
    std::string places;
    for (std::size_t i = 0; i < std::min(pixels.size(), most_named); ++i)
        places += fmt::format("{}({}, {})", i == 0 ? "" : ", ", pixels[i] % side.width, pixels[i] / side.width);
    return fmt::format("{} values in {} pixels of the {} are NaN, infinite or negative: {}{}", side.invalid,
        pixels.size(), name, places, pixels.size() > most_named ? ", ..." : "");
}

void add_faults(Judgement& judgement, const SampledImage& reference, const SampledImage& candidate) {
    std::vector<std::string>& reasons = judgement.reasons;
    for (const auto& [name, side] : {std::pair{"reference", &reference}, {"candidate", &candidate}})
        if (side->invalid > 0) reasons.push_back(told_of_invalid(name, *side));
    const FixedPixels& fixed = judgement.fixed;
    if (fixed.mismatches > 0) {
        const std::size_t pixel = fixed.first_mismatch / channel_count;
        reasons.push_back(fmt::format(
            "{} of {} pixel channels without variance differ beyond rounding, by up to {}, first at ({}, {})",
            fixed.mismatches, fixed.count, percent(fixed.greatest_relative), pixel % reference.width,
            pixel / reference.width));
    }
    for (const LevelResult& level : judgement.levels)
        if (level.significant) reasons.push_back(reason_of(level));
}

bool is_black(const SampledImage& image) {
    return image.invalid == 0 &&  // no radiance is negative, so that a mean of 0 is of zeros
           std::ranges::all_of(image.pixels, [](const PixelStatistics& pixel) { return pixel.mean == 0.0; });
}

// To the rounding that fixed pixels are allowed.
bool is_constant(const SampledImage& image, double tolerance) {
    for (std::size_t i = 0; i < image.pixels.size(); ++i) {
        const PixelStatistics &pixel = image.pixels[i], &first = image.pixels[i % channel_count];
        const double allowed = tolerance * std::abs(first.mean);
        if (std::abs(pixel.mean - first.mean) > allowed || std::sqrt(pixel.variance) > allowed) return false;
    }
    return true;
}

bool is_zero(const ClosedForm* form) {
    return form != nullptr && std::ranges::all_of(form->radiance, [](double radiance) { return radiance == 0.0; });
}

void explain_indecision(Judgement& judgement, const Margins& margins) {
    const RegionComparison &image = widest(judgement.level("image")), &tile = widest(judgement.level("tiles 16x16"));
    if (!judgement.image_within_margin)
        judgement.reasons.push_back(fmt::format("image: {} is only known to ±{}, margin {}",
            channel_names.at(image.channel), percent(image.bound()), percent(margins.image)));
    if (!judgement.tiles_within_margin)
        judgement.reasons.push_back(fmt::format("tiles 16x16: {} at {} is only known to ±{}, margin {}",
            channel_names.at(tile.channel), place(tile), percent(tile.bound()), percent(margins.tile)));
    if (judgement.closed_form_within_margin) return;
    for (const char* name : {closed_form_reference_level, closed_form_candidate_level}) {
        const LevelResult& level = judgement.level(name);
        const RegionComparison& mean = widest(level);
        if (!equivalent(level, margins.image))
            judgement.reasons.push_back(fmt::format("{}: the mean in {} is only known to ±{}, margin {}", name,
                channel_names.at(mean.channel), percent(mean.bound()), percent(margins.image)));
    }
}

}  // namespace

const char* name_of(Verdict verdict) {
    switch (verdict) {
        case Verdict::agree:
            return "agree";
        case Verdict::disagree:
            return "disagree";
        case Verdict::undecided:
            break;
    }
    return "undecided";
}

Verdict combined(std::span<const Verdict> verdicts, bool whole) {
    for (const Verdict verdict : {Verdict::disagree, Verdict::undecided})
        if (std::ranges::find(verdicts, verdict) != verdicts.end()) return verdict;
    return whole ? Verdict::agree : Verdict::undecided;
}

const LevelResult& Judgement::level(const std::string& name) const {
    const auto found = std::ranges::find(levels, name, &LevelResult::name);
    if (found == levels.end()) throw Error("the verdict has no level '" + name + "'");
    return *found;
}

bool Judgement::significant(const std::string& name) const {
    return std::ranges::any_of(levels, [&](const LevelResult& l) { return l.name == name && l.significant; });
}

Judgement judge(const SampledImage& reference, const SampledImage& candidate, const PairedResult* paired,
    const Criteria& criteria, const LookShare& share, const ClosedForm* closed_form) {
    Judgement judgement;
    const Scales scales = scales_of(reference, candidate, criteria.margins);
    if (criteria.greatest)
        judgement.fixed.fixed.assign(reference.pixels.size(), false);
    else
        judgement.fixed = compare_fixed_pixels(reference, candidate, criteria.fixed_tolerance);
    judgement.levels = mean_levels(reference, candidate, scales, criteria, share.doubt);
    PixelLevel pixels = compare_pixels(reference, candidate, judgement.fixed, scales, criteria);
    judgement.levels.push_back(std::move(pixels.level));
    judgement.pixel_p = std::move(pixels.p);
    judgement.discoveries = pixels.discoveries;

    std::vector<LevelResult> reported;
    for (const bool whole : {true, false}) {
        LevelResult level = compare_variances(whole ? "variance of the image" : "variance of tiles 16x16", reference,
            candidate, whole, criteria.negligible.variance_ratio, criteria.fixed_tolerance, share.doubt);
        (criteria.same_estimator ? judgement.levels : reported).push_back(std::move(level));
    }
    if (paired != nullptr && paired->done) {
        std::vector<LevelResult>& levels = criteria.greatest ? reported : judgement.levels;
        for (const LevelResult& level : {paired->image, paired->tiles, paired->pixels}) levels.push_back(level);
        if (paired->paths) levels.push_back(*paired->paths);
        levels.insert(levels.end(), paired->alone.begin(), paired->alone.end());
        if (paired->arithmetic) (criteria.strict ? levels : reported).push_back(paired->arithmetic->level);
    }
    if (closed_form != nullptr)
        for (const auto& [name, side] :
            {std::pair{closed_form_reference_level, &reference}, {closed_form_candidate_level, &candidate}}) {
            judgement.levels.push_back(compare_closed_form(name, *closed_form, *side, criteria, share.doubt));
            if (!equivalent(judgement.levels.back(), criteria.margins.image))
                judgement.closed_form_within_margin = false;
        }
    set_significance(judgement.levels, share.false_alarm);
    judgement.coarse_arithmetic =
        paired != nullptr && paired->arithmetic && paired->arithmetic->level.p <= criteria.false_alarm;
    set_detectable(judgement.levels, criteria);
    std::ranges::move(reported, std::back_inserter(judgement.levels));

    judgement.image_within_margin = equivalent(judgement.level("image"), criteria.margins.image);
    judgement.tiles_within_margin = equivalent(judgement.level("tiles 16x16"), criteria.margins.tile);
    judgement.black = is_black(reference) && is_black(candidate);
    judgement.constant = !judgement.black && is_constant(reference, criteria.fixed_tolerance) &&
                         is_constant(candidate, criteria.fixed_tolerance);
    add_faults(judgement, reference, candidate);
    if (!judgement.reasons.empty())
        judgement.verdict = Verdict::disagree;
    else if (judgement.black && !is_zero(closed_form))
        judgement.reasons.emplace_back(
            "no light reached any pixel: look for a missing light, or a camera inside a body");
    else if (judgement.image_within_margin && judgement.tiles_within_margin && judgement.closed_form_within_margin)
        judgement.verdict = Verdict::agree;
    else
        explain_indecision(judgement, criteria.margins);
    return judgement;
}

bool pairs_resolve(const Judgement& judgement, const Criteria& criteria) {
    return judgement.level("paired image").resolution_relative <= criteria.paired_resolution.image &&
           judgement.level("paired tiles 16x16").resolution_relative <= criteria.paired_resolution.tile;
}

std::string off_by(const LevelResult& level) {
    const RegionComparison& worst = level.worst;
    const bool whole = level.regions.size() == channel_count;
    return fmt::format("{} ({}, {}{})", signed_percent(worst.relative),
        level.name.starts_with("closed form") ? "image" : level.name, channel_names.at(worst.channel),
        whole ? "" : ", " + place(worst));
}

std::string off_by(const Judgement& judgement) {
    const LevelResult* most = nullptr;
    for (const LevelResult& level : judgement.levels)
        if (level.significant && compares_means(level) && (most == nullptr || level.p < most->p)) most = &level;
    if (most != nullptr) return off_by(*most);
    const FixedPixels& fixed = judgement.fixed;
    if (fixed.mismatches > 0)
        return fmt::format(
            "up to {} in {} pixel channels without variance", percent(fixed.greatest_relative), fixed.mismatches);
    return judgement.reasons.empty() ? "nothing" : judgement.reasons.front();
}

std::string sentence_of(const Judgement& judgement, const Criteria& criteria, const std::string& reference_name,
    const std::string& candidate_name) {
    const std::string both = reference_name + " and " + candidate_name;
    const std::string bounds = fmt::format("±{} overall (margin {}), worst 16×16 tile ±{} (margin {}), at {:.0f} %",
        percent(widest(judgement.level("image")).bound()), percent(criteria.margins.image),
        percent(widest(judgement.level("tiles 16x16")).bound()), percent(criteria.margins.tile),
        100.0 * (1.0 - criteria.doubt));
    std::string detectable =
        "; detectable: " + percent(judgement.level("image").minimum_detectable_relative) + " overall";
    for (const LevelResult& level : judgement.levels)
        if (level.name == "paired image" && level.threshold > 0.0)
            detectable += fmt::format(", with paired seeds {} overall and {} in every tile",
                percent(level.resolution_relative), percent(judgement.level("paired tiles 16x16").resolution_relative));
    const char* constant =
        judgement.constant ? "; every pixel is the same without noise, so that one value alone was compared" : "";
    switch (judgement.verdict) {
        case Verdict::agree:
            if (judgement.black) return both + " agree: both are black, as the closed form says";
            return both + " agree within " + bounds + detectable + constant;
        case Verdict::disagree:
            return both + " disagree: " + judgement.reasons.front();
        case Verdict::undecided:
            break;
    }
    if (judgement.black) return both + " are undecided: both are black, so nothing was compared";
    return both + " are undecided: no difference found, but it is only known to lie within " + bounds + detectable;
}

}  // namespace tandem
