// glTF 2.0 models (.gltf, .glb), by tinygltf, whose header stays in this file. It trusts much of what a file says. So
// the JSON is held to our limits first, and every offset is checked before data are read.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <glm/geometric.hpp>
#include <glm/gtc/matrix_access.hpp>
#include <glm/gtc/matrix_transform.hpp>
#include <glm/gtc/quaternion.hpp>
#include <map>
#include <optional>
#include <string_view>

#include "common/error.h"
#include "common/scene/loader/gltf_materials.h"
#include "common/scene/loader/models.h"
#include "common/scene/loader/parts.h"

#define TINYGLTF_IMPLEMENTATION
#define TINYGLTF_NO_STB_IMAGE
#define TINYGLTF_NO_STB_IMAGE_WRITE
#define TINYGLTF_NO_EXTERNAL_IMAGE
#include <tiny_gltf.h>

namespace tandem::scene_json {

namespace {

constexpr std::size_t greatest_triangles = std::size_t{1} << 24;
constexpr std::size_t greatest_buffers = 16;  // tinygltf copies a .glb file's data for each
constexpr std::uint64_t greatest_offset = greatest_file_bytes;
constexpr int greatest_depth = 64;

// Keys whose values, or those of an array's elements, are counts, offsets and indices.
constexpr std::string_view whole_numbers[] = {"count", "byteOffset", "byteLength", "byteStride", "buffer", "bufferView",
    "mesh", "material", "indices", "mode", "componentType", "scene", "skin", "nodes", "children", "POSITION", "NORMAL",
    "TEXCOORD_0"};

std::uint32_t little_endian(std::string_view bytes, std::size_t offset) {
    std::uint32_t value = 0;
    for (std::size_t i = 4; i-- > 0;) value = value << 8 | static_cast<unsigned char>(bytes[offset + i]);
    return value;
}

// Bytes of a binary glTF file before its first chunk, and of a chunk before its data.
constexpr std::size_t first_chunk = 12, chunk_head = 8;

// Elements of an accessor, all within their buffer.
struct Elements {
    const unsigned char* data = nullptr;
    std::size_t count = 0, stride = 0;
    int component = 0;

    template <class T>
    [[nodiscard]] T value(std::size_t element, std::size_t place) const {
        T result;
        std::memcpy(&result, data + element * stride + place * sizeof(T), sizeof(T));
        return result;
    }
    [[nodiscard]] double fraction(std::size_t element, std::size_t place) const {  // a float, or a normalised integer
        if (component == TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE) return value<std::uint8_t>(element, place) / 255.0;
        if (component == TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT) return value<std::uint16_t>(element, place) / 65535.0;
        return static_cast<double>(value<float>(element, place));
    }
    [[nodiscard]] std::uint32_t index(std::size_t element) const {
        if (component == TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE) return value<std::uint8_t>(element, 0);
        if (component == TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT) return value<std::uint16_t>(element, 0);
        return value<std::uint32_t>(element, 0);
    }
};

class GltfReader {
public:
    GltfReader(const std::filesystem::path& path, const Place& place, const std::string& shown_name, ModelParts parts)
        : path_(path), place_(place), shown_(shown_name), parts_(parts) {}

    TriangleModel read() {
        parse();
        check_extensions();
        if (parts_.mesh)
            read_mesh(*parts_.mesh);
        else
            read_scene();
        if (model_.triangles.empty()) refuse("holds no triangle", "name a model with triangles");
        set_corners(model_, std::move(corners_), parts_);
        note_passed_over();
        return std::move(model_);
    }

private:
    void read_mesh(std::uint32_t mesh) {
        if (mesh >= source_.meshes.size())
            refuse(fmt::format("has {} meshes, and no mesh {}", source_.meshes.size(), mesh), "count them from 0");
        for (const tinygltf::Primitive& primitive : source_.meshes[mesh].primitives)
            read_primitive(primitive, glm::dmat4(1.0));
    }

    void read_scene() {
        if (source_.scenes.empty()) refuse("has no scene", "export it with one");
        visited_.assign(source_.nodes.size(), false);
        for (const int node : at(source_.scenes, source_.defaultScene < 0 ? 0 : source_.defaultScene).nodes)
            read_node(node, glm::dmat4(1.0), 0);
    }

    [[noreturn]] void refuse(const std::string& reason, const std::string& mend) const {
        throw input_error(place_.file, place_.pointer, printable(shown_) + ": " + reason, mend);
    }

