// The part of pbrt-v4's scene text that Tandem has a word for. What it has none for is refused, with the line; settings
// of the renderer that change no mean are named as not taken over. Meshes come to stand in OBJ files beside the scene
// file.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/gtc/matrix_transform.hpp>
#include <glm/matrix.hpp>
#include <glm/trigonometric.hpp>
#include <map>
#include <optional>
#include <set>

#include "common/error.h"
#include "common/files/read_file.h"
#include "common/scene/export/parts_json.h"
#include "common/scene/import/import.h"
#include "common/scene/import/pbrt_state.h"
#include "common/text.h"

namespace tandem::scene_import {

namespace {

using scene_export::matrix_json;
using scene_export::vector_json;

constexpr std::size_t greatest_bytes = std::size_t{128} << 20;

class PbrtImport : PbrtState {
public:
    PbrtImport(const std::filesystem::path& file, const std::filesystem::path& out)
        : PbrtState(file.string(), read_file(file, greatest_bytes)), folder_(file.parent_path()), out_(out) {}

    ImportedScene read() {
        Json& document = result_.document;
        document = {{"description", "Imported from " + std::filesystem::path(file_).filename().string()},
            {"entities", Json::array()}, {"background", {0.0, 0.0, 0.0}}};
        while (at_ < tokens_.size()) directive();
        if (!states_.empty()) refuse("ends within an AttributeBegin", "close it");
        if (!document.contains("camera")) refuse("has no Camera", "add one");
        if (!document.contains("film")) document["film"] = {{"width", 1280}, {"height", 720}};
        set_field();
        if (!outer_medium_.empty()) document["medium"] = outer_medium_;
        if (!document.contains("render")) document["render"] = {{"integrator", "next-event"}, {"bounces", 5}};
        result_.inputs.push_back(file_);
        return std::move(result_);
    }

private:
    void remark(const std::string& what) {
        if (remarked_.insert(what).second) result_.remarks.push_back("is imported without " + what);
    }

    // -- Directives

    void directive() {
        const Token token = next("a directive");
        const std::string& name = token.text;
        if (token.quoted) refuse("\"" + printable(name) + "\" stands where a directive should", "remove it");
        if (transform_directive(name) || state_directive(name)) return;
        if (name == "Camera") return camera();
        if (name == "Film") return film();
        if (name == "Integrator") return integrator();
        if (name == "PixelFilter") {
            const std::string kind = text("a filter");
            (void)parameters();
            if (kind != "box")
                remark("the " + printable(kind) + " filter: Tandem's is a box of one pixel, or what --filter says");
            return;
        }
        if (name == "Sampler" || name == "Option" || name == "ColorSpace" || name == "Accelerator") {
            const Token& first = next("a name");
            if (name == "ColorSpace" && first.text != "srgb")
                refuse("the colour space " + printable(first.text), "use srgb");
            if (name == "Option") --at_;
            (void)parameters();
            return;
        }
        if (name == "WorldBegin") {
            state_ = State{};
            state_.transform = named_systems_["world"] = world_;
            return;
        }
        if (name == "LightSource") return light();
        if (name == "AreaLightSource") return area_light();
        if (name == "Material") {
            const std::string kind = text("a material");
            return material("", kind, parameters());
        }
        if (name == "MakeNamedMaterial") {
            const std::string own = text("a name");
            const Parameters all = parameters();
            return material(own, word(all, "type", ""), all);
        }
        if (name == "NamedMaterial") {
            state_.material = text("a material's name");
            if (!materials_.contains(state_.material))
                refuse("knows no material \"" + printable(state_.material) + "\"", "make it first");
            return;
        }
        if (name == "Texture") return texture();
        if (name == "MakeNamedMedium") return medium();
        if (name == "MediumInterface") {
            state_.inside = text("a medium");
            state_.outside = at_ < tokens_.size() && tokens_[at_].quoted ? text("a medium") : state_.inside;
            return;
        }
        if (name == "Shape") return shape();
        refuse("the directive " + printable(name) + " is none that is imported", "see scenes/format/EXPORT.md");
    }

    // -- Before the world

