// What specialisation leaves of the shaders. With an effect its code is there, without it is gone, and so are its
// buffers and its state in a path.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <map>
#include <set>
#include <spirv-tools/libspirv.hpp>

#include "tests/vulkan/scenes.h"
#include "vulkan/framework/shader_library.h"
#include "vulkan/framework/spirv_optimizer.h"
#include "vulkan/renderer/kernels/stages.h"

using namespace tandem;
using namespace tandem::testing;

namespace {

std::vector<SpecialisationConstant> constants_of(EffectSet effects) {
    Specialisation specialisation;
    specialisation.effects = effects;
    // As general kernels are told them: without a primitive there would be no code for any.
    specialisation.triangles = specialisation.spheres = specialisation.cuboids = 0xffffffffu;
    specialisation.path.interiors = effects.has(Effect::interiors);
    return specialisation.constants();
}

std::vector<std::uint32_t> optimised(Stage stage, EffectSet effects) {
    return optimised_spirv(shader_code(stage), constants_of(effects));
}

std::vector<std::uint32_t> trimmed(Stage stage, EffectSet effects) {
    return trimmed_spirv(shader_code(stage), constants_of(effects));
}

// What a module's constants and variables are called in traits.
struct Names {
    std::map<std::uint32_t, std::uint32_t> constants, sets, bindings;
    std::set<std::uint32_t> pushed;

