// pbrt-v4 scene text. Coordinates stay right-handed: pbrt's are left-handed, so the camera's x is mirrored.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/gtc/matrix_transform.hpp>
#include <glm/trigonometric.hpp>
#include <map>
#include <numbers>

#include "common/scene/export/export.h"
#include "common/scene/export/parts_json.h"
#include "common/scene/export/shapes.h"

namespace tandem::scene_export {

namespace {

std::string numbers(const glm::dvec3& v) { return fmt::format("{} {} {}", v.x, v.y, v.z); }
std::string rgb_parameter(const char* name, const glm::dvec3& v) {
    return fmt::format(" \"rgb {}\" [ {} ]", name, numbers(v));
}
std::string real_parameter(const char* name, double v) { return fmt::format(" \"float {}\" [ {} ]", name, v); }

// Names stand in quotation marks, on one line.
std::string in_quotes(const std::string& name) {
    std::string text = "\"";
    for (const char c : name) text += c == '"' || c == '\\' || static_cast<unsigned char>(c) < ' ' ? '\'' : c;
    return text + '"';
}

// Column by column, as pbrt reads them.
std::string columns(const glm::dmat4& m) {
    std::string text;
    for (int i = 0; i < 16; ++i) text += fmt::format(" {}", m[i / 4][i % 4]);
    return "[" + text + " ]";
}

// MODEL.md 8.1, without the image's scale and rotation.
glm::dvec3 sky_at(const Background& background, const glm::dvec3& d) {
    if (!background.image) return glm::mix(background.down, background.up, (d.y + 1.0) / 2.0);
    const Pixels& image = *background.image;
    const double x = (0.5 + std::atan2(-d.z, d.x) / (2.0 * std::numbers::pi)) * image.width - 0.5;
    const double y = std::clamp(
        std::acos(std::clamp(d.y, -1.0, 1.0)) / std::numbers::pi * image.height - 0.5, 0.0, image.height - 1.0);
    const auto texel = [&](double column, double row) {
        const auto i = static_cast<std::size_t>(std::fmod(column + image.width, image.width));
        const auto j = std::min(static_cast<std::size_t>(row), std::size_t{image.height} - 1);
        const float* rgb = &image.rgb[3 * (j * image.width + i)];
        return glm::dvec3(rgb[0], rgb[1], rgb[2]);
    };
    const double left = std::floor(x), top = std::floor(y);
    return glm::mix(glm::mix(texel(left, top), texel(left + 1.0, top), x - left),
        glm::mix(texel(left, top + 1.0), texel(left + 1.0, top + 1.0), x - left), y - top);
}

// A square that pbrt-v4 folds around the sphere so that equal areas cover equal solid angles: +z is in its middle, −z
// in its corners. [Clarberg 2008, Fast equal-area mapping of the (hemi)sphere using SIMD]
glm::dvec3 on_sphere(double s, double t) {
    const double edge = 1.0 - std::abs(s) - std::abs(t);  // < 0 beyond the equator
    const double radius = 1.0 - std::abs(edge);
    const double azimuth = radius == 0.0 ? 0.0 : std::numbers::pi / 4.0 * (1.0 + (std::abs(t) - std::abs(s)) / radius);
    const double across = radius * std::sqrt(2.0 - radius * radius);
    return {std::copysign(across * std::cos(azimuth), s), std::copysign(across * std::sin(azimuth), t),
        std::copysign(1.0 - radius * radius, edge)};
}

// pbrt looks up the nearest texel; each is the mean of 4 × 4 places.
Pixels equal_area_sky(const Background& background) {
    constexpr std::uint32_t side = 512, places = 4 * side;
    Pixels made{side, side, std::vector<float>(std::size_t{3} * side * side)};
    for (std::uint32_t y = 0; y < places; ++y)
        for (std::uint32_t x = 0; x < places; ++x) {
            const glm::dvec3 radiance =
                sky_at(background, on_sphere((2.0 * x + 1.0) / places - 1.0, (2.0 * y + 1.0) / places - 1.0));
            float* const texel = &made.rgb[3 * (std::size_t{y / 4} * side + x / 4)];
            for (int c = 0; c < 3; ++c) texel[c] += static_cast<float>(radiance[c] / 16.0);
        }
    return made;
}

class PbrtWriter {
public:
    PbrtWriter(const Scene& scene, const ExportOptions& options) : scene_(scene), options_(options), names_(scene) {}

