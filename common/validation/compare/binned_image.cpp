#include "common/validation/compare/binned_image.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/error.h"
#include "common/image/tiled_image.h"
#include "common/validation/compare/colour_space.h"

namespace tandem {

namespace {

enum class Channel { mean, variance, count };

Channel kind_of(const std::string& name) {
    if (name == "count") return Channel::count;
    return name.find("ariance") == std::string::npos ? Channel::mean : Channel::variance;
}

// Pixel i of m has n_i samples, each of variance v_i. The mean of the pixels' means has the variance sum(v_i / n_i) /
// m^2. It comes from N = sum n_i samples, each as if of N times that variance. Where variances are those of pixels'
// means, n_i is left out on both sides. It is too where a file says of one number of samples alone what all pixels
// have.
class Binner {
public:
    Binner(const Image& header, std::uint32_t edge, VarianceOf variance_of)
        : width_(header.width), edge_(edge), columns_((header.width - 1) / edge + 1) {
        for (const std::string& name : header.channels) kinds_.push_back(kind_of(name));
        const auto count = std::ranges::find(header.channels, "count");
        counted_ = count != header.channels.end() && variance_of == VarianceOf::sample;
        if (counted_) count_ = static_cast<std::size_t>(count - header.channels.begin());
        sums_.resize(columns_ * kinds_.size());
        pixels_.resize(columns_);
    }

    void add_row(const float* row) {
        const std::size_t channels = kinds_.size();
        for (std::uint32_t x = 0; x < width_; ++x) {
            const float* pixel = row + x * channels;
            double* sums = &sums_[x / edge_ * channels];
            const double samples = counted_ ? double{pixel[count_]} : 1.0;
            for (std::size_t c = 0; c < channels; ++c)
                sums[c] += kinds_[c] == Channel::variance ? double{pixel[c]} / samples : double{pixel[c]};
            pixels_[x / edge_] += 1.0;
        }
    }

    // Appends the row of squares that is done, and begins the next.
    void end_squares(std::vector<float>& to) {
        const std::size_t channels = kinds_.size();
        for (std::size_t column = 0; column < columns_; ++column) {
            const double* sums = &sums_[column * channels];
            const double m = pixels_[column], samples = counted_ ? sums[count_] : 1.0;
            for (std::size_t c = 0; c < channels; ++c)
                to.push_back(static_cast<float>(kinds_[c] == Channel::count      ? sums[c]
                                                : kinds_[c] == Channel::variance ? samples * sums[c] / (m * m)
                                                                                 : sums[c] / m));
        }
        std::ranges::fill(sums_, 0.0);
        std::ranges::fill(pixels_, 0.0);
    }

private:
    std::uint32_t width_, edge_;
    std::size_t columns_;
    std::vector<Channel> kinds_;
    bool counted_ = false;   // by a channel of its own
    std::size_t count_ = 0;  // its place
    std::vector<double> sums_, pixels_;
};

}  // namespace

Image read_binned_image(const std::filesystem::path& path, std::uint32_t edge, VarianceOf variance_of) {
    BandedImage file(path);
    Image image = file.header();
    if (colour_space_of(image).transfer.curve != Transfer::Curve::linear)
        throw input_error(path.string(), "", "--bin takes means of linear values, and these are encoded",
            "write linear values, or leave --bin out");
    Binner binner(image, edge, variance_of);
    const auto count = static_cast<std::size_t>(std::ranges::find(image.channels, "count") - image.channels.begin());
    const std::size_t row = std::size_t{image.width} * image.channels.size();
    for (std::uint32_t begin = 0; begin < image.height; begin += file.band_height()) {
        const std::uint32_t end = std::min(image.height, begin + file.band_height());
        const std::vector<float> pixels = file.read(begin, end);
        for (std::uint32_t y = begin; y < end; ++y) {
            const float* const first = &pixels[(y - begin) * row];
            for (std::uint32_t x = 0; count < image.channels.size() && x < image.width; ++x)
                if (first[x * image.channels.size() + count] == 0.0f)
                    throw input_error(
                        path.string(), "", fmt::format("pixel ({}, {}) has no samples", x, y), "render the whole film");
            binner.add_row(first);
            if ((y + 1) % edge == 0 || y + 1 == image.height) binner.end_squares(image.pixels);
        }
    }
    const auto squares = [edge](std::uint32_t length) { return (length - 1) / edge + 1; };
    image.width = squares(image.width);
    image.height = squares(image.height);
    image.full_width = squares(image.full_width);
    image.full_height = squares(image.full_height);
    return image;
}

}  // namespace tandem