    // "binding 0 6", "push"; empty: neither.
    [[nodiscard]] std::string variable(std::uint32_t id) const {
        if (const auto found = bindings.find(id); found != bindings.end())
            return fmt::format("binding {} {}", sets.at(id), found->second);
        return pushed.contains(id) ? "push" : "";
    }
};

// Within functions these are opcodes ("op 166"), alone and with each constant operand ("op 170 of 0x4"), functions of
// GLSL.std.450 ("function 8"), and bindings. Others are members by which blocks are entered ("push 10", "binding 0 0
// 3"; * is no constant), and literals ("literal 0x40000000").
std::set<std::string> traits_of(std::span<const std::uint32_t> code) {
    constexpr std::uint32_t ext_inst = 12, constant = 43, function = 54, variable = 59, access_chain = 65,
                            decorate = 71, binding = 33, set = 34, push_constant = 9;
    constexpr std::uint32_t shuffle = 79, composite_extract = 81, composite_insert = 82;  // literals as operands
    std::set<std::string> traits;
    Names names;
    bool within = false;
    for (std::size_t at = 5; at < code.size(); at += code[at] >> 16) {
        const std::uint32_t opcode = code[at] & 0xffffu, words = code[at] >> 16;
        if (opcode == decorate && code[at + 2] == set) names.sets[code[at + 1]] = code[at + 3];
        if (opcode == decorate && code[at + 2] == binding) names.bindings[code[at + 1]] = code[at + 3];
        if (opcode == variable && code[at + 3] == push_constant) names.pushed.insert(code[at + 2]);
        if (opcode == constant) {
            names.constants[code[at + 2]] = code[at + 3];
            traits.insert(fmt::format("literal {:#x}", code[at + 3]));
        }
        within = within || opcode == function;
        if (!within) continue;
        traits.insert(opcode == ext_inst ? fmt::format("function {}", code[at + 4]) : fmt::format("op {}", opcode));
        if (opcode == access_chain) {
            std::string chain = names.variable(code[at + 3]);
            if (!chain.empty()) traits.insert(chain);
            for (std::size_t word = 4; word < words; ++word) {
                const auto found = names.constants.find(code[at + word]);
                chain += found == names.constants.end() ? " *" : fmt::format(" {}", found->second);
            }
            traits.insert(chain);
            continue;
        }
        if (opcode == ext_inst || opcode == shuffle || opcode == composite_extract || opcode == composite_insert)
            continue;
        for (std::size_t word = 1; word < words; ++word)
            if (const auto found = names.constants.find(code[at + word]); found != names.constants.end())
                traits.insert(fmt::format("op {} of {:#x}", opcode, found->second));
    }
    return traits;
}

std::string literal(float value) { return fmt::format("literal {:#x}", std::bit_cast<std::uint32_t>(value)); }

struct Signature {
    Effect effect;
    Stage stage;
    EffectSet around;         // what the effect is looked at beside
    std::string trait;        // that only its code has; empty: its instructions are counted alone
    std::string reason = "";  // why there is no such trait
};

const EffectSet plain{Effect::triangles, Effect::diffuse};
const EffectSet lit = plain.united({Effect::emission, Effect::light_sampling, Effect::triangle_lights});
// A test of a bit of flags, a comparison with the number of a kind.
std::string flag(std::uint32_t bit) { return fmt::format("op 199 of {:#x}", bit); }
std::string kind(std::uint32_t number) { return fmt::format("op 170 of {:#x}", number); }

constexpr const char* scaled = "op 133 of 0x3f800000";  // OpFMul by the share of a surface's light: 1
constexpr const char* compared = "op 179";              // OpSLessThan, of priorities alone
constexpr const char* floor_ = "function 8";
constexpr const char* at_most = "op 188";   // OpFOrdLessThanEqual
constexpr const char* to_whole = "op 110";  // OpConvertFToS
constexpr const char* clamp_ = "function 43";
constexpr const char* tables = "binding 0 15";

std::vector<Signature> signatures() {
    const EffectSet glass_ = plain.with(Effect::translucent), fog = plain.with(Effect::medium_absorption);
    const EffectSet textured = plain.with(Effect::checker);
    return {{Effect::triangles, Stage::intersect, {Effect::spheres, Effect::diffuse}, "binding 0 7"},
        {Effect::spheres, Stage::intersect, plain, "binding 0 8"},
        {Effect::cuboids, Stage::intersect, plain, "binding 0 9"},
        {Effect::entity_motion, Stage::intersect, plain, "binding 0 3"}, {Effect::lens, Stage::ray_gen, plain, floor_},
        {Effect::camera_motion, Stage::ray_gen, plain, "binding 1 0 14"},
        {Effect::diffuse, Stage::scatter, {Effect::triangles, Effect::specular}, literal(3.14159265f)},
        {Effect::specular, Stage::scatter, plain, literal(2.0f)},
        {Effect::fuzz, Stage::scatter, plain.with(Effect::specular), literal(0x1p-40f)},
        {Effect::translucent, Stage::scatter, plain, literal(2.0f)}, {Effect::schlick, Stage::scatter, glass_, flag(2)},
        {Effect::rough_translucent, Stage::scatter, glass_, at_most},
        {Effect::smooth_conductor, Stage::scatter, plain, literal(2.0f)},
        {Effect::rough_conductor, Stage::scatter, plain, at_most},
        {Effect::rough_diffuse, Stage::scatter, plain, literal(33.0f)},
        {Effect::boundary, Stage::scatter, plain, kind(4)}, {Effect::emission, Stage::scatter, plain, scaled},
        {Effect::one_sided_emission, Stage::scatter, plain.with(Effect::emission), flag(4)},
        {Effect::translucent_emission, Stage::scatter, glass_.with(Effect::emission), "",
            "chooses between alpha, which absorption reads too, and 1: nothing of it is its own"},
        {Effect::shading_normals, Stage::scatter, {Effect::triangles, Effect::diffuse}, tables},
        {Effect::texture_coordinates, Stage::scatter, textured, tables},
        {Effect::checker, Stage::scatter, plain, "binding 0 14"},
        {Effect::noise, Stage::scatter, plain, "literal 0x19660d"},  // 1664525
        {Effect::image_texture, Stage::scatter, textured.with(Effect::texture_coordinates), to_whole},
        {Effect::background, Stage::scatter, plain, "binding 0 0"},
        {Effect::background_gradient, Stage::scatter, plain.with(Effect::background), "binding 0 0 2"},
        {Effect::background_image, Stage::scatter, plain.with(Effect::background), tables},
        {Effect::medium_absorption, Stage::scatter, plain, "binding 0 16"},
        {Effect::medium_scattering, Stage::scatter, fog, literal(0.693147181f)},
        {Effect::anisotropic_phase, Stage::scatter, fog.with(Effect::medium_scattering), clamp_},
        {Effect::density_grid, Stage::scatter, fog, tables}, {Effect::interiors, Stage::scatter, plain, "binding 2 14"},
        {Effect::nested_dielectrics, Stage::scatter, glass_.with(Effect::interiors), compared},
        {Effect::light_sampling, Stage::intersect, plain.with(Effect::emission), "binding 2 11"},
        {Effect::triangle_lights, Stage::scatter,
            // No surface is a triangle, so that none but the light's are read.
            {Effect::spheres, Effect::diffuse, Effect::emission, Effect::light_sampling, Effect::sphere_lights},
            "binding 0 7"},
        {Effect::sphere_lights, Stage::scatter, lit.with(Effect::spheres), flag(1u << 27)},
        {Effect::cuboid_lights, Stage::scatter, lit.with(Effect::cuboids), "op 176 of 0x5"},
        {Effect::ellipsoid_lights, Stage::scatter, lit.with(Effect::spheres), kind(7)},
        {Effect::point_lights, Stage::scatter, lit, kind(3)},
        {Effect::spot_lights, Stage::scatter, lit.with(Effect::point_lights), clamp_},
        {Effect::suns, Stage::intersect, lit, "literal 0xffffffff"},
        {Effect::sampled_background, Stage::scatter, lit.with(Effect::background), kind(6)},
        {Effect::direct_only, Stage::scatter, lit, "push 15"}, {Effect::roulette, Stage::scatter, plain, "push 8"}};
}

std::set<std::string> names_of(const std::vector<JobFacts::Part>& parts) {
    std::set<std::string> names;
    for (const JobFacts::Part& part : parts) names.insert(part.name);
    return names;
}

JobFacts facts_of(const Scene& scene, const RenderSettings& settings) {
    return renderer_with_kernel("stages").prepare(scene, settings)->facts();
}

std::uint64_t instructions(const JobFacts& facts) {
    std::uint64_t sum = 0;
    for (const JobFacts::Part& kernel : facts.kernels) sum += kernel.amount;
    return sum;
}

}  // namespace

