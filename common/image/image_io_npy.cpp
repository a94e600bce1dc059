// NumPy arrays, as numpy.save writes them. (height, width, 3) is R, G, B; (height, width, 6) also variance.R, .G, .B.
// (height, width) and (height, width, 1) are grey. Rows from the top. Linear values. [numpy.lib.format: "\x93NUMPY",
// version, length of the header, header as a Python dictionary, values]
#include <fmt/format.h>

#include <bit>
#include <cstring>
#include <fstream>
#include <regex>

#include "common/error.h"
#include "common/image/image_io_parts.h"

namespace tandem::image_files {

namespace {

static_assert(std::endian::native == std::endian::little);

InputError refusal(const std::filesystem::path& path, const std::string& reason, const std::string& mend) {
    return input_error(path.string(), "", "is no image: " + reason, mend);
}

std::string header_of(std::ifstream& stream, const std::filesystem::path& path) {
    std::array<unsigned char, 8> magic{};
    stream.read(reinterpret_cast<char*>(magic.data()), magic.size());
    if (!stream || std::memcmp(magic.data(), "\x93NUMPY", 6) != 0)
        throw refusal(path, "it does not begin as a NumPy array does", "write it by numpy.save");
    std::array<unsigned char, 4> length{};
    stream.read(reinterpret_cast<char*>(length.data()), magic[6] == 1 ? 2 : 4);
    std::size_t size = 0;
    for (std::size_t byte = length.size(); byte-- > 0;) size = size << 8 | length[byte];
    constexpr std::size_t greatest_header = 1 << 16;
    std::string header(std::min(size, greatest_header), '\0');
    stream.read(header.data(), static_cast<std::streamsize>(header.size()));
    if (!stream || size > greatest_header) throw refusal(path, "its header ends early", "write it again");
    return header;
}

std::string found_in(const std::string& header, const char* pattern) {
    std::smatch match;
    return std::regex_search(header, match, std::regex(pattern)) ? match[1].str() : std::string();
}

std::vector<std::uint64_t> shape_of(const std::string& header) {
    std::vector<std::uint64_t> shape;
    const std::string text = found_in(header, "'shape': *\\(([0-9, ]{0,80})\\)");
    const std::regex number("[0-9]{1,9}");
    for (std::sregex_iterator at(text.begin(), text.end(), number), end; at != end; ++at)
        shape.push_back(std::stoull(at->str()));
    return shape;
}

std::vector<std::string> channels_of(std::uint64_t count) {
    if (count == 1) return {"Y"};
    if (count == 3) return {"R", "G", "B"};
    if (count == 6) return {"R", "G", "B", "variance.R", "variance.G", "variance.B"};
    return {};
}

template <class Value>
void read_values(std::ifstream& stream, std::vector<float>& pixels) {
    std::vector<Value> values(pixels.size());
    stream.read(reinterpret_cast<char*>(values.data()), static_cast<std::streamsize>(values.size() * sizeof(Value)));
    for (std::size_t i = 0; i < values.size(); ++i) pixels[i] = static_cast<float>(values[i]);
}

}  // namespace

Image read_npy(const std::filesystem::path& path, std::uint64_t limit) {
    std::ifstream stream(path, std::ios::binary);
    const std::string header = header_of(stream, path);
    const std::string type = found_in(header, "'descr': *'([^']*)'");
    if (type != "<f4" && type != "<f8")
        throw refusal(path, "its values are of type '" + type + "'", "save an array of float32 or float64");
    if (found_in(header, "'fortran_order': *(True|False)") != "False")
        throw refusal(path, "its values are ordered by columns", "save numpy.ascontiguousarray of it");
    std::vector<std::uint64_t> shape = shape_of(header);
    if (shape.size() == 2) shape.push_back(1);
    constexpr std::uint64_t greatest_side = 65536;
    Image image;
    if (shape.size() == 3) image.channels = channels_of(shape[2]);
    if (image.channels.empty() || shape[0] < 1 || shape[1] < 1 || shape[0] > greatest_side || shape[1] > greatest_side)
        throw refusal(path, fmt::format("its shape is ({})", found_in(header, "'shape': *\\(([0-9, ]*)\\)")),
            "save (height, width, 3), or 6 with the variances of a sample behind");
    image.height = static_cast<std::uint32_t>(shape[0]);
    image.width = static_cast<std::uint32_t>(shape[1]);
    const std::uint64_t count = shape[0] * shape[1] * shape[2];
    if (count > limit) throw refusal(path, fmt::format("it is larger than {} MiB", limit >> 18), "cut it");
    const auto begin = static_cast<std::uint64_t>(stream.tellg());
    if (std::filesystem::file_size(path) != begin + count * (type == "<f4" ? 4 : 8))
        throw refusal(path, fmt::format("it does not hold {} values", count), "write it again");
    image.pixels.resize(count);
    if (type == "<f4")
        read_values<float>(stream, image.pixels);
    else
        read_values<double>(stream, image.pixels);
    if (!stream) throw refusal(path, "it ends early", "write it again");
    return image;
}

}  // namespace tandem::image_files