    template <class T>
    const T& at(const std::vector<T>& list, int index) const {
        if (index < 0 || static_cast<std::size_t>(index) >= list.size())
            refuse(fmt::format("names element {} of {}", index, list.size()), "export it again");
        return list[static_cast<std::size_t>(index)];
    }

    // Magic, version, length; then chunks: length, type, data. The JSON is the first of them.
    void check_container(const std::string& bytes) const {
        if (bytes.size() < first_chunk + chunk_head)
            refuse("is no sound binary glTF file: it is cut short", "export it again");
        if (const std::uint32_t version = little_endian(bytes, 4); version != 2)
            refuse(fmt::format("is binary glTF of version {}", version), "export it as glTF 2.0");
        if (const std::uint32_t length = little_endian(bytes, 8); length != bytes.size())
            refuse(fmt::format("has {} bytes, but says {} of itself", bytes.size(), length), "export it again");
        for (std::size_t at = first_chunk; at < bytes.size();) {
            const std::size_t left = bytes.size() - at;
            if (left < chunk_head || little_endian(bytes, at) > left - chunk_head)
                refuse(fmt::format("has a chunk at byte {} that goes on beyond its end", at), "export it again");
            if (at == first_chunk && bytes.compare(at + 4, 4, "JSON") != 0)
                refuse("has another chunk before its JSON", "export it again");
            at += chunk_head + little_endian(bytes, at);
        }
    }

    // The JSON, bounded in depth and buffers, before tinygltf sees it.
    void check_json(const std::string& bytes, bool binary) {
        std::string json = bytes;
        if (binary) {
            check_container(bytes);
            json = bytes.substr(first_chunk + chunk_head, little_endian(bytes, first_chunk));
        }
        const std::string name = fmt::format("{}: {}: {}", place_.file, place_.pointer, printable(shown_));
        document_ = parse_strict(json, name);
        if (document_.is_object() && document_.contains("buffers") && document_["buffers"].size() > greatest_buffers)
            refuse(fmt::format("has more than {} buffers", greatest_buffers), "export it with one");
        check_whole_numbers(document_, "");
        check_views();
        if (parts_.materials)
            materials_.emplace(Value(document_, name), ModelImages(path_.parent_path(), place_), image_bytes_);
    }

    // tinygltf takes a count, an offset or an index that is no whole number for one that is not there.
    void check_whole_numbers(const Json& value, std::string_view key) const {
        if (value.is_object()) {
            for (const auto& [name, member] : value.items())
                if (name != "extras" && name != "extensions") check_whole_numbers(member, name);
        } else if (value.is_array()) {
            for (const Json& element : value) check_whole_numbers(element, key);
        } else if (!value.is_number_unsigned() && std::ranges::find(whole_numbers, key) != std::end(whole_numbers)) {
            refuse(
                fmt::format("\"{}\" is {}, which is no whole number", key, printable(value.dump())), "export it again");
        }
    }

    // tinygltf looks at neither where an image's bytes end nor whether there is a buffer to put a chunk into.
    void check_views() const {
        const Json none = Json::array();
        const auto list = [&](const char* name) -> const Json& {
            return document_.is_object() && document_.contains(name) && document_[name].is_array() ? document_[name]
                                                                                                   : none;
        };
        const Json& buffers = list("buffers");
        const auto size_of = [](const Json& thing, const char* name) {
            return thing.is_object() && thing.contains(name) && thing[name].is_number_unsigned()
                       ? thing[name].get<std::uint64_t>()
                       : 0;
        };
        for (const Json& buffer : buffers)
            if (size_of(buffer, "byteLength") == 0) refuse("has a buffer of no bytes", "export it again");
        for (const Json& view : list("bufferViews")) {
            const std::uint64_t buffer = size_of(view, "buffer"), offset = size_of(view, "byteOffset"),
                                length = size_of(view, "byteLength");
            const std::uint64_t whole = buffer < buffers.size() ? size_of(buffers[buffer], "byteLength") : 0;
            if (offset > whole || length > whole - offset)
                refuse("has a view that goes on beyond its buffer", "export it again");
        }
    }

    // An image within the model, which tinygltf need not decode.
    static bool keep_image(tinygltf::Image*, int index, std::string*, std::string*, int, int,
        const unsigned char* bytes, int size, void* self) {
        auto& reader = *static_cast<GltfReader*>(self);
        if (reader.parts_.materials && size > 0)
            reader.image_bytes_[static_cast<std::size_t>(index)].assign(bytes, bytes + size);
        return true;
    }

