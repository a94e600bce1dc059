// Wavefront OBJ models, by tinyobjloader.
#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <glm/geometric.hpp>
#include <optional>
#include <sstream>
#include <string_view>

#include "common/error.h"
#include "common/scene/loader/models.h"
#include "common/scene/loader/mtl.h"

#define TINYOBJLOADER_IMPLEMENTATION
#define TINYOBJLOADER_USE_DOUBLE
#include <tiny_obj_loader.h>

namespace tandem::scene_json {

namespace {

// Ear clipping takes cubic time in the corners of a face; real models stay far below.
constexpr std::size_t greatest_corners = 64;

// tinyobjloader reads what is no number as 0 and what is no index as a warning. So the lines are checked here first,
// and it is given the faces alone, on vertices that are known to be sound.
class Checker {
public:
    Checker(const std::filesystem::path& path, const Place& place, const std::string& shown_name, ModelParts parts)
        : path_(path), place_(place), shown_(shown_name), parts_(parts) {}

    void read(std::string_view text) {
        for_each_line(text, [&](std::string_view line) {
            ++line_;
            read_line(line);
        });
        if (expected_triangles_ == 0) refuse("holds no face", "name a model with triangles");
    }

    TriangleModel triangulated() {
        std::istringstream stream(std::move(faces_));
        tinyobj::attrib_t attributes;
        std::vector<tinyobj::shape_t> shapes;
        std::vector<tinyobj::material_t> materials;
        std::string warning, error;
        if (!tinyobj::LoadObj(&attributes, &shapes, &materials, &warning, &error, &stream, nullptr, true, false))
            refuse("is not a sound OBJ model: " + printable(error), "export it again");
        TriangleModel model;
        model.vertices = std::move(vertices_);
        std::vector<Corners> corners;
        for (const tinyobj::shape_t& shape : shapes) {
            const auto& indices = shape.mesh.indices;
            for (std::size_t i = 0; i + 2 < indices.size(); i += 3) {
                model.triangles.push_back({static_cast<std::uint32_t>(indices[i].vertex_index),
                    static_cast<std::uint32_t>(indices[i + 1].vertex_index),
                    static_cast<std::uint32_t>(indices[i + 2].vertex_index)});
                if (parts_.coordinates || !normals_.empty()) corners.push_back(corners_of(&indices[i]));
            }
        }
        if (model.triangles.size() != expected_triangles_) refuse_polygon(0);
        check_fronts(model);
        set_corners(model, std::move(corners), parts_);
        if (parts_.materials)
            for (const Face& face : face_list_)
                model.material_of.insert(model.material_of.end(), face.corners - 2, face.material);
        model.materials = std::move(used_materials_);
        model.passed_over = std::move(passed_over_);
        return model;
    }

private:
    // A face with its place in the file; its corners − 2 triangles follow those of the face before.
    struct Face {
        std::size_t line, corners;
        std::uint32_t material;
    };

    [[noreturn]] void refuse_polygon(std::size_t line) {
        line_ = line;
        refuse("a polygon cannot be cut into triangles", "export the model as triangles");
    }

    // A face has coordinates at all its corners or at none, and so it is with normals (read_face).
    Corners corners_of(const tinyobj::index_t* corner) const {
        Corners result;
        for (std::size_t i = 0; i < 3; ++i) {
            const int coordinates = corner[i].texcoord_index, normal = corner[i].normal_index;
            if (parts_.coordinates)
                result[i].coordinates = coordinates < 0 ? default_coordinates[i]
                                                        : texture_coordinates_[static_cast<std::size_t>(coordinates)];
            if (normal >= 0) result[i].normal = normals_[static_cast<std::size_t>(normal)];
        }
        return result;
    }

    // A bad cut of a concave polygon shows in a triangle whose front is not the polygon's. The front of the polygon is
    // its vector area, the sum of those of its triangles however they are cut.
    void check_fronts(const TriangleModel& model) {
        const auto vector_area = [&](const std::array<std::uint32_t, 3>& t) {
            const glm::dvec3& a = model.vertices[t[0]];
            return glm::cross(model.vertices[t[1]] - a, model.vertices[t[2]] - a);
        };
        auto triangle = model.triangles.begin();
        for (const Face& face : face_list_) {
            const auto end = triangle + static_cast<std::ptrdiff_t>(face.corners - 2);
            glm::dvec3 front(0.0);
            for (auto t = triangle; t != end; ++t) front += vector_area(*t);
            // Flat triangles, of no area but for rounding, are legal: 2^-40 of the whole lies well above rounding.
            for (; triangle != end; ++triangle)
                if (glm::dot(vector_area(*triangle), front) < -0x1p-40 * glm::dot(front, front))
                    refuse_polygon(face.line);
        }
    }

