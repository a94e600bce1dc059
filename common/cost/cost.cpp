#include "common/cost/cost.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>

#include "common/cost/hierarchy_cost.h"
#include "common/cost/regions.h"
#include "common/cost/schedule.h"
#include "common/text.h"
#include "common/validation/verdict/error_metrics.h"
#include "common/validation/verdict/sampled_image.h"

namespace tandem {

namespace {

using nlohmann::json;

// An error that is aimed at, which is a round number: "0.5 %".
std::string words_of_error(double error) { return fmt::format("{:g} %", 100.0 * error); }

std::string factor(double ratio) { return ratio >= 10.0 ? fmt::format("{:.0f}", ratio) : fmt::format("{:.2f}", ratio); }

// Text of a ratio with its interval: "1.80 (1.75 to 1.86)".
std::string factor(const Estimated& ratio) {
    return fmt::format("{} ({} to {})", factor(ratio.value), factor(ratio.low), factor(ratio.high));
}
Estimated inverse(const Estimated& ratio) { return {1.0 / ratio.value, 1.0 / ratio.high, 1.0 / ratio.low}; }

std::string duration(double seconds) {
    if (!std::isfinite(seconds)) return "any time";                        // the end of an interval that has none
    if (seconds < 0.9995) return fmt::format("{:.3g} ms", 1e3 * seconds);  // more is rounded to 1 s
    if (seconds < 600.0) return fmt::format("{:.3g} s", seconds);
    if (seconds < 7200.0) return fmt::format("{:.0f} min", seconds / 60.0);
    return fmt::format("{:.0f} h", seconds / 3600.0);
}

std::string words_of(const TimeToError& time) {
    if (time.not_measured) return "not at the counts measured";
    if (!time.seconds) return time.unknown ? "not known yet" : "never: its bias is greater";
    if (!time.extrapolated) return duration(time.seconds->value) + ", measured";
    return fmt::format("{} ({} to {}), forecast", duration(time.seconds->value), duration(time.seconds->low),
        duration(time.seconds->high));
}

std::string time_cell(const TimeToError& time) {
    if (!time.seconds) return time.unknown || time.not_measured ? "unknown" : "never";
    return fmt::format(
        "{}{}{}", time.extrapolated ? "~" : "", duration(time.seconds->value), time.floor_unknown ? "?" : "");
}

std::string floor_cell(const ArmFigures& arm) {
    const Estimated floor = arm.bias_floor();
    if (!arm.has_floor) return fmt::format("< {}", percent(floor.high));
    return fmt::format("{} ({} to {})", percent(floor.value), percent(floor.low), percent(floor.high));
}

std::string sentence_on_floor(const ArmFigures& arm, const ArmFigures& baseline) {
    const Estimated floor = arm.bias_floor(), base = baseline.bias_floor();
    if (arm.has_floor && (!baseline.has_floor || floor.low > base.high))
        return fmt::format("leaves a floor of {} ({} to {}): no smaller error can be met", percent(floor.value),
            percent(floor.low), percent(floor.high));
    if (baseline.has_floor && floor.high < base.low)
        return fmt::format(
            "removes the baseline's floor of {} (what is left is below {})", percent(base.value), percent(floor.high));
    return "";
}

// Where a bias stands that the image's mean hides; nothing where the baseline has one there that is as great.
std::string sentence_on_tile(const ArmFigures& arm, const ArmFigures& baseline) {
    if (!arm.tile || !arm.tile->significant) return "";
    const auto distance = [](const TileBias& tile) {  // of the interval from 0
        return tile.significant ? std::max({0.0, tile.relative.low, -tile.relative.high}) : 0.0;
    };
    if (&arm != &baseline && baseline.tile && distance(*arm.tile) <= distance(*baseline.tile)) return "";
    const Estimated& bias = arm.tile->relative;
    return fmt::format("the tile at ({}, {}) is off by {} ({} to {})", arm.tile->x, arm.tile->y,
        signed_percent(bias.value), signed_percent(bias.low), signed_percent(bias.high));
}

bool has_time_ratio(const ArmFigures& arm) { return std::isfinite(arm.time_ratio.high); }

std::string sentence_on_noise(const ArmFigures& arm, const ArmFigures& baseline) {
    if (arm.variance == 0.0) return "there is no noise";
    if (baseline.variance == 0.0) return "there is noise, which the baseline has not";
    const std::string down = "the noise is down ";
    if (!arm.cost_differs) {
        // An interval a side, not corrected for the many: it bounds what was not found.
        const double seen = std::max(arm.cost_ratio.high, 1.0 / std::max(arm.cost_ratio.low, 1e-9)) - 1.0;
        return down + fmt::format("as soon as the baseline's, to {}", percent(seen));
    }
    if (arm.cost_ratio.value < 1.0)
        return down + fmt::format("{} times sooner than the baseline's", factor(inverse(arm.cost_ratio)));
    return down + fmt::format("{} times later than the baseline's", factor(arm.cost_ratio));
}

std::string sentence_on_cost(const ArmFigures& arm, const ArmFigures& baseline) {
    if (!has_time_ratio(arm)) return "it was not rendered beside the baseline, so their times are not compared";
    return fmt::format(
        "a sample takes {} times the baseline's time; {}", factor(arm.time_ratio), sentence_on_noise(arm, baseline));
}

// An arm whose errors are known only where they were measured, at the greatest count that the baseline has too.
std::string sentence_on_measured(const ArmFigures& arm, const ArmFigures& baseline) {
    for (auto own = arm.points.rbegin(); own != arm.points.rend(); ++own) {
        const auto base = std::ranges::find(baseline.points, own->samples, &CostPoint::samples);
        if (base == baseline.points.end()) continue;
        return fmt::format(
            "{}: at {} samples its error is {} in {}, the baseline's {} in {}; at {} samples its bias is {}",
            arm.arm.name(), own->samples, percent(own->rmse.value), duration(own->seconds.value),
            percent(base->rmse.value), duration(base->seconds.value), arm.points.back().samples, floor_cell(arm));
    }
    return fmt::format("{}: no number of samples was rendered that the baseline has too", arm.arm.name());
}

const Confirmation* confirmation_of(const CostReport& report, double error) {
    const auto found = std::ranges::find(report.confirmations, error, &Confirmation::relative_error);
    if (found == report.confirmations.end()) return nullptr;
    // An arm whose time is not known by all samples together is not to be had, whatever its own stage says.
    const auto is_had = [&](const ArmFigures& arm) {
        return arm.arm.name() == found->recommended && arm.time_to(error).seconds.has_value();
    };
    return std::ranges::any_of(report.figures, is_had) ? &*found : nullptr;
}

std::string sentence_on(const Confirmation& confirmation) {
    const Rival& nearest = confirmation.rivals.front();
    const std::string anew = fmt::format("{} {} rounds it {} {} ({} to {}); ",
        confirmation.forecast ? "By a forecast from" : "Measured anew in", confirmation.rounds,
        confirmation.forecast ? "would take" : "takes", duration(confirmation.seconds.value),
        duration(confirmation.seconds.low), duration(confirmation.seconds.high));
    switch (confirmation.outcome) {
        case Confirmed::shown:
            return anew + fmt::format("it is the fastest of what was measured: {} takes {} times as long.",
                              nearest.name, factor(nearest.time_ratio));
        case Confirmed::refuted: {
            const auto found = std::ranges::find(confirmation.rivals, confirmation.recommended, &Rival::name);
            return anew + fmt::format("it was faster than {}, which had been found soonest before: {} of its time.",
                              confirmation.first, factor(found->time_ratio));
        }
        case Confirmed::open:
            break;
    }
    // Those that are not told apart from it, and those that did not render beside it.
    std::string names, faster;
    for (const Rival& rival : confirmation.rivals) {
        if (rival.time_ratio.low > 1.0) continue;
        std::string& text = rival.time_ratio.high < 1.0 ? faster : names;
        text += fmt::format("{}{} ({} times its time)", text.empty() ? "" : ", ", rival.name, factor(rival.time_ratio));
    }
    if (!faster.empty())
        return anew + "these seem to be faster, but were not measured beside it: " + faster + "; give more --time.";
    return anew + "nothing is shown to be faster, but these may be: " + names + ".";
}

std::string_view outcome_name(Confirmed outcome) {
    return outcome == Confirmed::shown ? "shown" : outcome == Confirmed::open ? "open" : "refuted";
}

json to_json(const Estimated& figure) { return {{"value", figure.value}, {"low", figure.low}, {"high", figure.high}}; }

json to_json(const Confirmation& confirmation) {
    json rivals = json::array();
    for (const Rival& rival : confirmation.rivals)
        rivals.push_back({{"arm", rival.name}, {"time_ratio", to_json(rival.time_ratio)}});
    return {{"relative_error", confirmation.relative_error}, {"first", confirmation.first},
        {"recommended", confirmation.recommended}, {"outcome", outcome_name(confirmation.outcome)},
        {"seconds", confirmation.seconds.value}, {"seconds_low", confirmation.seconds.low},
        {"seconds_high", confirmation.seconds.high}, {"forecast", confirmation.forecast},
        {"rounds", confirmation.rounds}, {"rivals", rivals}};
}

json to_json(const ArmFigures& arm) {
    json points = json::array();
    for (const CostPoint& point : arm.points)
        points.push_back({{"samples", point.samples}, {"seconds", point.seconds.value},
            {"seconds_low", point.seconds.low}, {"seconds_high", point.seconds.high}, {"rmse", point.rmse.value},
            {"rmse_low", point.rmse.low}, {"rmse_high", point.rmse.high}, {"relmse", point.relmse}});
    json times = json::array();
    for (const TimeToError& time : arm.times) {
        json one{{"relative_error", time.relative_error}, {"extrapolated", time.extrapolated},
            {"floor_unknown", time.floor_unknown}, {"unknown", time.unknown || time.not_measured}, {"seconds", nullptr},
            {"measured", time.seconds.has_value() && !time.extrapolated}, {"seconds_low", nullptr},
            {"seconds_high", nullptr}, {"samples", nullptr}, {"samples_low", nullptr}, {"samples_high", nullptr}};
        if (time.samples_interval) {
            one["samples_low"] = time.samples_interval->low;
            one["samples_high"] = time.samples_interval->high;
        }
        if (time.seconds) {
            one["seconds"] = time.seconds->value;
            one["seconds_low"] = time.seconds->low;
            one["seconds_high"] = time.seconds->high;
            one["samples"] = std::ceil(*time.samples);
        }
        times.push_back(std::move(one));
    }
    json regions = json::object();
    for (const RegionError& region : arm.regions)
        regions[region.name] = {{"share", region.share}, {"rmse", region.rmse},
            {"cost_ratio", arm.has_forecasts() ? json(region.cost_ratio) : json()}};
    const Estimated floor = arm.bias_floor();
    json result{{"knob", arm.arm.knob}, {"setting", arm.arm.setting}, {"options", arm.arm.options},
        {"replicates", arm.replicates}, {"points", points}, {"bias_floor", floor.value}, {"bias_floor_low", floor.low},
        {"bias_floor_high", floor.high}, {"bias_floor_significant", arm.has_floor}, {"efficiency", nullptr},
        {"slope", nullptr}, {"slope_low", nullptr}, {"slope_high", nullptr}, {"seconds_to", times},
        {"seconds_to_one_percent", nullptr}, {"seconds_to_one_percent_extrapolated", arm.times[1].extrapolated},
        {"pareto", arm.pareto}, {"keeps_estimate", arm.arm.keeps_estimate},
        {"time_ratio", has_time_ratio(arm) ? to_json(arm.time_ratio) : json()},
        {"cost_ratio", arm.has_forecasts() ? to_json(arm.cost_ratio) : json()}, {"forecasts", arm.has_forecasts()},
        {"cost_differs", arm.cost_differs}, {"invalid_samples", arm.invalid},
        {"bias_floor_known", arm.has_floor || floor.high <= floor_bound}, {"mse", arm.mse},
        {"noise", std::sqrt(arm.variance)}, {"flip", arm.flip}, {"regions", regions}};
    if (arm.efficiency) {
        result["efficiency"] = arm.efficiency->value;
        result["efficiency_low"] = arm.efficiency->low;
        result["efficiency_high"] = arm.efficiency->high;
    }
    if (arm.tile)
        result["most_biased_tile"] = {{"x", arm.tile->x}, {"y", arm.tile->y}, {"edge", standard_tile_edge},
            {"relative_bias", to_json(arm.tile->relative)}, {"significant", arm.tile->significant}};
    if (arm.slope) {
        result["slope"] = arm.slope->value;
        result["slope_low"] = arm.slope->low;
        result["slope_high"] = arm.slope->high;
    }
    if (arm.arm.hierarchy_seconds) result["hierarchy_seconds"] = *arm.arm.hierarchy_seconds;
    if (arm.times[1].seconds) result["seconds_to_one_percent"] = arm.times[1].seconds->value;
    return result;
}

// What rendered the reference, which a file may bring from elsewhere.
std::string backend_of_reference(const CostReport& report) {
    const std::string& by = report.reference.made_by;
    return by.empty() ? report.reference_backend : by.substr(0, by.find(','));
}

}  // namespace

const ArmFigures* recommended(const CostReport& report, double relative_error) {
    if (const Confirmation* confirmation = confirmation_of(report, relative_error))
        for (const ArmFigures& arm : report.figures)
            if (arm.arm.name() == confirmation->recommended) return &arm;
    const ArmFigures* best = soonest(report.figures, relative_error);
    const auto is_forecast = [&](const ArmFigures& arm) { return arm.time_to(relative_error).extrapolated; };
    if (best == nullptr || !(best->variance > 0.0) || !is_forecast(*best)) return best;
    const ArmFigures* surer = soonest(report.figures, relative_error, false);
    return surer == nullptr || is_forecast(*surer) ? best : surer;
}

namespace {

// What the baseline was given goes for every arm, but for what the arm itself says; a guard takes its length with it.
std::string render_command(const CostReport& report, const CostArm& arm) {
    const auto says = [&](const std::string& option) { return arm.options.find(option + " ") != std::string::npos; };
    const std::string image = std::filesystem::path(report.scene_file).stem().string() + ".exr";
    std::string command = fmt::format("tandem render {} -o {}", shell_word(report.scene_file), shell_word(image));
    for (const auto& [option, value] : report.given)
        if (!says(option) && !(option == "--epsilon" && says("--guard")))
            command += " " + option + " " + shell_word(value);
    return escaped(command + (arm.options.empty() ? "" : " ") + arm.options);
}

// What was soonest among many, by luck or not, and had no second measurement.
std::string not_confirmed(const CostReport& report, const ArmFigures& best, double error) {
    if (const TimeToError time = best.time_to(error); !time.extrapolated) {
        if (const ArmFigures* first = soonest(report.figures, error); first != &best)
            return fmt::format("{} may be sooner: {}.", first->arm.name(), words_of(first->time_to(error)));
        const ArmFigures* rival = nullptr;
        double least = time.seconds->high;
        for (const ArmFigures& arm : report.figures) {
            const TimeToError other = arm.time_to(error);
            if (&arm == &best || !other.seconds || other.extrapolated || !arm.is_safe_at(error)) continue;
            if (other.seconds->low > least) continue;
            least = other.seconds->low;
            rival = &arm;
        }
        return rival == nullptr ? "Nothing that may be as fast was measured to this error."
                                : fmt::format("{} may be as fast; neither was measured anew.", rival->arm.name());
    }
    if (std::ranges::find(cost_errors, error) != cost_errors.end())
        return "It was not measured anew; give more --time.";
    std::vector<std::string> measured;
    for (const double one : cost_errors) measured.push_back(words_of_error(one));
    return fmt::format("Settings are measured to {} alone.", fmt::join(measured, ", "));
}

// Such samples count as 0, so that no figure of theirs is to be trusted; a render of them ends with status 1.
std::vector<std::string> sentences_on_invalid(const CostReport& report) {
    std::vector<std::string> sentences;
    for (const ArmFigures& arm : report.figures)
        if (arm.invalid > 0)
            sentences.push_back(
                fmt::format("{}: {} samples were negative or not finite (MODEL.md section 12): its figures are wrong.",
                    arm.arm.name(), arm.invalid));
    return sentences;
}

// The command to an error, and what is known of it.
std::string sentence_to(const CostReport& report, double error) {
    const Confirmation* confirmation = confirmation_of(report, error);
    const ArmFigures* best = recommended(report, error);
    if (best == nullptr) {
        const bool unknown =
            std::ranges::any_of(report.figures, [&](const ArmFigures& arm) { return arm.time_to(error).unknown; });
        return unknown
                   ? fmt::format("To {}: not known, as errors of 100 % and more foretell nothing; give more --time.",
                         words_of_error(error))
                   : fmt::format("No setting here reaches {}.", words_of_error(error));
    }
    const TimeToError time = best->time_to(error);
    if (const double samples = std::ceil(*time.samples); samples > static_cast<double>(numbers_alike))
        return fmt::format("To {}: {:.2g} samples a pixel, by a forecast, and no render takes more than {}.",
            words_of_error(error), samples, numbers_alike);
    return fmt::format("To {}: `{} --samples {:.0f}`, {}{}. {}", words_of_error(error),
        render_command(report, best->arm), std::ceil(*time.samples), words_of(time),
        time.floor_unknown ? "; a bias as great is not excluded, and none assumed" : "",
        confirmation == nullptr ? not_confirmed(report, *best, error) : sentence_on(*confirmation));
}

// What pays for few samples and for many, where the seconds of renders do not tell.
std::vector<std::string> sentences_on_building(const CostReport& report) {
    std::vector<std::string> sentences;
    for (const ArmFigures& arm : report.figures)
        if (const std::string sentence = sentence_on_building(arm, report.figures.front()); !sentence.empty())
            sentences.push_back(sentence + ".");
    return sentences;
}

}  // namespace

std::vector<std::string> recommendations(const CostReport& report) {
    std::vector<std::string> sentences;
    if (report.figures.empty()) return sentences;
    const ArmFigures& baseline = report.figures.front();
    for (const double error : cost_errors) sentences.push_back(sentence_to(report, error));
    for (const ArmFigures& arm : report.figures) {
        if (&arm == &baseline) {
            if (arm.has_floor)
                sentences.push_back(fmt::format("The baseline leaves a floor of {}.", percent(arm.bias_floor().value)));
            if (const std::string tile = sentence_on_tile(arm, baseline); !tile.empty())
                sentences.push_back(fmt::format("baseline: {}.", tile));
            continue;
        }
        if (!arm.has_forecasts()) {
            sentences.push_back(sentence_on_measured(arm, baseline) + ".");
            continue;
        }
        const std::string floor = sentence_on_floor(arm, baseline);
        const std::string tile = sentence_on_tile(arm, baseline);
        sentences.push_back(fmt::format("{}: {}{}{}{}{}.", arm.arm.name(), sentence_on_cost(arm, baseline),
            floor.empty() ? "" : "; it ", floor, tile.empty() ? "" : "; ", tile));
    }
    std::ranges::move(sentences_on_building(report), std::back_inserter(sentences));
    std::ranges::move(sentences_on_invalid(report), std::back_inserter(sentences));
    return sentences;
}

json to_json(const CostReport& report) {
    json arms = json::array(), skipped = json::array(), confirmations = json::array();
    for (const Confirmation& one : report.confirmations) confirmations.push_back(to_json(one));
    for (const ArmFigures& arm : report.figures) arms.push_back(to_json(arm));
    for (const SkippedArm& arm : report.skipped)
        skipped.push_back({{"knob", arm.knob}, {"setting", arm.setting}, {"reason", arm.reason}});
    return {{"scene", report.scene}, {"backend", report.backend}, {"device", report.device}, {"driver", report.driver},
        {"width", report.width}, {"height", report.height},
        {"errors",
            fmt::format(
                "rmse and bias_floor: relative to the mean of the reference image. relmse: mean over pixels "
                "and channels of (x - r)^2 / (r^2 + {:g}). mse: in the image's own unit. flip: mean, of images "
                "exposed to a mean of {:g} and clipped at 1. noise: the error without bias, relative to the mean. mse, "
                "noise, flip and regions: at the greatest sample count. seconds: of rendering; hierarchy_seconds: of "
                "building the hierarchy before",
                ErrorMetrics::epsilon, shown_mean)},
        {"regions",
            fmt::format(
                "dark: the darkest {:g} of the pixels by the reference's luminance. bright: the brightest {:g}. "
                "edges: the {:g} with the greatest relative step of luminance to the right or lower neighbour. "
                "rmse: relative to the region's mean",
                dark_share, bright_share, edges_share)},
        {"asked_error_relative", report.asked_error},
        {"reference",
            {{"samples", report.reference.samples}, {"relative_uncertainty", report.reference.relative_uncertainty()},
                {"image_mean", report.reference.image_mean()}, {"backend", backend_of_reference(report)},
                {"options", report.reference.options}, {"seconds", report.reference.seconds},
                {"made_by", report.reference.made_by}, {"git", report.reference.program},
                {"image", report.reference.image}}},
        {"arms", arms}, {"not_measured", skipped}, {"confirmations", confirmations},
        {"recommendations", recommendations(report)}, {"seconds", report.seconds}};
}

namespace {

std::string head_of(const CostReport& report) {
    return fmt::format("{} on {} ({}), {}x{}; reference {} samples by {}, known to {}\n", escaped(report.scene),
        report.device, report.backend, report.width, report.height, report.reference.samples,
        report.reference.made_by.empty() ? report.reference_backend : report.reference.made_by,
        percent(report.reference.relative_uncertainty()));
}

std::string bias_of(const ArmFigures& arm) {
    const Estimated floor = arm.bias_floor();
    if (!arm.has_forecasts())
        return fmt::format("{} at {} samples, fewer have more", floor_cell(arm), arm.points.back().samples);
    if (arm.has_floor)
        return fmt::format("{} ({} to {})", percent(floor.value), percent(floor.low), percent(floor.high));
    return fmt::format("{}, below {}", arm.arm.is_unbiased() ? "none by design" : "none found", percent(floor.high));
}

// Regions where a setting that is good in the mean costs half as much again as the baseline.
std::string bad_regions(const ArmFigures& arm) {
    constexpr double bad = 1.5;
    std::string text;
    if (arm.cost_ratio.value > 1.0 || !arm.has_forecasts()) return text;
    for (const RegionError& region : arm.regions)
        if (region.cost_ratio > bad) text += fmt::format("; {} regions: {} x", region.name, factor(region.cost_ratio));
    return text;
}

// The rows of the table: the settings of the chosen knobs, the fastest to the asked error, and the baseline. Cheap
// tricks are there too, since their bias must be known before they are used.
std::vector<const ArmFigures*> rows_of(const CostReport& report) {
    constexpr std::size_t most_tricks = 3;
    const ArmFigures& baseline = report.figures.front();
    std::vector<const ArmFigures*> asked{&baseline}, sound, tricks;
    for (const ArmFigures& arm : report.figures) {
        if (&arm == &baseline) continue;
        const bool cheap = arm.has_floor && (arm.time_ratio.value < 1.0 || arm.cost_ratio.value < 1.0);
        if (std::ranges::find(report.asked_knobs, arm.arm.knob) != report.asked_knobs.end())
            asked.push_back(&arm);
        else if (!arm.has_forecasts() || (!arm.arm.keeps_estimate && cheap))
            tricks.push_back(&arm);
        else if (arm.time_to(report.asked_error).seconds && arm.is_safe_at(report.asked_error))
            sound.push_back(&arm);
    }
    const auto seconds = [&](const ArmFigures* arm) {
        const TimeToError time = arm->time_to(report.asked_error);
        return time.seconds ? time.seconds->value : std::numeric_limits<double>::infinity();
    };
    std::ranges::stable_sort(sound, {}, seconds);
    std::ranges::stable_sort(tricks, {}, [](const ArmFigures* arm) {
        return arm->has_forecasts() ? arm->bias_floor().value : -1.0;  // first, as nothing else shows them
    });
    tricks.resize(std::min(tricks.size(), most_tricks));
    const std::size_t taken = asked.size() + tricks.size();
    sound.resize(std::min(sound.size(), most_rows - std::min(most_rows, taken)));
    sound.insert(sound.end(), asked.begin(), asked.end());
    std::ranges::stable_sort(sound, {}, seconds);
    sound.insert(sound.end(), tricks.begin(), tricks.end());
    return sound;
}

}  // namespace

std::string to_text(const CostReport& report) {
    if (report.figures.empty()) return head_of(report);
    std::string text = head_of(report);
    constexpr std::size_t column = 44;
    const auto row = [column](std::string settings, const std::string& time, const std::string& bias) {
        if (settings.size() > column) settings += "\n" + std::string(column, ' ');
        return fmt::format("{:{}} {:36} {}\n", settings, column, time, bias);
    };
    text += "\n" + row("settings", "to " + words_of_error(report.asked_error), "bias");
    for (const ArmFigures* arm : rows_of(report))
        text += row(arm == report.figures.data() ? "the scene's own (baseline)" : arm->arm.options,
            words_of(arm->time_to(report.asked_error)), bias_of(*arm) + bad_regions(*arm));
    text += fmt::format("\n{}\n", sentence_to(report, report.asked_error));
    for (const std::string& sentence : sentences_on_building(report)) text += sentence + "\n";
    for (const std::string& sentence : sentences_on_invalid(report)) text += sentence + "\n";
    const auto more = report.figures.size() - std::min(report.figures.size(), rows_of(report).size());
    if (more > 0 || !report.skipped.empty())
        text += fmt::format(
            "{} more settings were measured, {} were not; --all prints them.\n", more, report.skipped.size());
    return text;
}

std::string all_to_text(const CostReport& report) {
    std::string text = head_of(report);
    text += fmt::format(
        "Times: ~ forecast, ? a bias as great is not excluded, unknown: errors of 100 % and more foretell nothing. * "
        "is "
        "on the Pareto front.\n\n");
    text += fmt::format("  {:32} {:>9} {:>22} {:>22}", "arm", "time", "floor", "slope");
    for (const double error : cost_errors) text += fmt::format(" {:>9}", words_of_error(error));
    text += "\n";
    for (const ArmFigures& arm : report.figures) {
        const std::string slope =
            arm.slope ? fmt::format("{:.2f} ({:.2f} to {:.2f})", arm.slope->value, arm.slope->low, arm.slope->high)
                      : std::string(arm.variance > 0.0 ? "too few samples" : "no noise");
        text += fmt::format("{} {:32} {:>9} {:>22} {:>22}", arm.pareto ? "*" : " ", arm.arm.name(),
            has_time_ratio(arm) ? factor(arm.time_ratio.value) + "x" : "unknown", floor_cell(arm), slope);
        for (const TimeToError& time : arm.times) text += fmt::format(" {:>9}", time_cell(time));
        text += "\n";
    }
    for (const SkippedArm& arm : report.skipped)
        text += fmt::format("  {} {}: not measured: {}\n", arm.knob, arm.setting, arm.reason);
    text += "\n";
    for (const std::string& sentence : recommendations(report)) text += sentence + "\n";
    return text;
}

}  // namespace tandem