    // A buffer's file, which tinygltf also looks for in the working folder: only the model's own counts.
    static bool is_beside(const std::string& name, void* self) {
        const auto& reader = *static_cast<GltfReader*>(self);
        return name.starts_with(reader.folder()) && std::filesystem::exists(name);
    }
    static bool read_buffer(std::vector<unsigned char>* data, std::string*, const std::string& name, void* self) {
        const auto& reader = *static_cast<GltfReader*>(self);
        const std::string bytes = read_named_file(name, reader.place_, reader.shown_);
        data->assign(bytes.begin(), bytes.end());
        return true;
    }
    [[nodiscard]] std::string folder() const { return (path_.parent_path() / "").string(); }

    void parse() {
        const std::string bytes = read_named_file(path_, place_, shown_);
        const bool binary = bytes.starts_with("glTF");
        check_json(bytes, binary);
        tinygltf::TinyGLTF parser;
        parser.SetImageLoader(&keep_image, this);
        parser.SetFsCallbacks({&is_beside, [](const std::string& name, void*) { return name; }, &read_buffer,
            [](std::string*, const std::string&, const std::vector<unsigned char>&, void*) { return false; }, this});
        std::string error, warning;
        const auto length = static_cast<unsigned>(bytes.size());
        const bool sound = binary
                               ? parser.LoadBinaryFromMemory(&source_, &error, &warning,
                                     reinterpret_cast<const unsigned char*>(bytes.data()), length, folder())
                               : parser.LoadASCIIFromString(&source_, &error, &warning, bytes.data(), length, folder());
        while (!error.empty() && std::string_view(" \n.").find(error.back()) != std::string_view::npos)
            error.pop_back();
        if (!sound) refuse("is no sound glTF 2.0 model: " + printable(error), "export it again");
        if (!source_.asset.version.starts_with("2."))
            refuse("is glTF of version \"" + printable(source_.asset.version) + "\"", "export it as glTF 2.0");
    }

    void check_extensions() const {
        for (const std::string& name : source_.extensionsRequired)
            if (!name.starts_with("KHR_materials_") && !name.starts_with("KHR_texture_"))
                refuse("requires the extension " + printable(name), "export it without");
    }

    [[nodiscard]] glm::dmat4 transform_of(const tinygltf::Node& node) const {
        const auto sized = [&](const std::vector<double>& list, std::size_t size) {
            if (!list.empty() && list.size() != size) refuse("has a node of no sound transform", "export it again");
            return !list.empty();
        };
        glm::dmat4 matrix(1.0);
        if (sized(node.matrix, 16)) {
            for (int i = 0; i < 16; ++i) matrix[i / 4][i % 4] = node.matrix[static_cast<std::size_t>(i)];
            if (glm::row(matrix, 3) != glm::dvec4(0.0, 0.0, 0.0, 1.0))
                refuse("has a node of a transform that is not affine", "end its matrix with the row 0, 0, 0, 1");
            return matrix;
        }
        if (sized(node.translation, 3))
            matrix = glm::translate(matrix, {node.translation[0], node.translation[1], node.translation[2]});
        if (sized(node.rotation, 4)) {
            glm::dquat turn;
            turn.x = node.rotation[0];
            turn.y = node.rotation[1];
            turn.z = node.rotation[2];
            turn.w = node.rotation[3];
            const double length = glm::length(turn);
            if (!(length > 0.0 && std::isfinite(length)))
                refuse("has a node of no sound rotation", "write a unit quaternion");
            matrix = matrix * glm::mat4_cast(glm::normalize(turn));
        }
        if (sized(node.scale, 3)) matrix = glm::scale(matrix, {node.scale[0], node.scale[1], node.scale[2]});
        return matrix;
    }

    void read_node(int index, const glm::dmat4& outer, int depth) {
        const tinygltf::Node& node = at(source_.nodes, index);
        if (visited_[static_cast<std::size_t>(index)] || depth > greatest_depth)
            refuse("has nodes that are no tree", "export it again");
        visited_[static_cast<std::size_t>(index)] = true;
        if (node.skin >= 0) refuse("is deformed by a skin", "apply it before the export");
        const glm::dmat4 matrix = outer * transform_of(node);
        if (node.mesh >= 0)
            for (const tinygltf::Primitive& primitive : at(source_.meshes, node.mesh).primitives)
                read_primitive(primitive, matrix);
        for (const int child : node.children) read_node(child, matrix, depth + 1);
    }

