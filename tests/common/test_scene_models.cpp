// What OBJ and glTF models of a scene file come to in memory, and unsound files beside it.
#include <doctest/doctest.h>

#include <cstring>
#include <glm/geometric.hpp>

#include "tests/common/draw.h"
#include "tests/common/scene_texts.h"

using namespace tandem;
using namespace tandem::test;

namespace {

// A triangle (0,0,0), (1,0,0), (0,1,0) in a node mirrored along x and moved to x = 10. Its second corner has
// coordinates (1, 0.25) from the top.
Json gltf_triangle(const std::string& buffer_uri) {
    return {{"asset", {{"version", "2.0"}}}, {"scene", 0}, {"scenes", {{{"nodes", {0}}}}},
        {"nodes", {{{"children", {1}}, {"translation", {10, 0, 0}}}, {{"mesh", 0}, {"scale", {-1, 1, 1}}}}},
        {"meshes", {{{"primitives", {{{"attributes", {{"POSITION", 0}, {"TEXCOORD_0", 1}}}, {"indices", 2}}}}}}},
        {"buffers", {{{"byteLength", 66}, {"uri", buffer_uri}}}},
        {"bufferViews", {{{"buffer", 0}, {"byteOffset", 0}, {"byteLength", 36}},
                            {{"buffer", 0}, {"byteOffset", 36}, {"byteLength", 24}},
                            {{"buffer", 0}, {"byteOffset", 60}, {"byteLength", 6}}}},
        {"accessors", {{{"bufferView", 0}, {"componentType", 5126}, {"count", 3}, {"type", "VEC3"}, {"min", {0, 0, 0}},
                           {"max", {1, 1, 0}}},
                          {{"bufferView", 1}, {"componentType", 5126}, {"count", 3}, {"type", "VEC2"}},
                          {{"bufferView", 2}, {"componentType", 5123}, {"count", 3}, {"type", "SCALAR"}}}}};
}

std::string gltf_buffer() {
    const float numbers[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0.25F, 0, 1};
    const std::uint16_t indices[] = {0, 1, 2};
    std::string bytes(66, '\0');
    std::memcpy(bytes.data(), numbers, 60);
    std::memcpy(bytes.data() + 60, indices, 6);
    return bytes;
}

// The same triangle in one file.
std::string gltf_binary() {
    Json document = gltf_triangle("");
    document["buffers"][0].erase("uri");
    std::string json = document.dump(), data = gltf_buffer();
    json.resize((json.size() + 3) / 4 * 4, ' ');
    data.resize((data.size() + 3) / 4 * 4, '\0');
    const auto word = [](std::size_t value) {
        const auto bits = static_cast<std::uint32_t>(value);
        return std::string(reinterpret_cast<const char*>(&bits), 4);
    };
    return "glTF" + word(2) + word(28 + json.size() + data.size()) + word(json.size()) + "JSON" + json +
           word(data.size()) + std::string("BIN\0", 4) + data;
}

Json model_scene(const std::string& kind, const std::string& file, bool coordinates) {
    Json scene = base();
    scene["entities"] = {{{"material", "m"}, {"primitives", {{{kind, {{"file", file}}}}}}}};
    if (coordinates) {
        scene["textures"]["t"] = {{"kind", "checker"}, {"colours", {{0, 0, 0}, {1, 1, 1}}}, {"space", "coordinates"}};
        scene["materials"]["m"]["colour"] = {{"texture", "t"}};
    }
    return scene;
}

}  // namespace

