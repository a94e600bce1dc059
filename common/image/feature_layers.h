// Feature images as files: layers of an EXR image, or pictures.
#pragma once

#include "common/image/image_io.h"
#include "common/render/feature_images.h"

namespace tandem {

// What a feature image was made from: `pixels` as render_features returns them, of so many samples each.
struct FeatureImages {
    std::vector<Feature> chosen;
    std::vector<PixelFeatures> pixels;
    std::uint64_t samples = 0;
};

// Adds the chosen features to an image of the same size. Channels are albedo.R/G/B, normal.X/Y/Z, position.X/Y/Z,
// depth.Z, distance.Z and coverage.A. The channels primitive.ID and material.ID are whole numbers (4294967295: nothing
// was hit).
void add_layers(Image& image, const FeatureImages& features);

// One feature to look at, R, G and B from 0 to 1. A direction n is (n + 1)/2, a distance the darker the farther. A
// place is its part of the image's greatest box. An id has a colour of its own.
[[nodiscard]] Image feature_picture(
    const FeatureImages& features, Feature feature, std::uint32_t width, std::uint32_t height);

}  // namespace tandem
