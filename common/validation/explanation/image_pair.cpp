#include "common/validation/explanation/image_pair.h"

#include <algorithm>
#include <cmath>

namespace tandem {

namespace {

SampledImage blank(std::uint32_t width, std::uint32_t height, const SampledImage& like) {
    SampledImage image;
    image.width = width;
    image.height = height;
    image.samples = like.samples;
    image.correlation = like.correlation;
    image.pixels.resize(std::size_t{width} * height * channel_count);
    return image;
}

SampledImage cut(const SampledImage& image, const Rectangle& part) {
    SampledImage result = blank(part.x1 - part.x0, part.y1 - part.y0, image);
    for (std::uint32_t y = part.y0; y < part.y1; ++y) {
        const auto from = image.pixels.begin() +
                          static_cast<std::ptrdiff_t>((std::size_t{y} * image.width + part.x0) * channel_count);
        std::copy_n(from, std::size_t{result.width} * channel_count,
            result.pixels.begin() +
                static_cast<std::ptrdiff_t>(std::size_t{y - part.y0} * result.width * channel_count));
    }
    return result;
}

// Each pixel the weighted sum of its 3x3 neighbours, weights [dy + 1][dx + 1] of sum 1, without the border.
using Weights = std::array<std::array<double, 3>, 3>;
SampledImage filtered(const SampledImage& image, const Weights& weights) {
    SampledImage result = blank(image.width - 2, image.height - 2, image);
    const std::size_t row = std::size_t{image.width} * channel_count;
    for (std::uint32_t y = 0; y < result.height; ++y)
        for (std::size_t k = 0; k < std::size_t{result.width} * channel_count; ++k) {
            PixelStatistics pixel{0.0, 0.0, image.pixels[(y + 1) * row + channel_count + k].count};
            for (std::size_t v = 0; v < 3; ++v)
                for (std::size_t u = 0; u < 3; ++u) {
                    const double weight = weights[v][u];
                    if (weight == 0.0) continue;
                    const PixelStatistics& from = image.pixels[(y + v) * row + u * channel_count + k];
                    pixel.mean += weight * from.mean;
                    pixel.variance += weight * weight * from.variance;
                }
            result.pixels[y * std::size_t{result.width} * channel_count + k] = pixel;
        }
    return result;
}

// Noise is averaged over pixels that this ties together; the mean of many keeps its variance.
ImagePair filtered(const ImagePair& pair, const Weights& of_reference, const Weights& of_candidate) {
    double squares = 0.0;  // of both they are the same
    for (const auto& line : of_reference)
        for (const double weight : line) squares += weight * weight;
    ImagePair result{
        filtered(pair.reference, of_reference), filtered(pair.candidate, of_candidate), pair.tied / squares};
    result.reference.correlation /= squares;
    result.candidate.correlation /= squares;
    return result;
}

// Moves to the right by dx and down by dy, each at most a pixel.
Weights moving(double dx, double dy) {
    Weights weights{};
    const std::size_t u = dx > 0.0 ? 0 : 2, v = dy > 0.0 ? 0 : 2;
    const double across = std::abs(dx), down = std::abs(dy);
    weights[1][1] = (1.0 - across) * (1.0 - down);
    weights[1][u] = across * (1.0 - down);
    weights[v][1] = (1.0 - across) * down;
    weights[v][u] = across * down;
    return weights;
}

}  // namespace

ImagePair with_candidate_moved(const ImagePair& pair, const std::function<Place(Place)>& source) {
    ImagePair result = pair;
    const std::uint32_t width = pair.candidate.width;
    for (std::uint32_t y = 0; y < pair.candidate.height; ++y)
        for (std::uint32_t x = 0; x < width; ++x) {
            const Place from = source({x, y});
            for (std::size_t c = 0; c < channel_count; ++c)
                result.candidate.pixels[(std::size_t{y} * width + x) * channel_count + c] =
                    pair.candidate.pixels[(std::size_t{from.y} * width + from.x) * channel_count + c];
        }
    return result;
}

ImagePair with_channels_moved(const ImagePair& pair, const std::array<std::uint32_t, channel_count>& order) {
    ImagePair result = pair;
    for (std::size_t i = 0; i < pair.candidate.pixels.size(); ++i)
        result.candidate.pixels[i - i % channel_count + order.at(i % channel_count)] = pair.candidate.pixels[i];
    return result;
}

SampledImage through(const SampledImage& image, const Curve& curve) {
    SampledImage result = image;
    for (PixelStatistics& pixel : result.pixels) {
        const double slope = curve.slope(std::max(pixel.mean, std::sqrt(pixel.variance / pixel.count)));
        pixel.mean = curve.value(pixel.mean);
        pixel.variance *= slope * slope;
    }
    return result;
}

SampledImage to_power(const SampledImage& image, double exponent, double factor) {
    SampledImage result = image;
    for (PixelStatistics& pixel : result.pixels) {
        const double power = std::pow(std::abs(pixel.mean), exponent), noise = std::sqrt(pixel.variance / pixel.count);
        const double slope = std::abs(pixel.mean) > noise ? exponent * power / std::abs(pixel.mean)
                             : noise > 0.0                ? exponent * std::pow(noise, exponent - 1.0)
                                                          : 0.0;
        pixel.mean = factor * std::copysign(power, pixel.mean);
        pixel.variance *= factor * factor * slope * slope;
    }
    return result;
}

SampledImage scaled(const SampledImage& image, const std::array<double, channel_count>& factors, double offset) {
    SampledImage result = image;
    for (std::size_t i = 0; i < result.pixels.size(); ++i) {
        const double factor = factors.at(i % channel_count);
        result.pixels[i].mean = (result.pixels[i].mean + offset) * factor;
        result.pixels[i].variance *= factor * factor;
    }
    return result;
}

ImagePair without(const ImagePair& pair, const std::vector<bool>& left_out) {
    ImagePair result = pair;
    for (std::size_t i = 0; i < left_out.size(); ++i)
        if (left_out[i]) result.candidate.pixels[i] = result.reference.pixels[i];
    return result;
}

ImagePair overlapped(const ImagePair& pair, std::int32_t dx, std::int32_t dy) {
    const auto place = [](std::int32_t d) { return static_cast<std::uint32_t>(std::max(d, 0)); };
    const auto lost = [](std::int32_t d) { return static_cast<std::uint32_t>(std::abs(d)); };
    const std::uint32_t width = pair.reference.width - lost(dx), height = pair.reference.height - lost(dy);
    const Rectangle of_reference{place(-dx), place(-dy), place(-dx) + width, place(-dy) + height};
    const Rectangle of_candidate{place(dx), place(dy), place(dx) + width, place(dy) + height};
    return {cut(pair.reference, of_reference), cut(pair.candidate, of_candidate), pair.tied};
}

ImagePair met_halfway(const ImagePair& pair, double dx, double dy) {
    return filtered(pair, moving(0.5 * dx, 0.5 * dy), moving(-0.5 * dx, -0.5 * dy));
}

ImagePair smoothed(const ImagePair& pair) {
    constexpr double s = 1.0 / 16.0;
    const Weights weights{{{s, 2.0 * s, s}, {2.0 * s, 4.0 * s, 2.0 * s}, {s, 2.0 * s, s}}};
    return filtered(pair, weights, weights);
}

ImagePair part_of(const ImagePair& pair, const Rectangle& part) {
    return {cut(pair.reference, part), cut(pair.candidate, part), pair.tied};
}

}  // namespace tandem
