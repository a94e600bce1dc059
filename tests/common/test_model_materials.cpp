// Materials that OBJ and glTF models bring: what Tandem has in their place, what it says is lost, and what it refuses.
#include <doctest/doctest.h>

#include <cmath>

#include "tests/common/scene_texts.h"

using namespace tandem;
using namespace tandem::test;

namespace {

// An entity of one model, without a material of its own.
Json model_scene(const std::string& kind, const std::string& file) {
    Json scene = base();
    scene["entities"] = {{{"primitives", {{{kind, {{"file", file}}}}}}}};
    return scene;
}

constexpr const char* triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\n";

// The scene of a triangle of the MTL material "m".
Scene load_mtl(const TemporaryFolder& folder, const std::string& material) {
    put(folder / "m.mtl", "newmtl m\n" + material);
    put(folder / "m.obj", std::string("mtllib m.mtl\n") + triangle + "usemtl m\nf 1/1 2/2 3/3\n");
    return load(folder, model_scene("obj", "m.obj"));
}

// A glTF triangle of the material, if there is one.
Json gltf_of(const Json& material) {
    Json primitive = {{"attributes", {{"POSITION", 0}}}};
    if (!material.is_null()) primitive["material"] = 0;
    Json document = {{"asset", {{"version", "2.0"}}}, {"scenes", {{{"nodes", {0}}}}}, {"nodes", {{{"mesh", 0}}}},
        {"meshes", {{{"primitives", {primitive}}}}}, {"buffers", {{{"byteLength", 36}, {"uri", "m.bin"}}}},
        {"bufferViews", {{{"buffer", 0}, {"byteLength", 36}}}},
        {"accessors", {{{"bufferView", 0}, {"componentType", 5126}, {"count", 3}, {"type", "VEC3"}, {"min", {0, 0, 0}},
                          {"max", {1, 1, 0}}}}}};
    if (!material.is_null()) document["materials"] = {material};
    return document;
}

void put_gltf(const TemporaryFolder& folder, const Json& document) {
    const float corners[] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
    put(folder / "m.bin", std::string(reinterpret_cast<const char*>(corners), sizeof corners));
    put(folder / "m.gltf", document.dump());
}

Scene load_gltf(const TemporaryFolder& folder, const Json& material) {
    put_gltf(folder, gltf_of(material));
    return load(folder, model_scene("gltf", "m.gltf"));
}

// The material of a scene of one entity.
const Material& only_material(const Scene& scene) {
    REQUIRE(scene.entities.size() == 1);
    return scene.materials[scene.entities[0].material];
}

bool says(const Scene& scene, const std::string& part) {
    return scene.remarks.size() == 1 && contains(scene.remarks[0], part);
}

}  // namespace

TEST_CASE("an entity without a material becomes one for each material of its OBJ model") {
    const TemporaryFolder folder;
    put_pfm(folder / "half.pfm", 1, 1, {0.5f, 1, 0});
    std::filesystem::create_directory(folder / "parts");
    put(folder / "parts/m.mtl",
        "# two\nnewmtl dark red\nKd 0.5 0.25 0.125\n\nnewmtl painted\r\nKd 0.5 0.5 0.5\r\nmap_Kd ../half.pfm\r\n"
        "newmtl lamp\nKe 4\nKd 0 0 0\nillum 0\n");
    put(folder / "m.obj", std::string("mtllib parts/m.mtl\n") + triangle +
                              "usemtl dark red\nf 1/1 2/2 3/3\nusemtl lamp\nf 1 3 2\nusemtl dark red\nf 2 3 1\n"
                              "usemtl painted\nf 1/1 2/2 3/3\n");
    const Scene scene = load(folder, model_scene("obj", "m.obj"));
    REQUIRE(scene.entities.size() == 3);
    const auto material = [&](std::size_t i) { return scene.materials[scene.entities[i].material]; };
    CHECK(material(0).name == "m.obj: dark red");
    CHECK(material(0).colour == glm::dvec3(0.5, 0.25, 0.125));
    CHECK(scene.entities[0].primitive_count == 2);
    CHECK(material(1).kind == MaterialKind::emissive);
    CHECK(material(1).radiance == glm::dvec3(4));
    CHECK(scene.entities[1].primitive_count == 1);
    REQUIRE(material(2).colour_texture != no_index);
    const Texture& texture = scene.textures[material(2).colour_texture];
    CHECK(texture.image->rgb == std::vector<float>{0.25f, 0.5f, 0});  // times Kd
    CHECK(scene.texture_coordinates.size() == scene.vertices.size());
    CHECK(scene.remarks.empty());
}

