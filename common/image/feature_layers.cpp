#include "common/image/feature_layers.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <limits>

#include "common/error.h"
#include "common/render/random.h"

namespace tandem {

namespace {

struct Layer {
    std::vector<std::string> channels;
    std::vector<double> (*values)(const PixelFeatures&);
};

std::vector<double> list(const glm::dvec3& v) { return {v.x, v.y, v.z}; }

// Nothing for ids, which are whole numbers.
std::optional<Layer> layer_of(Feature feature) {
    switch (feature) {
        case Feature::albedo:
            return Layer{{"albedo.R", "albedo.G", "albedo.B"}, [](const PixelFeatures& p) { return list(p.albedo); }};
        case Feature::normal:
            return Layer{{"normal.X", "normal.Y", "normal.Z"}, [](const PixelFeatures& p) { return list(p.normal); }};
        case Feature::position:
            return Layer{
                {"position.X", "position.Y", "position.Z"}, [](const PixelFeatures& p) { return list(p.position); }};
        case Feature::depth:
            return Layer{{"depth.Z"}, [](const PixelFeatures& p) { return std::vector{p.depth}; }};
        case Feature::distance:
            return Layer{{"distance.Z"}, [](const PixelFeatures& p) { return std::vector{p.distance}; }};
        case Feature::coverage:
            return Layer{{"coverage.A"}, [](const PixelFeatures& p) { return std::vector{p.coverage}; }};
        case Feature::primitive:
        case Feature::material:
            break;
    }
    return std::nullopt;
}

std::uint32_t id_of(const PixelFeatures& pixel, Feature feature) {
    return feature == Feature::primitive ? pixel.primitive : pixel.material;
}

void add_floats(Image& image, const std::vector<std::string>& channels,
    const std::function<std::vector<double>(std::size_t pixel)>& values) {
    const std::size_t before = image.channels.size(), pixels = image.pixels.size() / before;
    std::vector<float> joined;
    joined.reserve(pixels * (before + channels.size()));
    for (std::size_t i = 0; i < pixels; ++i) {
        const auto old = image.pixels.begin() + static_cast<std::ptrdiff_t>(i * before);
        joined.insert(joined.end(), old, old + static_cast<std::ptrdiff_t>(before));
        for (const double value : values(i)) joined.push_back(static_cast<float>(value));
    }
    image.pixels = std::move(joined);
    image.channels.insert(image.channels.end(), channels.begin(), channels.end());
}

// Least and greatest of what is finite.
struct Box {
    glm::dvec3 least{std::numeric_limits<double>::infinity()}, most{-std::numeric_limits<double>::infinity()};
    void add(const glm::dvec3& v) { least = glm::min(least, v), most = glm::max(most, v); }
    [[nodiscard]] glm::dvec3 share(const glm::dvec3& v) const {
        glm::dvec3 part(0.5);
        for (int c = 0; c < 3; ++c)
            if (most[c] > least[c]) part[c] = (v[c] - least[c]) / (most[c] - least[c]);
        return part;
    }
};

glm::dvec3 colour_of_id(std::uint32_t id) {
    const RandomBlock words = random_block(0, id, 0, 0);
    return {to_unit<double>(words[0]), to_unit<double>(words[1]), to_unit<double>(words[2])};
}

glm::dvec3 colour_of(const PixelFeatures& pixel, Feature feature, const Box& box) {
    constexpr double nearest = 1.0, farthest = 0.1;
    switch (feature) {
        case Feature::albedo:
            return pixel.albedo;
        case Feature::normal:
            return 0.5 * (pixel.normal + 1.0);
        case Feature::position:
            return box.share(pixel.position);
        case Feature::depth:
            return glm::dvec3(glm::mix(nearest, farthest, box.share(glm::dvec3(pixel.depth)).x));
        case Feature::distance:
            return glm::dvec3(glm::mix(nearest, farthest, box.share(glm::dvec3(pixel.distance)).x));
        case Feature::coverage:
            return glm::dvec3(pixel.coverage);
        case Feature::primitive:
        case Feature::material:
            return colour_of_id(id_of(pixel, feature));
    }
    return glm::dvec3(0.0);
}

}  // namespace

void add_layers(Image& image, const FeatureImages& features) {
    if (features.chosen.empty()) return;
    if (features.pixels.size() != std::size_t{image.width} * image.height)
        throw Error("feature images are not of the image's size");
    for (const Feature feature : features.chosen) {
        if (const auto layer = layer_of(feature))
            add_floats(image, layer->channels, [&](std::size_t i) { return layer->values(features.pixels[i]); });
        else
            image.word_channels.push_back(std::string(feature_names.at(static_cast<std::size_t>(feature))) + ".ID");
    }
    for (const PixelFeatures& pixel : features.pixels)
        for (const Feature feature : features.chosen)
            if (feature == Feature::primitive || feature == Feature::material)
                image.words.push_back(id_of(pixel, feature));
    image.metadata["tandem:feature_samples"] = std::to_string(features.samples);
}

Image feature_picture(const FeatureImages& features, Feature feature, std::uint32_t width, std::uint32_t height) {
    Image image;
    image.width = width;
    image.height = height;
    image.channels = {"R", "G", "B"};
    Box box;
    for (const PixelFeatures& pixel : features.pixels) {
        if (pixel.coverage == 0.0) continue;
        box.add(feature == Feature::position ? pixel.position
                                             : glm::dvec3(feature == Feature::depth ? pixel.depth : pixel.distance));
    }
    for (const PixelFeatures& pixel : features.pixels) {
        const glm::dvec3 colour =
            pixel.coverage > 0.0 || feature == Feature::coverage ? colour_of(pixel, feature, box) : glm::dvec3(0.0);
        for (int c = 0; c < 3; ++c) image.pixels.push_back(static_cast<float>(colour[c]));
    }
    return image;
}

}  // namespace tandem
