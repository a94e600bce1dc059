// Mitsuba 3 scene XML, for RGB variants. Meshes stand in the world's space, in OBJ files beside.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <map>
#include <numbers>

#include "common/scene/export/export.h"
#include "common/scene/export/parts_json.h"
#include "common/scene/export/shapes.h"
#include "common/text.h"

namespace tandem::scene_export {

namespace {

std::string plain(const std::string& text) {
    std::string safe;
    for (const char c : escaped(text)) {
        if (c == '&') safe += "&amp;";
        if (c == '<') safe += "&lt;";
        if (c == '"') safe += "&quot;";
        if (c == '-') safe += safe.ends_with('-') ? " -" : "-";  // comments hold no two in a row
        if (std::string_view("&<\"-").find(c) == std::string_view::npos) safe += c;
    }
    return safe;
}

std::string triple(const glm::dvec3& v) { return fmt::format("{}, {}, {}", v.x, v.y, v.z); }
std::string rgb_element(const char* name, const glm::dvec3& v) {
    return fmt::format("<rgb name=\"{}\" value=\"{}\"/>", name, triple(v));
}
std::string real_element(const char* name, double v) {
    return fmt::format("<float name=\"{}\" value=\"{}\"/>", name, v);
}

// Mitsuba's images of the sky begin and end with a row at a pole, and their columns run the other way. With rows half
// as far apart as the texels' middles, its bilinear values are those of MODEL.md 8.1.
Pixels sky_image(const Pixels& image) {
    Pixels made{std::max(2U, image.width), 2 * image.height + 1, {}};
    const auto texel = [&](std::uint32_t x, std::uint32_t y, std::size_t c) {
        return image.rgb[3 * (std::size_t{y} * image.width + x % image.width) + c];
    };
    for (std::uint32_t y = 0; y < made.height; ++y)
        for (std::uint32_t x = 0; x < made.width; ++x)
            for (std::size_t c = 0; c < 3; ++c) {
                const std::uint32_t above = y == 0 ? 0 : (y - 1) / 2, below = std::min(y / 2, image.height - 1);
                made.rgb.push_back(0.5F * (texel(made.width - 1 - x, above, c) + texel(made.width - 1 - x, below, c)));
            }
    return made;
}

// The mix of two colours; between rows it is off by (π/1024)²/8 of half their difference.
Pixels sky_image(const Background& background) {
    constexpr std::uint32_t steps = 1024;
    Pixels made{2, steps + 1, {}};
    for (std::uint32_t y = 0; y <= steps; ++y) {
        const glm::dvec3 colour =
            glm::mix(background.down, background.up, (std::cos(std::numbers::pi * y / steps) + 1.0) / 2.0);
        for (int i = 0; i < 6; ++i) made.rgb.push_back(static_cast<float>(colour[i % 3]));
    }
    return made;
}

class MitsubaWriter {
public:
    MitsubaWriter(const Scene& scene, const ExportOptions& options) : scene_(scene), options_(options), names_(scene) {}

    std::vector<ExportedFile> write() {
        text_ = "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n";
        text_ += fmt::format(
            "<!-- {}, written by tandem export. For scalar_rgb, llvm_ad_rgb or cuda_ad_rgb.\n", plain(scene_.name));
        for (const std::string& remark : remarks_on(scene_, Target::mitsuba)) text_ += "     " + plain(remark) + "\n";
        text_ += "-->\n<scene version=\"3.0.0\">\n";
        write_head();
        for (std::size_t i = 0; i < scene_.media.size(); ++i) write_medium(i);
        for (std::size_t i = 0; i < scene_.materials.size(); ++i) write_material(i);
        write_lights();
        for (const Entity& entity : scene_.entities) write_entity(entity);
        text_ += "</scene>\n";
        files_.insert(files_.begin(), {options_.name, text_});
        return std::move(files_);
    }

private:
    void line(const std::string& text, int depth = 1) {
        text_ += std::string(static_cast<std::size_t>(2 * depth), ' ') + text + "\n";
    }

