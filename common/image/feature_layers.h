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

// Adds the chosen features to an image of the same size: albedo.R/G/B, normal.X/Y/Z, position.X/Y/Z, depth.Z,
// distance.Z, coverage.A, and as whole numbers primitive.ID and material.ID (4294967295: nothing was hit).
void add_layers(Image& image, const FeatureImages& features);

// One feature to look at, R, G and B from 0 to 1: a direction n as (n + 1)/2, a distance the darker the farther, a
// place by its part of the image's greatest box, an id by a colour of its own.
[[nodiscard]] Image feature_picture(
    const FeatureImages& features, Feature feature, std::uint32_t width, std::uint32_t height);

}  // namespace tandem