    void camera() {
        const std::string kind = text("a camera");
        const Parameters all = parameters();
        if (kind != "perspective") refuse("the camera " + printable(kind), "use \"perspective\"");
        if (state_.end_motion != glm::dvec3(0.0)) refuse("a camera that moves", "move the bodies instead");
        glm::dmat4 to_world = glm::inverse(state_.transform);
        glm::dmat3 axes(to_world);
        for (int axis = 0; axis < 3; ++axis) axes[axis] = glm::normalize(axes[axis]);
        if (!(std::abs(std::abs(glm::determinant(axes)) - 1.0) <= 1e-6))
            refuse("the camera is sheared, or looks at its own place",
                "transform it by turns, moves and scales that are alike along all axes");
        // pbrt is left-handed, and its camera looks along z. Tandem is right-handed, so the whole world is mirrored;
        // unless a Scale that mirrors stands before LookAt, as in exports.
        if (glm::determinant(axes) > 0.0) world_[0].x = -1.0;
        to_world = world_ * to_world;
        named_systems_["camera"] = to_world;
        const glm::dvec3 position(to_world[3]), forward = glm::normalize(glm::dvec3(to_world[2]));
        const glm::dvec3 up = glm::normalize(glm::dvec3(to_world[1]));
        Json& camera = result_.document["camera"];
        camera = {
            {"position", vector_json(position)}, {"target", vector_json(position + forward)}, {"up", vector_json(up)}};
        field_ = real(all, "fov", 90.0);
        // pbrt's transforms move over the times 0 to 1, and Tandem's bodies while the shutter is open.
        whole_motion_ = real(all, "shutteropen", 0.0) == 0.0 && real(all, "shutterclose", 1.0) == 1.0;
        if (const double radius = real(all, "lensradius", 0.0); radius > 0.0) {
            camera["lens_radius"] = radius;
            camera["focus_distance"] = real(all, "focaldistance", 1e6);
        } else {
            (void)real(all, "focaldistance", 0.0);
        }
        only(all, "the camera");
        if (!state_.outside.empty()) outer_medium_ = state_.outside;
    }

    std::uint32_t count(const Parameters& all, const char* name, std::uint32_t least, std::uint32_t otherwise) const {
        constexpr double greatest = 1e9;
        const double value = real(all, name, otherwise);
        if (!(value >= least && value <= greatest && value == std::floor(value)))
            refuse(fmt::format("{} is {}", name, value), fmt::format("write a whole number of at least {}", least));
        return static_cast<std::uint32_t>(value);
    }

    // pbrt's field is that of the shorter side of the image.
    void set_field() {
        const Json& film = result_.document["film"];
        const double aspect = film["width"].get<double>() / film["height"].get<double>();
        const double half = std::tan(glm::radians(field_) / 2.0);
        result_.document["camera"]["vertical_field_degrees"] =
            aspect >= 1.0 ? field_ : glm::degrees(2.0 * std::atan(half / aspect));
    }

    void film() {
        (void)text("a film");
        const Parameters all = parameters();
        result_.document["film"] = {
            {"width", count(all, "xresolution", 1, 1280)}, {"height", count(all, "yresolution", 1, 720)}};
        if (const std::string sensor = word(all, "sensor", "cie1931"); sensor != "cie1931")
            remark("the sensor " + printable(sensor) + ", which has colours of its own");
        only(all, "the film", {"filename", "diagonal", "savefp16", "iso", "maxcomponentvalue"});
    }

    void integrator() {
        const std::string kind = text("an integrator");
        const Parameters all = parameters();
        if (kind != "path" && kind != "volpath" && kind != "simplepath" && kind != "simplevolpath")
            refuse("the integrator " + printable(kind), "use \"path\" or \"volpath\"");
        result_.document["render"] = {{"integrator", "next-event"}, {"bounces", count(all, "maxdepth", 0, 5)}};
        only(all, "the integrator", {"regularize", "lightsampler", "samplelights", "samplebsdf"});
    }

    // -- Lights

    glm::dvec3 in_world(const glm::dvec3& point) const { return glm::dvec3(state_.transform * glm::dvec4(point, 1.0)); }

