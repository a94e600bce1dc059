// Many tests at once: family-wise and false-discovery control, simultaneous intervals, and looking more than once.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace tandem {

// Holm 1979. adjusted[i] <= alpha means: test i is significant at family-wise level alpha.
[[nodiscard]] std::vector<double> holm_adjusted(std::span<const double> p_values);

// The level that p_values[i] itself was held to in Holm's procedure at `alpha`: alpha / (m - rank), rank from 0.
[[nodiscard]] std::vector<double> holm_thresholds(std::span<const double> p_values, double alpha);

// Benjamini, Hochberg 1995. adjusted[i] <= q means: i is a discovery at false-discovery rate q.
[[nodiscard]] std::vector<double> benjamini_hochberg_adjusted(std::span<const double> p_values);

// One p for "no test of the family is real": min over ranks i of m p_(i) / i [Simes 1986]; it is <= q exactly when
// Benjamini-Hochberg makes a discovery at q. Holds for independent and positively dependent tests.
[[nodiscard]] double simes(std::span<const double> p_values);

// The same under any dependence: m times the least p.
[[nodiscard]] double bonferroni(std::span<const double> p_values);

// Level a side of each of `count` intervals that hold together with confidence 1 - 2 alpha_each_side. [Sidak 1967]
[[nodiscard]] double simultaneous_level(double alpha_each_side, std::size_t count);

// Shares of `alpha` for a fixed number of looks: spending function alpha t^power at information times t = 1/K ... 1
// (power 1 shares equally; larger ones keep more for late looks) [Kim, DeMets 1987], each look being tested at its own
// increment. As the increments add up to alpha, the whole schedule keeps it by Bonferroni, whatever the looks share.
[[nodiscard]] std::vector<double> alpha_spending(double alpha, std::size_t looks, double power = 1.0);

}  // namespace tandem
