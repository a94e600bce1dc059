#include "common/exercise/checks.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "common/statistics/distributions.h"
#include "common/statistics/sample_moments.h"

namespace tandem {

namespace {

// A single-precision function rounds its arguments, and what it computes, by a few times 2^-24 each. So it may be the
// exact function of arguments that differ by 2^-18 of their size. Vulkan lets arc functions be off by 2^-12 (4096 ulp),
// which 1 - cos makes several times as much: 2^-9 of the value. Planted bugs change it by percents.
constexpr double argument_error = 0x1p-18, least_argument_error = 0x1p-21, value_error = 0x1p-9, vector_error = 0x1p-12;
constexpr double edge = 0.02;  // of the value: where so small a change of the arguments does so much, nothing is asked

std::string number(double x) { return std::isnan(x) ? "not a number" : fmt::format("{:.7g}", x); }

// "origin = (0, 1, 2), radius = 3".
std::string list_of(const std::vector<std::string>& names, const Values& values) {
    std::string text;
    for (std::size_t k = 0; k < names.size(); ++k) {
        const std::size_t dot = names[k].find('.');
        const bool first = dot == std::string::npos || names[k][dot + 1] == 'x';
        const bool last =
            k + 1 == names.size() || names[k + 1].find('.') == std::string::npos || names[k + 1].ends_with(".x");
        if (first) text += (k == 0 ? "" : ", ") + names[k].substr(0, dot) + (dot == std::string::npos ? " = " : " = (");
        text += (first ? "" : ", ") + number(values[k]);
        if (last && dot != std::string::npos) text += ")";
    }
    return text;
}

bool has_nan(const Values& values, std::size_t count) {
    return std::any_of(values.list.begin(), values.list.begin() + static_cast<std::ptrdiff_t>(count),
        [](double x) { return !std::isfinite(x); });
}

// What a right answer may differ by, for each result; nothing at an edge.
std::optional<Values> tolerances(const Trial& trial, Answer answer, const Values& arguments) {
    const std::size_t count = trial.result_names.size();
    Values exact, tolerance;
    answer(arguments, exact);
    double size = 0.0;
    for (std::size_t k = 0; k < count; ++k) size = std::max(size, std::abs(exact[k]));
    for (std::size_t j = 0; j < trial.argument_names.size(); ++j) {
        Values change;
        for (const double side : {-1.0, 1.0}) {
            Values moved = arguments, result;
            moved[j] += side * (argument_error * std::abs(arguments[j]) + least_argument_error);
            answer(moved, result);
            for (std::size_t k = 0; k < count; ++k) {
                const double by = std::abs(result[k] - exact[k]);
                if (!std::isfinite(by)) return std::nullopt;
                change[k] = std::max(change[k], by);
            }
        }
        for (std::size_t k = 0; k < count; ++k) tolerance[k] += change[k];
    }
    for (std::size_t k = 0; k < count; ++k) {
        if (tolerance[k] > edge * size && size > 0.0) return std::nullopt;
        tolerance[k] += value_error * std::abs(exact[k]) + vector_error * size + least_argument_error;
    }
    return tolerance;
}

// The greatest difference in tolerances; infinite for NaN.
double distance(const Values& results, const Values& exact, const Values& tolerance, std::size_t count) {
    double greatest = 0.0;
    for (std::size_t k = 0; k < count; ++k) {
        const double by = std::abs(results[k] - exact[k]) / tolerance[k];
        greatest = std::isfinite(by) ? std::max(greatest, by) : std::numeric_limits<double>::infinity();
    }
    return greatest;
}

// A result that overflowed shows nothing of the formula behind it.
enum class NoNumbers { differ, are_passed_over };

// The share of the arguments at which the results are those of `answer`.
double agreement(const Trial& trial, Answer answer, NoNumbers no_numbers) {
    std::size_t agree = 0, asked = 0;
    for (std::size_t i = 0; i < trial.arguments.size(); ++i) {
        const auto tolerance = tolerances(trial, answer, trial.arguments[i]);
        if (!tolerance) continue;
        if (no_numbers == NoNumbers::are_passed_over && has_nan(trial.results[i], trial.result_names.size())) continue;
        Values expected;
        answer(trial.arguments[i], expected);
        ++asked;
        agree += distance(trial.results[i], expected, *tolerance, trial.result_names.size()) <= 1.0;
    }
    return asked == 0 ? 0.0 : static_cast<double>(agree) / static_cast<double>(asked);
}

constexpr double alike = 0.9;  // of the arguments

struct Cause {
    double closeness;  // the greater, the likelier
    std::string name;
};

std::vector<std::string> likeliest_first(std::vector<Cause> causes) {
    std::ranges::stable_sort(causes, [](const Cause& a, const Cause& b) { return a.closeness > b.closeness; });
    std::vector<std::string> names;
    for (const Cause& cause : causes) names.push_back(cause.name);
    return names;
}

std::string name_of_factor(double factor) {
    using std::numbers::pi;
    struct Known {
        double value;
        std::string_view name;
    };
    constexpr Known known[] = {{pi, "π"}, {1.0 / pi, "1/π"}, {2.0 * pi, "2π"}, {0.5 / pi, "1/(2π)"}, {4.0 * pi, "4π"},
        {0.25 / pi, "1/(4π)"}, {2.0, "2"}, {0.5, "1/2"}, {4.0, "4"}, {0.25, "1/4"}, {pi * pi, "π²"}};
    if (std::abs(factor + 1.0) < 1e-3) return "the sign is the other one";
    for (const Known& k : known)
        if (std::abs(factor / k.value - 1.0) < 1e-3) return fmt::format("{} times what it should be", k.name);
    return fmt::format("{:.4g} times what it should be", factor);
}

// All results off by one factor.
std::optional<std::string> common_factor(const Trial& trial) {
    std::vector<double> factors;
    for (std::size_t i = 0; i < trial.arguments.size(); ++i) {
        Values exact;
        trial.exercise->answer(trial.arguments[i], exact);
        for (std::size_t k = 0; k < trial.result_names.size(); ++k)
            if (std::abs(exact[k]) > 1e-3) factors.push_back(trial.results[i][k] / exact[k]);
    }
    if (factors.size() < trial.arguments.size() / 2) return std::nullopt;
    const auto middle = factors.begin() + static_cast<std::ptrdiff_t>(factors.size() / 2);
    std::ranges::nth_element(factors, middle);
    const double factor = *middle;
    const auto near = std::ranges::count_if(factors, [&](double f) { return std::abs(f / factor - 1.0) < 1e-3; });
    if (!std::isfinite(factor) || factor == 0.0 || std::abs(factor - 1.0) < 1e-3 ||
        static_cast<double>(near) < alike * static_cast<double>(factors.size()))
        return std::nullopt;
    return name_of_factor(factor);
}

// The share of the arguments at which the results are as far off as those of `answer`. Many answers are right, and many
// are wrong in the same way.
double agreement_of_faults(const Trial& trial, Answer answer) {
    std::size_t agree = 0;
    for (std::size_t i = 0; i < trial.arguments.size(); ++i) {
        Values results;
        answer(trial.arguments[i], results);
        const double own = trial.exercise->fault(trial.arguments[i], trial.results[i]);
        const double other = trial.exercise->fault(trial.arguments[i], results);
        agree += std::abs(own - other) <= 0.05 * (1.0 + std::abs(other));
    }
    return static_cast<double>(agree) / static_cast<double>(trial.arguments.size());
}

template <typename ShareOf>
std::vector<std::string> causes_by(const Trial& trial, const ShareOf& share_of) {
    std::vector<Cause> causes;
    for (const WrongAnswer& wrong : trial.exercise->wrong)
        if (const double share = share_of(wrong.answer); share >= alike)
            causes.push_back({share, std::string(wrong.name)});
    return likeliest_first(std::move(causes));
}

// The worst place of those where results are no numbers, or are off.
struct Fault {
    std::size_t index = 0, off = 0, asked = 0, no_numbers = 0;  // no numbers: of those that are off
    double worst = 0.0;
    double greatest_right = 0.0;
};

Mark mark_of_fault(const Trial& trial, const Fault& fault, const std::string& right) {
    Mark mark;
    if (fault.off == 0) {
        mark.kind = MarkKind::right;
        mark.summary = right;
        return mark;
    }
    mark.summary = fmt::format("{} of {} answers are off{}", fault.off, fault.asked,
        fault.no_numbers > 0 && fault.no_numbers < fault.off
            ? fmt::format(", {} of them infinite or not a number", fault.no_numbers)
            : "");
    mark.evidence.push_back("at     " + list_of(trial.argument_names, trial.arguments[fault.index]));
    mark.evidence.push_back("yours  " + list_of(trial.result_names, trial.results[fault.index]));
    return mark;
}

Fault fault_by_property(const Trial& trial) {
    Fault fault{.asked = trial.arguments.size()};
    for (std::size_t i = 0; i < trial.arguments.size(); ++i) {
        double off =
            has_nan(trial.results[i], trial.result_names.size()) ? std::numeric_limits<double>::infinity() : 0.0;
        if (off == 0.0 && trial.exercise->fault != nullptr)
            off = trial.exercise->fault(trial.arguments[i], trial.results[i]);
        if (!(off <= 1.0)) {
            ++fault.off, fault.no_numbers += has_nan(trial.results[i], trial.result_names.size());
            if (!(off <= fault.worst)) fault.worst = off, fault.index = i;
        }
    }
    return fault;
}

}  // namespace

Mark check_values(const Trial& trial, std::size_t* worst) {
    Fault fault;
    for (std::size_t i = 0; i < trial.arguments.size(); ++i) {
        const auto tolerance = tolerances(trial, trial.exercise->answer, trial.arguments[i]);
        if (!tolerance) continue;
        Values exact;
        trial.exercise->answer(trial.arguments[i], exact);
        ++fault.asked;
        const double off = distance(trial.results[i], exact, *tolerance, trial.result_names.size());
        if (off <= 1.0) {
            for (std::size_t k = 0; k < trial.result_names.size(); ++k)
                fault.greatest_right = std::max(fault.greatest_right, std::abs(trial.results[i][k] - exact[k]));
            continue;
        }
        ++fault.off, fault.no_numbers += has_nan(trial.results[i], trial.result_names.size());
        if (off > fault.worst) fault.worst = off, fault.index = i;
    }
    Mark mark = mark_of_fault(trial, fault,
        fmt::format("shown at {} arguments, none off by more than {:.1e}", fault.asked, fault.greatest_right));
    if (mark.kind == MarkKind::right) return mark;
    if (worst != nullptr) *worst = fault.index;
    Values exact;
    trial.exercise->answer(trial.arguments[fault.index], exact);
    mark.evidence.push_back("right  " + list_of(trial.result_names, exact));
    // Where most are numbers, these tell the causes apart.
    const NoNumbers no_numbers = 2 * fault.no_numbers < fault.off ? NoNumbers::are_passed_over : NoNumbers::differ;
    mark.errs_like = causes_by(trial, [&](Answer answer) { return agreement(trial, answer, no_numbers); });
    const auto factor = common_factor(trial);
    if (factor && std::ranges::find(mark.errs_like, *factor) == mark.errs_like.end()) mark.errs_like.push_back(*factor);
    return mark;
}

Mark check_property(const Trial& trial) {
    const Fault fault = fault_by_property(trial);
    Mark mark = mark_of_fault(trial, fault, fmt::format("shown at {} arguments", fault.asked));
    if (mark.kind == MarkKind::right) return mark;
    mark.evidence.push_back(fmt::format("off by {:.3g} times what rounding allows", fault.worst));
    mark.errs_like = causes_by(trial, [&](Answer answer) { return agreement_of_faults(trial, answer); });
    return mark;
}

namespace {

constexpr std::size_t bins_a_side = 16;
constexpr double false_alarm = 1e-6;           // of a right answer
constexpr std::uint32_t reference_factor = 4;  // so many more samples has the reference

using Histogram = std::vector<double>;

Histogram histogram_of(
    const Exercise& exercise, const std::vector<Values>& arguments, const std::vector<Values>& results) {
    Histogram bins(bins_a_side * bins_a_side);
    const auto bin = [](double x) {
        return static_cast<std::size_t>(std::clamp(x, 0.0, 1.0 - 0x1p-40) * static_cast<double>(bins_a_side));
    };
    for (std::size_t i = 0; i < arguments.size(); ++i) {
        const glm::dvec2 place = exercise.place(arguments[i], results[i]);
        if (std::isfinite(place.x) && std::isfinite(place.y)) ++bins[bin(place.y) * bins_a_side + bin(place.x)];
    }
    return bins;
}

Histogram histogram_by(const Trial& trial, Answer answer, std::uint64_t seed) {
    std::vector<Values> arguments, results;
    // Numbers of their own: those of another seed.
    for (std::uint32_t i = 0; i < reference_factor * trial.arguments.size(); ++i) {
        arguments.push_back(drawn(*trial.exercise, seed + 1, i));
        answer(arguments.back(), results.emplace_back());
    }
    return histogram_of(*trial.exercise, arguments, results);
}

struct ChiSquare {
    double statistic = 0.0, dof = 0.0, p = 1.0;
    std::size_t worst = 0;
};

// Two samples' histograms; bins of fewer than forty are taken together. The tail by [Wilson, Hilferty 1931].
ChiSquare chi_square(const Histogram& a, const Histogram& b) {
    double all_a = 0.0, all_b = 0.0;
    for (std::size_t i = 0; i < a.size(); ++i) all_a += a[i], all_b += b[i];
    if (all_a == 0.0) return {.p = 0.0};
    const double up = std::sqrt(all_b / all_a), down = std::sqrt(all_a / all_b);
    ChiSquare result;
    double worst = -1.0, rare_a = 0.0, rare_b = 0.0;
    const auto add = [&](double x, double y, std::size_t i) {
        const double term = (up * x - down * y) * (up * x - down * y) / (x + y);
        result.statistic += term;
        result.dof += 1.0;
        if (term > worst) worst = term, result.worst = i;
    };
    for (std::size_t i = 0; i < a.size(); ++i) {
        if (a[i] + b[i] < 40.0)
            rare_a += a[i], rare_b += b[i];
        else
            add(a[i], b[i], i);
    }
    if (rare_a + rare_b >= 5.0) add(rare_a, rare_b, 0);
    result.dof = std::max(1.0, result.dof - 1.0);
    const double spread = 2.0 / (9.0 * result.dof);
    result.p = normal_upper_tail((std::cbrt(result.statistic / result.dof) - 1.0 + spread) / std::sqrt(spread));
    return result;
}

}  // namespace

Mark check_distribution(const Trial& trial, std::uint64_t seed, std::optional<MarkPicture>* picture) {
    const Exercise& exercise = *trial.exercise;
    const Histogram own = histogram_of(exercise, trial.arguments, trial.results);
    const Histogram right = histogram_by(trial, exercise.answer, seed);
    const ChiSquare test = chi_square(own, right);
    const Fault fault = fault_by_property(trial);
    // What chi-square finds but for 1 %: a density off by this much, root mean square [normal theory].
    const double shown =
        std::sqrt((normal_quantile(1.0 - false_alarm) + normal_quantile(0.99)) * std::sqrt(2.0 * test.dof) *
                  (1.0 + 1.0 / reference_factor) / static_cast<double>(trial.results.size()));
    Mark mark = mark_of_fault(trial, fault,
        fmt::format("{} samples, chi-square {:.0f} with {:.0f} degrees of freedom (p = {:.2g}); a density {:.1f} % off "
                    "would have shown",
            trial.results.size(), test.statistic, test.dof, test.p, 100.0 * shown));
    const bool other_density = test.p < false_alarm;
    if (other_density) {
        mark.kind = MarkKind::wrong;
        mark.summary = fmt::format("{} samples have another density: chi-square {:.0f} with {:.0f} degrees of freedom",
            trial.results.size(), test.statistic, test.dof);
        const double total = static_cast<double>(trial.results.size());
        mark.evidence.push_back(fmt::format("region ({}, {}) of {} x {} has {:.3f} % of them; right is {:.3f} %",
            test.worst % bins_a_side, test.worst / bins_a_side, bins_a_side, bins_a_side,
            100.0 * own[test.worst] / total, 100.0 * right[test.worst] / (reference_factor * total)));
        if (picture != nullptr) {
            *picture = MarkPicture{.side = bins_a_side,
                .right = right,
                .yours = own,
                .shows = fmt::format("how many samples fall into each of {0} x {0} regions", bins_a_side)};
            for (double& samples : (*picture)->right) samples /= reference_factor;
        }
    } else if (fault.off > 0) {
        mark.summary = fmt::format("the density is right, but {} of {} answers are off", fault.off, fault.asked);
    }
    if (mark.kind == MarkKind::right) return mark;
    std::vector<Cause> causes;
    for (const WrongAnswer& wrong : exercise.wrong) {
        // Where the density is right, what else is wrong tells the causes apart.
        const ChiSquare like = chi_square(own, histogram_by(trial, wrong.answer, seed));
        const double share =
            fault.off > 0 && exercise.fault != nullptr ? agreement(trial, wrong.answer, NoNumbers::differ) : 0.0;
        if (like.p >= false_alarm && (other_density || share >= alike))
            causes.push_back({share - like.statistic / 1e6, std::string(wrong.name)});
    }
    mark.errs_like = likeliest_first(std::move(causes));
    return mark;
}

namespace {

constexpr double most_deviations = 5.0;  // of a right answer's mean: 6e-7 a result
constexpr double like_deviations = 4.0;
constexpr double shown_deviations = 2.58;  // 99 %
constexpr double rounding = 0x1p-16;       // of a mean
constexpr double margin = 0.02;            // a right answer is shown to be within

// How far the results' mean is from that of `answer`, in standard errors; the greatest over the results.
struct Bias {
    double deviations = 0.0, shown = 0.0;
    std::size_t result = 0;
    double own = 0.0, expected = 0.0;
};

Bias bias_from(const Trial& trial, Answer answer) {
    Bias bias{.deviations = -1.0};
    for (std::size_t k = 0; k < trial.result_names.size(); ++k) {
        SampleMoments differences, expected, own;
        for (std::size_t i = 0; i < trial.arguments.size(); ++i) {
            Values mean;
            answer(trial.arguments[i], mean);
            differences.add(trial.results[i][k] - mean[k]);
            expected.add(mean[k]);
            own.add(trial.results[i][k]);
        }
        // Rounding alone is no bias.
        const double error = std::sqrt(differences.variance_of_mean()) + rounding * std::abs(expected.mean) + 1e-30;
        const double size = std::max(std::abs(expected.mean), std::sqrt(expected.variance()));
        const double deviations = std::abs(differences.mean) / error;
        bias.shown = std::max(bias.shown, (std::abs(differences.mean) + shown_deviations * error) / size);
        if (!(deviations <= bias.deviations))
            bias.deviations = deviations, bias.result = k, bias.own = own.mean, bias.expected = expected.mean;
    }
    return bias;
}

}  // namespace

Mark check_expectation(const Trial& trial) {
    const Fault fault = fault_by_property(trial);
    const Bias bias = bias_from(trial, trial.exercise->answer);
    Mark mark = mark_of_fault(trial, fault,
        fmt::format(
            "the mean of {} answers is right within {:.2g} % (99 %)", trial.results.size(), 100.0 * bias.shown));
    if (fault.off == 0 && !(bias.deviations <= most_deviations)) {
        mark.kind = MarkKind::wrong;
        mark.summary = fmt::format(
            "the mean of {} answers is off by {:.0f} standard errors", trial.results.size(), bias.deviations);
        mark.evidence.push_back(fmt::format(
            "{}: your mean is {:.5g}; right is {:.5g}", trial.result_names[bias.result], bias.own, bias.expected));
    } else if (mark.kind == MarkKind::right && bias.shown > margin) {
        mark.kind = MarkKind::undecided;
        mark.summary = fmt::format(
            "no fault was found, but the answers are so noisy that only {:.2g} % are shown", 100.0 * bias.shown);
    }
    if (mark.kind != MarkKind::wrong) return mark;
    std::vector<Cause> causes;
    for (const WrongAnswer& wrong : trial.exercise->wrong)
        if (const Bias like = bias_from(trial, wrong.answer); like.deviations <= like_deviations)
            causes.push_back({-like.deviations, std::string(wrong.name)});
    mark.errs_like = likeliest_first(std::move(causes));
    return mark;
}

}  // namespace tandem