TEST_CASE("OBJ vertices are split where their texture coordinates differ") {
    const TemporaryFolder folder;
    const std::string vertices = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n",
                      coordinates = "vt 0 0\nvt 1 0 0\nvt 0.5 0.25\n";
    put(folder / "m.obj", vertices + coordinates + "vn 0 0 0\nf 1/1 2/2 3/3\nf 1/1/1 3/-2/1 4/1/1\nf 1 2 4\n");
    CHECK(load(folder, model_scene("obj", "m.obj", false)).vertices.size() == 4);
    put(folder / "marked.obj", "\xEF\xBB\xBF" + vertices + "f 1 2 3\n");
    CHECK(load(folder, model_scene("obj", "marked.obj", false)).vertices.size() == 4);
    const Scene scene = load(folder, model_scene("obj", "m.obj", true));
    REQUIRE(scene.primitives.size() == 3);
    REQUIRE(scene.texture_coordinates.size() == scene.vertices.size());
    const auto at = [&](std::size_t triangle, std::size_t corner) {
        return scene.texture_coordinates[scene.primitives[triangle].index[corner]];
    };
    const auto point = [&](std::size_t triangle, std::size_t corner) {
        return scene.vertices[scene.primitives[triangle].index[corner]];
    };
    CHECK(at(0, 2) == glm::dvec2(0.5, 0.25));
    CHECK(at(1, 1) == glm::dvec2(1, 0));
    CHECK(point(0, 2) == point(1, 1));
    CHECK(scene.primitives[0].index[0] == scene.primitives[1].index[0]);  // the same pair, shared
    CHECK(at(2, 0) == glm::dvec2(0, 0));
    CHECK(at(2, 1) == glm::dvec2(1, 0));
    CHECK(at(2, 2) == glm::dvec2(0, 1));
    CHECK(
        scene.vertices.size() == 6);  // of corners 1/1, 2/2, 3/3, 3/2, 4/1 and the last face's 4; the others are shared
    const auto refused = [&](const std::string& rest, const std::string& reason) {
        put(folder / "m.obj", vertices + rest);
        CHECK(contains(refusal(folder, model_scene("obj", "m.obj", true)), reason));
    };
    refused(coordinates + "f 1/1 2/2 3\n", "line 8: some corners of a face have texture coordinates");
    refused(coordinates + "f 1/1 2/2 3/4\n", "coordinate 4 is not among the 3 before it");
    refused("vt nan 0\n", "line 5: \"nan\" is no coordinate");
    refused("vt 1\n", "is no coordinate");
}

TEST_CASE("glTF models give triangles under their nodes, mirrored ones with their fronts kept") {
    const TemporaryFolder folder;
    put(folder / "m.bin", gltf_buffer());
    put(folder / "m.gltf", gltf_triangle("m.bin").dump());
    for (const bool coordinates : {false, true}) {
        const Scene scene = load(folder, model_scene("gltf", "m.gltf", coordinates));
        REQUIRE(scene.primitives.size() == 1);
        const auto& index = scene.primitives[0].index;
        const glm::dvec3 a = scene.vertices[index[0]], b = scene.vertices[index[1]], c = scene.vertices[index[2]];
        CHECK(a == glm::dvec3(10, 0, 0));
        CHECK(glm::cross(b - a, c - a) == glm::dvec3(0, 0, 1));  // mirrored along x, it still faces z
        CHECK(scene.texture_coordinates.size() == (coordinates ? 3 : 0));
        if (!coordinates) continue;
        for (const std::uint32_t i : index)
            if (scene.vertices[i].x == 9.0) CHECK(scene.texture_coordinates[i] == glm::dvec2(1, 0.75));
    }
}

TEST_CASE("binary glTF models are read") {
    const TemporaryFolder folder;
    const std::string glb = gltf_binary();
    put(folder / "m.glb", glb);
    CHECK(load(folder, model_scene("gltf", "m.glb", true)).primitives.size() == 1);
    for (const auto& [place, part] : {std::pair{4, "version 3"}, {8, "says"}, {12, "beyond its end"}}) {
        std::string lies = glb;
        lies[static_cast<std::size_t>(place)] =
            place == 4 ? 3 : static_cast<char>(lies[static_cast<std::size_t>(place)] + 64);
        put(folder / "m.glb", lies);
        CHECK(contains(refusal(folder, model_scene("gltf", "m.glb", true)), part));
    }
    for (std::size_t cut = 0; cut < glb.size(); cut += 7) {
        put(folder / "m.glb", glb.substr(0, cut));
        CHECK(contains(refusal(folder, model_scene("gltf", "m.glb", true)), "/entities/0/primitives/0/gltf/file"));
    }
}