    void write_head() {
        line("<default name=\"samples\" value=\"256\"/>");  // mitsuba -D samples=64 -D seed=7
        line("<default name=\"seed\" value=\"0\"/>");
        const std::uint32_t segments = scene_.defaults.bounces + 1;
        line(fmt::format("<integrator type=\"{}\">", scene_.media.empty() ? "path" : "volpath"));
        line(fmt::format("<integer name=\"max_depth\" value=\"{}\"/>", segments), 2);
        line(fmt::format("<integer name=\"rr_depth\" value=\"{}\"/>", segments + 1), 2);
        line("</integrator>");
        const Camera& camera = scene_.camera;
        const double distance = glm::length(camera.target - camera.position);
        line(fmt::format("<sensor type=\"{}\">", camera.lens_radius > 0.0 ? "thinlens" : "perspective"));
        line(real_element("fov", camera.vertical_field_degrees) + "<string name=\"fov_axis\" value=\"y\"/>", 2);
        line(real_element("near_clip", 1e-4 * distance) + real_element("far_clip", 1e6 * distance), 2);
        if (camera.lens_radius > 0.0)
            line(real_element("aperture_radius", camera.lens_radius) +
                     real_element("focus_distance", camera.focus_distance),
                2);
        line(fmt::format("<transform name=\"to_world\"><lookat origin=\"{}\" target=\"{}\" up=\"{}\"/></transform>",
                 triple(camera.position), triple(camera.target), triple(camera.up)),
            2);
        line(
            "<sampler type=\"independent\"><integer name=\"sample_count\" value=\"$samples\"/><integer name=\"seed\" "
            "value=\"$seed\"/></sampler>",
            2);
        line(fmt::format("<film type=\"hdrfilm\"><integer name=\"width\" value=\"{}\"/><integer name=\"height\" "
                         "value=\"{}\"/><string name=\"pixel_format\" value=\"rgb\"/><string "
                         "name=\"component_format\" value=\"float32\"/><rfilter type=\"box\"/></film>",
                 scene_.film.width, scene_.film.height),
            2);
        if (scene_.medium != no_index) line(medium_reference(scene_.medium, "medium"), 2);
        line("</sensor>");
    }

    [[nodiscard]] std::string medium_reference(std::uint32_t medium, const char* name) const {
        return fmt::format("<ref name=\"{}\" id=\"medium {}\"/>", name, plain(names_.media[medium]));
    }

    void write_medium(std::size_t i) {
        const Medium& medium = scene_.media[i];
        const glm::dvec3 extinction = medium.absorption + medium.scattering;
        glm::dvec3 albedo(0.0);
        for (int c = 0; c < 3; ++c)
            if (extinction[c] > 0.0) albedo[c] = medium.scattering[c] / extinction[c];
        line(fmt::format("<medium type=\"homogeneous\" id=\"medium {}\">", plain(names_.media[i])));
        line(rgb_element("sigma_t", extinction) + rgb_element("albedo", albedo), 2);
        if (medium.anisotropy != 0.0)
            line("<phase type=\"hg\">" + real_element("g", medium.anisotropy) + "</phase>", 2);
        line("</medium>");
    }

    // -- Materials

    std::string colour(const Material& material, const char* name) {
        if (material.colour_texture == no_index) return rgb_element(name, material.colour);
        const Texture& texture = scene_.textures[material.colour_texture];
        if (texture.kind == TextureKind::checker)
            // Mitsuba's has 2 × 2 cells a unit, and it turns the v of OBJ files round.
            return fmt::format(
                "<texture type=\"checkerboard\" name=\"{}\">{}{}<transform name=\"to_uv\"><scale x=\"{}\" "
                "y=\"{}\"/><translate y=\"{}\"/></transform></texture>",
                name, rgb_element("color0", texture.first), rgb_element("color1", texture.second),
                texture.frequency.x / 2.0, -texture.frequency.y / 2.0, texture.frequency.y / 2.0);
        std::string& file = images_[&texture];
        if (file.empty()) {
            file = beside(options_.name, fmt::format(".image{}.pfm", images_.size() - 1));
            files_.push_back({file, pfm_bytes(*texture.image)});
        }
        return fmt::format(
            "<texture type=\"bitmap\" name=\"{}\"><string name=\"filename\" value=\"{}\"/><boolean "
            "name=\"raw\" value=\"true\"/><string name=\"filter_type\" value=\"bilinear\"/><string "
            "name=\"wrap_mode\" value=\"repeat\"/></texture>",
            name, plain(file));
    }