    std::vector<ExportedFile> write() {
        text_ = fmt::format("# {}, written by tandem export --to pbrt\n", in_quotes(scene_.name));
        for (const std::string& remark : remarks_on(scene_, Target::pbrt)) text_ += "# " + remark + "\n";
        write_head();
        text_ += "\nWorldBegin\n";
        write_lights();
        for (std::size_t i = 0; i < scene_.materials.size(); ++i)
            if (scene_.materials[i].colour_texture == no_index)
                write_named_material(scene_.materials[i], names_.materials[i]);
        for (std::size_t i = 0; i < scene_.entities.size(); ++i) write_entity(scene_.entities[i], i);
        files_.insert(files_.begin(), {options_.name, text_});
        return std::move(files_);
    }

private:
    void write_head() {
        const Camera& camera = scene_.camera;
        const glm::dvec3 target = camera.target;
        text_ += "\nScale -1 1 1\n";  // pbrt's images run the other way
        text_ += fmt::format("LookAt {}  {}  {}\n", numbers(camera.position), numbers(target), numbers(camera.up));
        const double half = std::tan(glm::radians(camera.vertical_field_degrees) / 2.0);
        const double aspect = double{1.0} * scene_.film.width / scene_.film.height;
        // pbrt's field is that of the shorter side.
        const double field =
            aspect >= 1.0 ? camera.vertical_field_degrees : glm::degrees(2.0 * std::atan(half * aspect));
        if (scene_.medium != no_index) {
            write_media();
            text_ += fmt::format("MediumInterface \"\" {}\n", in_quotes(names_.media[scene_.medium]));
        }
        text_ += "Camera \"perspective\"" + real_parameter("fov", field);
        if (camera.lens_radius > 0.0)
            text_ += real_parameter("lensradius", camera.lens_radius) +
                     real_parameter("focaldistance", camera.focus_distance);
        text_ += " \"float shutteropen\" [ 0 ] \"float shutterclose\" [ 1 ]\n";
        text_ += fmt::format(
            "Film \"rgb\" \"integer xresolution\" [ {} ] \"integer yresolution\" [ {} ] \"string "
            "filename\" [ {} ] \"string sensor\" [ \"cie1931\" ] \"bool savefp16\" [ false ]\n",
            scene_.film.width, scene_.film.height, in_quotes(beside(options_.name, ".exr")));
        text_ += "PixelFilter \"box\" \"float xradius\" [ 0.5 ] \"float yradius\" [ 0.5 ]\n";
        text_ += "Sampler \"independent\" \"integer pixelsamples\" [ 256 ]\n";
        const bool media = !scene_.media.empty();
        text_ += fmt::format("Integrator \"{}\" \"integer maxdepth\" [ {} ] \"bool regularize\" [ false ]\n",
            media ? "volpath" : "path", scene_.defaults.bounces);
        if (media && scene_.medium == no_index) write_media();
    }

    void write_media() {
        for (std::size_t i = 0; i < scene_.media.size(); ++i) {
            const Medium& medium = scene_.media[i];
            text_ += fmt::format("MakeNamedMedium {} \"string type\" [ \"homogeneous\" ]", in_quotes(names_.media[i]));
            text_ += rgb_parameter("sigma_a", medium.absorption) + rgb_parameter("sigma_s", medium.scattering) +
                     real_parameter("g", medium.anisotropy) + "\n";
        }
    }

    // -- Lights

    void write_background() {
        const Background& background = scene_.background;
        if (!background.image && background.down == background.up) {
            if (background.up != glm::dvec3(0.0))
                text_ += "LightSource \"infinite\"" + rgb_parameter("L", background.up) + "\n";
            return;
        }
        const std::string file = beside(options_.name, ".sky.pfm");
        files_.push_back({file, pfm_bytes(equal_area_sky(background))});
        const bool image = background.image != nullptr;
        text_ += fmt::format(
            "AttributeBegin\nRotate {} 0 1 0\nLightSource \"infinite\" \"string filename\" [ {} ]{}\n"
            "AttributeEnd\n",
            image ? background.rotation_degrees : 0.0, in_quotes(file),
            real_parameter("scale", image ? background.image_scale : 1.0));
    }