    // `type` and the components allowed, the last of which a file may also have normalised.
    [[nodiscard]] Elements elements(int accessor_index, int type, std::initializer_list<int> components) const {
        const tinygltf::Accessor& accessor = at(source_.accessors, accessor_index);
        if (accessor.sparse.isSparse) refuse("has a sparse accessor", "export it without");
        if (accessor.type != type || std::ranges::find(components, accessor.componentType) == components.end())
            refuse("has an accessor of another type than its use", "export it again");
        const tinygltf::BufferView& view = at(source_.bufferViews, accessor.bufferView);
        const std::vector<unsigned char>& data = at(source_.buffers, view.buffer).data;
        const auto size = static_cast<std::size_t>(
            tinygltf::GetComponentSizeInBytes(static_cast<std::uint32_t>(accessor.componentType)) *
            tinygltf::GetNumComponentsInType(static_cast<std::uint32_t>(accessor.type)));
        const std::size_t stride = view.byteStride == 0 ? size : view.byteStride;
        for (const std::size_t number :
            {accessor.byteOffset, accessor.count, view.byteOffset, view.byteLength, view.byteStride})
            if (number > greatest_offset) refuse("has an accessor beyond its buffer", "export it again");
        if (accessor.count == 0 || view.byteOffset + view.byteLength > data.size() ||
            accessor.byteOffset + (accessor.count - 1) * stride + size > view.byteLength)
            refuse("has an accessor beyond its buffer", "export it again");
        return {data.data() + view.byteOffset + accessor.byteOffset, accessor.count, stride, accessor.componentType};
    }

    // What the file has and Tandem does not, or not here, beside what its materials lose.
    void note_passed_over() {
        const auto lost = [&](bool there, const char* what) {
            if (there) model_.passed_over.insert(what);
        };
        if (!parts_.mesh) {
            lost(!source_.animations.empty(), "animations");
            lost(!source_.lights.empty(), "lights");
            lost(source_.scenes.size() > 1, "other scenes than its default");
        }
        if (!materials_) return;
        model_.materials = materials_->take();
        model_.passed_over.merge(materials_->passed_over());
    }

    void read_primitive(const tinygltf::Primitive& primitive, const glm::dmat4& matrix) {
        if (primitive.mode != TINYGLTF_MODE_TRIANGLES)
            refuse(fmt::format("has a primitive of mode {}", primitive.mode), "export it as triangles, mode 4");
        if (!primitive.targets.empty()) refuse("is deformed by morph targets", "apply them before the export");
        const auto position = primitive.attributes.find("POSITION");
        if (position == primitive.attributes.end()) refuse("has a primitive without POSITION", "export it again");
        const Elements points = elements(position->second, TINYGLTF_TYPE_VEC3, {TINYGLTF_COMPONENT_TYPE_FLOAT});
        const auto first = static_cast<std::uint32_t>(model_.vertices.size());
        if (first + points.count > 3 * greatest_triangles) refuse_size();
        for (std::size_t i = 0; i < points.count; ++i) {
            const glm::dvec4 point(
                points.value<float>(i, 0), points.value<float>(i, 1), points.value<float>(i, 2), 1.0);
            model_.vertices.emplace_back(matrix * point);
            const glm::dvec3& vertex = model_.vertices.back();
            if (!(std::max({std::abs(vertex.x), std::abs(vertex.y), std::abs(vertex.z)}) <= greatest_length) ||
                !std::isfinite(glm::length(vertex)))
                refuse("has a vertex that is not finite, or too far out", "export it again");
        }
        read_triangles(primitive, points.count, first, matrix);
    }

