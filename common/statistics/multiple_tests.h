// Many tests at once: family-wise and false-discovery control, and looking more than once.
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

// One p for "no test of the family is real": min over ranks i of m p_(i) / i [Simes 1986]. It is <= q exactly when
// Benjamini-Hochberg makes a discovery at q. Holds for independent and positively dependent tests.
[[nodiscard]] double simes(std::span<const double> p_values);

// The same under any dependence: m times the least p.
[[nodiscard]] double bonferroni(std::span<const double> p_values);

// Shares of `alpha` for a fixed number of looks, each tested at its own. They follow the spending function alpha t at
// information times t = 1/K ... 1 [Kim, DeMets 1987]. As the shares add up to alpha, the whole schedule keeps it by
// Bonferroni, whatever the looks share.
[[nodiscard]] std::vector<double> alpha_spending(double alpha, std::size_t looks);

}  // namespace tandem