    void light() {
        const std::string kind = text("a light");
        const Parameters all = parameters();
        const double scale = real(all, "scale", 1.0);
        const auto place = [&](const char* name, const glm::dvec3& otherwise) {
            const auto list = vectors<3>(all, name);
            return in_world(list.empty() ? otherwise : list.front());
        };
        Json& lights = result_.document["lights"];
        if (kind == "infinite") {
            if (find(all, "filename") != nullptr)
                refuse("an image of the sky: pbrt-v4's are squares of equal area",
                    "write a latitude-longitude image into the scene file");
            const glm::dvec3 radiance = scale * colour(all, "L").value_or(glm::dvec3(1.0));
            result_.document["background"] = {{"radiance", vector_json(radiance)}, {"sampled", true}};
        } else if (kind == "point") {
            const glm::dvec3 intensity = scale * colour(all, "I").value_or(glm::dvec3(1.0));
            lights.push_back({{"point",
                {{"position", vector_json(place("from", glm::dvec3(0.0)))}, {"intensity", vector_json(intensity)}}}});
        } else if (kind == "spot") {
            const glm::dvec3 from = place("from", glm::dvec3(0.0)), to = place("to", {0.0, 0.0, 1.0});
            const double outer = real(all, "coneangle", 30.0), delta = real(all, "conedeltaangle", 5.0);
            const glm::dvec3 intensity = scale * colour(all, "I").value_or(glm::dvec3(1.0));
            lights.push_back({{"spot", {{"position", vector_json(from)}, {"direction", vector_json(to - from)},
                                           {"intensity", vector_json(intensity)}, {"inner_degrees", outer - delta},
                                           {"outer_degrees", outer}}}});
        } else if (kind == "distant") {
            const glm::dvec3 from = place("from", glm::dvec3(0.0)), to = place("to", {0.0, 0.0, 1.0});
            const glm::dvec3 irradiance = scale * colour(all, "L").value_or(glm::dvec3(1.0));
            lights.push_back(
                {{"sun", {{"direction", vector_json(to - from)}, {"irradiance", vector_json(irradiance)}}}});
        } else {
            refuse("the light " + printable(kind), "use infinite, point, spot or distant");
        }
        if (lights.empty()) result_.document.erase("lights");
        only(all, "the light");
    }

    void area_light() {
        if (const std::string kind = text("a light"); kind != "diffuse")
            refuse("the area light " + printable(kind), "use \"diffuse\"");
        const Parameters all = parameters();
        const double scale = real(all, "scale", 1.0);
        const bool both = word(all, "twosided", "false") == "true";
        state_.emission = Json{{"radiance", vector_json(scale * colour(all, "L").value_or(glm::dvec3(1.0)))},
            {"sides", both ? "both" : "front"}};
        only(all, "the area light");
    }

    // -- Materials, textures, media

    double roughness(const Parameters& all, const std::string& what) const {
        const double value = real(all, "roughness", 0.0);
        const double u = real(all, "uroughness", value), v = real(all, "vroughness", value);
        if (u != v) refuse(what + " is rougher one way than the other", "make both alike");
        if (word(all, "remaproughness", "true") != "false" && u > 0.0)
            refuse(what + " has its roughness remapped",
                "write \"bool remaproughness\" false, and its square root as alpha");
        return std::sqrt(u);
    }

    void material(const std::string& name, const std::string& kind, const Parameters& all) {
        Json json;
        (void)word(all, "type", "");
        if (kind == "diffuse") {
            json["kind"] = "diffuse";
            if (const Parameter* found = find(all, "reflectance"); found != nullptr && found->type == "texture") {
                if (!textures_.contains(found->values.front().text))
                    refuse("knows no texture \"" + printable(found->values.front().text) + "\"", "make it first");
                json["colour"] = {{"texture", found->values.front().text}};
            } else {
                json["colour"] = vector_json(colour(all, "reflectance").value_or(glm::dvec3(0.5)));
            }
        } else if (kind == "dielectric") {
            json = {{"kind", "specular"}, {"translucent", true}, {"colour", {1.0, 1.0, 1.0}}, {"alpha", 0.0},
                {"refractive_index", real(all, "eta", 1.5)}};
            if (const double rough = roughness(all, "a dielectric"); rough > 0.0) json["roughness"] = rough;
        } else if (kind == "conductor") {
            const auto eta = colour(all, "eta"), k = colour(all, "k"), r = colour(all, "reflectance");
            if (r && (eta || k)) refuse("a conductor has a reflectance and an index", "remove one");
            if (!r && !(eta && k)) refuse("a conductor without \"rgb eta\" and \"rgb k\"", "write both");
            json = {{"kind", "conductor"}, {"eta", vector_json(eta.value_or(glm::dvec3(1.0)))},
                {"k", vector_json(r ? 2.0 * glm::sqrt(*r / glm::max(1.0 - *r, 1e-12)) : *k)}};
            if (const double rough = roughness(all, "a conductor"); rough > 0.0) json["roughness"] = rough;
        } else if (kind == "interface" || kind.empty()) {
            json = {{"kind", "boundary"}};
        } else {
            refuse("the material " + printable(kind) + " is none of Tandem's",
                "use diffuse, dielectric, conductor or interface");
        }
        only(all, "the material");
        if (name.empty()) state_.material = fmt::format("material {}", materials_.size());
        materials_[name.empty() ? state_.material : name] = std::move(json);
    }

