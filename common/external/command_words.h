// The text after `exec:`: a command as words, with placeholders for the parameters of an image. No shell reads it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "common/render/renderer.h"

namespace tandem {

// One image that a program is to render.
struct ImageRequest {
    std::filesystem::path scene;
    std::uint32_t width = 0, height = 0;  // pixels
    std::uint64_t samples = 0;            // a pixel
    std::uint64_t seed = 0, first_sample = 0;
    std::uint32_t bounces = 0;  // scattering events at most
    PixelFilter filter = PixelFilter::box;
    unsigned threads = 1;
    std::filesystem::path out;
};

class CommandWords {
public:
    // Splits `text` at blanks. Quotes '…' and "…" keep words together, and \ takes the next character as it is.
    // Nothing is expanded. Throws InputError for an open quote, no word, an unknown placeholder, or a placeholder in
    // the text of `sh -c`. It also does for a program that is not there, and placeholders without {out}, {samples} and
    // {seed}.
    explicit CommandWords(const std::string& text);

    [[nodiscard]] bool has(const std::string& placeholder) const;
    // No placeholders: the program is started once and asked by lines of JSON.
    [[nodiscard]] bool stays_up() const { return placeholders_.empty(); }
    // Ending of the image's file: "exr", or NAME of {out:NAME}.
    [[nodiscard]] const std::string& ending() const { return ending_; }
    // The first word without its folder; of an interpreter, the first file that is given to it: "tracer.py" of "python3
    // tools/tracer.py".
    [[nodiscard]] std::string program_name() const;
    // The words with the request's values in place of the placeholders; a value never becomes several words.
    [[nodiscard]] std::vector<std::string> filled(const ImageRequest& request) const;
    [[nodiscard]] const std::string& text() const { return text_; }

private:
    void split();
    void find_placeholders();
    void check_shell() const;
    void check_program() const;

    std::string text_;
    std::vector<std::string> words_;
    std::vector<std::string> placeholders_;
    std::string ending_ = "exr";
};

}  // namespace tandem
