// One side of `compare`: from images as read to what the statistics work on.
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <optional>

#include "common/error.h"
#include "common/image/denoise.h"
#include "common/statistics/sample_moments.h"
#include "common/validation/compare/colour_space.h"
#include "common/validation/compare/compare.h"

namespace tandem {

namespace {

std::optional<std::size_t> find_channel(const Image& image, const std::string& name) {
    const auto found = std::ranges::find(image.channels, name);
    if (found == image.channels.end()) return std::nullopt;
    return static_cast<std::size_t>(found - image.channels.begin());
}

using ChannelTriple = std::array<std::size_t, channel_count>;

std::optional<ChannelTriple> find_triple(const Image& image, const std::string& prefix) {
    ChannelTriple triple{};
    constexpr std::array<const char*, channel_count> letters{"R", "G", "B"};
    for (std::size_t c = 0; c < channel_count; ++c) {
        const std::optional<std::size_t> channel = find_channel(image, prefix + letters[c]);
        if (!channel) return std::nullopt;
        triple[c] = *channel;
    }
    return triple;
}

// Everything before the last letter of a channel R: "" or "ViewLayer.Combined.".
std::vector<std::string> layers_of(const Image& image) {
    std::vector<std::string> layers;
    for (const std::string& channel : image.channels) {
        if (!channel.ends_with('R') || (channel.size() > 1 && channel[channel.size() - 2] != '.')) continue;
        const std::string layer = channel.substr(0, channel.size() - 1);
        if (find_triple(image, layer)) layers.push_back(layer);
    }
    return layers;
}

bool holds_variance(const std::string& layer) { return layer.ends_with("variance.") || layer.ends_with("Variance."); }

// The image itself: plain R, G, B, else the one layer with a name of what renderers call it, else the only layer.
std::string colour_layer(const NamedImage& named) {
    std::vector<std::string> layers = layers_of(named.image), beauty;
    std::erase_if(layers, holds_variance);
    if (std::ranges::find(layers, "") != layers.end()) return "";
    for (const std::string& layer : layers)
        for (const char* name : {"Combined.", "Beauty.", "beauty.", "rgba.", "RGBA."})
            if (layer.ends_with(name)) beauty.push_back(layer);
    if (beauty.empty()) beauty = layers;
    if (beauty.size() == 1) return beauty.front();
    std::string there;
    for (const std::string& channel : named.image.channels) there += (there.empty() ? "" : ", ") + channel;
    if (beauty.empty())
        throw input_error(named.name, "", "has no channels R, G and B (it has " + there + ")", "give an RGB image");
    throw input_error(named.name, "",
        fmt::format("has {} layers of R, G and B (its channels: {})", beauty.size(), there),
        "name the one to compare: --layer");
}

ChannelTriple colour_channels(const NamedImage& named) { return *find_triple(named.image, colour_layer(named)); }

// variance.R or Variance.R, in whatever layer.
std::optional<ChannelTriple> variance_channels(const NamedImage& named) {
    for (const std::string& layer : layers_of(named.image)) {
        if (!holds_variance(layer)) continue;
        return find_triple(named.image, layer);
    }
    return std::nullopt;
}

// "samples" is anybody's, "samplesPerPixel" pbrt-v4's, "tandem:samples" our own, "cycles.LAYER.samples" Blender's.
bool tells_samples(const std::string& key) {
    return key == "samples" || key == "samplesPerPixel" || key == "tandem:samples" ||
           (key.starts_with("cycles.") && key.ends_with(".samples"));
}

std::optional<double> count_in_metadata(const Image& image) {
    for (const auto& [key, text] : image.metadata) {
        if (!tells_samples(key)) continue;
        double value = 0.0;
        const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
        if (error == std::errc{} && value >= 1.0) return value;
    }
    return std::nullopt;
}

// A value that is no radiance is counted and taken as 0.
double valid(double value, std::size_t i, SampledImage& side, bool may_be_negative = false) {
    if (std::isfinite(value) && (value >= 0.0 || may_be_negative)) return value;
    ++side.invalid;
    side.invalid_pixels.push_back(static_cast<std::uint32_t>(i / channel_count));
    return 0.0;
}

// Means in linear light, [pixel * 3 + channel], and the variance that rounding to integers gave them.
struct Light {
    std::vector<double> mean, rounding;
};

Light light_of(const NamedImage& named, SampledImage& side) {
    const Image& image = named.image;
    const ChannelTriple colour = colour_channels(named);
    const Transfer transfer = colour_space_of(image).transfer;
    const double step = image.greatest_integer > 0 ? 1.0 / image.greatest_integer : 0.0;
    Light light;
    const std::optional<std::size_t> count = find_channel(image, "count");
    for (std::size_t pixel = 0; count && pixel < std::size_t{image.width} * image.height; ++pixel)
        if (image.pixels[pixel * image.channels.size() + *count] == 0.0f)
            throw input_error(named.name, "",
                fmt::format("pixel ({}, {}) has no samples", pixel % image.width, pixel / image.width),
                "render the whole film");
    for (std::size_t i = 0; i < std::size_t{image.width} * image.height * channel_count; ++i) {
        const double value = valid(image.pixels[i / channel_count * image.channels.size() + colour[i % channel_count]],
            i, side, named.may_be_negative);
        const double width = step * transfer.slope(value);
        light.mean.push_back(transfer.decoded(value));
        light.rounding.push_back(width * width / 12.0);
    }
    return light;
}

SampledImage empty_side(const Image& image) {
    SampledImage side;
    side.width = image.width;
    side.height = image.height;
    side.pixels.resize(std::size_t{image.width} * image.height * channel_count);
    return side;
}

using Notes = std::vector<std::string>;

void note(Notes* notes, const std::string& text) {
    if (notes != nullptr && std::ranges::find(*notes, text) == notes->end()) notes->push_back(text);
}

// Once for all images of a side that are alike.
void note_transfers(const std::vector<NamedImage>& side, Notes* notes) {
    std::map<std::string, std::vector<std::string>> names;  // by what is said of them
    for (const NamedImage& named : side) {
        const Image& image = named.image;
        const Transfer transfer = colour_space_of(image).transfer;
        if (transfer.curve == Transfer::Curve::linear) continue;
        const char* bits = image.greatest_integer == 0    ? ""
                           : image.greatest_integer > 255 ? " of 16 bits"
                                                          : " of 8 bits";
        const std::string from = transfer.curve == Transfer::Curve::srgb
                                     ? std::string("sRGB")
                                     : fmt::format("a gamma of {:g}", transfer.exponent);
        names[fmt::format("values{} are decoded to linear light from {}{}", bits, from,
                  image.colour_space.empty() ? ", as the file does not say otherwise" : "")]
            .push_back(named.name);
    }
    for (const auto& [text, files] : names)
        note(notes,
            files.front() + (files.size() > 1 ? fmt::format(" and {} more", files.size() - 1) : "") + ": " + text);
}

SampledImage from_variance(const NamedImage& named, VarianceOf variance_of, Notes* notes) {
    const Image& image = named.image;
    const std::optional<ChannelTriple> variance = variance_channels(named);
    if (!variance)
        throw input_error(named.name, "", "is alone on its side and has no channels variance.R, .G, .B",
            "add them, or give two or more images of independent seeds");
    if (colour_space_of(image).transfer.curve != Transfer::Curve::linear)
        throw input_error(named.name, "",
            "has variance channels beside values encoded as '" + image.colour_space + "', whose noise they do not tell",
            "write linear values, or give two or more images of independent seeds");
    const std::optional<std::size_t> count_channel = find_channel(image, "count");
    std::optional<double> count = count_in_metadata(image);
    if (!count_channel && !count && variance_of == VarianceOf::mean) {
        count = assumed_count;
        note(notes, fmt::format("{}: does not say how many samples it holds; {:g} are taken for granted", named.name,
                        assumed_count));
    }
    if (!count_channel && !count)
        throw input_error(named.name, "", "does not say how many samples its variance of one sample stands for",
            "add a channel or metadata, or say that it is the variance of the mean");

    SampledImage side = empty_side(image);
    const Light light = light_of(named, side);
    for (std::size_t i = 0; i < side.pixels.size(); ++i) {
        const float* pixel = &image.pixels[i / channel_count * image.channels.size()];
        PixelStatistics& statistics = side.pixels[i];
        statistics.mean = light.mean[i];
        statistics.variance = valid(pixel[(*variance)[i % channel_count]], i, side);
        statistics.count = count_channel ? double{pixel[*count_channel]} : *count;
        if (!(statistics.count >= 2.0))
            throw input_error(named.name, "",
                fmt::format("pixel ({}, {}) has fewer than two samples", i / channel_count % image.width,
                    i / channel_count / image.width),
                "render more samples");
        if (variance_of == VarianceOf::mean) statistics.variance *= statistics.count;
        statistics.variance += statistics.count * light.rounding[i];
        side.samples = std::max(side.samples, static_cast<std::uint64_t>(statistics.count));
    }
    return side;
}

// How much more the means of tiles scatter over the images than independent pixels would let them; 1 unless surely
// more.
double tile_correlation(const std::vector<SampledImage>& images, const std::vector<PixelStatistics>& pixels) {
    const TileGrid grid(images.front().width, images.front().height, standard_tile_edge);
    std::vector<SampleMoments> tiles(grid.size() * channel_count);
    std::vector<double> expected(tiles.size(), 0.0), sizes(tiles.size(), 0.0);
    for (std::size_t i = 0; i < pixels.size(); ++i) {
        const std::size_t tile = grid.tile_of_pixel()[i / channel_count] * channel_count + i % channel_count;
        expected[tile] += pixels[i].variance;
        sizes[tile] += 1.0;
    }
    for (const SampledImage& image : images) {
        std::vector<double> sums(tiles.size(), 0.0);
        for (std::size_t i = 0; i < pixels.size(); ++i)
            sums[grid.tile_of_pixel()[i / channel_count] * channel_count + i % channel_count] += image.pixels[i].mean;
        for (std::size_t t = 0; t < tiles.size(); ++t) tiles[t].add(sums[t]);
    }
    double ratios = 0.0, counted = 0.0;
    for (std::size_t t = 0; t < tiles.size(); ++t)
        if (expected[t] > 0.0) {
            ratios += tiles[t].variance() / expected[t];
            counted += 1.0;
        }
    if (counted == 0.0) return 1.0;
    // Three standard errors of a mean of scaled chi squares; channels go together, so they count as one.
    const double dof = std::max(1.0, counted / channel_count * static_cast<double>(images.size() - 1));
    const double ratio = ratios / counted;
    return ratio > 1.0 + 3.0 * std::sqrt(2.0 / dof) ? ratio : 1.0;
}

SampledImage from_seeds(const std::vector<NamedImage>& side, Notes* notes) {
    SampledImage result = empty_side(side.front().image);
    std::vector<SampledImage> images;
    double samples = 0.0;
    std::vector<double> rounding(result.pixels.size(), 0.0);
    note_transfers(side, notes);
    for (const NamedImage& named : side) {
        SampledImage image = empty_side(named.image);
        const Light light = light_of(named, result);
        for (std::size_t i = 0; i < image.pixels.size(); ++i) {
            image.pixels[i].mean = light.mean[i];
            rounding[i] = std::max(rounding[i], light.rounding[i]);
        }
        samples += count_in_metadata(named.image).value_or(1.0);
        images.push_back(std::move(image));
    }
    for (std::size_t i = 0; i < result.pixels.size(); ++i) {
        SampleMoments moments;
        for (const SampledImage& image : images) moments.add(image.pixels[i].mean);
        // Values that round alike in all images do so in their mean too.
        result.pixels[i] = {moments.mean, moments.variance() + moments.count * rounding[i], moments.count};
    }
    result.samples = static_cast<std::uint64_t>(samples);
    result.correlation = tile_correlation(images, result.pixels);
    return result;
}

}  // namespace

Image only_layer(const NamedImage& named, const std::string& layer) {
    const Image& image = named.image;
    std::vector<std::size_t> kept;
    Image result = image;
    result.channels.clear();
    result.pixels.clear();
    for (std::size_t c = 0; c < image.channels.size(); ++c) {
        const std::string& channel = image.channels[c];
        const bool of_layer = channel.starts_with(layer + ".");
        if (!of_layer && channel != "count") continue;
        kept.push_back(c);
        result.channels.push_back(of_layer ? channel.substr(layer.size() + 1) : channel);
    }
    if (!find_triple(result, "")) {
        std::string there;
        for (const std::string& one : layers_of(image))
            there += (there.empty() ? "" : ", ") + (one.empty() ? "plain R, G, B" : one.substr(0, one.size() - 1));
        throw input_error(named.name, "",
            fmt::format("has no channels {0}.R, {0}.G, {0}.B; its layers are {1}", layer, there), "name one of these");
    }
    for (std::size_t pixel = 0; pixel < std::size_t{image.width} * image.height; ++pixel)
        for (const std::size_t c : kept) result.pixels.push_back(image.pixels[pixel * image.channels.size() + c]);
    return result;
}

SampledImage sampled_image_of(const std::vector<NamedImage>& side, VarianceOf variance_of, Notes* notes) {
    if (side.empty()) throw InputError("compare: a side has no images; give at least one a side");
    for (const NamedImage& named : side)
        if (is_denoised(named.image))
            throw input_error(named.name, "", "is denoised, so it is biased and no evidence (MODEL.md section 11.6)",
                "give the image that it was made of");
    SampledImage result = side.size() == 1 ? from_variance(side.front(), variance_of, notes) : from_seeds(side, notes);
    std::vector<std::uint32_t>& pixels = result.invalid_pixels;
    std::ranges::sort(pixels);
    pixels.erase(std::unique(pixels.begin(), pixels.end()), pixels.end());
    return result;
}

}  // namespace tandem