    void texture() {
        const std::string name = text("a name"), of = text("spectrum"), kind = text("a kind of texture");
        const Parameters all = parameters();
        if (of != "spectrum") refuse("a texture of " + printable(of), "textures are colours");
        Json json;
        if (kind == "imagemap") {
            std::filesystem::path image = folder_ / word(all, "filename", "");
            json = {{"kind", "image"}, {"file", name_beside(image, out_)},
                {"colour_space", word(all, "encoding", "sRGB") == "linear" ? "linear" : "srgb"}};
            if (word(all, "wrap", "repeat") != "repeat")
                refuse("an image that does not repeat", "write \"string wrap\" \"repeat\"");
            (void)word(all, "filter", "bilinear");
        } else if (kind == "checkerboard") {
            const bool solid = real(all, "dimension", 2.0) == 3.0;
            const glm::dvec3 one = colour(all, "tex1").value_or(glm::dvec3(1.0)),
                             two = colour(all, "tex2").value_or(glm::dvec3(0.0));
            json = {{"kind", "checker"}, {"colours", {vector_json(one), vector_json(two)}}};
            if (solid)
                solid_checker(json);
            else
                json.update({{"space", "coordinates"},
                    {"frequency", {real(all, "uscale", 1.0), real(all, "vscale", 1.0), 0.0}}});
        } else {
            refuse("the texture " + printable(kind), "use imagemap or checkerboard");
        }
        only(all, "the texture");
        textures_.insert(name);
        result_.document["textures"][name] = std::move(json);
        if (result_.document["textures"][name].value("space", "") == "object") solid_systems_[name] = outer_system();
    }

    // Tandem's cells lie in the space of the entity: a checker must have been laid out there.
    void check_system(const glm::dmat4& transform) const {
        const Json& material = materials_.at(state_.material);
        if (!material.contains("colour") || !material["colour"].is_object()) return;
        const auto system = solid_systems_.find(material["colour"]["texture"].get<std::string>());
        if (system == solid_systems_.end()) return;
        for (int i = 0; i < 4; ++i)
            if (glm::length(system->second[i] - transform[i]) > 1e-9 * (1.0 + glm::length(transform[i])))
                refuse("a checker that was laid out in another space than its shape", "make it where the shape is");
    }

    // Cells along the axes of the transform; it must be one of scales and half cells, within that of its shapes.
    void solid_checker(Json& json) const {
        json["space"] = "object";
        const glm::dmat4 cells = glm::inverse(glm::inverse(outer_system()) * state_.transform);
        glm::dvec3 frequency;
        for (int axis = 0; axis < 3; ++axis) {
            for (int other = 0; other < 3; ++other)
                if (other != axis && std::abs(cells[other][axis]) > 1e-9)
                    refuse("a checker that is turned against its shape", "turn the shape with it");
            const bool flat = std::abs(cells[axis][axis]) < 1e-9;
            const bool moved =
                flat ? std::fmod(std::floor(cells[3][axis]), 2.0) != 0.0 : std::abs(cells[3][axis]) > 1e-9;
            if (moved) refuse("a checker that is moved against its shape", "move the shape with it");
            frequency[axis] = flat ? 0.0 : cells[axis][axis];
        }
        json["frequency"] = vector_json(frequency);
    }

