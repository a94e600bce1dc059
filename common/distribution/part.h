// A part of a render as a file: the exact sums of some samples, and a description of them. Parts of one image merge to
// the bits of a render that was never split.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "common/image/image_io.h"
#include "common/render/renderer.h"

namespace tandem {

// What parts of one image have in common.
struct Provenance {
    std::string scene;     // hash of every file that was read for it
    std::string settings;  // JSON of what the samples depend on
    std::string version;   // the commit of the program
    bool operator==(const Provenance&) const = default;
};

// `inputs`: the files of the scene. Throws InputError where one cannot be read any more.
[[nodiscard]] Provenance provenance_of(const std::vector<std::string>& inputs, const RenderSettings& settings,
    const std::string& precision, const std::string& version);

struct Part {
    Estimate estimate;
    Provenance of;
    std::set<std::string> devices;                // that rendered it, "cpu: Intel Xeon …"
    std::uint64_t whole = 0;                      // samples a pixel of the whole image; 0: nobody told
    double seconds = 0.0;                         // of rendering, all devices added up
    std::map<std::string, std::string> metadata;  // "tandem:…", as an image of it has
    [[nodiscard]] bool independent() const;       // samples, so that their scatter tells an error
};

// Throws UnsupportedError for settings whose samples are no sum of parts.
void check_splittable(const RenderSettings& settings);

// The mean for a viewer, and the sums. Throws InputError, as write_image does.
void write_part(const std::filesystem::path& path, const Part& part, const FilesRead& read = {});
[[nodiscard]] Part read_part(const std::filesystem::path& path);

// Takes in another part. Throws InputError, which names the file `name`, where it is of something else or holds samples
// that are there already.
void take_in(Part& all, Part part, const std::string& name);

// What `part` lacks of the range. Throws InputError, naming the file `name`, where a block was begun and cannot go on.
[[nodiscard]] std::vector<SampleRange> missing(const Estimate& part, SampleRange range, const std::string& name);

// "A:B", with A a multiple of samples_per_block. Throws InputError.
[[nodiscard]] SampleRange range_from(const std::string& text);

// As --range and messages have it.
[[nodiscard]] std::string to_string(const SampleRange& range);
[[nodiscard]] std::string to_string(const std::vector<SampleRange>& ranges);

}  // namespace tandem
