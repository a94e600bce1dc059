// Materials of a scene file (MODEL.md section 7).
#include <fmt/format.h>

#include "common/scene/loader/parts.h"

namespace tandem::scene_json {

namespace {

constexpr double least_roughness = 0.03;  // below, the lobe of GGX overflows single precision
constexpr std::int32_t greatest_priority = 1'000'000;

constexpr std::string_view translucent_alone[] = {"alpha", "refractive_index", "fresnel", "interior", "priority"};

class MaterialReader {
public:
    MaterialReader(const Value& value, const Names& textures, const Names& media)
        : value_(value), textures_(textures), media_(media) {}

    Material read() {
        value_.only({"kind", "colour", "radiance", "sides", "translucent", "alpha", "fuzz", "refractive_index",
            "fresnel", "roughness", "eta", "k", "interior", "priority"});
        material_.kind = static_cast<MaterialKind>(
            value_.required("kind").choice({"diffuse", "specular", "emissive", "conductor", "boundary"}));
        if (material_.kind != MaterialKind::conductor)
            for (const std::string_view key : {"eta", "k"}) ignored(key, "only a conductor has a complex index");
        switch (material_.kind) {
            case MaterialKind::diffuse:
                read_diffuse();
                break;
            case MaterialKind::specular:
                read_specular();
                break;
            case MaterialKind::emissive:
                read_emissive();
                break;
            case MaterialKind::conductor:
                read_conductor();
                break;
            case MaterialKind::boundary:
                read_boundary();
                break;
        }
        return std::move(material_);
    }

private:
    void ignored(std::string_view key, const std::string& reason) const { without(value_, key, reason); }

    void read_colour() {
        const Value colour = value_.required("colour");
        if (!colour.json().is_object()) {
            material_.colour = colour.vector(0.0, 1.0);
            return;
        }
        colour.only({"texture"});
        material_.colour_texture = textures_.find(colour.required("texture"));
    }

    void read_translucent() {
        material_.translucent = value_.has("translucent") && value_.member("translucent").boolean();
        if (!material_.translucent) {
            for (const std::string_view key : translucent_alone)
                ignored(key, "an opaque material has none, and would ignore it");
            return;
        }
        material_.alpha = optional_number(value_, "alpha", 0.0, 1.0, material_.alpha);
        // Beyond these no medium lies, and single precision loses the squared ratio.
        material_.refractive_index = optional_number(value_, "refractive_index", 1e-3, 1e3, material_.refractive_index);
        if (value_.has("fresnel"))
            material_.fresnel = static_cast<Fresnel>(value_.member("fresnel").choice({"exact", "schlick"}));
        read_interior();
    }

    void read_interior() {
        if (value_.has("interior")) material_.interior = media_.find(value_.member("interior"));
        if (value_.has("priority"))
            material_.priority = value_.member("priority").signed_integer(-greatest_priority, greatest_priority);
    }

    void read_emission() {
        material_.radiance = read_radiance(value_.required("radiance"));
        if (value_.has("sides"))
            material_.sides = static_cast<EmittingSides>(value_.member("sides").choice({"both", "front"}));
    }

    void read_fuzz() { material_.fuzz = optional_number(value_, "fuzz", 0.0, 1.0, material_.fuzz); }

    void read_roughness() {
        if (!value_.has("roughness")) return;
        const Value roughness = value_.member("roughness");
        material_.roughness = roughness.number(0.0, 1.0);
        if (material_.roughness > 0.0 && material_.roughness < least_roughness)
            roughness.refuse(fmt::format("{} is too sharp a lobe for single precision", shown(material_.roughness)),
                fmt::format("write 0 for a smooth surface, or a number from {} to 1", shown(least_roughness)));
    }

    void read_diffuse() {
        ignored("translucent", "a diffuse material is always opaque");
        for (const std::string_view key : {"fuzz", "roughness"}) ignored(key, "a diffuse material has no lobe to blur");
        for (const std::string_view key : translucent_alone)
            ignored(key, "a diffuse material is opaque, and would ignore it");
        read_colour();
        if (value_.has("radiance"))
            read_emission();
        else
            ignored("sides", "without \"radiance\" there is nothing to emit to one side or both");
    }

    void read_specular() {
        for (const std::string_view key : {"radiance", "sides"})
            ignored(key, "a specular material does not emit; an emissive translucent one does both");
        read_colour();
        read_translucent();
        if (!material_.translucent)
            ignored("roughness", "an opaque specular material blurs by \"fuzz\", and would ignore it");
        else if (value_.has("fuzz"))
            ignored("roughness", "fuzz and roughness blur the same lobe");
        read_fuzz();
        read_roughness();
    }

    void read_emissive() {
        read_emission();
        read_translucent();
        ignored("roughness", "an emissive material blurs by \"fuzz\" if at all, and would ignore it");
        if (!material_.translucent)
            for (const std::string_view key : {"colour", "fuzz"})
                ignored(key, "an opaque emissive material reflects nothing, and would ignore it");
        else
            read_colour();
        read_fuzz();
    }

    void read_conductor() {
        for (const std::string_view key : {"radiance", "sides"}) ignored(key, "a conductor does not emit");
        for (const std::string_view key : translucent_alone) ignored(key, "a conductor is opaque, and would ignore it");
        ignored("translucent", "a conductor is always opaque");
        ignored("colour", "a conductor has its colour from \"eta\" and \"k\"");
        ignored("fuzz", "a conductor blurs by \"roughness\"");
        // Between these lie all metals; single precision keeps the fourth powers of section 7.6.
        material_.eta = value_.required("eta").vector(1e-3, 1e3);
        material_.k = value_.required("k").vector(0.0, 1e3);
        read_roughness();
    }

    void read_boundary() {
        for (const std::string_view key :
            {"colour", "radiance", "sides", "translucent", "alpha", "fuzz", "refractive_index", "fresnel", "roughness"})
            ignored(key, "a boundary changes nothing but the medium");
        if (!value_.has("interior") && !value_.has("priority"))
            value_.refuse("a boundary without interior or priority does nothing", "name the medium inside");
        read_interior();
    }

    const Value& value_;
    const Names& textures_;
    const Names& media_;
    Material material_;
};

}  // namespace

Material read_material(const Value& value, const std::string& name, const Names& textures, const Names& media) {
    Material material = MaterialReader(value, textures, media).read();
    material.name = name;
    return material;
}

}  // namespace tandem::scene_json