TEST_CASE("MTL materials become Tandem's by their illum, and what is lost is said in one line") {
    const TemporaryFolder folder;
    const Scene glass = load_mtl(folder, "illum 7\nNi 1.25\nTf 0.5 0.75 1\nd 0.1\nKd 1 0 0\n");
    CHECK(only_material(glass).kind == MaterialKind::specular);
    CHECK(only_material(glass).translucent);
    CHECK(only_material(glass).refractive_index == 1.25);
    CHECK(only_material(glass).colour == glm::dvec3(0.5, 0.75, 1));
    CHECK(glass.remarks.empty());
    const Scene mirror = load_mtl(folder, "illum 3\nKs 0.5 0.5 0.75\n");
    CHECK(only_material(mirror).kind == MaterialKind::specular);
    CHECK_FALSE(only_material(mirror).translucent);
    CHECK(only_material(mirror).colour == glm::dvec3(0.5, 0.5, 0.75));
    const Scene shiny =
        load_mtl(folder, "Ka 1 1 1\nKd 0.5 0.5 0.5\nKs 0.5 0 0\nNs 90\nd 0.5\nKe 2 3 4\nmap_Bump b.png\n");
    CHECK(only_material(shiny).kind == MaterialKind::diffuse);
    CHECK(only_material(shiny).radiance == glm::dvec3(2, 3, 4));
    CHECK(says(shiny, "/entities/0/primitives/0/obj/file: m.obj is rendered without Ks beside Kd, "));
    CHECK(says(shiny, ", d and Tr of what is not glass by illum, map_Bump"));
    CHECK(only_material(load_mtl(folder, "Ns 10\n")).colour == glm::dvec3(0));
}

TEST_CASE("unsound MTL files are refused with their line") {
    const TemporaryFolder folder;
    const auto refused = [&](const std::string& material, const std::string& reason) {
        put(folder / "m.mtl", material);
        put(folder / "m.obj", std::string("mtllib m.mtl\n") + triangle + "usemtl m\nf 1 2 3\n");
        const std::string line = refusal(folder, model_scene("obj", "m.obj"));
        CAPTURE(line);
        CHECK(contains(line, "/entities/0/primitives/0/obj/file: "));
        CHECK(contains(line, reason));
        CHECK(contains(line, "; "));
    };
    refused("Kd 1 1 1\n", "m.mtl: line 1: a statement before the first newmtl");
    refused("newmtl m\nnewmtl m\n", "line 2: material \"m\" stands twice");
    refused("newmtl \n", "a material without a name");
    for (const std::string colour :
        {"Kd 1 2 1", "Kd nan", "Kd 1 1", "Kd", "Kd x y z", "Ke -1 0 0", "Ks inf", "Kd 1e999"})
        refused("newmtl m\n" + colour + "\n", "m.mtl: line 2: ");
    refused("newmtl m\nKd spectral a.rfl\n", "a colour that is spectral");
    refused("newmtl m\nNi 0\n", "\"0\" is out of range");
    refused("newmtl m\nillum 1.5\n", "illum is no whole number");
    refused("newmtl m\nmap_Kd /etc/passwd\n", "no relative path");
    refused("newmtl m\nmap_Kd none.png\n", "none.png: no such file");
    refused("newmtl other\n", "m.obj: line 9: material \"m\" is in no MTL file");
}

TEST_CASE("faces without a material and missing MTL files are refused where the scene names no material") {
    const TemporaryFolder folder;
    const auto put_model = [&](const std::string& text) { put(folder / "m.obj", text); };
    put_model(std::string(triangle) + "f 1 2 3\n");
    CHECK(contains(refusal(folder, model_scene("obj", "m.obj")), "m.obj: line 7: a face has no material"));
    put_model(std::string(triangle) + "usemtl m\nf 1 2 3\n");
    CHECK(contains(refusal(folder, model_scene("obj", "m.obj")), "material \"m\" is in no MTL file"));
    put_model(std::string("mtllib none.mtl\n") + triangle + "usemtl m\nf 1 2 3\n");
    CHECK(contains(refusal(folder, model_scene("obj", "m.obj")), "none.mtl: no such file"));
    put_model(std::string("mtllib /none.mtl\n") + triangle + "usemtl m\nf 1 2 3\n");
    CHECK(contains(refusal(folder, model_scene("obj", "m.obj")), "mtllib is followed by no relative path"));

    Json named = model_scene("obj", "m.obj");
    named["entities"][0]["material"] = "m";  // the scene's wins, and the MTL file is not missed
    CHECK(load(folder, named).entities[0].material == 0);
    named["entities"][0].erase("material");
    named["entities"][0]["primitives"].push_back({{"sphere", {{"centre", {0, 0, 0}}, {"radius", 1}}}});
    CHECK(contains(refusal(folder, named), "without \"material\", and not all of its primitives are models"));
}