TEST_CASE("unsound glTF models are refused") {
    const TemporaryFolder folder;
    put(folder / "m.bin", gltf_buffer());
    const auto refused = [&](const std::string& patch, const std::string& reason) {
        CAPTURE(patch);
        const Json document = gltf_triangle("m.bin").patch(Json::parse(patch));
        put(folder / "m.gltf", document.dump());
        const std::string line = refusal(folder, model_scene("gltf", "m.gltf", true));
        CAPTURE(line);
        CHECK(contains(line, "/entities/0/primitives/0/gltf/file: m.gltf: "));
        CHECK(contains(line, reason));
    };
    refused(R"([{"op": "replace", "path": "/buffers/0/uri", "value": "none.bin"}])", "no sound glTF");
    refused(R"([{"op": "replace", "path": "/buffers/0/byteLength", "value": 999}])", "no sound glTF");
    refused(R"([{"op": "replace", "path": "/accessors/0/count", "value": 4}])", "beyond its buffer");
    refused(R"([{"op": "add", "path": "/accessors/0/byteOffset", "value": 1099511627776}])", "beyond its buffer");
    refused(R"([{"op": "add", "path": "/accessors/0/byteOffset", "value": 4}])", "beyond its buffer");
    refused(R"([{"op": "replace", "path": "/bufferViews/2/byteOffset", "value": 64}])", "beyond its buffer");
    // An image that no accessor looks at.
    refused(R"([{"op": "add", "path": "/bufferViews/3", "value": {"buffer": 0, "byteLength": 1000000000}},
        {"op": "add", "path": "/images", "value": [{"bufferView": 3, "mimeType": "image/png"}]}])",
        "a view that goes on beyond its buffer");
    refused(R"([{"op": "replace", "path": "/buffers/0/byteLength", "value": 0}])", "a buffer of no bytes");
    refused(R"([{"op": "replace", "path": "/accessors/0/componentType", "value": 5123}])", "another type");
    refused(R"([{"op": "replace", "path": "/accessors/2/bufferView", "value": 1},
        {"op": "add", "path": "/accessors/2/byteOffset", "value": 8}])",
        "vertex 16256 is not among 3");
    refused(R"([{"op": "replace", "path": "/accessors/0/bufferView", "value": 9}])", "names element 9 of 3");
    refused(R"([{"op": "replace", "path": "/accessors/1/count", "value": 2}])", "not one texture coordinate a vertex");
    refused(R"([{"op": "replace", "path": "/scenes/0/nodes/0", "value": 5}])", "names element 5 of 2");
    refused(R"([{"op": "add", "path": "/nodes/1/children", "value": [0]}])", "no tree");
    refused(R"([{"op": "add", "path": "/nodes/0/children/1", "value": 1}])", "no tree");
    refused(R"([{"op": "add", "path": "/meshes/0/primitives/0/mode", "value": 5}])", "a primitive of mode 5");
    refused(
        R"([{"op": "add", "path": "/extensionsRequired", "value": ["KHR_draco_mesh_compression"]}])", "requires the");
    refused(R"([{"op": "remove", "path": "/scenes"}])", "has no scene");
    refused(R"([{"op": "replace", "path": "/asset/version", "value": "1.0"}])", "is glTF of version \"1.0\"");
    refused(R"([{"op": "add", "path": "/accessors/0/byteOffset", "value": -4}])", "\"byteOffset\" is -4");
    refused(R"([{"op": "add", "path": "/bufferViews/0/byteStride", "value": -12}])", "\"byteStride\" is -12");
    refused(R"([{"op": "replace", "path": "/meshes/0/primitives/0/indices", "value": 1.5}])", "\"indices\" is 1.5");
    refused(R"([{"op": "add", "path": "/nodes/0/children/0", "value": "1"}])", "\"children\" is \"1\"");
    refused(R"([{"op": "add", "path": "/nodes/0/rotation", "value": [0, 0, 0, 0]}])", "no sound rotation");
    refused(R"([{"op": "add", "path": "/nodes/1/matrix", "value": [1, 0, 0, 1, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]}])",
        "not affine");
    put(folder / "m.gltf", "{\"asset\": " + std::string(100, '[') + "}");
    CHECK(contains(refusal(folder, model_scene("gltf", "m.gltf", false)), "nested deeper than 64 levels"));
}

