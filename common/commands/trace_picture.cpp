#include "common/commands/trace_picture.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <glm/geometric.hpp>
#include <map>
#include <numbers>
#include <optional>
#include <span>

namespace tandem {

namespace {

using Point = glm::dvec2;

constexpr double panel_side = 480.0, gap = 30.0, top = 60.0;  // of a panel, in SVG's pixels
constexpr const char* colours[] = {"#d33", "#06c", "#2a2", "#a60"};

std::string escaped_for_xml(const std::string& text) {
    std::string escaped;
    for (const char c : text) {
        const std::string_view found = c == '&' ? "&amp;" : c == '<' ? "&lt;" : c == '>' ? "&gt;" : "";
        if (found.empty())
            escaped += static_cast<unsigned char>(c) < 0x20 ? ' ' : c;
        else
            escaped += found;
    }
    return escaped;
}

struct Line {
    glm::dvec3 a, b;
};

void add_box(std::vector<Line>& lines, const glm::dmat4& map, const glm::dvec3& low, const glm::dvec3& high) {
    const auto corner = [&](int i) {
        return glm::dvec3(
            map * glm::dvec4(i & 1 ? high.x : low.x, i & 2 ? high.y : low.y, i & 4 ? high.z : low.z, 1.0));
    };
    for (int i = 0; i < 8; ++i)
        for (const int bit : {1, 2, 4})
            if (!(i & bit)) lines.push_back({corner(i), corner(i | bit)});
}

void add_sphere(std::vector<Line>& lines, const glm::dmat4& map, const glm::dvec3& centre, double radius, int steps) {
    for (int axis = 0; axis < 3; ++axis) {
        const auto at = [&](int i) {
            const double angle = 2.0 * std::numbers::pi * i / steps;
            glm::dvec3 p = centre;
            p[axis] += radius * std::cos(angle), p[(axis + 1) % 3] += radius * std::sin(angle);
            return glm::dvec3(map * glm::dvec4(p, 1.0));
        };
        for (int i = 0; i < steps; ++i) lines.push_back({at(i), at(i + 1)});
    }
}

// Edges of triangles. One that two triangles of a plane share is no edge of the body, and is left out.
class TriangleEdges {
public:
    void add(const std::array<glm::dvec3, 3>& corners) {
        const glm::dvec3 normal = glm::normalize(glm::cross(corners[1] - corners[0], corners[2] - corners[0]));
        for (std::size_t k = 0; k < 3; ++k) {
            const glm::dvec3 &a = corners[k], &b = corners[(k + 1) % 3];
            const auto key = std::minmax({std::array{a.x, a.y, a.z}, std::array{b.x, b.y, b.z}});
            faces_[key].push_back(normal);
        }
    }