TEST_CASE("glTF materials become diffuse, conductors and glass") {
    const TemporaryFolder folder;
    const Scene plain = load_gltf(folder, Json::parse(R"({"name": "clay", "emissiveFactor": [0, 0.5, 1],
        "pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.25, 1, 1], "metallicFactor": 0},
        "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 8}}})"));
    CHECK(only_material(plain).name == "m.gltf: clay");
    CHECK(only_material(plain).kind == MaterialKind::diffuse);
    CHECK(only_material(plain).colour == glm::dvec3(0.5, 0.25, 1));
    CHECK(only_material(plain).radiance == glm::dvec3(0, 4, 8));
    CHECK(only_material(plain).sides == EmittingSides::front);
    CHECK(says(plain, "without the gloss of what is no metal"));

    const Scene lamp = load_gltf(folder, Json::parse(R"({"emissiveFactor": [1, 1, 1], "doubleSided": true,
        "pbrMetallicRoughness": {"baseColorFactor": [0, 0, 0, 1], "metallicFactor": 0},
        "extensions": {"KHR_materials_specular": {"specularFactor": 0}}})"));
    CHECK(only_material(lamp).kind == MaterialKind::emissive);
    CHECK(only_material(lamp).sides == EmittingSides::both);
    CHECK(lamp.remarks.empty());

    const Scene metal = load_gltf(folder,
        Json::parse(R"({"pbrMetallicRoughness": {"baseColorFactor": [0, 0.5, 1, 1], "roughnessFactor": 0.25}})"));
    CHECK(only_material(metal).kind == MaterialKind::conductor);
    CHECK(only_material(metal).roughness == 0.25);
    const glm::dvec3 k = only_material(metal).k;
    CHECK(only_material(metal).eta == glm::dvec3(1));
    CHECK(k.x == 0.0);
    CHECK(k.y * k.y / (4.0 + k.y * k.y) == doctest::Approx(0.5));  // reflectance at normal incidence
    CHECK(k.z == 1000.0);
    CHECK(metal.remarks.empty());

    const Scene glass = load_gltf(folder, Json::parse(R"({"pbrMetallicRoughness": {"metallicFactor": 0,
        "roughnessFactor": 0.02, "baseColorFactor": [1, 0.5, 1, 1]}, "extensions":
        {"KHR_materials_transmission": {"transmissionFactor": 1}, "KHR_materials_ior": {"ior": 1.25}}})"));
    CHECK(only_material(glass).translucent);
    CHECK(only_material(glass).roughness == 0.0);
    CHECK(only_material(glass).refractive_index == 1.25);
    CHECK(only_material(glass).colour == glm::dvec3(1, 0.5, 1));
    CHECK(glass.remarks.empty());

    const Scene without = load_gltf(folder, nullptr);  // glTF's default: a rough white metal
    CHECK(only_material(without).kind == MaterialKind::conductor);
    CHECK(only_material(without).roughness == 1.0);
}

TEST_CASE("images of glTF materials are read from files and from within, times their factors") {
    const TemporaryFolder folder;
    put_pfm(folder / "grey image.pfm", 2, 1, {0.5f, 0.5f, 0.5f, 1, 0.25f, 0.5f});
    Json document = gltf_of(Json::parse(R"({"pbrMetallicRoughness": {"metallicFactor": 0,
        "baseColorFactor": [1, 0.5, 1, 1], "baseColorTexture": {"index": 0}}})"));
    document["textures"] = {{{"source", 0}}};
    document["images"] = {{{"uri", "grey%20image.pfm"}}};
    put_gltf(folder, document);
    const Scene scene = load(folder, model_scene("gltf", "m.gltf"));
    REQUIRE(scene.textures.size() == 1);
    CHECK(only_material(scene).colour_texture == 0);
    CHECK(scene.textures[0].image->rgb[1] == doctest::Approx(0.5 * 0.21404).epsilon(1e-4));  // of sRGB 0.5

    // A PNG of one texel, (255, 0, 0, 127): alpha does not darken it.
    document["images"] = {{{"uri",
        "data:image/png;base64,"
        "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR4nGP4z8BQDwAEgAF/edUTLQAAAABJRU5ErkJggg=="}}};
    put_gltf(folder, document);
    const Scene within = load(folder, model_scene("gltf", "m.gltf"));
    REQUIRE(within.textures.size() == 1);
    CHECK(within.textures[0].image->rgb == std::vector<float>{1, 0, 0});

    document["materials"][0]["pbrMetallicRoughness"]["metallicFactor"] = 1;
    document["images"] = {{{"uri", "grey%20image.pfm"}}};
    document["materials"][0]["pbrMetallicRoughness"]["metallicRoughnessTexture"] = {{"index", 0}};
    put_gltf(folder, document);
    const Scene mean = load(folder, model_scene("gltf", "m.gltf"));
    CHECK(only_material(mean).roughness == 0.375);
    CHECK(only_material(mean).kind == MaterialKind::conductor);
    CHECK(says(mean, "metallicRoughnessTexture (its mean is taken)"));
}

