// Images out and in again: every bit, every word beside them, and files that appear whole or not at all.
#include <doctest/doctest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <csignal>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>
#include <map>
#include <sstream>
#include <string>

#include "common/files/outputs.h"
#include "common/files/write_file.h"
#include "common/image/image_io.h"
#include "common/image/image_io_parts.h"
#include "common/image/tiled_image.h"
#include "tests/refusal.h"
#include "tests/temporary_folder.h"

using namespace tandem;

namespace {

std::string content(const std::filesystem::path& path) {
    std::ifstream stream(path, std::ios::binary);
    std::ostringstream text;
    text << stream.rdbuf();
    return text.str();
}

void put(const std::filesystem::path& path, const std::string& text) { std::ofstream(path, std::ios::binary) << text; }

// Values that a careless path would change: denormal, infinite, NaN, −0, beyond half precision.
Image awkward_image(std::vector<std::string> channels) {
    Image image;
    image.width = 5;
    image.height = 3;
    image.channels = std::move(channels);
    image.pixels.resize(std::size_t{15} * image.channels.size());
    for (std::size_t i = 0; i < image.pixels.size(); ++i) image.pixels[i] = 1.0f / static_cast<float>(i + 3);
    image.pixels[0] = 1e-40f;
    image.pixels[1] = std::numeric_limits<float>::infinity();
    image.pixels[2] = std::numeric_limits<float>::quiet_NaN();
    image.pixels[3] = -0.0f;
    image.pixels[4] = 3e38f;
    return image;
}

std::vector<std::uint32_t> bits_of(const Image& image, const std::string& channel) {
    const auto place = std::ranges::find(image.channels, channel);
    if (place == image.channels.end()) return {};
    std::vector<std::uint32_t> bits;
    for (auto i = static_cast<std::size_t>(place - image.channels.begin()); i < image.pixels.size();
         i += image.channels.size())
        bits.push_back(std::bit_cast<std::uint32_t>(image.pixels[i]));
    return bits;
}

void check_same_bits(const Image& before, const Image& after) {
    CHECK(after.width == before.width);
    CHECK(after.height == before.height);
    CHECK(after.channels.size() == before.channels.size());
    for (const std::string& channel : before.channels) {
        CAPTURE(channel);
        CHECK(bits_of(after, channel) == bits_of(before, channel));
    }
}

}  // namespace

TEST_CASE("PFM keeps three channels bit by bit, rows from the top") {
    const TemporaryFolder folder;
    const Image image = awkward_image({"R", "G", "B"});
    write_image(folder / "a.pfm", image);
    const Image again = read_image(folder / "a.pfm");
    check_same_bits(image, again);
    CHECK(again.full_width == 5);
    CHECK(again.full_height == 3);
    CHECK(again.colour_space.empty());
}

TEST_CASE("PFM of more channels keeps the first three") {
    const TemporaryFolder folder;
    const Image image = awkward_image({"R", "G", "B", "variance.R"});
    write_image(folder / "a.pfm", image);
    const Image again = read_image(folder / "a.pfm");
    CHECK(again.channels == std::vector<std::string>{"R", "G", "B"});
    CHECK(bits_of(again, "B") == bits_of(image, "B"));
}

TEST_CASE("PFM of the other byte order is read") {
    const TemporaryFolder folder;
    put(folder / "a.pfm", std::string("Pf\n1 1\n1.0\n\x3f\x80\x00\x00", 15));
    CHECK(read_image(folder / "a.pfm").pixels == std::vector<float>{1.0f});
}

TEST_CASE("a PFM that is cut, padded or not one is refused") {
    const TemporaryFolder folder;
    for (const std::string& text : {std::string("PF\n2 1\n-1.0\nabcd"), std::string("Pf\n1 1\n-1.0\nabcdefgh"),
             std::string("P6\n1 1\n255\nabc"), std::string("PF\n"), std::string(), std::string("PF\n-1 5\n-1.0\n"),
             std::string("PF\n65536 65536\n-1.0\n"), std::string("PF\n99999999999999999999 1\n-1.0\n")}) {
        CAPTURE(text);
        put(folder / "a.pfm", text);
        CHECK(contains(refusal([&] { (void)read_image(folder / "a.pfm"); }), "a.pfm: is not a sound PFM image"));
    }
}

