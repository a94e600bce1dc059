// Wavefront MTL, the materials of OBJ models. scenes/format/FORMAT.md says what becomes of them.
#pragma once

#include <algorithm>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>

#include "common/scene/loader/models.h"

namespace tandem::scene_json {

// A word of a line, which is cut off; empty at its end.
[[nodiscard]] std::string_view next_word(std::string_view& line);
// What is left of a line, without blanks around it.
[[nodiscard]] std::string_view rest_of(std::string_view line);
// Finite, and all of the word.
[[nodiscard]] std::optional<double> number_of(std::string_view word);

// The lines of `text`, one after the other, without a byte order mark.
template <class Visit>
void for_each_line(std::string_view text, const Visit& visit) {
    constexpr std::string_view byte_order_mark = "\xEF\xBB\xBF";  // some editors write it before UTF-8
    if (text.starts_with(byte_order_mark)) text.remove_prefix(byte_order_mark.size());
    while (!text.empty()) {
        const std::size_t end = std::min(text.find('\n'), text.size());
        visit(text.substr(0, end));
        text.remove_prefix(std::min(end + 1, text.size()));
    }
}

// A material as its file has it.
struct MtlMaterial {
    std::string name;
    std::optional<glm::dvec3> diffuse;  // Kd
    glm::dvec3 specular{0.0};           // Ks
    glm::dvec3 emission{0.0};           // Ke
    glm::dvec3 filter{1.0};             // Tf
    double index = 1.5;                 // Ni
    double dissolve = 1.0;              // d, or 1 - Tr
    int illumination = 2;               // illum
    std::string image;                  // map_Kd, relative to the MTL file
    std::set<std::string> passed_over;
};

// Those of the file that an OBJ model at `place` calls `shown`, by name. Throws InputError naming file and line.
[[nodiscard]] std::map<std::string, MtlMaterial, std::less<>> read_mtl(
    const std::filesystem::path& path, const Place& place, const std::string& shown);

// What Tandem has in its place; what is lost is added to `passed_over`. Images are read through `images`, those of the
// folder that the MTL file is in.
[[nodiscard]] ModelMaterial material_of(
    const MtlMaterial& source, ModelImages& images, std::set<std::string>& passed_over);

}  // namespace tandem::scene_json