TEST_CASE("every effect's code is in the optimised SPIR-V with it, and gone without it" * doctest::test_suite("full")) {
    EffectSet tested;
    for (const Signature& signature : signatures()) {
        CAPTURE(effect_name(signature.effect));
        tested = tested.with(signature.effect);
        const auto with = optimised(signature.stage, signature.around.with(signature.effect));
        const auto without = optimised(signature.stage, signature.around.without(signature.effect));
        CHECK(count_instructions(with) > count_instructions(without));
        CHECK(signature.trait.empty() != signature.reason.empty());
        if (signature.trait.empty()) continue;
        CHECK(traits_of(with).contains(signature.trait));
        CHECK(!traits_of(without).contains(signature.trait));
    }
    CHECK(tested == EffectSet::all());
}

TEST_CASE(
    "trimmed kernels are valid, have no constants left to specialise, and hold less the fewer effects there are") {
    constexpr std::uint32_t spec_constant_true = 48, spec_constant_op = 52;
    const spvtools::SpirvTools tools(SPV_ENV_VULKAN_1_2);
    for (const Stage stage : {Stage::vertex, Stage::ray_gen, Stage::intersect, Stage::scatter, Stage::megakernel,
             Stage::fragment, Stage::ray_batch}) {
        CAPTURE(static_cast<int>(stage));
        std::uint64_t least = count_instructions(shader_code(stage));
        for (const EffectSet effects : {EffectSet::all(), EffectSet().with(Effect::triangles)}) {
            const std::vector<std::uint32_t> code = trimmed(stage, effects);
            CHECK(tools.Validate(code));
            for (std::size_t at = 5; at < code.size(); at += code[at] >> 16) {
                const std::uint32_t opcode = code[at] & 0xffffu;
                CHECK_FALSE((opcode >= spec_constant_true && opcode <= spec_constant_op));
            }
            CHECK(count_instructions(code) <= least);
            least = count_instructions(code);
        }
        CHECK(least < count_instructions(shader_code(stage)));
    }
}

TEST_CASE("a plain scene has no buffers, no state and fewer instructions than general kernels") {
    SceneBuilder builder;
    builder.camera({0, 1, 4}, {0, 0, 0}).background(glm::dvec3(1.0), glm::dvec3(1.0));
    builder.sphere(builder.material(diffuse(glm::dvec3(0.5))), {0, 0, 0}, 1.0);
    RenderSettings settings = settings_of(16, 4);
    const JobFacts own = facts_of(builder.scene(), settings);
    settings.effects = EffectSet::all();
    const JobFacts general = facts_of(builder.scene(), settings);
    CHECK(own.effects == needed_effects(builder.scene(), settings));
    CHECK(general.effects == EffectSet::all());
    CHECK(own.kernels.size() == 6);
    CHECK(4 * instructions(own) < instructions(general));
    CHECK(own.bytes_per_path == 3 * 16);           // origin, direction, throughput
    CHECK(general.bytes_per_path == 6 * 16 + 16);  // radiance, contribution, shadow ray, interiors
    const std::set<std::string> names = names_of(own.buffers);
    for (const char* name : {"gathered-radiances", "next-event-contributions", "shadow-rays", "interiors", "textures",
             "image-texels", "media", "density-grid", "lights", "tree-nodes", "world-triangles", "world-cuboids"})
        CHECK(!names.contains(name));
    for (const char* name : {"ray-origins", "world-spheres", "materials", "sums"}) CHECK(names.contains(name));
    CHECK(own.kernel_seconds > 0.0);
}

TEST_CASE("the buffers of textures, skies, media and bodies are there where they are called for") {
    const std::set<std::string> outdoor =
        names_of(facts_of(outdoor_scene(true), settings_of(8, 2, Integrator::next_event)).buffers);
    for (const char* name : {"textures", "image-texels", "texture-coordinates", "background-image", "background-shares",
             "lights", "shadow-rays"})
        CHECK(outdoor.contains(name));
    CHECK(!outdoor.contains("media"));
    CHECK(!outdoor.contains("interiors"));
    const std::set<std::string> foggy = names_of(facts_of(foggy_scene(), settings_of(8, 2)).buffers);
    for (const char* name : {"media", "density-grid", "interiors"}) CHECK(foggy.contains(name));
    for (const char* name : {"textures", "background-image", "lights", "shadow-rays"}) CHECK(!foggy.contains(name));
}