namespace {

// As numpy.save writes it; `rest`: what follows the header.
std::string npy(const std::string& dictionary, const std::string& rest) {
    std::string header = dictionary;
    while ((10 + header.size()) % 64 != 63) header += ' ';
    header += '\n';
    return std::string("\x93NUMPY\x01\x00", 8) + static_cast<char>(header.size() & 0xff) +
           static_cast<char>(header.size() >> 8) + header + rest;
}

template <class Value>
std::string bytes_of(const std::vector<Value>& values) {
    return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(Value)};
}

}  // namespace

TEST_CASE("NumPy arrays of 3 and 6 channels are read, of single and double precision") {
    const TemporaryFolder folder;
    put(folder / "a.npy",
        npy("{'descr': '<f4', 'fortran_order': False, 'shape': (1, 2, 3), }", bytes_of<float>({1, 2, 3, 4, 5, 6.5f})));
    const Image three = read_image(folder / "a.npy");
    CHECK(three.width == 2);
    CHECK(three.height == 1);
    CHECK(three.channels == std::vector<std::string>{"R", "G", "B"});
    CHECK(three.pixels == std::vector<float>{1, 2, 3, 4, 5, 6.5f});
    put(folder / "b.npy",
        npy("{'descr': '<f8', 'fortran_order': False, 'shape': (1, 1, 6), }", bytes_of<double>({1, 2, 3, 4, 5, 0.5})));
    const Image six = read_image(folder / "b.npy");
    CHECK(six.channels.back() == "variance.B");
    CHECK(six.pixels == std::vector<float>{1, 2, 3, 4, 5, 0.5f});
}

TEST_CASE("a NumPy array that is no image is refused with the mend") {
    const TemporaryFolder folder;
    const std::string three = bytes_of<float>({1, 2, 3});
    const std::string good = "{'descr': '<f4', 'fortran_order': False, 'shape': (1, 1, 3), }";
    const std::vector<std::pair<std::string, std::string>> cases{
        {npy("{'descr': '<f4', 'fortran_order': True, 'shape': (1, 1, 3), }", three), "ascontiguousarray"},
        {npy("{'descr': '<i4', 'fortran_order': False, 'shape': (1, 1, 3), }", three), "save an array of float32"},
        {npy("{'descr': '<f4', 'fortran_order': False, 'shape': (1, 1, 4), }", three), "(1, 1, 4)"},
        {npy("{'descr': '<f4', 'fortran_order': False, 'shape': (), }", three), "shape is ()"},
        {npy(good, three.substr(1)), "does not hold 3 values"}, {npy(good, three + "x"), "does not hold 3 values"},
        {npy(good, three).substr(0, 30), "ends early"}, {"NUMPY", "numpy.save"}};
    for (const auto& [text, mention] : cases) {
        put(folder / "a.npy", text);
        const std::string line = refusal([&] { (void)read_image(folder / "a.npy"); });
        CAPTURE(line);
        CHECK(contains(line, "a.npy: is no image: "));
        CHECK(contains(line, mention));
    }
}

TEST_CASE("an estimate becomes mean, variance of one sample and count") {
    Estimate estimate(1, 1);
    estimate.add_block({0, 64}, {{64.0, 128.0}, {0.0, 0.0}, {32.0, 16.0}});
    const Image image = image_of(estimate, {{"tandem:seed", "7"}});
    CHECK(image.channels == std::vector<std::string>{"R", "G", "B", "variance.R", "variance.G", "variance.B", "count"});
    CHECK(image.pixels == std::vector<float>{1.0f, 0.0f, 0.5f, static_cast<float>(64.0 / 63.0), 0.0f, 0.0f, 64.0f});
    CHECK(image.metadata.at("tandem:seed") == "7");
}

TEST_CASE("sRGB bytes follow IEC 61966-2-1") {
    Image image;
    image.width = 8;
    image.height = 1;
    image.channels = {"Y"};
    // 0.002 lies on the linear toe; 0.2140411 is the linear value of byte 127.5 / 255 = 0.5.
    image.pixels = {0.0f, 0.002f, 0.2140411f, 0.5f, 1.0f, 7.0f, -1.0f, std::numeric_limits<float>::quiet_NaN()};
    const std::vector<std::uint8_t> bytes = image_files::to_srgb8(image, 1.0);
    std::vector<int> first;
    for (std::size_t i = 0; i < bytes.size(); i += 3) {
        first.push_back(bytes[i]);
        CHECK(bytes[i] == bytes[i + 1]);
        CHECK(bytes[i] == bytes[i + 2]);
    }
    CHECK((first[2] == 127 || first[2] == 128));
    first[2] = 0;
    CHECK(first == std::vector<int>{0, 7, 0, 188, 255, 255, 0, 0});
    CHECK(image_files::to_srgb8(image, 2.0)[9] == 255);  // 0.5 · 2
}

