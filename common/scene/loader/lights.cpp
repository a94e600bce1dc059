// Lights of a scene file that are no surfaces: points, spots, suns and the background (MODEL.md section 8).
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>

#include "common/scene/loader/parts.h"

namespace tandem::scene_json {

namespace {

// cos θ_inner − cos θ_outer, by which a spot's penumbra is divided: 2⁻¹⁶ leaves it eight bits of single precision.
constexpr double least_penumbra = 0x1p-16;

glm::dvec3 unit_direction(const Value& value, const glm::dvec3& vector) {
    if (!(glm::length(vector) >= least_length)) value.refuse("has no direction", "name a vector other than 0");
    return glm::normalize(vector);
}

void read_point_light(const Value& value, PunctualLight& light) {
    value.only({"position", "intensity"});
    light.kind = PunctualKind::point;
    light.position = read_point(value.required("position"));
    light.intensity = read_radiance(value.required("intensity"));
}

void read_spot(const Value& value, PunctualLight& light) {
    value.only({"position", "direction", "target", "intensity", "inner_degrees", "outer_degrees"});
    light.kind = PunctualKind::spot;
    light.position = read_point(value.required("position"));
    if (value.has("direction") == value.has("target"))
        value.refuse("a spot has either a direction or a target", "write one of the two");
    if (value.has("direction")) {
        light.direction = unit_direction(value.member("direction"), read_point(value.member("direction")));
    } else {
        const Value target = value.member("target");
        light.direction = unit_direction(target, read_point(target) - light.position);
    }
    light.intensity = read_radiance(value.required("intensity"));
    light.inner_degrees = value.required("inner_degrees").number(0.0, 90.0);
    light.outer_degrees = value.required("outer_degrees").number(0.0, 90.0);
    const double penumbra = std::cos(glm::radians(light.inner_degrees)) - std::cos(glm::radians(light.outer_degrees));
    if (!(penumbra >= least_penumbra))
        value.refuse(fmt::format("no penumbra lies between {} and {} degrees that single precision resolves",
                         shown(light.inner_degrees), shown(light.outer_degrees)),
            "make the outer angle larger than the inner one");
}

void read_sun(const Value& value, PunctualLight& light) {
    value.only({"direction", "irradiance"});
    light.kind = PunctualKind::sun;
    light.direction = unit_direction(value.required("direction"), read_point(value.member("direction")));
    light.intensity = read_radiance(value.required("irradiance"));
}

void read_image_background(const Value& value, const std::filesystem::path& folder, Background& background) {
    value.only({"image", "colour_space", "scale", "rotation_degrees", "sampled"});
    const bool srgb = value.required("colour_space").choice({"srgb", "linear"}) == 0;
    background.image_scale = optional_number(value, "scale", least_length, 1e9, 1.0);
    background.rotation_degrees = optional_number(value, "rotation_degrees", -1e6, 1e6, 0.0);
    PixelSource source = pixel_source(value.member("image"), folder);
    source.srgb = srgb;
    source.greatest = greatest_length / std::max(1.0, background.image_scale);
    background.image = read_pixels(source);
    background.sampled = true;  // images are for suns and windows, which scattering seldom finds
}

}  // namespace

Background read_background(const Value& value, const std::filesystem::path& folder) {
    Background background;
    if (value.json().is_array()) {
        background.down = background.up = read_radiance(value);
        return background;
    }
    if (value.has("image")) {
        read_image_background(value, folder, background);
    } else if (value.has("radiance")) {
        value.only({"radiance", "sampled"});
        background.down = background.up = read_radiance(value.member("radiance"));
    } else {
        value.only({"down", "up", "radiance", "image", "sampled"});
        background.down = read_radiance(value.required("down"));
        background.up = read_radiance(value.required("up"));
    }
    if (value.has("sampled")) background.sampled = value.member("sampled").boolean();
    return background;
}

PunctualLight read_light(const Value& value) {
    value.only({"name", "point", "spot", "sun"});
    PunctualLight light;
    if (value.has("name")) light.name = value.member("name").text();
    const int kinds = (value.has("point") ? 1 : 0) + (value.has("spot") ? 1 : 0) + (value.has("sun") ? 1 : 0);
    if (kinds != 1) value.refuse(fmt::format("holds {} of point, spot, sun", kinds), "write one an object");
    if (value.has("point")) read_point_light(value.member("point"), light);
    if (value.has("spot")) read_spot(value.member("spot"), light);
    if (value.has("sun")) read_sun(value.member("sun"), light);
    return light;
}

}  // namespace tandem::scene_json