    void draw(std::vector<Line>& lines) const {
        const auto place = [](const std::array<double, 3>& p) { return glm::dvec3(p[0], p[1], p[2]); };
        for (const auto& [edge, normals] : faces_)
            if (normals.size() != 2 || !(std::abs(glm::dot(normals[0], normals[1])) > 1.0 - flat))
                lines.push_back({place(edge.first), place(edge.second)});
    }

private:
    static constexpr double flat = 1e-6;  // planes that turn by less than a twelfth of a degree
    std::map<std::pair<std::array<double, 3>, std::array<double, 3>>, std::vector<glm::dvec3>> faces_;
};

// A body of more primitives than this is drawn as the box around it: its edges would cover the path.
constexpr std::uint32_t most_primitives = 200;

// So many lines make a great circle. Among many spheres each is small.
int steps_of_circles(const Scene& scene) {
    std::size_t spheres = 1;
    for (const PlacedPrimitive placed : placed_primitives(scene))
        spheres += scene.primitives[placed.primitive].kind == PrimitiveKind::sphere;
    return static_cast<int>(std::clamp<std::size_t>(6000 / spheres, 12, 48));
}

void add_entity(std::vector<Line>& lines, const Scene& scene, const Entity& entity, int steps) {
    const auto vertex = [&](const Primitive& primitive, std::size_t i) {
        return glm::dvec3(scene.vertices[primitive.index[i]]);
    };
    glm::dvec3 low(std::numeric_limits<double>::infinity()), high = -low;
    TriangleEdges edges;
    for (std::uint32_t i = 0; i < entity.primitive_count; ++i) {
        const Primitive& p = scene.primitives[entity.first_primitive + i];
        const std::size_t points = p.kind == PrimitiveKind::triangle ? 3 : p.kind == PrimitiveKind::cuboid ? 2 : 1;
        if (entity.primitive_count > most_primitives) {
            for (std::size_t k = 0; k < points; ++k) {
                low = glm::min(low, vertex(p, k) - p.radius);
                high = glm::max(high, vertex(p, k) + p.radius);
            }
        } else if (p.kind == PrimitiveKind::triangle) {
            const auto world = [&](std::size_t k) {
                return glm::dvec3(entity.object_to_world * glm::dvec4(vertex(p, k), 1.0));
            };
            edges.add({world(0), world(1), world(2)});
        } else if (p.kind == PrimitiveKind::cuboid) {
            add_box(lines, entity.object_to_world, vertex(p, 0), vertex(p, 1));
        } else {
            add_sphere(lines, entity.object_to_world, vertex(p, 0), p.radius, steps);
        }
    }
    edges.draw(lines);
    if (entity.primitive_count > most_primitives) add_box(lines, entity.object_to_world, low, high);
}

// Maps a line to a panel; nothing where no part of it can be seen.
using View = std::function<std::optional<std::pair<Point, Point>>(const Line&)>;

View view_of_camera(const Camera& camera, const RenderSettings& settings, double scale) {
    const glm::dvec3 f = glm::normalize(camera.target - camera.position), r = glm::normalize(glm::cross(f, camera.up)),
                     v = glm::cross(r, f);
    const double h = std::tan(camera.vertical_field_degrees * std::numbers::pi / 360.0);
    const double width = settings.width, height = settings.height;
    return [=](const Line& line) -> std::optional<std::pair<Point, Point>> {
        glm::dvec3 a = line.a - camera.position, b = line.b - camera.position;
        // What is behind the camera has no image. The part before it ends at a thousandth of the line's depth.
        const double in_a = glm::dot(a, f), in_b = glm::dot(b, f), least = 1e-3 * std::max(in_a, in_b);
        if (!(least > 0.0)) return std::nullopt;
        if (in_a < least) a += (least - in_a) / (in_b - in_a) * (b - a);
        if (in_b < least) b += (least - in_b) / (in_a - in_b) * (a - b);
        const auto image = [&](const glm::dvec3& p) {
            const double depth = glm::dot(p, f) * h;
            return scale * Point(0.5 * width + 0.5 * height * glm::dot(p, r) / depth,
                               0.5 * height - 0.5 * height * glm::dot(p, v) / depth);
        };
        return std::pair{image(a), image(b)};
    };
}

// Shows all of `places` with a margin of a tenth.
View view_from_above(const std::vector<glm::dvec3>& places) {
    Point low(places.front().x, places.front().z), high = low;
    for (const glm::dvec3& p : places) low = glm::min(low, Point(p.x, p.z)), high = glm::max(high, Point(p.x, p.z));
    const double extent = std::max({high.x - low.x, high.y - low.y, std::numeric_limits<double>::min()});
    const double scale = 0.8 * panel_side / extent;
    const Point centre = 0.5 * (low + high);
    return [=](const Line& line) {
        const auto plan = [&](const glm::dvec3& p) { return scale * (Point(p.x, p.z) - centre) + 0.5 * panel_side; };
        return std::optional(std::pair{plan(line.a), plan(line.b)});
    };
}

class Panel {
public:
    Panel(std::string& out, std::string name, View view) : out_(out), name_(std::move(name)), view_(std::move(view)) {}

    void line(const Line& line, const std::string& style) { lines(std::span(&line, 1), style); }

    // Each begins where the one before it ends, or anew.
    void lines(std::span<const Line> all, const std::string& style) {
        std::string way, pen;
        for (const Line& line : all) {
            const auto seen = view_(line);
            // A coordinate that SVG readers could not hold is far outside.
            const auto far = [](const Point& p) { return !(std::abs(p.x) < 1e6 && std::abs(p.y) < 1e6); };
            if (!seen || far(seen->first) || far(seen->second)) continue;
            const auto text = [](const Point& p) { return fmt::format("{:.2f} {:.2f}", p.x, p.y); };
            if (pen != text(seen->first)) way += "M" + text(seen->first);
            pen = text(seen->second);
            way += "L" + pen;
        }
        if (!way.empty()) out_ += fmt::format("<path d=\"{}\" {}/>\n", way, style);
    }

