// The module: EXR, PNG and what else OpenImageIO reads. Its headers stay in this file, and the program is not linked
// with it.
#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>
#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <memory>
#include <utility>

#include "common/error.h"
#include "common/image/image_io_parts.h"

namespace tandem::image_files {

namespace {

// libpng and others behind OpenImageIO write to stderr what they also return as the error.
class QuietStderr {
public:
#ifdef TANDEM_LIBRARY_MAY_WRITE_TO_STDERR
    QuietStderr() : kept_(-1) {}
#else
    QuietStderr() : kept_(::dup(STDERR_FILENO)) {
        const int nowhere = ::open("/dev/null", O_WRONLY | O_CLOEXEC);
        if (kept_ >= 0 && nowhere >= 0) ::dup2(nowhere, STDERR_FILENO);
        if (nowhere >= 0) ::close(nowhere);
    }
#endif
    ~QuietStderr() {
        if (kept_ < 0) return;
        ::dup2(kept_, STDERR_FILENO);
        ::close(kept_);
    }
    QuietStderr(const QuietStderr&) = delete;
    QuietStderr& operator=(const QuietStderr&) = delete;

private:
    int kept_;
};

std::string one_line(std::string text) {
    for (char& c : text)
        if (c == '\n' || c == '\r') c = ' ';
    while (!text.empty() && text.back() == ' ') text.pop_back();
    return text.empty() ? "no reason given" : text;
}

InputError refusal(const std::filesystem::path& path, const std::string& reason, const std::string& mend) {
    return input_error(path.string(), "", reason, mend);
}

InputError too_large(const std::filesystem::path& path, std::uint64_t limit) {
    return refusal(path, "is larger than " + std::to_string(limit >> 18) + " MiB of floats", "cut it");
}

// As the file declares it. Chromaticities count where they are not those of Rec. 709, which an EXR file has by default.
std::string colour_space_of(const OIIO::ImageSpec& spec) {
    std::string name(spec.get_string_attribute("oiio:ColorSpace"));
    const OIIO::ParamValue* chromaticities =
        spec.find_attribute("chromaticities", OIIO::TypeDesc(OIIO::TypeDesc::FLOAT, 8));
    if (chromaticities == nullptr) return name;
    constexpr std::array<float, 8> rec709{0.64f, 0.33f, 0.3f, 0.6f, 0.15f, 0.06f, 0.3127f, 0.329f};
    const auto* found = static_cast<const float*>(chromaticities->data());
    bool same = true;
    for (std::size_t i = 0; i < rec709.size(); ++i)
        same = same && std::abs(found[i] - rec709[i]) < 1e-3f;  // three digits are usual
    return same ? name : name + ", chromaticities " + chromaticities->get_string();
}

std::string encoded(const char* format, OIIO::ImageSpec spec, OIIO::TypeDesc type, const void* pixels,
    const std::filesystem::path& shown) {
    const auto refuse = [&](const std::string& reason) {
        return refusal(shown, "cannot be encoded (" + one_line(reason) + ")", "choose another format");
    };
    const std::unique_ptr<OIIO::ImageOutput> output = OIIO::ImageOutput::create(format);
    if (!output) throw refuse(OIIO::geterror());
    std::vector<unsigned char> bytes;
    OIIO::Filesystem::IOVecOutput memory(bytes);
    if (!output->set_ioproxy(&memory)) throw refuse("the image library cannot write it to memory");
    if (!output->open(shown.string(), spec) || !output->write_image(type, pixels) || !output->close())
        throw refuse(output->geterror());
    return {bytes.begin(), bytes.end()};
}

// The image without its pixels.
Image header_of(const OIIO::ImageSpec& spec, const std::filesystem::path& path) {
    if (spec.deep || spec.depth > 1) throw refusal(path, "is a deep or a volume image", "name a flat one");
    if (spec.width < 1 || spec.height < 1 || spec.nchannels < 1) throw refusal(path, "has no pixels", "write it again");
    Image image;
    image.width = static_cast<std::uint32_t>(spec.width);
    image.height = static_cast<std::uint32_t>(spec.height);
    image.channels = spec.channelnames;
    image.data_x = spec.x;
    image.data_y = spec.y;
    image.full_x = spec.full_x;
    image.full_y = spec.full_y;
    image.full_width = static_cast<std::uint32_t>(spec.full_width);
    image.full_height = static_cast<std::uint32_t>(spec.full_height);
    image.colour_space = colour_space_of(spec);
    if (spec.format == OIIO::TypeDesc::UINT8) image.greatest_integer = 255;
    if (spec.format == OIIO::TypeDesc::UINT16) image.greatest_integer = 65535;
    for (const OIIO::ParamValue& attribute : spec.extra_attribs)
        image.metadata[attribute.name().string()] = attribute.get_string();
    return image;
}

// The part of the file that `input` is at.
Image read_part(OIIO::ImageInput& input, const std::filesystem::path& path, std::uint64_t limit) {
    const OIIO::ImageSpec& spec = input.spec();
    Image image = header_of(spec, path);
    const std::uint64_t count = std::uint64_t{image.width} * image.height * image.channels.size();
    if (count > limit) throw too_large(path, limit);
    image.pixels.resize(count);
    const int part = input.current_subimage();
    if (!input.read_image(part, 0, 0, spec.nchannels, OIIO::TypeDesc::FLOAT, image.pixels.data()))
        throw refusal(path, "cannot be read to its end (" + one_line(input.geterror()) + ")", "write it again");
    return image;
}

std::string part_name(const OIIO::ImageInput& input) {
    return std::string(input.spec().get_string_attribute("oiio:subimagename"));
}

// "R" of the part "albedo" becomes "albedo.R", as a layer of a file of one part is written.
void name_by_part(Image& image, const std::string& part) {
    for (std::string& channel : image.channels)
        if (!part.empty() && channel != part && !channel.starts_with(part + ".")) channel = part + "." + channel;
}

// One of another size, as an identification map may be, is no part of this image; nor is a deep one.
bool belongs_to(const Image& image, const OIIO::ImageSpec& part) {
    return !part.deep && part.depth == 1 && std::cmp_equal(part.width, image.width) &&
           std::cmp_equal(part.height, image.height) && part.x == image.data_x && part.y == image.data_y;
}

void append_channels(Image& image, const Image& more) {
    const std::size_t pixels = std::size_t{image.width} * image.height;
    const std::size_t before = image.channels.size(), added = more.channels.size();
    std::vector<float> both;
    both.reserve(pixels * (before + added));
    for (std::size_t i = 0; i < pixels; ++i) {
        const auto first = image.pixels.begin() + static_cast<std::ptrdiff_t>(i * before);
        const auto second = more.pixels.begin() + static_cast<std::ptrdiff_t>(i * added);
        both.insert(both.end(), first, first + static_cast<std::ptrdiff_t>(before));
        both.insert(both.end(), second, second + static_cast<std::ptrdiff_t>(added));
    }
    image.pixels = std::move(both);
    image.channels.insert(image.channels.end(), more.channels.begin(), more.channels.end());
    image.metadata.insert(more.metadata.begin(), more.metadata.end());
}

}  // namespace

namespace {

Image read(const LibrarySource& source, std::uint64_t limit) {
    const QuietStderr quiet;
    OIIO::ImageSpec how;
    if (source.straight_alpha) how.attribute("oiio:UnassociatedAlpha", 1);
    OIIO::Filesystem::IOMemReader memory(source.bytes.data(), source.bytes.size());
    if (void* proxy = &memory; !source.bytes.empty()) how.attribute("oiio:ioproxy", OIIO::TypeDesc::PTR, &proxy);
    const std::unique_ptr<OIIO::ImageInput> input = OIIO::ImageInput::open(source.path.string(), &how);
    if (!input)
        throw refusal(
            source.path, "is no readable image (" + one_line(OIIO::geterror()) + ")", "name an EXR, PNG or PFM file");
    Image image = read_part(*input, source.path, limit);
    // Pages of other formats, and mip levels, are other images; parts of an EXR file are channels of one.
    const bool has_parts = std::strcmp(input->format_name(), "openexr") == 0 && input->seek_subimage(1, 0);
    if (!has_parts) return image;
    input->seek_subimage(0, 0);
    name_by_part(image, part_name(*input));
    for (int part = 1; input->seek_subimage(part, 0); ++part) {
        if (!belongs_to(image, input->spec())) continue;
        Image next = read_part(*input, source.path, limit);
        name_by_part(next, part_name(*input));
        append_channels(image, next);
        if (image.pixels.size() > limit) throw too_large(source.path, limit);
    }
    return image;
}

Image read_words(const std::filesystem::path& path, std::uint64_t limit) {
    const QuietStderr quiet;
    const std::unique_ptr<OIIO::ImageInput> input = OIIO::ImageInput::open(path.string());
    if (!input || std::strcmp(input->format_name(), "openexr") != 0)
        throw refusal(path, "is no EXR image", "name a file that render --range wrote");
    const OIIO::ImageSpec& spec = input->spec();
    Image image;
    image.width = static_cast<std::uint32_t>(spec.width);
    image.height = static_cast<std::uint32_t>(spec.height);
    for (const OIIO::ParamValue& attribute : spec.extra_attribs)
        image.metadata[attribute.name().string()] = attribute.get_string();
    int begin = 0;
    while (begin < spec.nchannels && spec.channelformat(begin) != OIIO::TypeDesc::UINT32) ++begin;
    int end = begin;
    while (end < spec.nchannels && spec.channelformat(end) == OIIO::TypeDesc::UINT32)
        image.word_channels.push_back(spec.channelnames[static_cast<std::size_t>(end++)]);
    const std::uint64_t count = std::uint64_t{image.width} * image.height * image.word_channels.size();
    if (count > limit) throw too_large(path, limit);
    image.words.resize(count);
    if (count > 0 && !input->read_image(0, 0, begin, end, OIIO::TypeDesc::UINT32, image.words.data()))
        throw refusal(path, "cannot be read to its end (" + one_line(input->geterror()) + ")", "write it again");
    return image;
}

// Pixel by pixel the floats, then the whole numbers.
std::vector<std::uint32_t> floats_and_words(const Image& image) {
    const std::size_t floats = image.channels.size(), words = image.word_channels.size();
    std::vector<std::uint32_t> both;
    both.reserve(image.pixels.size() + image.words.size());
    for (std::size_t pixel = 0; pixel < image.pixels.size() / floats; ++pixel) {
        for (std::size_t c = 0; c < floats; ++c)
            both.push_back(std::bit_cast<std::uint32_t>(image.pixels[pixel * floats + c]));
        for (std::size_t c = 0; c < words; ++c) both.push_back(image.words[pixel * words + c]);
    }
    return both;
}

OIIO::ImageSpec exr_spec(const Image& image) {
    OIIO::ImageSpec spec(static_cast<int>(image.width), static_cast<int>(image.height),
        static_cast<int>(image.channels.size() + image.word_channels.size()), OIIO::TypeDesc::FLOAT);
    spec.channelnames = image.channels;
    if (!image.words.empty()) {
        spec.channelnames.insert(spec.channelnames.end(), image.word_channels.begin(), image.word_channels.end());
        spec.channelformats.resize(image.channels.size(), OIIO::TypeDesc::FLOAT);
        spec.channelformats.resize(spec.channelnames.size(), OIIO::TypeDesc::UINT32);
    }
    spec.x = image.data_x;
    spec.y = image.data_y;
    const bool windowed = image.full_width != 0 && image.full_height != 0;
    spec.full_x = windowed ? image.full_x : image.data_x;
    spec.full_y = windowed ? image.full_y : image.data_y;
    spec.full_width = static_cast<int>(windowed ? image.full_width : image.width);
    spec.full_height = static_cast<int>(windowed ? image.full_height : image.height);
    for (const auto& [key, value] : image.metadata) spec.attribute(key, value);
    spec.attribute("compression", "zip");
    return spec;
}

std::string exr(const Image& image, const std::filesystem::path& shown) {
    const OIIO::ImageSpec spec = exr_spec(image);
    if (!image.words.empty())
        return encoded("exr", spec, OIIO::TypeDesc::UNKNOWN, floats_and_words(image).data(), shown);
    return encoded("exr", spec, OIIO::TypeDesc::FLOAT, image.pixels.data(), shown);
}

std::string srgb8_png(const std::vector<std::uint8_t>& pixels, std::uint32_t width, std::uint32_t height,
    const std::filesystem::path& shown) {
    OIIO::ImageSpec spec(static_cast<int>(width), static_cast<int>(height), 3, OIIO::TypeDesc::UINT8);
    spec.attribute("oiio:ColorSpace", "sRGB");
    return encoded("png", spec, OIIO::TypeDesc::UINT8, pixels.data(), shown);
}

std::string srgb16_png(const Image& image, const std::filesystem::path& shown) {
    std::vector<std::uint16_t> pixels;
    for (std::size_t i = 0; i < image.pixels.size(); i += image.channels.size())
        for (std::size_t c = 0; c < 3; ++c) {
            const double linear = std::clamp(static_cast<double>(image.pixels[i + c]), 0.0, 1.0);
            const double encoded = linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1.0 / 2.4) - 0.055;
            pixels.push_back(static_cast<std::uint16_t>(std::lround(65535.0 * encoded)));
        }
    OIIO::ImageSpec spec(static_cast<int>(image.width), static_cast<int>(image.height), 3, OIIO::TypeDesc::UINT16);
    spec.attribute("oiio:ColorSpace", "sRGB");
    return encoded("png", spec, OIIO::TypeDesc::UINT16, pixels.data(), shown);
}

// An open file as OpenImageIO writes to one. It remembers the first failure, which the library does not always tell.
class DescriptorProxy final : public OIIO::Filesystem::IOProxy {
public:
    DescriptorProxy(int descriptor, const std::string& shown)
        : IOProxy(shown, IOProxy::Write), descriptor_(descriptor) {}