    [[noreturn]] void refuse(const std::string& reason, const std::string& mend) const {
        const std::string where = line_ == 0 ? "" : fmt::format("line {}: ", line_);
        throw input_error(place_.file, place_.pointer, printable(shown_) + ": " + where + reason, mend);
    }

    void read_line(std::string_view line) {
        const std::string_view statement = next_word(line);
        if (statement == "v") read_vertex(line);
        if (statement == "vt" && parts_.coordinates) read_coordinates(line);
        if (statement == "vn" && parts_.normals) read_normal(line);
        if (statement == "f") read_face(line);
        for (const std::string_view lost : {"l", "p", "curv", "curv2", "surf"})
            if (statement == lost) passed_over_.insert("lines, points and curves");
        if (!parts_.materials) return;
        if (statement == "mtllib") read_library(rest_of(line));
        if (statement == "usemtl") {
            material_name_ = rest_of(line);
            material_ = no_index;
        }
    }

    // One file whose name may have blanks, or several. What two of them define is the first one's.
    void read_library(std::string_view names) {
        const std::filesystem::path folder = path_.parent_path();
        std::error_code error;
        const bool single = std::filesystem::is_regular_file(folder / std::string(names), error);
        while (!names.empty()) {
            const std::string name(single ? names : next_word(names));
            names = single ? std::string_view() : rest_of(names);
            if (std::filesystem::path(name).is_absolute() || name.find('\0') != std::string::npos)
                refuse("mtllib is followed by no relative path", "name the file relative to the model");
            for (auto& [material, source] : read_mtl(folder / name, place_, name))
                materials_.try_emplace(
                    material, NamedMaterial{std::move(source), std::filesystem::path(name).parent_path(), no_index});
        }
        if (!images_) images_.emplace(folder, place_);
    }

    // That of the next faces, read when the first of them comes.
    std::uint32_t current_material() {
        if (material_ != no_index) return material_;
        const auto found = materials_.find(material_name_);
        if (material_name_.empty())
            refuse("a face has no material", "name one in the scene file, or write usemtl before it");
        if (found == materials_.end())
            refuse("material \"" + printable(material_name_) + "\" is in no MTL file of the model",
                "name a material in the scene file, or export the model again");
        if (found->second.index == no_index) {
            found->second.index = static_cast<std::uint32_t>(used_materials_.size());
            MtlMaterial source = found->second.source;
            if (!source.image.empty()) source.image = (found->second.folder / source.image).string();
            used_materials_.push_back(scene_json::material_of(source, *images_, passed_over_));
        }
        return material_ = found->second.index;
    }

    // The next word of `line` as a number, at most `greatest` in magnitude.
    double read_number(std::string_view& line, double greatest, const std::string& mend) const {
        const std::string_view word = next_word(line);
        const std::optional<double> number = number_of(word);
        if (!number || std::abs(*number) > greatest)
            refuse(fmt::format("\"{}\" is no coordinate", printable(word)), mend);
        return *number;
    }

    void read_vertex(std::string_view line) {
        glm::dvec3 vertex;
        for (int axis = 0; axis < 3; ++axis)
            vertex[axis] = read_number(line, greatest_length, "a vertex has three finite numbers, v x y z");
        vertices_.push_back(vertex);
        fmt::format_to(std::back_inserter(faces_), "v {} {} {}\n", vertex.x, vertex.y, vertex.z);
    }

    void read_coordinates(std::string_view line) {
        const std::string mend = fmt::format("write two numbers up to {}, vt u v", shown(greatest_coordinate));
        const double u = read_number(line, greatest_coordinate, mend);
        texture_coordinates_.emplace_back(u, read_number(line, greatest_coordinate, mend));
        faces_ += "vt 0 0\n";  // tinyobjloader only counts them
    }

