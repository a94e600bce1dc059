// Portable float maps: "PF" (three channels) or "Pf" (one), width and height, a scale whose sign gives the byte order.
// Then come rows of float32 from the bottom up. [Debevec, HDRShop]
#include <fmt/format.h>

#include <bit>
#include <cstring>
#include <fstream>
#include <sstream>

#include "common/error.h"
#include "common/image/image_io_parts.h"

namespace tandem::image_files {

namespace {

static_assert(sizeof(float) == 4 && std::endian::native == std::endian::little);

float swapped(float value) {
    const auto bits = std::bit_cast<std::uint32_t>(value);
    return std::bit_cast<float>(bits >> 24 | (bits >> 8 & 0xFF00u) | (bits << 8 & 0xFF0000u) | bits << 24);
}

}  // namespace

Image read_pfm(const std::filesystem::path& path, std::uint64_t limit) {
    const auto refuse = [&](const std::string& reason) -> InputError {
        return input_error(path.string(), "", "is not a sound PFM image: " + reason, "write it again");
    };
    std::ifstream stream(path, std::ios::binary);
    std::string kind(2, '\0');
    std::int64_t width = 0, height = 0;
    double scale = 0.0;
    stream.read(kind.data(), 2);
    if (!stream || (kind != "PF" && kind != "Pf")) throw refuse("it does not begin with PF or Pf");
    stream >> width >> height >> scale;
    stream.get();  // the one blank before the pixels
    constexpr std::int64_t greatest_side = 65536;
    if (!stream || width < 1 || height < 1 || width > greatest_side || height > greatest_side || scale == 0.0)
        throw refuse("its header has no size, or no scale");
    Image image;
    image.width = static_cast<std::uint32_t>(width);
    image.height = static_cast<std::uint32_t>(height);
    image.channels = kind == "PF" ? std::vector<std::string>{"R", "G", "B"} : std::vector<std::string>{"Y"};
    const std::uint64_t row = std::uint64_t{image.width} * image.channels.size(), count = row * image.height;
    if (count > limit) throw refuse(fmt::format("it is larger than {} MiB", limit >> 18));
    const auto header = static_cast<std::uint64_t>(stream.tellg());
    if (std::filesystem::file_size(path) != header + count * sizeof(float))
        throw refuse(
            fmt::format("it should hold {} pixels of {} channels and does not", width * height, image.channels.size()));
    image.pixels.resize(count);
    for (std::uint64_t y = image.height; y-- > 0;)
        stream.read(
            reinterpret_cast<char*>(image.pixels.data() + y * row), static_cast<std::streamsize>(row * sizeof(float)));
    if (!stream) throw refuse("it ends early");
    if (scale > 0.0)  // big-endian
        for (float& value : image.pixels) value = swapped(value);
    return image;
}

std::string pfm_bytes(const Image& image) {
    const std::size_t channels = image.channels.size();
    std::string bytes = fmt::format("PF\n{} {}\n-1.0\n", image.width, image.height);
    std::vector<float> row(std::size_t{image.width} * 3);
    bytes.reserve(bytes.size() + row.size() * sizeof(float) * image.height);
    for (std::size_t y = image.height; y-- > 0;) {
        for (std::size_t x = 0; x < image.width; ++x)
            for (std::size_t c = 0; c < 3; ++c)
                row[x * 3 + c] = image.pixels[(y * image.width + x) * channels + (channels < 3 ? 0 : c)];
        bytes.append(reinterpret_cast<const char*>(row.data()), row.size() * sizeof(float));
    }
    return bytes;
}

}  // namespace tandem::image_files
