// Materials of a scene file, by the rows of common/scene/materials.h.
#include "common/scene/materials.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/scene/loader/parts.h"

namespace tandem::scene_json {

namespace {

class MaterialReader {
public:
    MaterialReader(const Value& value, const Names& textures, const Names& media)
        : value_(value), textures_(textures), media_(media) {}

    Material read() {
        value_.only(material_keys());
        std::vector<std::string_view> names;
        for (const MaterialRow& row : material_rows()) names.push_back(row.name);
        material_.kind = static_cast<MaterialKind>(value_.required("kind").choice(names));
        for (const FieldRule& rule : row_of(material_.kind).rules)
            if (holds(rule)) apply(rule);
        return std::move(material_);
    }

private:
    [[nodiscard]] bool holds(const FieldRule& rule) const {
        using When = FieldRule::When;
        switch (rule.when) {
            case When::opaque:
                return !material_.translucent;
            case When::translucent:
                return material_.translucent;
            case When::with:
                return value_.has(rule.other->key);
            case When::without:
                return !value_.has(rule.other->key);
            case When::always:
                break;
        }
        return true;
    }

    void apply(const FieldRule& rule) {
        const auto given = [&](const MaterialField& field) { return value_.has(field.key); };
        if (rule.action == FieldRule::Action::need_any) {
            if (std::ranges::none_of(rule.fields, given))
                value_.refuse(std::string(rule.reason), std::string(rule.mend));
            return;
        }
        for (const MaterialField& field : rule.fields) {
            if (rule.action == FieldRule::Action::need)
                read_field(field, value_.required(field.key));
            else if (!given(field))
                continue;
            else if (rule.action == FieldRule::Action::refuse)
                value_.member(field.key).refuse(std::string(rule.reason), std::string(rule.mend));
            else
                read_field(field, value_.member(field.key));
        }
    }

    void read_field(const MaterialField& field, const Value& value) {
        if (field.texture != nullptr && value.json().is_object()) {
            value.only({"texture"});
            material_.*field.texture = textures_.find(value.required("texture"));
            return;
        }
        std::visit([&](auto member) { read_into(material_.*member, field, value); }, field.member);
    }

    static void read_into(double& number, const MaterialField& field, const Value& value) {
        number = value.number(field.least, field.greatest);
        if (number > 0.0 && number < field.least_positive)
            value.refuse(fmt::format("{} {}", shown(number), field.too_small),
                fmt::format("write 0 for a smooth surface, or a number from {} to {}", shown(field.least_positive),
                    shown(field.greatest)));
    }
    static void read_into(glm::dvec3& vector, const MaterialField& field, const Value& value) {
        vector = value.vector(field.least, field.greatest);
    }
    static void read_into(bool& flag, const MaterialField& /*field*/, const Value& value) { flag = value.boolean(); }
    static void read_into(EmittingSides& sides, const MaterialField& field, const Value& value) {
        sides = static_cast<EmittingSides>(value.choice(field.choices));
    }
    static void read_into(Fresnel& fresnel, const MaterialField& field, const Value& value) {
        fresnel = static_cast<Fresnel>(value.choice(field.choices));
    }
    void read_into(std::uint32_t& medium, const MaterialField& /*field*/, const Value& value) const {
        medium = media_.find(value);
    }
    static void read_into(std::optional<std::int32_t>& number, const MaterialField& field, const Value& value) {
        number =
            value.signed_integer(static_cast<std::int32_t>(field.least), static_cast<std::int32_t>(field.greatest));
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