    [[nodiscard]] const char* proxytype() const override { return "descriptor"; }
    std::size_t write(const void* bytes, std::size_t count) override {
        const std::size_t written = pwrite(bytes, count, m_pos);
        m_pos += static_cast<std::int64_t>(written);
        return written;
    }
    std::size_t pwrite(const void* bytes, std::size_t count, std::int64_t offset) override {
        std::size_t done = 0;
        while (done < count) {
            const ssize_t written = ::pwrite(descriptor_, static_cast<const char*>(bytes) + done, count - done,
                offset + static_cast<std::int64_t>(done));
            if (written < 0 && errno == EINTR) continue;
            if (written < 0) {
                if (failure_ == 0) failure_ = errno;
                break;
            }
            done += static_cast<std::size_t>(written);
        }
        size_ = std::max(size_, offset + static_cast<std::int64_t>(done));
        return done;
    }
    [[nodiscard]] std::size_t size() const override { return static_cast<std::size_t>(size_); }
    [[nodiscard]] int failure() const { return failure_; }  // an errno

private:
    int descriptor_;
    int failure_ = 0;
    std::int64_t size_ = 0;
};

class ExrTiles final : public ImageTiles {
public:
    ExrTiles(int descriptor, const Image& header, const std::filesystem::path& shown)
        : shown_(shown), file_(descriptor, shown.string()), output_(OIIO::ImageOutput::create("exr")) {
        if (!output_ || !output_->supports("tiles") || !output_->set_ioproxy(&file_))
            throw refusal(shown_, "cannot be written in tiles by the image library", "give more --memory");
        OIIO::ImageSpec spec = exr_spec(header);
        spec.tile_width = spec.tile_height = static_cast<int>(image_tile_edge);
        require(output_->open(shown.string(), spec));
    }