    void vertex(const glm::dvec3& place, std::size_t number, const char* colour) {
        const auto seen = view_({place, place});
        if (!seen) return;
        out_ += fmt::format("<circle class=\"{}-{}\" cx=\"{:.3f}\" cy=\"{:.3f}\" r=\"3\" fill=\"{}\"/>", name_, number,
            seen->first.x, seen->first.y, colour);
        label(seen->first, std::to_string(number));
    }

    void name(const glm::dvec3& place, const char* words) {
        if (const auto seen = view_({place, place})) label(seen->first, words);
    }

private:
    // Beside the point, where no other label is; labels of points that lie together form a row or a column.
    void label(const Point& point, const std::string& words) {
        constexpr double high = 13.0, a_letter = 9.0;  // of the font
        const Point size(a_letter * static_cast<double>(words.size()) + 3.0, high);
        const auto free = [&](const Point& at) {
            return std::ranges::none_of(labels_, [&](const auto& other) {
                return std::abs(at.x - other.first.x) < 0.5 * (size.x + other.second.x) &&
                       std::abs(at.y - other.first.y) < 0.5 * (size.y + other.second.y);
            });
        };
        // To the left where the panel ends.
        const double aside = 6.0 + 0.5 * size.x, towards = point.x + aside + 0.5 * size.x > panel_side ? -1.0 : 1.0;
        Point at = point + Point(towards * aside, -10.0);
        for (int i = 0; i < 12 && !free(at); ++i)
            at = point + Point(towards * (aside + a_letter * (i / 2)), i % 2 == 0 ? -10.0 : 12.0);
        labels_.emplace_back(at, size);
        out_ += fmt::format(
            "<text x=\"{:.2f}\" y=\"{:.2f}\" fill=\"#222\">{}</text>\n", at.x - 0.5 * size.x, at.y + 4.0, words);
    }

    std::vector<std::pair<Point, Point>> labels_;  // middles and sizes
    std::string& out_;
    std::string name_;
    View view_;
};

enum class CameraRay { drawn, left_out };  // seen by the camera itself it is a point, or by a lens a misleading line

void draw_path(Panel& panel, const PathTrace& path, double width, const char* colour, double extent, bool numbered,
    CameraRay camera_ray) {
    const std::string style = fmt::format("stroke=\"{}\" stroke-width=\"{}\"", colour, width);
    for (const TracedVertex& v : path.vertices) {
        if (!std::isfinite(v.t)) {
            panel.line({v.origin, v.origin + 0.3 * extent * v.direction}, style + " stroke-dasharray=\"6 4\"");
            continue;
        }
        if (&v != path.vertices.data() || camera_ray == CameraRay::drawn) panel.line({v.origin, v.position}, style);
        if (v.light != glm::dvec3(0.0))
            panel.line({v.position, v.position + 0.15 * extent * v.next_event.direction},
                "stroke=\"#e90\" stroke-width=\"1\" stroke-dasharray=\"2 3\"");
    }
    if (!numbered) return;
    for (std::size_t i = 0; i < path.vertices.size(); ++i)
        if (std::isfinite(path.vertices[i].t)) panel.vertex(path.vertices[i].position, i, colour);
}

// What the view from above shows: the camera and the path's vertices first.
struct Surroundings {
    std::vector<glm::dvec3> places;
    double extent = 0.0;  // of the path
};

Surroundings surroundings_of(
    const Scene& scene, const std::vector<DrawnPath>& paths, const std::vector<Line>& outlines) {
    std::vector<glm::dvec3> places{scene.camera.position};
    for (const DrawnPath& drawn : paths)
        for (const TracedVertex& v : drawn.path->vertices)
            if (std::isfinite(v.t)) places.push_back(v.position);
    if (places.size() == 1) places.push_back(scene.camera.target);
    double extent = 0.0;
    for (const glm::dvec3& place : places) extent = std::max(extent, glm::distance(place, places.front()));
    // What stands around the path is shown whole; a floor without end is not.
    const std::size_t own = places.size();
    for (const Line& line : outlines)
        if (std::max(glm::distance(line.a, places[own - 1]), glm::distance(line.b, places[own - 1])) < extent)
            places.insert(places.end(), {line.a, line.b});
    return {std::move(places), extent};
}

// The picture's beginning, with its title and the names of the paths.
std::string heading(const std::string& title, const std::vector<DrawnPath>& paths) {
    std::string out = fmt::format(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0:.0f}\" height=\"{1:.0f}\" viewBox=\"0 0 {0:.0f} "
        "{1:.0f}\" "
        "font-family=\"sans-serif\" font-size=\"13\">\n"
        "<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n<text x=\"{2}\" y=\"20\">{3}</text>\n",
        2.0 * panel_side + 3.0 * gap, panel_side + top + gap, gap, escaped_for_xml(title));
    for (std::size_t i = 0; i < paths.size(); ++i)
        out += fmt::format("<text x=\"{}\" y=\"42\" fill=\"{}\">{}</text>\n", gap + 90.0 * static_cast<double>(i),
            colours[i % std::size(colours)], escaped_for_xml(paths[i].name));
    return out +
           fmt::format(
               "<text x=\"{}\" y=\"42\" fill=\"#666\" text-anchor=\"end\">dashed: meets nothing; dotted: towards a "
               "light</text>\n",
               2.0 * (panel_side + gap));
}

}  // namespace