    std::string bsdf(const Material& material) {
        const auto made = [](const char* type, const std::string& parts) {
            return fmt::format("<bsdf type=\"{}\">{}</bsdf>", type, parts);
        };
        const bool rough = material.roughness > 0.0;
        const std::string lobe = rough ? "<string name=\"distribution\" value=\"ggx\"/>" +
                                             real_element("alpha", material.roughness * material.roughness)
                                       : "";
        switch (material.kind) {
            case MaterialKind::emissive:
                return made("diffuse", rgb_element("reflectance", glm::dvec3(0.0)));
            case MaterialKind::boundary:
                return made("null", "");
            case MaterialKind::conductor:
                return made("twosided", made(rough ? "roughconductor" : "conductor",
                                            rgb_element("eta", material.eta) + rgb_element("k", material.k) + lobe));
            case MaterialKind::specular: {
                if (!material.translucent)
                    return made("twosided", made("conductor", "<string name=\"material\" value=\"none\"/>" +
                                                                  colour(material, "specular_reflectance")));
                Material tint = material;
                tint.colour = 1.0 - material.alpha * (1.0 - material.colour);
                if (material.alpha == 0.0) tint.colour_texture = no_index;
                return made(rough ? "roughdielectric" : "dielectric",
                    real_element("int_ior", material.refractive_index) + real_element("ext_ior", 1.0) + lobe +
                        colour(tint, "specular_reflectance") + colour(tint, "specular_transmittance"));
            }
            case MaterialKind::diffuse:
            case MaterialKind::rough_diffuse:  // of roughness 0
                break;
        }
        return made("twosided", made("diffuse", colour(material, "reflectance")));
    }

    void write_material(std::size_t i) {
        std::string text = bsdf(scene_.materials[i]);
        text.insert(text.find('>'), fmt::format(" id=\"{}\"", plain(names_.materials[i])));
        line(text);
    }

    // -- Lights

    void write_background() {
        const Background& background = scene_.background;
        if (!background.image && background.down == background.up) {
            if (background.up != glm::dvec3(0.0))
                line("<emitter type=\"constant\">" + rgb_element("radiance", background.up) + "</emitter>");
            return;
        }
        const std::string file = beside(options_.name, ".sky.pfm");
        files_.push_back({file, pfm_bytes(background.image ? sky_image(*background.image) : sky_image(background))});
        line(
            fmt::format("<emitter type=\"envmap\"><string name=\"filename\" value=\"{}\"/>{}<transform "
                        "name=\"to_world\"><rotate y=\"1\" angle=\"{}\"/></transform></emitter>",
                plain(file), real_element("scale", background.image ? background.image_scale : 1.0),
                90.0 + background.rotation_degrees));
    }

    void write_lights() {
        write_background();
        for (const PunctualLight& light : scene_.lights)
            if (light.kind == PunctualKind::point)
                line(fmt::format("<emitter type=\"point\"><point name=\"position\" value=\"{}\"/>{}</emitter>",
                    triple(light.position), rgb_element("intensity", light.intensity)));
            else
                line(fmt::format("<emitter type=\"directional\"><vector name=\"direction\" value=\"{}\"/>{}</emitter>",
                    triple(light.direction), rgb_element("irradiance", light.intensity)));
    }

    // -- Shapes

