// Textures of a scene file, and the images that they and backgrounds are read from (MODEL.md sections 7.0 and 8.1).
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/error.h"
#include "common/image/image_io.h"
#include "common/scene/loader/parts.h"

namespace tandem::scene_json {

namespace {

// 16384 is the least side that every desktop GPU of today offers; 2²⁴ texels are 192 MiB.
constexpr std::uint32_t greatest_image_side = 16384;
constexpr std::uint64_t greatest_texels = std::uint64_t{1} << 24;
constexpr std::uint64_t greatest_channels = 4;  // of a file that is to be refused for its fourth, with the reason

constexpr double greatest_frequency = 1e6;
constexpr double greatest_amount = 1e3;

double srgb_decoded(double encoded) {  // IEC 61966-2-1
    return encoded <= 0.04045 ? encoded / 12.92 : std::pow((encoded + 0.055) / 1.055, 2.4);
}

// The places of red, green and blue among the channels; grey stands for all three. Empty: neither.
std::vector<std::size_t> colour_channels(std::vector<std::string> channels, bool alpha) {
    if (alpha && channels.size() > 1 && channels.back() == "A") channels.pop_back();
    if (channels.size() == 1) return {0, 0, 0};
    std::vector<std::size_t> places;
    for (const std::string_view name : {"R", "G", "B"}) {
        const auto found = std::ranges::find(channels, name);
        if (found != channels.end()) places.push_back(static_cast<std::size_t>(found - channels.begin()));
    }
    return channels.size() == 3 && places.size() == 3 ? places : std::vector<std::size_t>{};
}

// The image of a file, sound in its shape.
Image read_sound_image(const PixelSource& source) {
    const auto refuse = [&](const std::string& reason, const std::string& mend) {
        throw input_error(source.place.file, source.place.pointer, printable(source.shown) + ": " + reason, mend);
    };
    const std::filesystem::path& path = source.path;
    if (source.bytes.empty() && source.place.files) source.place.files->push_back(path.string());
    Image image;
    try {
        std::error_code error;
        const auto bytes = std::filesystem::file_size(path, error);
        if (!error && bytes > greatest_file_bytes)
            refuse(fmt::format("is larger than {} MiB", greatest_file_bytes >> 20), "make it smaller");
        image = source.alpha ? read_texture_image(path, source.bytes, greatest_texels * greatest_channels)
                             : read_image(path, greatest_texels * greatest_channels);
    } catch (const InputError& error) {  // "PATH: reason; mend", which is said of this place of the scene instead
        const std::string line = error.what(), prefix = path.string() + ": ";
        if (!line.starts_with(prefix)) throw;
        const std::size_t split = line.find("; ");
        refuse(line.substr(prefix.size(), split - prefix.size()),
            split == std::string::npos ? "name another image" : line.substr(split + 2));
    }
    if (std::max(image.width, image.height) > greatest_image_side ||
        std::uint64_t{image.width} * image.height > greatest_texels)
        refuse(fmt::format("has {} x {} pixels", image.width, image.height),
            fmt::format("keep the sides to {} pixels and all to 2^24", greatest_image_side));
    if (image.data_x != image.full_x || image.data_y != image.full_y || image.width != image.full_width ||
        image.height != image.full_height)
        refuse("is a part of a larger picture: its data window is not its display window", "write it whole");
    if (image.colour_space.find("chromaticities") != std::string::npos)
        refuse("is not in the primaries of Rec. 709", "convert it");
    return image;
}

glm::dvec3 read_frequency(const Value& value, TextureSpace space) {
    if (!value.has("frequency")) return space == TextureSpace::object ? glm::dvec3(1.0) : glm::dvec3(1.0, 1.0, 0.0);
    const Value given = value.member("frequency");
    glm::dvec3 frequency;
    if (given.json().is_array()) {
        frequency = given.vector(0.0, greatest_frequency);
        if (space == TextureSpace::coordinates && frequency.z != 0.0)
            given.element(2).refuse("texture coordinates have no third axis", "write 0");
    } else {
        frequency = glm::dvec3(given.number(0.0, greatest_frequency));
        if (space == TextureSpace::coordinates) frequency.z = 0.0;
    }
    if (frequency == glm::dvec3(0.0)) given.refuse("of frequency 0 nothing varies", "write a number above 0");
    return frequency;
}

void read_pattern(const Value& value, Texture& texture) {
    for (const std::string_view key : {"file", "colour_space"}) without(value, key, "only an image comes from a file");
    const Value colours = value.required("colours");
    if (colours.array_size() != 2)
        colours.refuse(fmt::format("has {} elements", colours.array_size()), "write two colours");
    texture.first = colours.element(0).vector(0.0, 1.0);
    texture.second = colours.element(1).vector(0.0, 1.0);
    if (value.has("space"))
        texture.space = static_cast<TextureSpace>(value.member("space").choice({"object", "coordinates"}));
    texture.frequency = read_frequency(value, texture.space);
}

void read_noise(const Value& value, Texture& texture) {
    if (value.has("style"))
        texture.style = static_cast<NoiseStyle>(value.member("style").choice({"smooth", "turbulence", "marble"}));
    if (texture.style == NoiseStyle::smooth) without(value, "octaves", "smooth noise has one");
    if (texture.style != NoiseStyle::marble) without(value, "amount", "only marble has veins to disturb");
    if (value.has("octaves")) texture.octaves = value.member("octaves").integer(1, 16);
    texture.amount = optional_number(value, "amount", 0.0, greatest_amount, texture.amount);
    if (value.has("seed")) texture.seed = value.member("seed").integer(0, 0xFFFFFFFFu);
}

}  // namespace

std::shared_ptr<const Pixels> read_pixels(const PixelSource& source) {
    const auto refuse = [&](const std::string& reason, const std::string& mend) {
        throw input_error(source.place.file, source.place.pointer, printable(source.shown) + ": " + reason, mend);
    };
    const Image image = read_sound_image(source);
    const std::vector<std::size_t> places = colour_channels(image.channels, source.alpha);
    if (places.empty())
        refuse("has other channels than red, green and blue, or grey",
            source.alpha ? "write it with these alone" : "write it with these alone, without alpha");
    auto pixels = std::make_shared<Pixels>(Pixels{image.width, image.height, {}});
    pixels->rgb.reserve(std::size_t{image.width} * image.height * 3);
    const double limit = source.srgb ? std::min(source.greatest, 1.0) : source.greatest;
    for (std::size_t pixel = 0; pixel < std::size_t{image.width} * image.height; ++pixel)
        for (std::size_t channel = 0; channel < 3; ++channel) {
            const float value = image.pixels[pixel * image.channels.size() + places[channel]];
            if (!(value >= 0.0F && value <= limit))  // false for what is no number
                refuse(fmt::format(
                           "{} at column {}, row {} is out of range", value, pixel % image.width, pixel / image.width),
                    fmt::format("keep its values from 0 to {}", shown(limit)));
            const double linear = source.srgb ? srgb_decoded(value) : static_cast<double>(value);
            pixels->rgb.push_back(static_cast<float>(linear * source.factor[static_cast<int>(channel)]));
        }
    return pixels;
}

Texture read_texture(const Value& value, const std::string& name, const std::filesystem::path& folder) {
    value.only({"kind", "colours", "frequency", "space", "style", "octaves", "amount", "seed", "file", "colour_space"});
    Texture texture;
    texture.name = name;
    texture.kind = static_cast<TextureKind>(value.required("kind").choice({"checker", "noise", "image"}));
    if (texture.kind != TextureKind::noise)
        for (const std::string_view key : {"style", "octaves", "amount", "seed"})
            without(value, key, "only noise has it");
    switch (texture.kind) {
        case TextureKind::checker:
            read_pattern(value, texture);
            break;
        case TextureKind::noise:
            read_pattern(value, texture);
            read_noise(value, texture);
            break;
        case TextureKind::image:
            for (const std::string_view key : {"colours", "frequency", "space"})
                without(value, key, "an image brings its colours and uses coordinates");
            const bool srgb = value.required("colour_space").choice({"srgb", "linear"}) == 0;
            texture.space = TextureSpace::coordinates;
            PixelSource source = pixel_source(value.required("file"), folder);
            source.srgb = srgb;
            texture.image = read_pixels(source);
    }
    return texture;
}

}  // namespace tandem::scene_json
