// The distributions from which tests take their p values, in double precision. Boost.Math does the work and stays in
// the .cpp.
#pragma once

namespace tandem {

[[nodiscard]] double normal_upper_tail(double z);  // P(Z > z)
[[nodiscard]] double normal_quantile(double p);    // z with P(Z <= z) = p, p in (0, 1)

// Student's t with `dof` > 0 degrees of freedom (not necessarily whole; infinity is the normal distribution).
[[nodiscard]] double student_upper_tail(double t, double dof);
[[nodiscard]] double student_quantile(double p, double dof);

// P(X >= successes) of a binomial X.
[[nodiscard]] double binomial_upper_tail(unsigned successes, unsigned trials, double chance);
// The chance above which so few successes or fewer are rarer than `error`. [Clopper, Pearson 1934]
[[nodiscard]] double binomial_upper_limit(unsigned successes, unsigned trials, double error);

}  // namespace tandem