    void medium() {
        const std::string name = text("a name");
        const Parameters all = parameters();
        if (const std::string kind = word(all, "type", ""); kind != "homogeneous")
            refuse("a medium of type " + printable(kind), "use homogeneous");
        const double scale = real(all, "scale", 1.0);
        const auto coefficient = [&](const char* key, const glm::dvec3& otherwise) {
            return vector_json(scale * colour(all, key).value_or(otherwise));
        };
        Json json{{"absorption", coefficient("sigma_a", {0.0011, 0.0024, 0.014})},
            {"scattering", coefficient("sigma_s", {2.55, 3.21, 3.77})}};
        if (const double g = real(all, "g", 0.0); g != 0.0) json["anisotropy"] = g;
        only(all, "the medium");
        result_.document["media"][name] = std::move(json);
    }

    // The material of a shape here: as it was made, with what it emits and what is inside.
    std::string material_name() {
        if (state_.material.empty()) {
            state_.material = "default";
            materials_["default"] = {{"kind", "diffuse"}, {"colour", {0.5, 0.5, 0.5}}};
        }
        Json json = materials_[state_.material];
        std::string name = state_.material;
        if (state_.emission) {
            if (json["kind"] != "diffuse") refuse("a lamp that is no diffuse surface", "give it \"diffuse\"");
            const bool black = json["colour"] == Json{0.0, 0.0, 0.0};
            if (black) json = {{"kind", "emissive"}};
            json.update(*state_.emission);
            name += " that emits";
        }
        const bool transparent = json["kind"] == "boundary" || json.contains("translucent");
        if (transparent && !state_.inside.empty()) {
            json["interior"] = state_.inside;
            name += " of " + state_.inside;
        }
        if (transparent && state_.inside.empty() && !state_.outside.empty())
            refuse("a body that keeps the medium around it out", "give it a medium inside");
        Json& all = result_.document["materials"];
        for (int number = 2; all.contains(name) && all[name] != json; ++number)
            name = fmt::format("{} {}", name, number);
        all[name] = std::move(json);
        return name;
    }

    // -- Shapes

    void shape() {
        const std::string kind = text("a shape");
        const Parameters all = parameters();
        Json entity{{"material", material_name()}};
        glm::dmat4 transform = state_.transform;
        const bool mirrored = glm::determinant(glm::dmat3(glm::inverse(world_) * transform)) < 0.0;
        if (kind == "sphere") {
            const double radius = real(all, "radius", 1.0);
            for (const char* key : {"zmin", "zmax"})
                if (std::abs(std::abs(real(all, key, radius)) - radius) > 1e-6 * radius)
                    refuse("a part of a sphere", "use a whole one");
            if (std::abs(real(all, "phimax", 360.0)) < 360.0) refuse("a part of a sphere", "use a whole one");
            // Outside is the front, which pbrt turns by a mirroring transform; its poles lie along z.
            if (mirrored != state_.reverse && state_.emission)
                refuse("a sphere whose front is inside", "add ReverseOrientation");
            transform =
                glm::rotate(glm::rotate(transform, glm::radians(180.0), {0, 0, 1}), glm::radians(90.0), {1, 0, 0});
            // Moved alone, it is a sphere in the space around it.
            glm::dvec3 centre(0.0);
            const glm::dmat4 local = glm::inverse(outer_system()) * transform;
            if (glm::length(local[0] - glm::dvec4(1, 0, 0, 0)) + glm::length(local[1] - glm::dvec4(0, 1, 0, 0)) +
                    glm::length(local[2] - glm::dvec4(0, 0, 1, 0)) <
                1e-9) {
                centre = glm::dvec3(local[3]);
                transform = outer_system();
            }
            entity["primitives"] = {{{"sphere", {{"centre", vector_json(centre)}, {"radius", radius}}}}};
        } else if (kind == "trianglemesh") {
            entity["primitives"] = mesh(all);
        } else {
            refuse("the shape " + printable(kind), "use sphere or trianglemesh");
        }
        only(all, "the shape", {"alpha"});
        check_system(transform);
        if (transform != glm::dmat4(1.0)) entity["transform"] = {{{"matrix", matrix_json(transform)}}};
        if (state_.end_motion != glm::dvec3(0.0)) {
            if (!whole_motion_)
                refuse("a shape that moves while the shutter is open for another time than from 0 to 1",
                    "leave shutteropen and shutterclose out");
            entity["motion"] = vector_json(state_.end_motion);
        }
        result_.document["entities"].push_back(std::move(entity));
    }