std::string trace_picture(const Scene& scene, const RenderSettings& settings, const std::string& title,
    const std::vector<std::uint32_t>& pixel, const std::vector<DrawnPath>& paths) {
    std::vector<Line> outlines;
    const int steps = steps_of_circles(scene);
    for (const Entity& entity : scene.entities) add_entity(outlines, scene, entity, steps);
    const Surroundings around = surroundings_of(scene, paths, outlines);
    const double scale = panel_side / std::max(settings.width, settings.height);
    const double wide = scale * settings.width, high = scale * settings.height;
    std::string out = heading(title, paths);
    const auto panel = [&](const char* name, const char* caption, double x, double width, double height, View view,
                           CameraRay camera_ray) {
        out += fmt::format(
            "<text x=\"{0}\" y=\"{1}\" fill=\"#666\">{2}</text>\n<svg id=\"{3}\" x=\"{0}\" y=\"{4}\" width=\"{5:.2f}\" "
            "height=\"{6:.2f}\" overflow=\"hidden\" fill=\"none\">\n"
            "<rect width=\"100%\" height=\"100%\" stroke=\"#bbb\" fill=\"#fafafa\"/>\n",
            x, top + height + 20.0, caption, name, top, width, height);
        Panel drawing(out, name, std::move(view));
        drawing.lines(outlines, "stroke=\"#bbb\" stroke-width=\"0.7\"");
        // The first is the widest: those that lie upon it leave its rims to be seen.
        for (std::size_t i = 0; i < paths.size(); ++i)
            draw_path(drawing, *paths[i].path, 2.0 + 3.0 * static_cast<double>(paths.size() - 1 - i),
                colours[i % std::size(colours)], around.extent, i == 0, camera_ray);
        if (camera_ray == CameraRay::drawn) drawing.name(scene.camera.position, "camera");
    };
    out += "<g fill=\"#222\">\n";
    panel("plan", "from above: x to the right, z down", gap, panel_side, panel_side, view_from_above(around.places),
        CameraRay::drawn);
    out += "</svg>\n";
    panel("image", "as the camera sees it", 2.0 * gap + panel_side, wide, high,
        view_of_camera(scene.camera, settings, scale), CameraRay::left_out);
    out += fmt::format(
        "<rect id=\"pixel\" x=\"{:.3f}\" y=\"{:.3f}\" width=\"{:.3f}\" height=\"{:.3f}\" stroke=\"#000\" "
        "stroke-width=\"0.5\"/>\n</svg>\n</g>\n</svg>\n",
        scale * pixel[0], scale * pixel[1], scale, scale);
    return out;
}

}  // namespace tandem
