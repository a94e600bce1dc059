#include "common/validation/compare/compare.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/error.h"
#include "common/image/tiled_image.h"
#include "common/stopwatch.h"
#include "common/validation/compare/binned_image.h"
#include "common/validation/compare/colour_space.h"
#include "common/validation/compare/pixel_correlation.h"

namespace tandem {

namespace {

void check_same(const NamedImage& a, const NamedImage& b) {
    const auto refuse = [&](const std::string& what, const std::string& of_a, const std::string& of_b) {
        throw input_error(b.name, "", fmt::format("its {} {} is not that of {}, {}", what, of_b, a.name, of_a),
            "compare images of the same film");
    };
    const Image &x = a.image, &y = b.image;
    const auto size = [](const Image& i) { return fmt::format("{}x{}", i.width, i.height); };
    if (x.width != y.width || x.height != y.height) refuse("size", size(x), size(y));
    const auto origin = [](const Image& i) { return fmt::format("({}, {})", i.data_x, i.data_y); };
    if (x.data_x != y.data_x || x.data_y != y.data_y) refuse("data window's origin", origin(x), origin(y));
    const auto display = [](const Image& i) {
        return fmt::format("{}x{} at ({}, {})", i.full_width ? i.full_width : i.width,
            i.full_height ? i.full_height : i.height, i.full_x, i.full_y);
    };
    if (display(x) != display(y)) refuse("display window", display(x), display(y));
    const std::string of_x = colour_space_of(x).primaries, of_y = colour_space_of(y).primaries;
    if (!of_x.empty() && !of_y.empty() && of_x != of_y)
        refuse("colour space", "'" + x.colour_space + "'", "'" + y.colour_space + "'");
}

// An image without noise may well be the same twice; one with noise came of the same random numbers.
bool noiseless(const Image& image) {
    bool has_variance = false;
    for (std::size_t channel = 0; channel < image.channels.size(); ++channel) {
        if (image.channels[channel].find("ariance") == std::string::npos) continue;
        has_variance = true;
        for (std::size_t i = channel; i < image.pixels.size(); i += image.channels.size())
            if (image.pixels[i] != 0.0f) return false;
    }
    return has_variance;
}

void check_different_bits(const std::vector<const NamedImage*>& images, std::vector<std::string>& notes) {
    for (std::size_t i = 0; i < images.size(); ++i)
        for (std::size_t j = i + 1; j < images.size(); ++j) {
            if (images[i]->image.pixels != images[j]->image.pixels) continue;
            const std::string same = "holds the same pixels as " + images[i]->name;
            if (!noiseless(images[i]->image))
                throw input_error(images[j]->name, "", same + ", so the two are no independent evidence",
                    "render it with another seed");
            notes.push_back(images[j]->name + ": " + same +
                            "; they have no noise, so that may be right, but a copy would look the same");
        }
}

// Tandem's generator is a function of the seed: with one seed on both sides, errors are not independent.
void check_seeds(const std::vector<NamedImage>& reference, const std::vector<NamedImage>& candidate) {
    const auto seed = [](const NamedImage& named) {
        const auto& metadata = named.image.metadata;
        const auto tandem_seed = metadata.find("tandem:seed");
        return tandem_seed == metadata.end() ? std::string() : tandem_seed->second;
    };
    std::vector<const NamedImage*> all;
    for (const auto* side : {&reference, &candidate})
        for (const NamedImage& named : *side) all.push_back(&named);
    for (std::size_t i = 0; i < all.size(); ++i)
        for (std::size_t j = i + 1; j < all.size(); ++j)
            if (const NamedImage& a = *all[i], &b = *all[j]; !seed(a).empty() && seed(a) == seed(b))
                throw input_error(b.name, "", "was made with seed " + seed(b) + ", as " + a.name + " was",
                    "render one of them with another seed");
}

void check_sides(const std::vector<NamedImage>& reference, const std::vector<NamedImage>& candidate,
    std::vector<std::string>& notes) {
    if (reference.empty() || candidate.empty())
        throw InputError("compare: a side has no images; give at least one a side");
    std::vector<const NamedImage*> all;
    for (const auto* side : {&reference, &candidate})
        for (const NamedImage& named : *side) {
            check_same(reference.front(), named);
            all.push_back(&named);
        }
    check_different_bits(all, notes);
    check_seeds(reference, candidate);
}

double variance_of_means(const SampledImage& side) {
    double sum = 0.0;
    for (const PixelStatistics& pixel : side.pixels) sum += pixel.variance / pixel.count;
    return sum;
}

// A side of one image does not tell how far its pixels go together. The difference of both sides does. The other side's
// share of it is known where that has several images.
void estimate_correlation(
    SampledImage& reference, bool reference_alone, SampledImage& candidate, bool candidate_alone) {
    if (!reference_alone && !candidate_alone) return;
    const double both = neighbour_correlation(reference, candidate);
    if (reference_alone && candidate_alone) {
        reference.correlation = candidate.correlation = both;
        return;
    }
    SampledImage &alone = reference_alone ? reference : candidate, &known = reference_alone ? candidate : reference;
    const double of_alone = variance_of_means(alone), of_known = variance_of_means(known);
    if (of_alone > 0.0)
        alone.correlation = std::max(1.0, (both * (of_alone + of_known) - known.correlation * of_known) / of_alone);
}

}  // namespace

Criteria CompareOptions::comparison_criteria() {
    Criteria criteria;
    criteria.negligible.image = 0x1p-10;
    criteria.negligible.tile = 1e-2;
    criteria.negligible.pixel = 2e-2;
    criteria.same_estimator = false;
    criteria.fixed_tolerance = 0x1p-10;
    return criteria;
}

SceneVerdict compare_images(
    const std::vector<NamedImage>& reference, const std::vector<NamedImage>& candidate, const CompareOptions& options) {
    const Stopwatch watch;
    SceneVerdict verdict;
    check_sides(reference, candidate, verdict.notes);
    verdict.scene = reference.front().name;
    verdict.criteria = options.criteria;
    verdict.reference_name = options.reference_name;
    verdict.candidate_name = options.candidate_name;
    verdict.reference_info.backend = verdict.candidate_info.backend = "image";
    verdict.reference = sampled_image_of(reference, options.variance_of_reference, &verdict.notes);
    verdict.candidate = sampled_image_of(candidate, options.variance_of_candidate, &verdict.notes);
    estimate_correlation(verdict.reference, reference.size() == 1, verdict.candidate, candidate.size() == 1);
    verdict.settings.width = verdict.reference.width;
    verdict.settings.height = verdict.reference.height;
    const LookShare share{options.criteria.false_alarm, options.criteria.doubt};
    verdict.judgement = judge(verdict.reference, verdict.candidate, nullptr, options.criteria, share);
    verdict.seconds = watch.seconds();
    verdict.looks.push_back(look_of(
        verdict.judgement, std::min(verdict.reference.samples, verdict.candidate.samples), share, verdict.seconds));
    conclude(verdict);
    return verdict;
}

namespace {

void check_different_files(const std::vector<std::filesystem::path>& files) {
    for (std::size_t i = 0; i < files.size(); ++i)
        for (std::size_t j = 0; j < i; ++j) {
            std::error_code error;  // what is not there is told on reading
            if (std::filesystem::equivalent(files[i], files[j], error))
                throw input_error(files[i].string(), "", "is the same file as " + files[j].string(),
                    "give each image once: a copy is no independent evidence");
        }
}

// What images of such files and their comparison take, as measured on images of 0.3 to 4 million pixels. It counts the
// channels, the statistics of both sides, and what the levels of the verdict work on.
constexpr std::uint64_t verdict_pixel_bytes = 500;

std::uint64_t bytes_needed(const std::vector<Image>& headers, std::uint64_t bin) {
    std::uint64_t channels = 0, most = 0;
    for (const Image& header : headers) {
        channels += header.channels.size();
        const auto squares = [bin](std::uint64_t length) { return (length - 1) / bin + 1; };
        most = std::max(most, squares(header.width) * squares(header.height));
    }
    constexpr std::uint64_t statistics = channel_count * sizeof(PixelStatistics);  // of one more image of a side
    return most *
           (channels * sizeof(float) + verdict_pixel_bytes + statistics * (headers.size() > 2 ? headers.size() : 0));
}

std::string gibibytes(std::uint64_t bytes) {
    const double gibibytes = static_cast<double>(bytes) / 0x1p30;
    return gibibytes < 10.0 ? fmt::format("{:.2g} GiB", gibibytes) : fmt::format("{:.0f} GiB", gibibytes);
}

// As many as the limit promises room for; without one, as everywhere.
std::uint64_t most_floats(const CompareOptions& options) {
    const bool limited = options.memory != std::numeric_limits<std::uint64_t>::max();
    return limited ? std::max(greatest_float_count, options.memory / sizeof(float)) : greatest_float_count;
}

// PFM and NumPy files say as much by their size; they are read whole.
void check_memory(const std::vector<std::filesystem::path>& files, const CompareOptions& options) {
    std::vector<Image> headers;
    for (const std::filesystem::path& file : files)
        if (file.extension() != ".pfm" && file.extension() != ".npy") headers.push_back(BandedImage(file).header());
    if (headers.empty()) return;
    const std::uint64_t needed = bytes_needed(headers, options.bin);
    if (needed <= options.memory) return;
    std::uint64_t bin = 2 * std::uint64_t{options.bin};
    while (bytes_needed(headers, bin) > options.memory && bin < headers.front().width) bin *= 2;
    throw InputError(fmt::format(
        "compare: images of {}x{} pixels take {}, and the limit is {}; compare means of {}x{} pixels, in {}: --bin {}, "
        "or give more --memory",
        headers.front().width, headers.front().height, gibibytes(needed), gibibytes(options.memory), bin, bin,
        gibibytes(bytes_needed(headers, bin)), bin));
}

}  // namespace

SceneVerdict compare_files(const std::vector<std::filesystem::path>& reference,
    const std::vector<std::filesystem::path>& candidate, const CompareOptions& options) {
    std::vector<std::filesystem::path> all = reference;
    all.insert(all.end(), candidate.begin(), candidate.end());
    check_different_files(all);
    check_memory(all, options);
    const auto read = [&](const std::vector<std::filesystem::path>& files, const std::string& layer,
                          VarianceOf variance_of) {
        std::vector<NamedImage> images;
        for (const std::filesystem::path& file : files) {
            images.push_back({file.string(), options.bin > 1 ? read_binned_image(file, options.bin, variance_of)
                                                             : read_image(file, most_floats(options))});
            if (!layer.empty()) images.back().image = only_layer(images.back(), layer);
        }
        return images;
    };
    SceneVerdict verdict = compare_images(read(reference, options.reference_layer, options.variance_of_reference),
        read(candidate, options.candidate_layer, options.variance_of_candidate), options);
    if (options.bin > 1)
        verdict.notes.push_back(
            fmt::format("pixels, tiles and places are those of images whose pixels are means of {0}x{0} "
                        "pixels of the files (--bin)",
                options.bin));
    return verdict;
}

}  // namespace tandem
