#include "common/statistics/multiple_tests.h"

#include <algorithm>
#include <numeric>

namespace tandem {

namespace {

std::vector<std::size_t> ascending_order(std::span<const double> p_values) {
    std::vector<std::size_t> order(p_values.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::ranges::stable_sort(order, {}, [&](std::size_t i) { return p_values[i]; });
    return order;
}

}  // namespace

std::vector<double> holm_adjusted(std::span<const double> p_values) {
    std::vector<double> adjusted(p_values.size());
    double running = 0.0, remaining = static_cast<double>(p_values.size());
    for (const std::size_t i : ascending_order(p_values)) {
        running = std::max(running, std::min(1.0, remaining * p_values[i]));
        adjusted[i] = running;
        remaining -= 1.0;
    }
    return adjusted;
}

std::vector<double> holm_thresholds(std::span<const double> p_values, double alpha) {
    std::vector<double> thresholds(p_values.size());
    double remaining = static_cast<double>(p_values.size());
    for (const std::size_t i : ascending_order(p_values)) {
        thresholds[i] = alpha / remaining;
        remaining -= 1.0;
    }
    return thresholds;
}

std::vector<double> benjamini_hochberg_adjusted(std::span<const double> p_values) {
    const std::vector<std::size_t> order = ascending_order(p_values);
    std::vector<double> adjusted(p_values.size());
    const double m = static_cast<double>(p_values.size());
    double running = 1.0;
    for (std::size_t rank = order.size(); rank > 0; --rank) {
        const std::size_t i = order[rank - 1];
        running = std::min(running, m * p_values[i] / static_cast<double>(rank));
        adjusted[i] = running;
    }
    return adjusted;
}

double simes(std::span<const double> p_values) {
    const double m = static_cast<double>(p_values.size());
    std::vector<double> sorted(p_values.begin(), p_values.end());
    std::ranges::sort(sorted);
    double least = 1.0;
    for (std::size_t i = 0; i < sorted.size(); ++i) least = std::min(least, m * sorted[i] / static_cast<double>(i + 1));
    return least;
}

double bonferroni(std::span<const double> p_values) {
    if (p_values.empty()) return 1.0;
    return std::min(1.0, static_cast<double>(p_values.size()) * *std::ranges::min_element(p_values));
}

std::vector<double> alpha_spending(double alpha, std::size_t looks) {
    std::vector<double> shares(looks);
    double spent = 0.0;
    for (std::size_t k = 0; k < looks; ++k) {
        const double total = alpha * (static_cast<double>(k + 1) / static_cast<double>(looks));
        shares[k] = total - spent;
        spent = total;
    }
    return shares;
}

}  // namespace tandem
