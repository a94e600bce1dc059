#include "common/statistics/distributions.h"

#include <boost/math/distributions/beta.hpp>
#include <boost/math/distributions/normal.hpp>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <limits>

namespace tandem {

namespace {

// Beyond this, Student's t and the normal distribution differ by less than 1e-8 relative out to six deviations. The
// first correction of the tail is (z^4 + 2 z^2) / (4 dof), about 340 / dof there.
constexpr double normal_from_dof = 4e10;

}  // namespace

double normal_upper_tail(double z) { return 0.5 * std::erfc(z * std::sqrt(0.5)); }

double normal_quantile(double p) { return boost::math::quantile(boost::math::normal{}, p); }

double student_upper_tail(double t, double dof) {
    if (std::isinf(t)) return t > 0.0 ? 0.0 : 1.0;
    if (dof > normal_from_dof) return normal_upper_tail(t);
    return boost::math::cdf(boost::math::complement(boost::math::students_t{dof}, t));
}

double student_quantile(double p, double dof) {
    if (dof > normal_from_dof) return normal_quantile(p);
    return boost::math::quantile(boost::math::students_t{dof}, p);
}

// The regularised incomplete beta function, as a cdf.
double binomial_upper_tail(unsigned successes, unsigned trials, double chance) {
    if (successes == 0) return 1.0;
    if (successes > trials) return 0.0;
    const double k = successes, n = trials;
    return boost::math::cdf(boost::math::beta_distribution<>{k, n - k + 1.0}, chance);
}

double binomial_upper_limit(unsigned successes, unsigned trials, double error) {
    if (successes >= trials) return 1.0;
    const double k = successes, n = trials;
    return boost::math::quantile(boost::math::complement(boost::math::beta_distribution<>{k + 1.0, n - k}, error));
}

}  // namespace tandem