    // An index of a face, counted from 1, or backwards from the last so far; `what` has `size` entries so far.
    std::int64_t read_index(std::string_view number, std::size_t size, std::string_view what) const {
        std::int64_t index = 0;
        const auto [end, status] = std::from_chars(number.data(), number.data() + number.size(), index);
        if (number.empty() || status != std::errc() || end != number.data() + number.size())
            refuse(fmt::format("\"{}\" is no {} index", printable(number), what), "write whole numbers, f 1 2 3");
        const auto count = static_cast<std::int64_t>(size);
        const std::int64_t absolute = index < 0 ? count + index + 1 : index;  // −1 is the last so far
        if (index == 0 || absolute < 1 || absolute > count)
            refuse(fmt::format("{} {} is not among the {} before it", what, index, count), "export the model again");
        return absolute;
    }

    void read_normal(std::string_view line) {
        glm::dvec3 normal;
        for (int axis = 0; axis < 3; ++axis)
            normal[axis] = read_number(line, greatest_length, "a normal has three finite numbers, vn x y z");
        normals_.push_back(normal);
        faces_ += "vn 0 0 0\n";  // tinyobjloader only counts them
    }

    // Corners of a face by what they name beside their vertex.
    struct CornerCounts {
        std::size_t all = 0, coordinates = 0, normals = 0;
    };

    // "vertex", "vertex/coordinate", "vertex//normal" or all three, to the same of what is read.
    void read_corner(std::string_view word, CornerCounts& counts) {
        const auto next_number = [&] {
            const std::string_view number = word.substr(0, word.find('/'));
            word.remove_prefix(std::min(number.size() + 1, word.size()));
            return number;
        };
        ++counts.all;
        fmt::format_to(std::back_inserter(faces_), " {}", read_index(next_number(), vertices_.size(), "vertex"));
        const std::string_view coordinate = next_number(), normal = next_number();
        const bool has_coordinates = parts_.coordinates && !coordinate.empty();
        const bool has_normal = parts_.normals && !normal.empty();
        if (has_coordinates || has_normal) faces_ += '/';
        if (has_coordinates) {
            fmt::format_to(
                std::back_inserter(faces_), "{}", read_index(coordinate, texture_coordinates_.size(), "coordinate"));
            ++counts.coordinates;
        }
        if (has_normal) {
            fmt::format_to(std::back_inserter(faces_), "/{}", read_index(normal, normals_.size(), "normal"));
            ++counts.normals;
        }
    }

    void read_face(std::string_view line) {
        CornerCounts corners;
        faces_ += 'f';
        for (std::string_view word = next_word(line); !word.empty(); word = next_word(line)) read_corner(word, corners);
        const auto refuse_mixed = [&](std::size_t some, const char* what) {
            if (some != 0 && some != corners.all)
                refuse(fmt::format("some corners of a face have {} and others do not", what), "export the model again");
        };
        refuse_mixed(corners.coordinates, "texture coordinates");
        refuse_mixed(corners.normals, "normals");
        faces_ += '\n';
        if (corners.all < 3) refuse("a face has three corners at least", "export the model again");
        if (corners.all > greatest_corners)
            refuse(fmt::format("a face has more than {} corners", greatest_corners), "export it as triangles");
        expected_triangles_ += corners.all - 2;
        face_list_.push_back({line_, corners.all, parts_.materials ? current_material() : no_index});
    }

    // A material of an MTL file, the folder that holds its images, its place among those used.
    struct NamedMaterial {
        MtlMaterial source;
        std::filesystem::path folder;
        std::uint32_t index = no_index;
    };

    const std::filesystem::path& path_;
    const Place& place_;
    const std::string& shown_;
    ModelParts parts_;
    std::size_t line_ = 0;
    std::size_t expected_triangles_ = 0;
    std::vector<glm::dvec3> vertices_;
    std::vector<glm::dvec2> texture_coordinates_;
    std::vector<glm::dvec3> normals_;
    std::vector<Face> face_list_;
    std::map<std::string, NamedMaterial, std::less<>> materials_;
    std::optional<ModelImages> images_;  // where there is an MTL file
    std::string material_name_;
    std::uint32_t material_ = no_index;  // the one of that name, once it is read
    std::vector<ModelMaterial> used_materials_;
    std::set<std::string> passed_over_;
    std::string faces_;  // the sound part of the file, for tinyobjloader
};

}  // namespace

TriangleModel read_obj(
    const std::filesystem::path& path, const Place& place, const std::string& shown_name, ModelParts parts) {
    const std::string text = read_named_file(path, place, shown_name);
    Checker checker(path, place, shown_name, parts);
    checker.read(text);
    return checker.triangulated();
}

}  // namespace tandem::scene_json
