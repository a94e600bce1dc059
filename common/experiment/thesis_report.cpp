#include <fmt/format.h>

#include <cmath>

#include "common/experiment/thesis.h"
#include "common/statistics/distributions.h"
#include "common/statistics/sample_moments.h"

namespace tandem {

namespace {

using nlohmann::json;

struct Mean {
    double mean = NAN, sigma = NAN, half = NAN;  // deviation of one frame; half width of the mean's 95 % interval
};

Mean mean_of(const std::vector<double>& values) {
    const SampleMoments moments = moments_of(values);
    if (moments.count < 2.0) return {values.empty() ? NAN : values[0], NAN, NAN};
    return {moments.mean, std::sqrt(moments.variance()),
        student_quantile(0.975, moments.count - 1.0) * std::sqrt(moments.variance_of_mean())};
}

json to_json(const std::vector<double>& milliseconds) {
    const Mean mean = mean_of(milliseconds);
    const auto number = [](double value) { return std::isfinite(value) ? json(value) : json(); };
    return {{"mean_milliseconds", number(mean.mean)}, {"sigma_milliseconds", number(mean.sigma)},
        {"low_milliseconds", number(mean.mean - mean.half)}, {"high_milliseconds", number(mean.mean + mean.half)},
        {"raw_milliseconds", milliseconds}};
}

json points_json(const std::vector<ThesisSweepPoint>& points) {
    json list = json::array();
    for (const ThesisSweepPoint& point : points) {
        json entry{{"samples", point.samples}, {"frame", to_json(point.milliseconds)}};
        if (point.thesis_sample > 0.0) entry["thesis_milliseconds_a_sample"] = point.thesis_sample;
        list.push_back(std::move(entry));
    }
    return list;
}

// A line's workload and clock, so that it can be read alone.
std::string workload_of(const ThesisReport& report, std::uint32_t bounces) {
    return fmt::format("{}x{}, {} bounces", report.setup.width, report.setup.height, bounces);
}

std::string name_of(const ThesisReport& report, const ThesisCell& cell) {
    return fmt::format("{:2} spp, {} thread{}, {}, {}", cell.samples, cell.threads, cell.threads == 1 ? " " : "s",
        cell.cohesive ? "cohesive" : "split   ", workload_of(report, report.setup.bounces));
}

std::string table(const ThesisReport& report, const ThesisRun& run, const char* clock, const char* title,
    std::vector<double> ThesisCell::*ours, double ThesisCell::*theirs, double ThesisCell::*their_sigma) {
    std::string text = fmt::format(
        "\n{}\n{:54} {:>32}   {:>20}\n", title, "milliseconds a frame", "here: mean (95 %), deviation", "thesis");
    for (const ThesisCell& cell : run.cells) {
        const Mean mean = mean_of(cell.*ours);
        const std::string thesis = their_sigma != nullptr
                                       ? fmt::format("{:.3f}, {:.3f}", cell.*theirs, cell.*their_sigma)
                                       : fmt::format("{:.3f}", cell.*theirs);
        text += fmt::format("{:54} {:>10.4g} (±{:.2g}), {:>8.3g}   {:>20}   {}\n", name_of(report, cell), mean.mean,
            mean.half, mean.sigma, thesis, clock);
    }
    return text;
}

std::string sweep_text(const std::vector<ThesisSweepPoint>& points, const std::string& workload, const char* clock) {
    std::string text;
    for (const ThesisSweepPoint& point : points) {
        const Mean mean = mean_of(point.milliseconds);
        text += fmt::format("  {:3} samples a frame, {}: {:.4g} ms a sample (±{:.2g})", point.samples, workload,
            mean.mean / point.samples, mean.half / point.samples);
        if (point.thesis_sample > 0.0) text += fmt::format("; thesis {:.3f}", point.thesis_sample);
        text += fmt::format("   {}\n", clock);
    }
    return text;
}

std::string run_text(const ThesisReport& report, const ThesisRun& run, const char* title, const char* clock) {
    std::string text = fmt::format("\n{}\nFrame: {}\nClock \"{}\": {}\n", title, run.frame, clock, run.clock);
    text += table(report, run, clock, "First frame (each of a fresh job)", &ThesisCell::first,
        &ThesisCell::thesis_first, nullptr);
    text += table(report, run, clock, "Ten frames of a freshly sent scene", &ThesisCell::fresh,
        &ThesisCell::thesis_fresh, &ThesisCell::thesis_fresh_sigma);
    text += table(report, run, clock, "Sixty frames of the unchanged scene", &ThesisCell::steady,
        &ThesisCell::thesis_steady, &ThesisCell::thesis_steady_sigma);
    text += "\nSamples a frame (8 threads, cohesive)\n" +
            sweep_text(run.sweep, workload_of(report, report.setup.bounces), clock);
    if (const std::optional<LogarithmicFit>& fit = run.fit)
        text += fmt::format("  fit: {:.4g} ({:.4g} to {:.4g}) + {:.3g} ({:.3g} to {:.3g}) ln(samples) ms a sample\n",
            fit->a, fit->a_interval.low, fit->a_interval.high, fit->b, fit->b_interval.low, fit->b_interval.high);
    return text + "\nAt two bounces (8 threads, cohesive)\n" +
           sweep_text(run.two_bounces, workload_of(report, 2), clock);
}

json run_json(const ThesisRun& run) {
    json cells = json::array();
    for (const ThesisCell& cell : run.cells)
        cells.push_back({{"samples", cell.samples}, {"threads", cell.threads}, {"cohesive", cell.cohesive},
            {"first", to_json(cell.first)}, {"fresh", to_json(cell.fresh)}, {"steady", to_json(cell.steady)},
            {"thesis",
                {{"first_milliseconds", cell.thesis_first}, {"fresh_milliseconds", cell.thesis_fresh},
                    {"fresh_sigma_milliseconds", cell.thesis_fresh_sigma}, {"steady_milliseconds", cell.thesis_steady},
                    {"steady_sigma_milliseconds", cell.thesis_steady_sigma}}}});
    json fit;  // null: too little was measured
    if (run.fit)
        fit = {{"text", "milliseconds a sample = a + b ln(samples a frame)"}, {"a", run.fit->a}, {"b", run.fit->b},
            {"a_low", run.fit->a_interval.low}, {"a_high", run.fit->a_interval.high},
            {"b_low", run.fit->b_interval.low}, {"b_high", run.fit->b_interval.high},
            {"residual_milliseconds", run.fit->residual}};
    return {{"frame", run.frame}, {"clock", run.clock}, {"configurations", cells}, {"sweep", points_json(run.sweep)},
        {"two_bounces", points_json(run.two_bounces)}, {"fit", fit}};
}

}  // namespace

json to_json(const ThesisReport& report) {
    json result = run_json(report.headless);
    result.update({{"width", report.setup.width}, {"height", report.setup.height}, {"bounces", report.setup.bounces},
        {"protocol_size", report.protocol_size}, {"stopped", report.stopped}});
    if (report.presented)
        result["presented"] = run_json(*report.presented);
    else
        result["not_presented"] = report.not_presented;
    return result;
}

std::string to_text(const ThesisReport& report) {
    std::string text = "The thesis's experiment: " + workload_of(report, report.setup.bounces) + "\n";
    if (!report.protocol_size)
        text += "NOT the thesis's size (1920x1080, 12 bounces): its figures stand beside for the record only.\n";
    if (report.stopped) text += "Stopped early: what was not measured is left out.\n";
    text += run_text(report, report.headless, "WITHOUT A WINDOW", "to-fence");
    if (report.presented) return text + run_text(report, *report.presented, "IN A WINDOW", "acquire-to-fence");
    return text + "\nIN A WINDOW\nNot applicable here: " + report.not_presented + "\n";
}

}  // namespace tandem