    // A mirrored node's triangles have their fronts the other way round [glTF 2.0, section 3.7.4].
    void read_triangles(
        const tinygltf::Primitive& primitive, std::size_t points, std::uint32_t first, const glm::dmat4& matrix) {
        const bool mirrored = glm::determinant(glm::dmat3(matrix)) < 0.0, indexed = primitive.indices >= 0;
        const Elements indices =
            indexed ? elements(primitive.indices, TINYGLTF_TYPE_SCALAR,
                          {TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE, TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT,
                              TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT})
                    : Elements{};
        const std::size_t count = indexed ? indices.count : points;
        if (count % 3 != 0) refuse("has a triangle of fewer than three corners", "export it again");
        if (model_.triangles.size() + count / 3 > greatest_triangles) refuse_size();
        const Elements coordinates = read_coordinates(primitive, points);
        const std::vector<glm::dvec3> normals = read_normals(primitive, points, glm::dmat3(matrix));
        if (materials_) {
            model_.material_of.insert(model_.material_of.end(), count / 3, materials_->index_of(primitive.material));
            if (primitive.attributes.contains("COLOR_0")) model_.passed_over.insert("COLOR_0");
        }
        for (std::size_t i = 0; i < count; i += 3) {
            std::array<std::uint32_t, 3> triangle{};
            Corners corners;
            for (std::size_t k = 0; k < 3; ++k) {
                const std::size_t place = i + (mirrored && k > 0 ? 3 - k : k);
                const std::size_t index = indexed ? indices.index(place) : place;
                if (index >= points) refuse(fmt::format("vertex {} is not among {}", index, points), "export it again");
                triangle[k] = first + static_cast<std::uint32_t>(index);
                if (parts_.coordinates)
                    corners[k].coordinates =
                        coordinates.data != nullptr ? coordinates_at(coordinates, index) : default_coordinates[k];
                if (!normals.empty()) corners[k].normal = normals[index];
            }
            model_.triangles.push_back(triangle);
            if (!parts_.coordinates && normals.empty()) continue;
            corners_.resize(model_.triangles.size() - 1);  // those before have nothing
            corners_.push_back(corners);
        }
    }

    [[nodiscard]] Elements read_coordinates(const tinygltf::Primitive& primitive, std::size_t points) const {
        const auto found = primitive.attributes.find("TEXCOORD_0");
        if (!parts_.coordinates || found == primitive.attributes.end()) return {};
        const Elements coordinates = elements(found->second, TINYGLTF_TYPE_VEC2,
            {TINYGLTF_COMPONENT_TYPE_FLOAT, TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE,
                TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT});
        if (coordinates.count != points) refuse("has not one texture coordinate a vertex", "export it again");
        return coordinates;
    }

    // Those of the vertices in the scene's space; none where the primitive has none, or its node is flat.
    [[nodiscard]] std::vector<glm::dvec3> read_normals(
        const tinygltf::Primitive& primitive, std::size_t points, const glm::dmat3& matrix) const {
        const auto found = primitive.attributes.find("NORMAL");
        if (!parts_.normals || found == primitive.attributes.end() || glm::determinant(matrix) == 0.0) return {};
        const Elements given = elements(found->second, TINYGLTF_TYPE_VEC3, {TINYGLTF_COMPONENT_TYPE_FLOAT});
        if (given.count != points) refuse("has not one normal a vertex", "export it again");
        const glm::dmat3 normal_matrix = glm::transpose(glm::inverse(matrix));
        std::vector<glm::dvec3> normals;
        for (std::size_t i = 0; i < points; ++i) {
            normals.push_back(normal_matrix *
                              glm::dvec3(given.value<float>(i, 0), given.value<float>(i, 1), given.value<float>(i, 2)));
            if (!(glm::length(normals.back()) <= greatest_length))
                refuse("has a normal that is not finite, or too long", "export it again");
        }
        return normals;
    }

    // glTF counts v downwards from the top of an image.
    [[nodiscard]] glm::dvec2 coordinates_at(const Elements& coordinates, std::size_t index) const {
        const glm::dvec2 at(coordinates.fraction(index, 0), 1.0 - coordinates.fraction(index, 1));
        if (!(std::abs(at.x) <= greatest_coordinate && std::abs(at.y) <= greatest_coordinate))
            refuse("has a texture coordinate that is not finite, or too large", "export it again");
        return at;
    }

    [[noreturn]] void refuse_size() const { refuse("has more than 2^24 triangles", "simplify it"); }

    const std::filesystem::path& path_;
    const Place& place_;
    const std::string& shown_;
    ModelParts parts_;
    Json document_;
    tinygltf::Model source_;
    std::map<std::size_t, std::string> image_bytes_;  // of the images that stand within the model
    std::optional<GltfMaterials> materials_;          // where they are asked for
    std::vector<bool> visited_;
    TriangleModel model_;
    std::vector<Corners> corners_;
};

}  // namespace

TriangleModel read_gltf(
    const std::filesystem::path& path, const Place& place, const std::string& shown_name, ModelParts parts) {
    return GltfReader(path, place, shown_name, parts).read();
}

}  // namespace tandem::scene_json
