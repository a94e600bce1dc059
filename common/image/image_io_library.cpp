// The image library, loaded with the first image that needs it. OpenImageIO brings more than 200 shared libraries, and
// most starts of the program touch no such image.
#include "common/error.h"
#include "common/files/load_module.h"
#include "common/image/image_io_parts.h"

namespace tandem::image_files {

namespace {

const ImageLibrary& library_for(const std::filesystem::path& path) {
    static const LoadedModule module = load_module(image_module_file, image_module_name);
    if (module.entry == nullptr)
        throw input_error(path.string(), "",
            "images other than .pfm need " + std::string(image_module_file) + ", which cannot be loaded (" +
                module.reason + ")",
            "build or install Tandem whole");
    return *reinterpret_cast<const ImageLibrary* (*)()>(module.entry)();
}

}  // namespace

bool has_library() { return true; }

void require_library(const std::filesystem::path& path) { static_cast<void>(library_for(path)); }

Image read_with_library(const LibrarySource& source, std::uint64_t limit) {
    return library_for(source.path).read(source, limit);
}

Image read_words_with_library(const std::filesystem::path& path, std::uint64_t limit) {
    return library_for(path).read_words(path, limit);
}

std::string exr_bytes(const Image& image, const std::filesystem::path& shown) {
    return library_for(shown).exr_bytes(image, shown);
}

std::string srgb8_png_bytes(const std::vector<std::uint8_t>& pixels, std::uint32_t width, std::uint32_t height,
    const std::filesystem::path& shown) {
    return library_for(shown).srgb8_png_bytes(pixels, width, height, shown);
}

std::string srgb16_png_bytes(const Image& image, const std::filesystem::path& shown) {
    return library_for(shown).srgb16_png_bytes(image, shown);
}

std::unique_ptr<ImageTiles> exr_tiles(int descriptor, const Image& header, const std::filesystem::path& shown) {
    return library_for(shown).exr_tiles(descriptor, header, shown);
}

std::unique_ptr<ImageBands> bands_with_library(const std::filesystem::path& path) {
    return library_for(path).bands(path);
}

}  // namespace tandem::image_files
