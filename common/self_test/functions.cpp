#include "common/self_test/functions.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "common/render/random.h"

namespace tandem {

namespace {

constexpr std::uint32_t argument_count = 8192;

// Numbers of task i in [0, 1), the same in every run.
class Draw {
public:
    Draw(std::uint32_t function, std::uint32_t i) : function_(function), i_(i) {}

    double unit() {
        if (used_ == 4) {
            block_ = philox4x32_10({i_, function_, ++round_, 0}, {0, 0});
            used_ = 0;
        }
        return to_unit<double>(block_[used_++]);
    }
    double uniform(double low, double high) { return low + (high - low) * unit(); }
    double sign() { return unit() < 0.5 ? -1.0 : 1.0; }
    // A number of any sign, its exponent uniform in [least, greatest).
    double scaled(int least, int greatest) {
        const int exponent = least + static_cast<int>(unit() * (greatest - least));
        return sign() * std::ldexp(1.0 + unit(), exponent);
    }
    double positive(int least, int greatest) { return std::abs(scaled(least, greatest)); }

private:
    std::uint32_t function_, i_, round_ = 0;
    RandomBlock block_{};
    std::size_t used_ = 4;
};

template <class Make>
std::vector<Arguments> drawn(Operation operation, const Make& make) {
    std::vector<Arguments> list;
    list.reserve(argument_count);
    for (std::uint32_t i = 0; i < argument_count; ++i) {
        Draw draw(static_cast<std::uint32_t>(operation), i);
        const std::array<double, 3> made = make(draw, i);
        list.push_back({static_cast<float>(made[0]), static_cast<float>(made[1]), static_cast<float>(made[2])});
    }
    return list;
}

// Sums need exponents that overlap, so that there is something to round, and signs that cancel.
std::vector<Arguments> of_sums() {
    return drawn(Operation::add, [](Draw& draw, std::uint32_t) {
        const double x = draw.scaled(-60, 60);
        return std::array{x, x * draw.scaled(-28, 28), 0.0};
    });
}
std::vector<Arguments> of_products() {
    return drawn(Operation::multiply, [](Draw& draw, std::uint32_t) {
        return std::array{draw.scaled(-60, 60), draw.scaled(-60, 60), 0.0};
    });
}
// Product and addend do not cancel to nothing: what one rounding more then costs, in ulp, has no bound.
std::vector<Arguments> of_fma() {
    return drawn(Operation::fma, [](Draw& draw, std::uint32_t) {
        const double x = draw.scaled(-20, 20), y = draw.scaled(-20, 20);
        const double ratio = draw.scaled(-28, 28);
        return std::array{x, y, x * y * (std::abs(ratio + 1.0) < 0.5 ? -ratio : ratio)};
    });
}
std::vector<Arguments> of_roots() {
    return drawn(Operation::square_root, [](Draw& draw, std::uint32_t i) {
        const double whole = static_cast<double>(i / 4 + 1);  // its square has an exact root
        return std::array{i % 4 == 0 ? whole * whole : draw.positive(-120, 120), 0.0, 0.0};
    });
}
// The interval for which Vulkan promises anything, a third of the arguments small.
std::vector<Arguments> of_angles() {
    return drawn(Operation::sine, [](Draw& draw, std::uint32_t i) {
        constexpr double end = std::numbers::pi - 0x1p-22;  // rounds to a float within
        return std::array{i % 3 == 0 ? draw.scaled(-24, 1) : draw.uniform(-end, end), 0.0, 0.0};
    });
}
std::vector<Arguments> of_exponents() {
    return drawn(Operation::exponential, [](Draw& draw, std::uint32_t i) {
        return std::array{i % 3 == 0 ? draw.scaled(-24, 1) : draw.uniform(-86.0, 88.0), 0.0, 0.0};
    });
}
std::vector<Arguments> of_logarithms() {
    return drawn(Operation::logarithm, [](Draw& draw, std::uint32_t i) {
        return std::array{i % 3 == 0 ? 1.0 + draw.scaled(-23, -1) : draw.positive(-120, 120), 0.0, 0.0};
    });
}
std::vector<Arguments> of_powers() {
    return drawn(Operation::power, [](Draw& draw, std::uint32_t) {
        return std::array{draw.positive(-4, 4), draw.uniform(-20.0, 20.0), 0.0};
    });
}
std::vector<Arguments> of_slopes() {
    return drawn(Operation::arc_tangent, [](Draw& draw, std::uint32_t) {
        return std::array{draw.scaled(-60, 60), 0.0, 0.0};
    });
}

// Correctly rounded in Vulkan's sense: the exact value where it is a float, else either neighbour.
double either_neighbour(double, double, double, double exact) {
    return static_cast<double>(static_cast<float>(exact)) == exact ? 0.0 : float_ulp(exact);
}
// The product's rounding, then that of the sum, which the first may carry over a power of two.
double product_and_sum(double x, double y, double, double exact) {
    const double product = float_ulp(x * y);
    return product + float_ulp(std::abs(exact) + product);
}
template <int half_ulps>
double ulps(double, double, double, double exact) {
    return 0.5 * half_ulps * float_ulp(exact);
}
// 1 / inversesqrt(x): 2 ulp of the latter, relative, then the 2.5 ulp of a division.
double root_of_inverse(double x, double, double, double exact) {
    const double inverse = 1.0 / std::sqrt(x);
    const double relative = 2.0 * float_ulp(inverse) / inverse;
    return exact * relative / (1.0 - relative) + 2.5 * float_ulp(exact * (1.0 + relative));
}
double angle(double, double, double, double) { return 0x1p-11; }
double exponential_error(double t, double exact) { return (3.0 + 2.0 * std::abs(t)) * float_ulp(exact); }
double logarithm_error(double x, double logarithm) {
    return x >= 0.5 && x <= 2.0 ? 0x1p-21 : 3.0 * float_ulp(logarithm);
}
// exp2(y log2 x): the errors of the logarithm and of the product, through the exponential function, and its own.
double through_logarithm(double x, double y, double, double exact) {
    const double logarithm = std::log2(x), t = y * logarithm;
    const double error = std::abs(y) * logarithm_error(x, logarithm) + float_ulp(t);
    return exact * std::expm1(std::numbers::ln2 * error) + exponential_error(std::abs(t) + error, 2.0 * exact);
}

constexpr std::string_view exactly = "correct rounding, either way";
constexpr std::array<MeasuredFunction, 13> functions{{
    {"x + y", Operation::add, exactly, of_sums, [](double x, double y, double) { return x + y; }, either_neighbour},
    {"x - y", Operation::subtract, exactly, of_sums, [](double x, double y, double) { return x - y; },
        either_neighbour},
    {"x * y", Operation::multiply, exactly, of_products, [](double x, double y, double) { return x * y; },
        either_neighbour},
    {"x / y", Operation::divide, "2.5 ulp", of_products, [](double x, double y, double) { return x / y; }, ulps<5>},
    {"fma", Operation::fma, "of x * y, then of + z", of_fma,
        [](double x, double y, double z) { return std::fma(x, y, z); }, product_and_sum},
    {"sqrt", Operation::square_root, "1 / inversesqrt", of_roots, [](double x, double, double) { return std::sqrt(x); },
        root_of_inverse},
    {"inversesqrt", Operation::inverse_square_root, "2 ulp", of_roots,
        [](double x, double, double) { return 1.0 / std::sqrt(x); }, ulps<4>},
    {"sin", Operation::sine, "2^-11 within pi", of_angles, [](double x, double, double) { return std::sin(x); }, angle},
    {"cos", Operation::cosine, "2^-11 within pi", of_angles, [](double x, double, double) { return std::cos(x); },
        angle},
    {"exp", Operation::exponential, "3 + 2 |x| ulp", of_exponents, [](double x, double, double) { return std::exp(x); },
        [](double x, double, double, double exact) { return exponential_error(x, exact); }},
    {"log", Operation::logarithm, "3 ulp, 2^-21 near 1", of_logarithms,
        [](double x, double, double) { return std::log(x); },
        [](double x, double, double, double exact) { return logarithm_error(x, exact); }},
    {"pow", Operation::power, "exp2(y * log2(x))", of_powers, [](double x, double y, double) { return std::pow(x, y); },
        through_logarithm},
    {"atan", Operation::arc_tangent, "4096 ulp", of_slopes, [](double x, double, double) { return std::atan(x); },
        ulps<8192>},
}};

}  // namespace

std::span<const MeasuredFunction> measured_functions() { return functions; }

double float_ulp(double value) {
    constexpr int digits = std::numeric_limits<float>::digits, least = std::numeric_limits<float>::min_exponent;
    int exponent = least;
    if (value != 0.0) (void)std::frexp(value, &exponent);
    return std::ldexp(1.0, std::max(exponent, least) - digits);
}

}  // namespace tandem
