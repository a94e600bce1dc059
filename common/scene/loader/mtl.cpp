#include "common/scene/loader/mtl.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

#include "common/error.h"

namespace tandem::scene_json {

namespace {

constexpr std::string_view blank = " \t\r";
constexpr double greatest_index = 1e3, least_index = 1e-3;  // of refraction, as in scene files
constexpr int greatest_illumination = 10;

// Statements without a meaning for a path tracer: ambient light, the sharpness of reflections from maps, and how maps
// are smoothed. Ns counts only with Ks.
constexpr std::string_view meaningless[] = {"Ka", "map_Ka", "Ns", "sharpness", "map_aat"};

class MtlReader {
public:
    MtlReader(const Place& place, const std::string& shown_name) : place_(place), shown_(shown_name) {}

    std::map<std::string, MtlMaterial, std::less<>> read(std::string_view text) {
        for_each_line(text, [&](std::string_view line) {
            ++line_;
            read_line(line);
        });
        return std::move(materials_);
    }

private:
    [[noreturn]] void refuse(const std::string& reason, const std::string& mend) const {
        throw input_error(
            place_.file, place_.pointer, fmt::format("{}: line {}: {}", printable(shown_), line_, reason), mend);
    }

    void read_line(std::string_view line) {
        const std::string_view statement = next_word(line);
        if (statement.empty() || statement.starts_with('#')) return;
        if (statement == "newmtl") {
            const std::string name(rest_of(line));
            if (name.empty()) refuse("a material without a name", "name it");
            const auto [place, added] = materials_.emplace(name, MtlMaterial{});
            if (!added) refuse("material \"" + printable(name) + "\" stands twice", "remove one");
            material_ = &place->second;
            material_->name = name;
            return;
        }
        if (material_ == nullptr) refuse("a statement before the first newmtl", "export the model again");
        read_statement(statement, line);
    }

    void read_statement(std::string_view statement, std::string_view line) {
        MtlMaterial& material = *material_;
        if (statement == "Kd") {
            material.diffuse = read_colour(line, 1.0);
        } else if (statement == "Ks") {
            material.specular = read_colour(line, 1.0);
        } else if (statement == "Ke") {
            material.emission = read_colour(line, greatest_length);
        } else if (statement == "Tf") {
            material.filter = read_colour(line, 1.0);
        } else if (statement == "Ni") {
            material.index = read_number(line, least_index, greatest_index);
        } else if (statement == "d") {
            material.dissolve = read_number(line, 0.0, 1.0);
        } else if (statement == "Tr") {
            material.dissolve = 1.0 - read_number(line, 0.0, 1.0);
        } else if (statement == "illum") {
            const double model = read_number(line, 0.0, greatest_illumination);
            if (model != std::floor(model)) refuse("illum is no whole number", "write one from 0 to 10");
            material.illumination = static_cast<int>(model);
        } else if (statement == "map_Kd") {
            read_map(line);
        } else if (std::ranges::find(meaningless, statement) == std::end(meaningless)) {
            material.passed_over.insert(printable(statement));
        }
    }

    double read_number(std::string_view& line, double least, double greatest) const {
        const std::string_view word = next_word(line);
        const std::optional<double> number = number_of(word);
        if (!number || !(*number >= least && *number <= greatest))
            refuse(fmt::format("\"{}\" is out of range, or no number", printable(word)),
                fmt::format("keep it from {} to {}", shown(least), shown(greatest)));
        return *number;
    }

    // A single number stands for all three.
    glm::dvec3 read_colour(std::string_view line, double greatest) const {
        std::string_view words = line;
        const std::string_view first = next_word(words);
        if (first == "spectral" || first == "xyz")
            refuse("a colour that is " + std::string(first), "write red, green and blue");
        glm::dvec3 colour(read_number(line, 0.0, greatest));
        if (rest_of(line).empty()) return colour;
        colour.y = read_number(line, 0.0, greatest);
        colour.z = read_number(line, 0.0, greatest);
        return colour;
    }