    void write(const PixelRectangle& place, std::span<const float> pixels) override {
        const auto at = [](std::uint32_t x) { return static_cast<int>(x); };
        require(output_->write_tiles(
            at(place.x0), at(place.x1), at(place.y0), at(place.y1), 0, 1, OIIO::TypeDesc::FLOAT, pixels.data()));
    }

    void close() override { require(output_->close()); }

private:
    void require(bool succeeded) const {
        if (file_.failure() != 0)
            throw refusal(shown_, std::string("cannot be written to its end (") + std::strerror(file_.failure()) + ")",
                "make room on its disk, or choose another folder");
        if (!succeeded)
            throw refusal(shown_, "cannot be encoded (" + one_line(output_->geterror()) + ")", "choose another format");
    }

    std::filesystem::path shown_;
    DescriptorProxy file_;  // outlives what writes to it
    std::unique_ptr<OIIO::ImageOutput> output_;
};

std::unique_ptr<ImageTiles> tiles(int descriptor, const Image& header, const std::filesystem::path& shown) {
    return std::make_unique<ExrTiles>(descriptor, header, shown);
}

class FileBands final : public ImageBands {
public:
    explicit FileBands(const std::filesystem::path& path) : path_(path) {
        const QuietStderr quiet;
        input_ = OIIO::ImageInput::open(path.string());
        if (!input_)
            throw refusal(path, "is no readable image (" + one_line(OIIO::geterror()) + ")", "name an EXR file");
        header_ = header_of(input_->spec(), path);
        tiled_ = input_->spec().tile_height > 0;
        several_parts_ = input_->seek_subimage(1, 0);
        input_->seek_subimage(0, 0);
    }