    void write_shape(const Entity& entity, const std::string& type, const std::string& parts) {
        const Material& material = scene_.materials[entity.material];
        line(fmt::format("<shape type=\"{}\">  <!-- {} -->", type, plain(entity.name)));
        line(parts, 2);
        line(fmt::format("<ref id=\"{}\"/>", plain(names_.materials[entity.material])), 2);
        if (material.interior != no_index) line(medium_reference(material.interior, "interior"), 2);
        const bool tracked = material.interior != no_index || material.kind == MaterialKind::boundary;
        if (tracked && scene_.medium != no_index) line(medium_reference(scene_.medium, "exterior"), 2);
        if (material.radiance != glm::dvec3(0.0))
            line("<emitter type=\"area\">" + rgb_element("radiance", material.radiance) + "</emitter>", 2);
        line("</shape>");
    }

    void write_entity(const Entity& entity) {
        const glm::dmat4& map = entity.object_to_world;
        for (const bool smooth : {false, true}) write_mesh(entity, triangles_of(scene_, entity, smooth));
        for (std::size_t p = 0; p < entity.primitive_count; ++p) {
            const Primitive& primitive = scene_.primitives[entity.first_primitive + p];
            const glm::dvec3& first = scene_.vertices[primitive.index[0]];
            if (primitive.kind == PrimitiveKind::cuboid)
                write_mesh(entity, cuboid(first, scene_.vertices[primitive.index[1]]));
            if (primitive.kind != PrimitiveKind::sphere) continue;
            const glm::dvec3 centre(map * glm::dvec4(first, 1.0));
            write_shape(entity, "sphere",
                fmt::format("<point name=\"center\" value=\"{}\"/>", triple(centre)) +
                    real_element("radius", primitive.radius * glm::length(glm::dvec3(map[0]))));
        }
    }

    // Counter-clockwise in the world too, where the transform mirrors.
    void write_mesh(const Entity& entity, const Mesh& mesh) {
        if (mesh.indices.empty()) return;
        const glm::dmat4& map = entity.object_to_world;
        const glm::dmat3 linear(map), normals = glm::transpose(glm::inverse(linear));
        std::string obj = "# written by tandem export\n";
        for (const glm::dvec3& point : mesh.points) {
            const glm::dvec3 at(map * glm::dvec4(point, 1.0));
            obj += fmt::format("v {} {} {}\n", at.x, at.y, at.z);
        }
        for (const glm::dvec2& at : mesh.coordinates) obj += fmt::format("vt {} {}\n", at.x, at.y);
        for (const glm::dvec3& normal : mesh.normals) {
            const glm::dvec3 n = normals * normal;  // MODEL.md 5.4 interpolates them as long as they come out
            obj += fmt::format("vn {} {} {}\n", n.x, n.y, n.z);
        }
        const bool mirrored = glm::determinant(linear) < 0.0;
        for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
            obj += "f";
            for (const std::size_t k :
                {std::size_t{0}, std::size_t{mirrored ? 2U : 1U}, std::size_t{mirrored ? 1U : 2U}}) {
                const std::uint32_t number = mesh.indices[i + k] + 1;
                obj += fmt::format(" {}", number);
                if (!mesh.coordinates.empty() || !mesh.normals.empty())
                    obj += mesh.coordinates.empty() ? "/" : fmt::format("/{}", number);
                if (!mesh.normals.empty()) obj += fmt::format("/{}", number);
            }
            obj += "\n";
        }
        const std::string file = beside(options_.name, fmt::format(".mesh{}.obj", mesh_count_++));
        files_.push_back({file, obj});
        write_shape(entity, "obj",
            fmt::format("<string name=\"filename\" value=\"{}\"/><boolean name=\"face_normals\" value=\"{}\"/>",
                plain(file), mesh.normals.empty()));
    }

    const Scene& scene_;
    const ExportOptions& options_;
    SceneNames names_;
    std::string text_;
    std::map<const Texture*, std::string> images_;
    std::size_t mesh_count_ = 0;
    std::vector<ExportedFile> files_;
};

}  // namespace

std::vector<ExportedFile> to_mitsuba(const Scene& scene, const ExportOptions& options) {
    return MitsubaWriter(scene, options).write();
}

}  // namespace tandem::scene_export
