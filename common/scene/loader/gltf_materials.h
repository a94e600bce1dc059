// The materials of glTF models, read from the model's JSON. scenes/format/FORMAT.md says what becomes of them.
#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "common/scene/loader/json.h"
#include "common/scene/loader/models.h"

namespace tandem::scene_json {

class GltfMaterials {
public:
    // `embedded`: the bytes of the images that stand within the model, by index. It and what `root` views outlive this.
    GltfMaterials(Value root, ModelImages images, const std::map<std::size_t, std::string>& embedded)
        : root_(std::move(root)), images_(std::move(images)), embedded_(embedded) {}

    // The place in take() of the model's material, read when it is first asked for; below 0: glTF's default. Throws
    // InputError.
    [[nodiscard]] std::uint32_t index_of(int material);

    [[nodiscard]] std::vector<ModelMaterial> take() { return std::move(materials_); }
    [[nodiscard]] const std::vector<ModelMaterial>& read_so_far() const { return materials_; }
    // Features that are not taken over.
    [[nodiscard]] std::set<std::string>& passed_over() { return passed_over_; }

private:
    struct Surface;

    [[nodiscard]] ModelMaterial read(const Value& material);
    void read_metal_and_roughness(const Value& material, Surface& surface);
    void read_extensions(const Value& material, Surface& surface);
    void read_volume(const Value& volume, Surface& surface);
    void note_losses(const Value& material, const Surface& surface);
    [[nodiscard]] std::shared_ptr<const Pixels> read_texture(
        const Value& reference, bool srgb, const glm::dvec3& factor);
    [[nodiscard]] Value element(std::string_view list, const Value& index) const;

    Value root_;
    ModelImages images_;
    const std::map<std::size_t, std::string>& embedded_;
    std::map<int, std::uint32_t> index_;
    std::vector<ModelMaterial> materials_;
    std::set<std::string> passed_over_;
};

}  // namespace tandem::scene_json