    bool takes_coordinates(const Json& material) const {
        if (!material.contains("colour") || !material["colour"].is_object()) return false;
        return !solid_systems_.contains(material["colour"]["texture"].get<std::string>());
    }

    Json mesh(const Parameters& all) {
        const auto points = vectors<3>(all, "P"), normals = vectors<3>(all, "N");
        const auto coordinates = vectors<2>(all, "uv");
        const Parameter* found = find(all, "indices");
        std::vector<std::size_t> indices{0, 1, 2};
        if (found == nullptr && points.size() != 3) refuse("a mesh without indices", "write three a triangle");
        if (found != nullptr) {
            indices.clear();
            for (const Token& token : found->values) {
                const double value = number_of(token);
                if (!(value >= 0.0 && value < static_cast<double>(points.size()) && value == std::floor(value)))
                    refuse(fmt::format("vertex {} is not among {}", value, points.size()), "write it again");
                indices.push_back(static_cast<std::size_t>(value));
            }
        }
        if (indices.size() % 3 != 0 || points.size() < 3)
            refuse("a mesh of no whole triangles", "write three indices each");
        if ((!normals.empty() && normals.size() != points.size()) ||
            (!coordinates.empty() && coordinates.size() != points.size()))
            refuse("a mesh has not one N and uv a point", "write one each");
        // Where a mesh has no coordinates and its material asks for some, corners have pbrt's: not Tandem's own.
        constexpr std::array<const char*, 3> corner_coordinates{"0 0", "1 0", "1 1"};
        const bool own_coordinates = coordinates.empty() && takes_coordinates(materials_.at(state_.material));
        if (state_.reverse)
            for (std::size_t i = 0; i < indices.size(); i += 3) std::swap(indices[i + 1], indices[i + 2]);
        std::string obj = "# imported from " + std::filesystem::path(file_).filename().string() + "\n";
        for (const glm::dvec3& p : points) obj += fmt::format("v {} {} {}\n", p.x, p.y, p.z);
        for (const glm::dvec2& at : coordinates) obj += fmt::format("vt {} {}\n", at.x, at.y);
        if (own_coordinates)
            for (const char* corner : corner_coordinates) obj += fmt::format("vt {}\n", corner);
        for (const glm::dvec3& n : normals) obj += fmt::format("vn {} {} {}\n", n.x, n.y, n.z);
        for (std::size_t i = 0; i < indices.size(); ++i) {
            const std::size_t number = indices[i] + 1;
            obj += i % 3 == 0 ? "f" : "";
            obj += fmt::format(" {}", number);
            const std::size_t corner = state_.reverse ? (3 - i % 3) % 3 : i % 3;  // before the swap
            if (own_coordinates)
                obj += fmt::format("/{}", corner + 1);
            else if (!coordinates.empty() || !normals.empty())
                obj += coordinates.empty() ? "/" : fmt::format("/{}", number);
            if (!normals.empty()) obj += fmt::format("/{}", number);
            obj += i % 3 == 2 ? "\n" : "";
        }
        const std::string name = scene_export::beside(out_.filename().string(), fmt::format(".mesh{}.obj", meshes_++));
        result_.files.push_back({name, obj});
        return {{{"obj", {{"file", name}}}}};
    }

    std::filesystem::path folder_, out_;
    std::size_t meshes_ = 0;
    std::string outer_medium_;
    double field_ = 90.0;
    bool whole_motion_ = true;
    std::map<std::string, Json> materials_;
    std::set<std::string> textures_, remarked_;
    std::map<std::string, glm::dmat4> solid_systems_;
    ImportedScene result_;
};

}  // namespace

ImportedScene from_pbrt(const std::filesystem::path& file, const std::filesystem::path& out) {
    return PbrtImport(file, out).read();
}

}  // namespace tandem::scene_import