    void write_lights() {
        write_background();
        for (const PunctualLight& light : scene_.lights) {
            const glm::dvec3 to = light.position + light.direction;
            if (light.kind == PunctualKind::point)
                text_ += "LightSource \"point\"" + rgb_parameter("I", light.intensity) +
                         fmt::format(" \"point3 from\" [ {} ]\n", numbers(light.position));
            else if (light.kind == PunctualKind::spot)
                text_ +=
                    "LightSource \"spot\"" + rgb_parameter("I", light.intensity) +
                    fmt::format(" \"point3 from\" [ {} ] \"point3 to\" [ {} ]", numbers(light.position), numbers(to)) +
                    real_parameter("coneangle", light.outer_degrees) +
                    real_parameter("conedeltaangle", light.outer_degrees - light.inner_degrees) + "\n";
            else
                text_ += "LightSource \"distant\"" + rgb_parameter("L", light.intensity) +
                         fmt::format(" \"point3 from\" [ 0 0 0 ] \"point3 to\" [ {} ]\n", numbers(light.direction));
        }
    }

    // -- Materials

    // `colour`: the parameter that says it.
    std::string material_text(const Material& material, const std::string& colour) const {
        switch (material.kind) {
            case MaterialKind::diffuse:
            case MaterialKind::rough_diffuse:  // of roughness 0
                return "\"diffuse\"" + colour;
            case MaterialKind::emissive:
                return "\"diffuse\"" + rgb_parameter("reflectance", glm::dvec3(0.0));
            case MaterialKind::conductor:
                return "\"conductor\"" + rgb_parameter("eta", material.eta) + rgb_parameter("k", material.k) +
                       roughness(material);
            case MaterialKind::specular:
                return "\"dielectric\"" + real_parameter("eta", material.refractive_index) + roughness(material);
            case MaterialKind::boundary:
                break;
        }
        return "\"interface\"";
    }

    static std::string roughness(const Material& material) {
        return real_parameter("roughness", material.roughness * material.roughness) +
               " \"bool remaproughness\" [ false ]";
    }

    void write_named_material(const Material& material, const std::string& name) {
        std::string text = material_text(material, rgb_parameter("reflectance", material.colour));
        const std::size_t kind_end = text.find('"', 1) + 1;
        text_ += fmt::format("MakeNamedMaterial {} \"string type\" [ {} ]{}\n", in_quotes(name),
            text.substr(0, kind_end), text.substr(kind_end));
    }

    // Patterns of object space are laid out by the entity's transform, which stands here already.
    std::string texture_text(const Texture& texture, const std::string& name) {
        if (texture.kind == TextureKind::image) {
            std::string& file = images_[&texture];
            if (file.empty()) {
                file = beside(options_.name, fmt::format(".image{}.pfm", images_.size() - 1));
                files_.push_back({file, pfm_bytes(*texture.image)});
            }
            return fmt::format(
                "Texture {} \"spectrum\" \"imagemap\" \"string filename\" [ {} ] \"string encoding\" "
                "[ \"linear\" ] \"string filter\" [ \"bilinear\" ] \"string wrap\" [ \"repeat\" ]\n",
                in_quotes(name), in_quotes(file));
        }
        const bool object = texture.space == TextureSpace::object;
        std::string text = fmt::format(
            "Texture {} \"spectrum\" \"checkerboard\" \"integer dimension\" [ {} ]", in_quotes(name), object ? 3 : 2);
        text += rgb_parameter("tex1", texture.first) + rgb_parameter("tex2", texture.second);
        if (!object)
            return text + real_parameter("uscale", texture.frequency.x) +
                   real_parameter("vscale", texture.frequency.y) + "\n";
        // An axis of frequency 0 lies in the middle of a cell; 2⁻⁴⁰ keeps the matrix invertible.
        glm::dmat4 cells(1.0);
        for (int axis = 0; axis < 3; ++axis) {
            const bool flat = texture.frequency[axis] == 0.0;
            cells[axis][axis] = flat ? 0x1p-40 : texture.frequency[axis];
            cells[3][axis] = flat ? 0.5 : 0.0;
        }
        return "TransformBegin\nConcatTransform " + columns(glm::inverse(cells)) + "\n" + text + "\nTransformEnd\n";
    }