    [[nodiscard]] const Image& header() const override { return header_; }
    [[nodiscard]] std::uint32_t height() const override {
        constexpr std::uint32_t of_scanlines = 64;  // a few blocks of 16 or 32 rows, as EXR compresses them
        return tiled_ ? static_cast<std::uint32_t>(input_->spec().tile_height) : of_scanlines;
    }
    [[nodiscard]] std::vector<float> read(std::uint32_t begin, std::uint32_t end) override {
        if (several_parts_) throw refusal(path_, "has several parts, which are read whole", "write a file of one");
        const OIIO::ImageSpec& spec = input_->spec();
        std::vector<float> pixels(std::size_t{end - begin} * header_.width * header_.channels.size());
        const int y0 = spec.y + static_cast<int>(begin), y1 = spec.y + static_cast<int>(end);
        const bool whole =
            tiled_ ? input_->read_tiles(0, 0, spec.x, spec.x + spec.width, y0, y1, 0, 1, 0, spec.nchannels,
                         OIIO::TypeDesc::FLOAT, pixels.data())
                   : input_->read_scanlines(0, 0, y0, y1, 0, 0, spec.nchannels, OIIO::TypeDesc::FLOAT, pixels.data());
        if (!whole)
            throw refusal(path_, "cannot be read to its end (" + one_line(input_->geterror()) + ")", "write it again");
        return pixels;
    }

private:
    std::filesystem::path path_;
    std::unique_ptr<OIIO::ImageInput> input_;
    Image header_;
    bool tiled_ = false, several_parts_ = false;
};

std::unique_ptr<ImageBands> bands(const std::filesystem::path& path) { return std::make_unique<FileBands>(path); }

}  // namespace

}  // namespace tandem::image_files

extern "C" [[gnu::visibility("default")]] const tandem::image_files::ImageLibrary* tandem_image_module() {
    using namespace tandem::image_files;
    static constexpr ImageLibrary library{read, read_words, exr, srgb8_png, srgb16_png, tiles, bands};
    return &library;
}