    // Options stand before the file's name, each with an unknown number of words.
    void read_map(std::string_view line) {
        std::string_view name = rest_of(line);
        if (name.starts_with('-')) {
            material_->passed_over.insert("options of map_Kd");
            name.remove_prefix(name.find_last_of(blank) + 1);  // 0 for none
        }
        if (name.empty() || name.starts_with('/') || name.find('\0') != std::string_view::npos)
            refuse("map_Kd is followed by no relative path", "name the image relative to the MTL file");
        material_->image = std::string(name);
    }

    const Place& place_;
    const std::string& shown_;
    std::size_t line_ = 0;
    std::map<std::string, MtlMaterial, std::less<>> materials_;
    MtlMaterial* material_ = nullptr;
};

// Images of floats hold light as it is, those of 8 or 16 bits what a screen wants.
bool is_encoded(const std::string& name) {
    const std::string ending = std::filesystem::path(name).extension().string();
    return ending != ".pfm" && ending != ".exr" && ending != ".hdr";
}

}  // namespace

std::string_view next_word(std::string_view& line) {
    line.remove_prefix(std::min(line.find_first_not_of(blank), line.size()));
    const std::string_view word = line.substr(0, line.find_first_of(blank));
    line.remove_prefix(word.size());
    return word;
}

std::string_view rest_of(std::string_view line) {
    line.remove_prefix(std::min(line.find_first_not_of(blank), line.size()));
    const std::size_t last = line.find_last_not_of(blank);
    return line.substr(0, last == std::string_view::npos ? 0 : last + 1);
}

std::optional<double> number_of(std::string_view word) {
    if (word.starts_with('+')) word.remove_prefix(1);
    double number = 0.0;
    const auto [end, status] = std::from_chars(word.data(), word.data() + word.size(), number);
    if (word.empty() || status != std::errc() || end != word.data() + word.size() || !std::isfinite(number)) return {};
    return number;
}

std::map<std::string, MtlMaterial, std::less<>> read_mtl(
    const std::filesystem::path& path, const Place& place, const std::string& shown_name) {
    const std::string text = read_named_file(path, place, shown_name);
    return MtlReader(place, shown_name).read(text);
}

ModelMaterial material_of(const MtlMaterial& source, ModelImages& images, std::set<std::string>& passed_over) {
    const glm::dvec3 black(0.0);
    const glm::dvec3 diffuse = source.diffuse.value_or(source.image.empty() ? black : glm::dvec3(1.0));
    const int model = source.illumination;
    const bool glass = model == 4 || model == 6 || model == 7 || model == 9;
    const bool mirror = (model == 3 || model == 5 || model == 8) && diffuse == black;
    passed_over.insert(source.passed_over.begin(), source.passed_over.end());
    const auto lost = [&](bool there, const char* what) {
        if (there) passed_over.insert(what);
    };
    lost(source.dissolve < 1.0 && !glass, "d and Tr of what is not glass by illum");
    lost(source.specular != black && !glass && !mirror, "Ks beside Kd");
    lost(source.emission != black && (glass || mirror), "Ke of glass and mirrors");

    ModelMaterial result;
    Material& material = result.material;
    material.name = source.name;
    if (glass || mirror) {
        material.kind = MaterialKind::specular;
        material.translucent = glass;
        material.colour = glass ? source.filter : source.specular;
        material.refractive_index = source.index;
        return result;
    }
    material.kind = diffuse == black && source.emission != black ? MaterialKind::emissive : MaterialKind::diffuse;
    material.colour = diffuse;
    material.radiance = source.emission;
    if (!source.image.empty() && diffuse != black)
        result.colour_image = images.read(source.image, is_encoded(source.image), diffuse);
    return result;
}

}  // namespace tandem::scene_json
