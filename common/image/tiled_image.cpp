#include "common/image/tiled_image.h"

#include "common/error.h"
#include "common/image/image_io_parts.h"

namespace tandem {

TiledImageWriter::TiledImageWriter(const std::filesystem::path& path, const Image& header) : file_(path) {
    if (image_files::ending(path) != ".exr")
        throw input_error(path.string(), "", "an image of tiles is an .exr file", "end the name in .exr");
    tiles_ = image_files::exr_tiles(file_.descriptor(), header, path);
}

void TiledImageWriter::commit(const FilesRead& read) {
    tiles_->close();
    file_.commit(read);
}

BandedImage::BandedImage(const std::filesystem::path& path) {
    image_files::require_regular_file(path);
    bands_ = image_files::bands_with_library(path);
}

}  // namespace tandem