TEST_CASE("a missing image, a folder and a file that is no image are refused by name") {
    const TemporaryFolder folder;
    CHECK(contains(refusal([&] { (void)read_image(folder / "none.exr"); }), "none.exr: no such file"));
    std::filesystem::create_directory(folder / "d.exr");
    CHECK(contains(refusal([&] { (void)read_image(folder / "d.exr"); }), "d.exr: is not a regular file"));
    put(folder / "words.exr", "these are words\n");
    const std::string line = refusal([&] { (void)read_image(folder / "words.exr"); });
    CHECK(contains(line, "words.exr: "));
    CHECK(!contains(line, "\n"));
}

TEST_CASE("what cannot be written is refused, and nothing is left behind") {
    const TemporaryFolder folder;
    const Image image = awkward_image({"R", "G", "B"});
    CHECK(contains(refusal([&] { write_image(folder / "no/a.pfm", image); }), "create the folder first"));
    CHECK(contains(refusal([&] { write_image("/proc/a.pfm", image); }), "cannot be written"));
    CHECK(contains(refusal([&] { write_image("/dev/null.jpeg2", image); }), "unknown kind of image"));
    std::filesystem::create_directory(folder / "d.pfm");
    CHECK(contains(refusal([&] { write_image(folder / "d.pfm", image); }), "is a folder"));
    CHECK(contains(refusal([&] {
        check_outputs({{"-o", folder / "no/a.pfm", OutputKind::image}}, {});
    }),
        "create the folder first"));
    CHECK(contains(refusal([&] { check_image_ending(folder / "a"); }), "unknown kind of image"));
    check_image_ending("fine.pfm");
    check_outputs({{"-o", folder / "fine.pfm", OutputKind::image}}, {});
    CHECK(folder.file_count() == 1);  // d.pfm
}

TEST_CASE("a replacement that is not committed leaves the old file as it was") {
    const TemporaryFolder folder;
    put(folder / "a.txt", "old");
    { const ReplacementFile file(folder / "a.txt"); }
    CHECK(content(folder / "a.txt") == "old");
    CHECK(folder.file_count() == 1);
    write_text_file(folder / "a.txt", "new");
    CHECK(content(folder / "a.txt") == "new");
    CHECK(folder.file_count() == 1);
}

// No file of this process may grow beyond `bytes` meanwhile: what writers meet on a disk without room.
class SmallDisk {
public:
    explicit SmallDisk(rlim_t bytes) : handler_(std::signal(SIGXFSZ, SIG_IGN)) {
        REQUIRE(::getrlimit(RLIMIT_FSIZE, &before_) == 0);
        const rlimit small{bytes, before_.rlim_max};
        REQUIRE(::setrlimit(RLIMIT_FSIZE, &small) == 0);
    }
    ~SmallDisk() {
        ::setrlimit(RLIMIT_FSIZE, &before_);
        std::signal(SIGXFSZ, handler_);
    }
    SmallDisk(const SmallDisk&) = delete;
    SmallDisk& operator=(const SmallDisk&) = delete;

private:
    rlimit before_{};
    void (*handler_)(int);
};

TEST_CASE("what does not fit on the disk is refused by every writer, and the old file stays") {
    const TemporaryFolder folder;
    const Image image = awkward_image({"R", "G", "B"});
    const std::map<std::string, std::function<void(const std::filesystem::path&)>> writers{
        {"a.pfm", [&](const auto& path) { write_image(path, image); }},
        {"a.exr", [&](const auto& path) { write_image(path, image); }},
        {"a.png", [&](const auto& path) { write_png(path, image); }},
        {"tiles.exr",
            [&](const auto& path) {
                Image header = image;
                header.pixels.clear();
                TiledImageWriter file(path, header);
                file.write({0, 0, image.width, image.height}, image.pixels);
                file.commit();
            }},
        {"a.json", [&](const auto& path) { write_text_file(path, "{\"a\": 1}"); }}};
    for (const auto& [name, write] : writers) {
        CAPTURE(name);
        if (!image_files::has_library() && !name.ends_with(".pfm") && !name.ends_with(".json")) continue;
        put(folder / name, "old");
        for (const rlim_t bytes : {rlim_t{0}, rlim_t{5}}) {
            std::string message;
            {
                const SmallDisk disk(bytes);
                message = refusal([&, &write = write, &name = name] { write(folder / name); });
            }
            CHECK(contains(message, "cannot be written to its end (File too large)"));
            CHECK(content(folder / name) == "old");
        }
        write(folder / name);
        CHECK(content(folder / name) != "old");
    }
    CHECK(folder.file_count() == writers.size());
}

