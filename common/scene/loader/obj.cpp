// Wavefront OBJ models, by tinyobjloader.
#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <glm/geometric.hpp>
#include <sstream>
#include <string_view>

#include "common/error.h"
#include "common/scene/loader/models.h"
#include "common/scene/loader/parts.h"

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
    Checker(const Place& place, const std::string& shown_name, bool coordinates)
        : place_(place), shown_(shown_name), coordinates_(coordinates) {}

    void read(std::string_view text) {
        constexpr std::string_view byte_order_mark = "\xEF\xBB\xBF";  // some editors write it before UTF-8
        if (text.starts_with(byte_order_mark)) text.remove_prefix(byte_order_mark.size());
        while (!text.empty()) {
            ++line_;
            const std::size_t end = std::min(text.find('\n'), text.size());
            read_line(text.substr(0, end));
            text.remove_prefix(std::min(end + 1, text.size()));
        }
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
        TriangleModel model{std::move(vertices_), {}, {}};
        std::vector<CornerCoordinates> corners;
        for (const tinyobj::shape_t& shape : shapes) {
            const auto& indices = shape.mesh.indices;
            for (std::size_t i = 0; i + 2 < indices.size(); i += 3) {
                model.triangles.push_back({static_cast<std::uint32_t>(indices[i].vertex_index),
                    static_cast<std::uint32_t>(indices[i + 1].vertex_index),
                    static_cast<std::uint32_t>(indices[i + 2].vertex_index)});
                if (coordinates_) corners.push_back(corners_of(&indices[i]));
            }
        }
        if (model.triangles.size() != expected_triangles_) refuse_polygon(0);
        check_fronts(model);
        if (coordinates_) set_coordinates(model, corners);
        return model;
    }

private:
    // A face with its place in the file; its corners − 2 triangles follow those of the face before.
    struct Face {
        std::size_t line, corners;
    };

    [[noreturn]] void refuse_polygon(std::size_t line) {
        line_ = line;
        refuse("a polygon cannot be cut into triangles", "export the model as triangles");
    }

    // A face has coordinates at all its corners or at none (read_face).
    CornerCoordinates corners_of(const tinyobj::index_t* corner) const {
        if (corner->texcoord_index < 0) return default_coordinates;
        CornerCoordinates result;
        for (std::size_t i = 0; i < 3; ++i)
            result[i] = texture_coordinates_[static_cast<std::size_t>(corner[i].texcoord_index)];
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

    static std::string_view next_word(std::string_view& line) {
        constexpr std::string_view blank = " \t\r";
        line.remove_prefix(std::min(line.find_first_not_of(blank), line.size()));
        const std::string_view word = line.substr(0, line.find_first_of(blank));
        line.remove_prefix(word.size());
        return word;
    }

    void read_line(std::string_view line) {
        const std::string_view statement = next_word(line);
        if (statement == "v") read_vertex(line);
        if (statement == "vt" && coordinates_) read_coordinates(line);
        if (statement == "f") read_face(line);
    }

    // The next word of `line` as a number, at most `greatest` in magnitude.
    double read_number(std::string_view& line, double greatest, const std::string& mend) const {
        std::string_view word = next_word(line);
        if (word.starts_with('+')) word.remove_prefix(1);
        double number = 0.0;
        const auto [end, status] = std::from_chars(word.data(), word.data() + word.size(), number);
        if (word.empty() || status != std::errc() || end != word.data() + word.size() ||
            !(std::abs(number) <= greatest))
            refuse(fmt::format("\"{}\" is no coordinate", printable(word)), mend);
        return number;
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

    void read_face(std::string_view line) {
        std::size_t corners = 0, with_coordinates = 0;
        faces_ += 'f';
        for (std::string_view word = next_word(line); !word.empty(); word = next_word(line), ++corners) {
            const std::size_t slash = std::min(word.find('/'), word.size());
            const std::int64_t vertex = read_index(word.substr(0, slash), vertices_.size(), "vertex");
            fmt::format_to(std::back_inserter(faces_), " {}", vertex);
            word.remove_prefix(std::min(slash + 1, word.size()));
            const std::string_view second = word.substr(0, word.find('/'));
            if (!coordinates_ || second.empty()) continue;
            fmt::format_to(
                std::back_inserter(faces_), "/{}", read_index(second, texture_coordinates_.size(), "coordinate"));
            ++with_coordinates;
        }
        if (with_coordinates != 0 && with_coordinates != corners)
            refuse("some corners of a face have texture coordinates and others do not", "export the model again");
        faces_ += '\n';
        if (corners < 3) refuse("a face has three corners at least", "export the model again");
        if (corners > greatest_corners)
            refuse(fmt::format("a face has more than {} corners", greatest_corners), "export it as triangles");
        expected_triangles_ += corners - 2;
        face_list_.push_back({line_, corners});
    }

    const Place& place_;
    const std::string& shown_;
    bool coordinates_;  // whether texture coordinates are read
    std::size_t line_ = 0;
    std::size_t expected_triangles_ = 0;
    std::vector<glm::dvec3> vertices_;
    std::vector<glm::dvec2> texture_coordinates_;
    std::vector<Face> face_list_;
    std::string faces_;  // the sound part of the file, for tinyobjloader
};

}  // namespace

TriangleModel read_obj(
    const std::filesystem::path& path, const Place& place, const std::string& shown_name, bool coordinates) {
    const std::string text = read_named_file(path, place, shown_name);
    Checker checker(place, shown_name, coordinates);
    checker.read(text);
    return checker.triangulated();
}

}  // namespace tandem::scene_json
