#include "tests/fuzz/targets.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include "common/error.h"
#include "common/image/image_io.h"
#include "common/render/renderer.h"
#include "common/scene/loader/scene_loader.h"
#include "common/scene/sound_scene.h"
#include "tests/temporary_folder.h"

namespace tandem::fuzz {

namespace {

// As a texture may have: a file of few bytes may declare a picture of any size.
constexpr std::uint64_t greatest_floats = std::uint64_t{1} << 26;

// A line for a terminal: 64 levels of keys, each cut at 160 bytes, are the longest pointer.
constexpr std::size_t greatest_line = 16384;

void put(const std::filesystem::path& path, Bytes bytes) {
    std::ofstream stream(path, std::ios::binary | std::ios::trunc);
    stream.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
}

void put(const std::filesystem::path& path, std::string_view text) { put(path, std::as_bytes(std::span(text))); }

// A scene of one entity, whose texture has the coordinates of its primitive.
std::string scene_of(const std::string& primitive, const std::string& texture, const std::string& rest) {
    return R"({"camera": {"position": [0, 0, 5], "target": [0, 0, 0], "vertical_field_degrees": 40},)" + rest +
           R"("textures": {"t": )" + texture +
           R"(}, "materials": {"m": {"kind": "diffuse", "colour": {"texture": "t"}}},
        "entities": [{"material": "m", "primitives": [)" +
           primitive + "]}]}";
}

// A scene of one model, which brings its materials.
std::string scene_of_model(const std::string& model) {
    return R"({"camera": {"position": [0, 0, 5], "target": [0, 0, 0], "vertical_field_degrees": 40},
        "entities": [{"primitives": [)" +
           model + "]}]}";
}

// The folder that all inputs of this process are written to, with sound files beside.
class Folder {
public:
    Folder() {
        const std::filesystem::path seeds = TANDEM_FUZZ_CORPUS;
        const auto copy = [&](const std::string& seed, const std::string& name) {
            std::filesystem::copy_file(seeds / seed, folder_ / name);
        };
        copy("obj/quad.obj", "quad.obj");
        copy("gltf/triangle.glb", "triangle.glb");
        copy("volume/six-cells.vol", "six-cells.vol");
        copy("image/colour.pfm", "colour.pfm");
        copy("gltf/triangle.bin", "triangle.bin");
        const std::string checker = R"({"kind": "checker", "space": "coordinates", "colours": [[0, 0, 0], [1, 1, 1]]})";
        const std::string quad = R"({"quad": {"corner": [0, 0, 0], "edges": [[1, 0, 0], [0, 1, 0]]}})";
        put(folder_ / "obj.json", scene_of(R"({"obj": {"file": "input.obj"}})", checker, ""));
        put(folder_ / "gltf.json", scene_of(R"({"gltf": {"file": "input.gltf"}})", checker, ""));
        copy("mtl/two.mtl", "two.mtl");
        copy("obj/of-mtl.obj", "of-mtl.obj");
        copy("obj/own.obj", "own.obj");
        copy("gltf/materials.gltf", "materials.gltf");
        put(folder_ / "own-obj.json", scene_of_model(R"({"obj": {"file": "input.obj"}})"));
        put(folder_ / "own-mtl.json", scene_of_model(R"({"obj": {"file": "of-mtl.obj"}})"));
        put(folder_ / "own-gltf.json", scene_of_model(R"({"gltf": {"file": "input.gltf"}})"));
        put(folder_ / "volume.json",
            scene_of(
                quad, checker, R"("media": {"v": {"scattering": 1, "grid": {"file": "input.vol"}}}, "medium": "v",)"));
        for (const std::string ending : {".pfm", ".exr"}) {
            const std::string file = R"("input)" + ending + R"(")";
            put(folder_ / ("texture" + ending + ".json"),
                scene_of(quad, R"({"kind": "image", "colour_space": "srgb", "file": )" + file + "}", ""));
            put(folder_ / ("sky" + ending + ".json"),
                scene_of(quad, checker, R"("background": {"colour_space": "linear", "image": )" + file + "},"));
        }
    }
    std::filesystem::path operator/(const std::string& name) const { return folder_ / name; }

private:
    TemporaryFolder folder_;
};

const Folder& folder() {
    static const Folder made;
    return made;
}

[[noreturn]] void fail(const std::string& what, const std::string& line) {
    std::fprintf(stderr, "fuzz: %s: %s\n", what.c_str(), line.c_str());
    std::abort();
}

// "FILE: POINTER: REASON; MEND" in printable text.
void check_refusal(const std::string& line, const std::filesystem::path& file) {
    if (!line.starts_with(file.string() + ": ")) fail("a refusal does not name its file", line);
    if (line.find("; ") == std::string::npos) fail("a refusal has no mend", line);
    if (line.size() > greatest_line) fail("a refusal is too long", line);
    if (std::ranges::any_of(line, [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7F; }))
        fail("a refusal is not one printable line", line);
}

void load(const std::string& name) {
    const std::filesystem::path file = folder() / name;
    try {
        const Scene scene = load_scene(file);
        const std::string fault = unsound_part(scene);
        if (!fault.empty()) fail("an unsound scene was accepted", fault);
        (void)needed_effects(scene, default_settings(scene));
    } catch (const InputError& error) {
        check_refusal(error.what(), file);
    }
}

}  // namespace

void scene(Bytes bytes) {
    put(folder() / "input.json", bytes);
    load("input.json");
}

void obj(Bytes bytes) {
    put(folder() / "input.obj", bytes);
    load("obj.json");
    load("own-obj.json");
}

void mtl(Bytes bytes) {
    put(folder() / "input.mtl", bytes);
    load("own-mtl.json");
}

void gltf(Bytes bytes) {
    put(folder() / "input.gltf", bytes);
    load("gltf.json");
    load("own-gltf.json");
}

void volume(Bytes bytes) {
    put(folder() / "input.vol", bytes);
    load("volume.json");
}

void image(Bytes bytes) {
    const bool map = !bytes.empty() && bytes.front() == std::byte{'P'};
    const std::string ending = map ? ".pfm" : ".exr";
    const std::filesystem::path file = folder() / ("input" + ending);
    put(file, bytes);
    load("texture" + ending + ".json");
    load("sky" + ending + ".json");
    try {
        const Image read = read_image(file, greatest_floats);
        if (read.pixels.size() != std::size_t{read.width} * read.height * read.channels.size())
            fail("an image of another size than it says", file.string());
    } catch (const InputError& error) {
        check_refusal(error.what(), file);
    }
}

}  // namespace tandem::fuzz
