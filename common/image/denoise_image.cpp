// The input and output of the filter: films, features and files.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/error.h"
#include "common/image/denoise.h"

namespace tandem {

namespace {

using Triple = std::array<std::size_t, 3>;

std::optional<std::size_t> place_of(const Image& image, const std::string& channel) {
    const auto found = std::ranges::find(image.channels, channel);
    if (found == image.channels.end()) return std::nullopt;
    return static_cast<std::size_t>(found - image.channels.begin());
}

// Where the channels of a file stand; those that are missing are named.
class Channels {
public:
    Channels(const Image& image, const std::string& name) : image_(image), name_(name) {}

    std::size_t one(const std::string& channel) {
        const auto found = place_of(image_, channel);
        if (!found) missing_ += (missing_.empty() ? "" : ", ") + channel;
        return found.value_or(0);
    }
    Triple three(const std::string& layer, const char* letters) {
        Triple places{};
        for (std::size_t c = 0; c < places.size(); ++c) places.at(c) = one(layer + letters[c]);
        return places;
    }
    // Throws InputError where any was missing.
    void require() const {
        if (missing_.empty()) return;
        const bool no_variance = missing_.find("variance.") != std::string::npos;
        throw input_error(name_, "", "has no channels " + missing_ + ", which denoising needs",
            fmt::format("render it by: tandem render SCENE -o IN.exr --aov albedo,normal,depth{}",
                no_variance ? " (not of Sobol points, which have no variance)" : ""));
    }

private:
    const Image& image_;
    std::string name_, missing_;
};

// Values of one pixel, as they are checked.
class PixelReader {
public:
    PixelReader(const Image& image, const std::string& name) : image_(image), name_(name) {}

    void go_to(std::size_t pixel) { pixel_ = pixel; }
    [[nodiscard]] double raw(std::size_t channel) const {
        return image_.pixels[pixel_ * image_.channels.size() + channel];
    }
    [[nodiscard]] double finite(std::size_t channel) const {
        const double value = raw(channel);
        if (!std::isfinite(value)) refuse(channel, "is no finite number");
        return value;
    }
    [[nodiscard]] double variance(std::size_t channel) const {
        const double value = raw(channel);
        if (!(value >= 0.0)) refuse(channel, "is no variance");
        return value;
    }
    [[nodiscard]] double count(std::size_t channel) const {
        constexpr double fewest = 2.0;  // that have a variance
        const double value = raw(channel);
        if (!(value >= fewest) || !std::isfinite(value)) refuse(channel, "is below 2 samples, which have no variance");
        return value;
    }

private:
    [[noreturn]] void refuse(std::size_t channel, const std::string& reason) const {
        throw input_error(name_, "",
            fmt::format("{} of pixel ({}, {}) is {:g}, which {}", image_.channels[channel], pixel_ % image_.width,
                pixel_ / image_.width, raw(channel), reason),
            "render it again, with more samples");
    }

    const Image& image_;
    std::string name_;
    std::size_t pixel_ = 0;
};

}  // namespace

bool is_denoised(const Image& image) { return image.metadata.contains(denoised_key); }

NoisyImage noisy_image_of(const FilmMoments& film, const std::vector<PixelFeatures>& features) {
    if (features.size() != film.pixel_count()) throw Error("feature images are not of the film's size");
    NoisyImage noisy;
    noisy.width = film.width;
    noisy.height = film.height;
    noisy.mean = mean_of(film);
    noisy.variance = variance_of(film);
    for (std::size_t i = 0; i < noisy.variance.size(); ++i)
        noisy.variance[i] /= static_cast<double>(film.counts[i / channel_count]);
    for (const PixelFeatures& pixel : features) {
        noisy.albedo.push_back(pixel.albedo);
        noisy.normal.push_back(pixel.normal);
        noisy.depth.push_back(pixel.depth);
    }
    return noisy;
}

NoisyImage noisy_image_of(const Image& image, const std::string& name) {
    if (is_denoised(image)) throw input_error(name, "", "is denoised already", "give the image that it was made of");
    Channels channels(image, name);
    const Triple colour = channels.three("", "RGB"), variance = channels.three("variance.", "RGB"),
                 albedo = channels.three("albedo.", "RGB"), normal = channels.three("normal.", "XYZ");
    const std::size_t count = channels.one("count"), depth = channels.one("depth.Z");
    channels.require();
    NoisyImage noisy;
    noisy.width = image.width;
    noisy.height = image.height;
    PixelReader reader(image, name);
    for (std::size_t pixel = 0; pixel < std::size_t{image.width} * image.height; ++pixel) {
        reader.go_to(pixel);
        const double samples = reader.count(count);
        for (std::size_t c = 0; c < channel_count; ++c) {
            noisy.mean.push_back(reader.finite(colour.at(c)));
            noisy.variance.push_back(reader.variance(variance.at(c)) / samples);
        }
        noisy.albedo.emplace_back(reader.finite(albedo[0]), reader.finite(albedo[1]), reader.finite(albedo[2]));
        noisy.normal.emplace_back(reader.finite(normal[0]), reader.finite(normal[1]), reader.finite(normal[2]));
        noisy.depth.push_back(reader.raw(depth));
    }
    return noisy;
}

Image denoised_image(const Image& of, const std::vector<double>& values) {
    Image image = of;
    image.channels = {"R", "G", "B"};
    image.word_channels.clear();
    image.words.clear();
    image.pixels.assign(values.begin(), values.end());
    // A file's other attributes are as the library reads them, not as it writes them.
    std::erase_if(image.metadata, [](const auto& entry) {
        return !entry.first.starts_with("tandem:") || entry.first.starts_with("tandem:relative_error");
    });
    image.metadata[denoised_key] = denoised_text;
    return image;
}

}  // namespace tandem