TEST_CASE("unsound glTF materials are refused") {
    const TemporaryFolder folder;
    const auto refused = [&](const std::string& material, const std::string& reason) {
        CAPTURE(material);
        Json document = gltf_of(Json::parse(material));
        document["textures"] = {{{"source", 0}}, {{"source", 7}}};
        document["images"] = {{{"uri", "none.png"}}};
        put_gltf(folder, document);
        const std::string line = refusal(folder, model_scene("gltf", "m.gltf"));
        CAPTURE(line);
        CHECK(contains(line, "/entities/0/primitives/0/gltf/file: "));
        CHECK(contains(line, reason));
        CHECK(contains(line, "; "));
    };
    refused(R"({"pbrMetallicRoughness": {"metallicFactor": 2}})", "m.gltf: /materials/0/pbrMetallicRoughness/metallic");
    refused(R"({"pbrMetallicRoughness": {"roughnessFactor": "x"}})", "/roughnessFactor: ");
    refused(R"({"pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1]}})", "has 3 elements");
    refused(R"({"pbrMetallicRoughness": {"baseColorTexture": {}}})", "baseColorTexture");
    refused(R"({"pbrMetallicRoughness": {"baseColorTexture": {"index": 2}}})", "/baseColorTexture/index");
    refused(R"({"pbrMetallicRoughness": {"baseColorTexture": {"index": 1}}})", "/textures/1/source");
    refused(R"({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}})", "none.png: no such file");
    refused(R"({"emissiveFactor": [1, 1, -1]})", "/emissiveFactor/2");
    refused(R"({"extensions": {"KHR_materials_ior": {"ior": 0.5}}})", "/KHR_materials_ior/ior");

    Json document = gltf_of(Json::parse("{}"));
    document["meshes"][0]["primitives"][0]["material"] = 4;
    put_gltf(folder, document);
    CHECK(contains(refusal(folder, model_scene("gltf", "m.gltf")), "4 is out of range"));
    document["meshes"][0]["primitives"][0]["material"] = 0.5;
    put_gltf(folder, document);
    CHECK(contains(refusal(folder, model_scene("gltf", "m.gltf")), "\"material\" is 0.5"));
}

TEST_CASE("a scene that says its own lights hears nothing of a model's lights and cameras") {
    const TemporaryFolder folder;
    Json document = gltf_of(Json::parse("{}"));
    document["cameras"] = Json::parse(R"([{"type": "perspective", "perspective": {"yfov": 1, "znear": 0.1}}])");
    document["extensionsUsed"] = {"KHR_lights_punctual"};
    document["extensions"]["KHR_lights_punctual"]["lights"] = Json::parse(R"([{"type": "point"}])");
    put_gltf(folder, document);
    Json scene = model_scene("gltf", "m.gltf");
    CHECK(says(load(folder, scene), "m.gltf is rendered without lights"));
    scene["lights"] = Json::parse(R"([{"point": {"position": [0, 1, 0], "intensity": [1, 1, 1]}}])");
    CHECK(load(folder, scene).remarks.empty());
}

TEST_CASE("groups repeat models with their own materials, and say once what is lost") {
    const TemporaryFolder folder;
    put(folder / "m.mtl", "newmtl a\nKd 1\nnewmtl b\nKd 0.5\nmap_Bump x.png\n");
    put(folder / "m.obj", std::string("mtllib m.mtl\n") + triangle + "usemtl a\nf 1 2 3\nusemtl b\nf 1 3 2\nl 1 2\n");
    Json scene = base();
    scene["groups"]["g"] = {{{"primitives", {{{"obj", {{"file", "m.obj"}}}}, {{"obj", {{"file", "m.obj"}}}}}}}};
    scene["entities"] = {{{"group", "g"}}, {{"group", "g"}, {"transform", {{{"translate", {1, 0, 0}}}}}}};
    const Scene loaded = load(folder, scene);
    CHECK(loaded.entities.size() == 8);
    CHECK(loaded.materials.size() == 3);
    CHECK(loaded.vertices.size() == 5);  // read once; the second face has other coordinates at two of its corners
    CHECK(says(loaded, "m.obj is rendered without lines, points and curves, map_Bump"));
}