    // -- Shapes

    void write_entity(const Entity& entity, std::size_t number) {
        const Material& material = scene_.materials[entity.material];
        text_ += fmt::format("\nAttributeBegin  # {}\n", in_quotes(entity.name));
        if (entity.motion != glm::dvec3(0.0))
            text_ +=
                fmt::format("ActiveTransform EndTime\nTranslate {}\nActiveTransform All\n", numbers(entity.motion));
        if (entity.object_to_world != glm::dmat4(1.0))
            text_ += "ConcatTransform " + columns(entity.object_to_world) + "\n";
        if (material.interior != no_index || material.kind == MaterialKind::boundary)
            text_ += fmt::format("MediumInterface {} {}\n",
                material.interior == no_index ? in_quotes("") : in_quotes(names_.media[material.interior]),
                scene_.medium == no_index ? in_quotes("") : in_quotes(names_.media[scene_.medium]));
        if (material.colour_texture == no_index) {
            text_ += fmt::format("NamedMaterial {}\n", in_quotes(names_.materials[entity.material]));
        } else {
            const std::string name = fmt::format("texture of entity {}", number);
            text_ += texture_text(scene_.textures[material.colour_texture], name);
            text_ += "Material " +
                     material_text(material, fmt::format(" \"texture reflectance\" [ {} ]", in_quotes(name))) + "\n";
        }
        if (material.radiance != glm::dvec3(0.0))
            text_ += "AreaLightSource \"diffuse\"" + rgb_parameter("L", material.radiance) +
                     fmt::format(" \"bool twosided\" [ {} ]\n", material.sides == EmittingSides::both);
        write_shapes(entity);
        text_ += "AttributeEnd\n";
    }

    void write_shapes(const Entity& entity) {
        for (const bool smooth : {false, true}) write_mesh(triangles_of(scene_, entity, smooth));
        for (std::size_t p = 0; p < entity.primitive_count; ++p) {
            const Primitive& primitive = scene_.primitives[entity.first_primitive + p];
            const glm::dvec3& first = scene_.vertices[primitive.index[0]];
            if (primitive.kind == PrimitiveKind::cuboid) write_mesh(cuboid(first, scene_.vertices[primitive.index[1]]));
            if (primitive.kind != PrimitiveKind::sphere) continue;
            // pbrt's spheres have their poles along z, and their seam half a turn on. Where a transform mirrors, it
            // keeps the fronts of meshes, as Tandem does, and turns those of spheres inside out.
            const bool mirrored = glm::determinant(glm::dmat3(entity.object_to_world)) < 0.0;
            text_ += fmt::format(
                "AttributeBegin\n{}Translate {}\nRotate -90 1 0 0\nRotate 180 0 0 1\nShape \"sphere\" "
                "\"float radius\" [ {} ]\nAttributeEnd\n",
                mirrored ? "ReverseOrientation\n" : "", numbers(first), primitive.radius);
        }
    }

    void write_mesh(const Mesh& mesh) {
        if (mesh.indices.empty()) return;
        text_ += "Shape \"trianglemesh\" \"integer indices\" [";
        for (const std::uint32_t index : mesh.indices) text_ += fmt::format(" {}", index);
        text_ += " ] \"point3 P\" [";
        for (const glm::dvec3& point : mesh.points) text_ += "  " + numbers(point);
        text_ += " ]";
        if (!mesh.normals.empty()) {
            text_ += " \"normal N\" [";
            for (const glm::dvec3& normal : mesh.normals) text_ += "  " + numbers(normal);
            text_ += " ]";
        }
        if (!mesh.coordinates.empty()) {
            text_ += " \"point2 uv\" [";
            for (const glm::dvec2& at : mesh.coordinates) text_ += fmt::format("  {} {}", at.x, at.y);
            text_ += " ]";
        }
        text_ += "\n";
    }

    const Scene& scene_;
    const ExportOptions& options_;
    SceneNames names_;
    std::string text_;
    std::map<const Texture*, std::string> images_;
    std::vector<ExportedFile> files_;
};

}  // namespace

std::vector<ExportedFile> to_pbrt(const Scene& scene, const ExportOptions& options) {
    return PbrtWriter(scene, options).write();
}

}  // namespace tandem::scene_export