TEST_CASE("mutilated models, volumes and images are loaded or refused, never anything else") {
    const TemporaryFolder folder;
    put(folder / "m.bin", gltf_buffer());
    put_pfm(folder / "t.pfm", 2, 2, std::vector<float>(12, 0.5F));
    const auto read = [&](const std::string& name) {
        std::ifstream stream(folder / name, std::ios::binary);
        return std::string((std::istreambuf_iterator<char>(stream)), std::istreambuf_iterator<char>());
    };
    put(folder / "of-mtl.obj", "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\nusemtl b\nf 1 2 3\n");
    Json own_materials = base(), with_materials = gltf_triangle("m.bin");
    own_materials["entities"] = {{{"primitives", {{{"obj", {{"file", "of-mtl.obj"}}}}}}}};
    with_materials["materials"] = {{{"emissiveFactor", {1, 0.5, 0}}, {"alphaMode", "BLEND"},
        {"pbrMetallicRoughness", {{"metallicFactor", 0}, {"baseColorTexture", {{"index", 0}}}}},
        {"extensions", {{"KHR_materials_transmission", {{"transmissionFactor", 0.5}}}}}}};
    with_materials["textures"] = {{{"source", 0}}};
    with_materials["images"] = {{{"uri", "t.pfm"}}};
    with_materials["meshes"][0]["primitives"][0]["material"] = 0;
    Json own_gltf = own_materials;
    own_gltf["entities"][0]["primitives"] = {{{"gltf", {{"file", "own.gltf"}}}}};
    const struct {
        std::string name, bytes;
        Json scene;
    } files[] = {{"m.gltf", gltf_triangle("m.bin").dump(), model_scene("gltf", "m.gltf", true)},
        {"m.glb", gltf_binary(), model_scene("gltf", "m.glb", true)},
        {"smoke.vol", volume(1, {2, 1, 3}, 1, {0, 1, 2, 3, 4, 5}), volume_scene()},
        {"t.pfm", read("t.pfm"), image_scene("t.pfm", "linear")},
        {"m.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0.5\nf 1/1 2/2 3/1 4/2\n",
            model_scene("obj", "m.obj", true)},
        {"own.gltf", with_materials.dump(), own_gltf},
        {"m.mtl", "newmtl a\nKd 1 0.5 0\nKe 1\nd 0.5\nnewmtl b\nillum 7\nNi 1.5\nTf 1 1 1\nmap_Kd -s 1 1 1 t.pfm\n",
            own_materials}};
    Draw draw;
    for (const auto& file : files) {
        CAPTURE(file.name);
        int refused = 0;
        for (int round = 0; round < 600; ++round) {
            std::string bytes = file.bytes;
            for (std::size_t change = 0; change <= draw(3); ++change) {
                const std::size_t place = draw(bytes.size());
                switch (draw(4)) {
                    case 0:
                        bytes[place] = static_cast<char>(draw(256));
                        break;
                    case 1:
                        bytes[place] = "0123456789[]{}\",:-"[draw(18)];
                        break;
                    case 2:
                        bytes.erase(place, 1 + draw(std::min<std::size_t>(20, bytes.size() - place)));
                        break;
                    default:
                        bytes.insert(place, 1, static_cast<char>(draw(256)));
                }
                if (bytes.empty()) bytes.push_back('x');
            }
            put(folder / file.name, bytes);
            refused += refusal(folder, file.scene).empty() ? 0 : 1;
        }
        CHECK(refused > 100);  // and whatever else is thrown fails the test
    }
}