TEST_CASE("text through a link replaces what the link names") {
    const TemporaryFolder folder;
    put(folder / "real.txt", "old");
    std::filesystem::create_symlink(folder / "real.txt", folder / "link.txt");
    write_text_file(folder / "link.txt", "new");
    CHECK(std::filesystem::is_symlink(folder / "link.txt"));
    CHECK(content(folder / "real.txt") == "new");
}

TEST_CASE("text that does not fit its device is an error") {
    CHECK(contains(refusal([] { write_text_file("/dev/full", "text"); }), "/dev/full: cannot be written to its end"));
    CHECK(std::filesystem::is_character_file("/dev/full"));
}

TEST_CASE("with OpenImageIO an EXR keeps channels, windows and metadata; without it the reason is given") {
    const TemporaryFolder folder;
    Image image = awkward_image({"R", "G", "B", "variance.R", "variance.G", "variance.B", "count"});
    image.metadata = {{"tandem:scene", "cornell \"classic\""}, {"tandem:samples", "64"}};
    image.data_x = 2;
    image.data_y = -1;
    image.full_width = 20;
    image.full_height = 10;
    if (!image_files::has_library()) {
        CHECK(contains(refusal([&] { write_image(folder / "a.exr", image); }), "built without OpenImageIO"));
        CHECK(contains(refusal([&] { write_png(folder / "a.png", image); }), "built without OpenImageIO"));
        CHECK(contains(refusal([&] { check_image_ending(folder / "a.exr"); }), "built without OpenImageIO"));
        CHECK(folder.file_count() == 0);
        return;
    }
    write_image(folder / "a.exr", image);
    const Image again = read_image(folder / "a.exr");
    check_same_bits(image, again);
    for (const auto& [key, value] : image.metadata) {
        CAPTURE(key);
        REQUIRE(again.metadata.contains(key));
        CHECK(again.metadata.at(key) == value);
    }
    CHECK(again.data_x == 2);
    CHECK(again.data_y == -1);
    CHECK(again.full_x == 0);
    CHECK(again.full_width == 20);
    CHECK(again.full_height == 10);
    CHECK(folder.file_count() == 1);
    CHECK(contains(refusal([&] { write_image(folder / "a.png", image); }), "end the name in .exr"));
}

TEST_CASE("with OpenImageIO a PNG holds the sRGB bytes and says so" * doctest::skip(!image_files::has_library())) {
    const TemporaryFolder folder;
    Image image;
    image.width = 2;
    image.height = 1;
    image.channels = {"R", "G", "B"};
    image.pixels = {0.002f, 0.5f, 1.0f, 0.0f, 4.0f, 0.25f};
    write_png(folder / "a.png", image, 1.0);
    const Image again = read_image(folder / "a.png");
    CHECK(again.colour_space == "sRGB");
    std::vector<int> bytes;
    for (const float value : again.pixels) bytes.push_back(static_cast<int>(std::lround(value * 255.0f)));
    CHECK(bytes == std::vector<int>{7, 188, 255, 0, 255, 137});
}

TEST_CASE(
    "a cut EXR is refused, and an EXR declares a linear colour space" * doctest::skip(!image_files::has_library())) {
    const TemporaryFolder folder;
    write_image(folder / "a.exr", awkward_image({"R", "G", "B"}));
    CHECK(contains(read_image(folder / "a.exr").colour_space, "inear"));
    const std::string whole = content(folder / "a.exr");
    put(folder / "cut.exr", whole.substr(0, whole.size() - 40));
    CHECK(contains(refusal([&] { (void)read_image(folder / "cut.exr"); }), "cut.exr: "));
}
