#include "common/validation/judges/judges.h"

#include <algorithm>
#include <cmath>

#include "common/error.h"
#include "common/statistics/distributions.h"

namespace tandem {

namespace {

double encoded(double linear) {
    const double x = std::clamp(linear, 0.0, 1.0);
    return x <= 0.0031308 ? 12.92 * x : 1.055 * std::pow(x, 1.0 / 2.4) - 0.055;
}

std::vector<double> luma(const std::vector<double>& rgb) {
    std::vector<double> y;
    for (std::size_t i = 0; i < rgb.size(); i += 3)
        y.push_back(0.2126 * rgb[i] + 0.7152 * rgb[i + 1] + 0.0722 * rgb[i + 2]);
    return y;
}

// The percentage of pixels of which some channel is off by more than `fail`; idiff counts so.
double failing_percent(const std::vector<double>& a, const std::vector<double>& b, double fail) {
    std::size_t failing = 0;
    for (std::size_t i = 0; i < a.size(); i += 3)
        failing +=
            std::max({std::abs(a[i] - b[i]), std::abs(a[i + 1] - b[i + 1]), std::abs(a[i + 2] - b[i + 2])}) > fail;
    return 300.0 * static_cast<double>(failing) / static_cast<double>(a.size());
}

double greatest_difference(const std::vector<double>& a, const std::vector<double>& b) {
    double greatest = 0.0;
    for (std::size_t i = 0; i < a.size(); ++i) greatest = std::max(greatest, std::abs(a[i] - b[i]));
    return greatest;
}

double mean_square(const std::vector<double>& a, const std::vector<double>& b) {
    double sum = 0.0;
    for (std::size_t i = 0; i < a.size(); ++i) sum += (a[i] - b[i]) * (a[i] - b[i]);
    return sum / static_cast<double>(a.size());
}

// Percentage of pixels and channels at which Mitsuba's z-test rejects: the reference's variance is the only noise.
double mitsuba_rejections(const JudgedPair& pair) {
    const double pixels = static_cast<double>(pair.reference.size()) / 3.0;
    const double alpha = 1.0 - std::pow(1.0 - 0.01, 1.0 / pixels);
    std::size_t rejected = 0;
    for (std::size_t i = 0; i < pair.reference.size(); ++i) {
        const double variance = std::max(pair.reference_variance[i] * pair.samples, 1e-4);
        const double z = std::abs(pair.candidate[i] - pair.reference[i]) * std::sqrt(pair.samples / variance);
        rejected += 2.0 * normal_upper_tail(z) <= alpha;
    }
    return 100.0 * static_cast<double>(rejected) / (3.0 * pixels);
}

// Minus the decimal logarithm of the least p of a t-test at each pixel and channel, times their number.
double bonferroni(const JudgedPair& pair) {
    double least = 1.0;
    for (std::size_t i = 0; i < pair.reference.size(); ++i) {
        const double variance = pair.reference_variance[i] + pair.candidate_variance[i];
        const double difference = std::abs(pair.reference[i] - pair.candidate[i]);
        if (difference == 0.0) continue;
        if (variance == 0.0) return 300.0;
        least = std::min(least, 2.0 * student_upper_tail(difference / std::sqrt(variance), 2.0 * pair.samples - 2.0));
    }
    return -std::log10(std::max(1e-300, std::min(1.0, least * static_cast<double>(pair.reference.size()))));
}

// The difference against that of two images of the reference alone.
double floor_ratio(const JudgedPair& pair) {
    double noise = 0.0;
    for (const double variance : pair.reference_variance) noise += 2.0 * variance;
    noise /= static_cast<double>(pair.reference.size());
    const double difference = mean_square(pair.reference, pair.candidate);
    return noise > 0.0 ? std::sqrt(difference / noise) : difference > 0.0 ? 1e6 : 1.0;
}

}  // namespace

std::vector<double> displayed(const std::vector<double>& linear) {
    std::vector<double> shown;
    for (const double value : linear) shown.push_back(std::round(255.0 * encoded(value)) / 255.0);
    return shown;
}

double structural_similarity(
    const std::vector<double>& a, const std::vector<double>& b, std::uint32_t width, std::uint32_t height) {
    constexpr int radius = 5;
    constexpr double sigma = 1.5, c1 = 0.01 * 0.01, c2 = 0.03 * 0.03;
    double total = 0.0, windows = 0.0;
    const int w = static_cast<int>(width), h = static_cast<int>(height);
    for (int y = radius; y + radius < h; ++y)
        for (int x = radius; x + radius < w; ++x) {
            double weights = 0.0, ma = 0.0, mb = 0.0, aa = 0.0, bb = 0.0, ab = 0.0;
            for (int dy = -radius; dy <= radius; ++dy)
                for (int dx = -radius; dx <= radius; ++dx) {
                    const double weight = std::exp(-(dx * dx + dy * dy) / (2.0 * sigma * sigma));
                    const auto i = static_cast<std::size_t>((y + dy) * w + x + dx);
                    weights += weight;
                    ma += weight * a[i];
                    mb += weight * b[i];
                    aa += weight * a[i] * a[i];
                    bb += weight * b[i] * b[i];
                    ab += weight * a[i] * b[i];
                }
            ma /= weights;
            mb /= weights;
            const double va = aa / weights - ma * ma, vb = bb / weights - mb * mb, vab = ab / weights - ma * mb;
            total += (2.0 * ma * mb + c1) * (2.0 * vab + c2) / ((ma * ma + mb * mb + c1) * (va + vb + c2));
            windows += 1.0;
        }
    return windows > 0.0 ? total / windows : 1.0;
}

JudgedPair judged_pair(const Image& reference, const Image& candidate) {
    if (reference.width != candidate.width || reference.height != candidate.height)
        throw InputError("judges: the images have different sizes; render both at one size");
    JudgedPair pair{.width = reference.width,
        .height = reference.height,
        .reference = {},
        .candidate = {},
        .reference_variance = {},
        .candidate_variance = {}};
    const auto take = [](const Image& image, const std::string& prefix, std::vector<double>& values) {
        std::vector<std::size_t> places;
        for (const char* name : {"R", "G", "B"})
            if (const auto found = std::ranges::find(image.channels, prefix + name); found != image.channels.end())
                places.push_back(static_cast<std::size_t>(found - image.channels.begin()));
        if (places.size() != 3) return false;
        for (std::size_t i = 0; i < image.pixels.size(); i += image.channels.size())
            for (const std::size_t place : places) values.push_back(static_cast<double>(image.pixels[i + place]));
        return true;
    };
    if (!take(reference, "", pair.reference) || !take(candidate, "", pair.candidate))
        throw InputError("judges: an image has no channels R, G, B; render it to .exr");
    const auto count = std::ranges::find(reference.channels, "count");
    if (count == reference.channels.end()) return pair;
    pair.samples = static_cast<double>(reference.pixels[static_cast<std::size_t>(count - reference.channels.begin())]);
    if (!take(reference, "variance.", pair.reference_variance) ||
        !take(candidate, "variance.", pair.candidate_variance) || !(pair.samples > 1.0)) {
        pair.reference_variance.clear();
        return pair;
    }
    for (double& variance : pair.reference_variance) variance /= pair.samples;
    for (double& variance : pair.candidate_variance) variance /= pair.samples;
    return pair;
}

std::vector<JudgeFinding> ask_judges(const JudgedPair& pair) {
    const std::vector<double> a = displayed(pair.reference), b = displayed(pair.candidate);
    const double psnr = -10.0 * std::log10(std::max(mean_square(a, b), 1e-30));
    std::vector<JudgeFinding> findings{
        {"idiff, Cycles", "more than 1 % of pixels off by more than 0.016, in 8 bits as shown",
            failing_percent(a, b, 0.016), 1.0},
        {"idiff, OSL", "more than 0.02 % of pixels off by more than 0.004, linear",
            failing_percent(pair.reference, pair.candidate, 0.004), 0.02},
        {"idiff, OSL, hard", "a pixel off by more than 0.01, linear",
            greatest_difference(pair.reference, pair.candidate), 0.01},
        {"idiff, OpenUSD", "more than 0.03 % of pixels off by more than 0.05, in 8 bits as shown",
            failing_percent(a, b, 0.05), 0.03},
        {"RMSE", "PSNR below 40 dB, as shown; a rule of thumb", -psnr, -40.0},
        {"SSIM", "mean SSIM below 0.95, luma as shown; a rule of thumb",
            1.0 - structural_similarity(luma(a), luma(b), pair.width, pair.height), 0.05},
        {"FLIP", "mean FLIP above 0.018, as wgpu sets it",
            flip_error(pair.reference, pair.candidate, pair.width, pair.height), 0.018}};
    if (pair.reference_variance.empty()) return findings;
    findings.push_back({"z-test, Mitsuba", "more than 0.25 % of pixels rejected at 1 %, Šidák's correction",
        mitsuba_rejections(pair), 0.25});
    findings.push_back({"floor ratio, Chrono",
        "difference more than 3 % above the reference's own noise; the 3 % are ours", floor_ratio(pair), 1.03});
    findings.push_back({"t-test a pixel, Bonferroni", "some pixel rejected at 1 %", bonferroni(pair), 2.0});
    return findings;
}

}  // namespace tandem
