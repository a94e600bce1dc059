// Devices whose stages see few storage buffers: those of a set are parts of one, and images keep their bits. The
// machine's device plays them, under a layer that lowers its limits (few_buffers.h).
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <numeric>
#include <set>
#include <spirv-tools/libspirv.hpp>
#include <vector>

#include "common/error.h"
#include "common/render/path_trace.h"
#include "common/scene/loader/scene_loader.h"
#include "tests/refusal.h"
#include "tests/thorough.h"
#include "tests/vulkan/few_buffers.h"
#include "tests/vulkan/machine.h"
#include "vulkan/framework/spirv_merging.h"
#include "vulkan/framework/spirv_words.h"

using namespace tandem;
using namespace tandem::testing;

namespace {

std::unique_ptr<Renderer> renderer(const std::string& kernel, Precision precision = Precision::single_precision) {
    BackendOptions options;
    options.kernel = kernel;
    options.precision = precision;
    return vulkan_backend().create(options);
}

// The same on a device with so few storage buffers.
std::unique_ptr<Renderer> with_few(std::uint32_t storage_buffers, const std::string& kernel,
    Precision precision = Precision::single_precision, bool validation = false) {
    const FewBuffers few({.storage_buffers = storage_buffers}, validation);
    BackendOptions options;
    options.kernel = kernel;
    options.precision = precision;
    options.validation = validation;
    return vulkan_backend().create(options);
}

Estimate image(Renderer& renderer, const Scene& scene, const RenderSettings& settings) {
    return renderer.prepare(scene, settings)->render({0, 70}).estimate;
}

RenderSettings lit() {
    RenderSettings settings = settings_of(13, 4, Integrator::next_event);
    settings.roulette_start = 2;
    return settings;
}

// Sets and bindings of the module's storage buffers.
std::set<std::pair<std::uint32_t, std::uint32_t>> storage_bindings(std::span<const std::uint32_t> code) {
    constexpr std::uint32_t decorate = 71, variable = 59, storage_buffer = 12, binding = 33, descriptor_set = 34;
    std::map<std::uint32_t, std::uint32_t> sets, bindings;
    std::set<std::pair<std::uint32_t, std::uint32_t>> found;
    spirv::for_each_instruction(code, [&](std::span<const std::uint32_t> words) {
        if (spirv::opcode_of(words) == decorate && words[2] == descriptor_set) sets[words[1]] = words[3];
        if (spirv::opcode_of(words) == decorate && words[2] == binding) bindings[words[1]] = words[3];
        if (spirv::opcode_of(words) == variable && words[3] == storage_buffer)
            found.emplace(sets.at(words[2]), bindings.at(words[2]));
    });
    return found;
}

std::string reason_of(const std::function<void()>& action) {
    try {
        action();
    } catch (const UnsupportedError& refusal) {
        return refusal.what();
    }
    return {};
}

}  // namespace

TEST_CASE("the layouts of merged sets hold what a device is asked for") {
    std::vector<SetBindings> sets = separate_bindings({});
    CHECK(storage_buffers(sets) == separate_storage_buffers);
    for (SetBindings& set : sets) set = merged(set);
    CHECK(storage_buffers(sets) == merged_storage_buffers);
    CHECK(sets.size() == bound_sets_needed);
    std::uint32_t uniform = 0;
    for (const SetBindings& set : sets)
        for (const SetBinding& binding : set)
            if (binding.type == vk::DescriptorType::eUniformBuffer) uniform += binding.count;
    CHECK(uniform == merged_uniform_buffers);
}

TEST_CASE("every kernel with merged buffers is valid, and sees three storage buffers at most") {
    spvtools::SpirvTools tools(SPV_ENV_VULKAN_1_2);
    std::string messages;
    tools.SetMessageConsumer([&](spv_message_level_t, const char*, const spv_position_t&, const char* message) {
        messages += std::string(message) + "\n";
    });
    std::size_t most_before = 0, checked = 0;
    const auto check = [&](std::span<const std::uint32_t> code) {
        const std::vector<std::uint32_t> words = with_merged_buffers(code, separate_bindings({}));
        most_before = std::max(most_before, storage_bindings(code).size());
        std::size_t seen = storage_bindings(words).size();
        if (storage_bindings(words).contains({4, 0})) --seen;  // what a pattern tells
        CHECK(seen <= merged_storage_buffers);
        CHECK_MESSAGE(tools.Validate(words), messages);
        ++checked;
    };
    for (std::uint32_t stage = 0; stage <= static_cast<std::uint32_t>(Stage::rt_nothing); ++stage) {
        CAPTURE(stage);
        check(shader_code(static_cast<Stage>(stage)));
        for (std::uint32_t number = 1; number <= static_cast<std::uint32_t>(last_variant); ++number) {
            const auto variant = static_cast<ShaderVariant>(number);
            if (variant == ShaderVariant::arrays || variant == ShaderVariant::arrays_nonuniform) continue;
            CAPTURE(number);
            if (const auto code = shader_variant(static_cast<Stage>(stage), variant); !code.empty()) check(code);
        }
    }
    CHECK(most_before > 10);
    CHECK(checked > 40);
}

TEST_CASE("arrays of descriptors cannot be merged") {
    CHECK_THROWS_AS(static_cast<void>(with_merged_buffers(
                        shader_variant(Stage::scatter, ShaderVariant::arrays), separate_bindings({}))),
        Error);
}

TEST_CASE("with 4, 8 and 24 storage buffers every shape of kernel gives the bits that it gives with 32" *
          doctest::test_suite("full")) {
    for (const char* kernel : {"stages", "megakernel", "image-stages", "fragment"}) {
        CAPTURE(kernel);
        const auto enough = renderer(kernel);
        const Estimate expected = image(*enough, foggy_scene(), lit()), full = image(*enough, full_scene(), lit()),
                       outdoor = image(*enough, outdoor_scene(true), lit());
        for (const std::uint32_t storage_buffers : {4u, 8u, 24u}) {
            CAPTURE(storage_buffers);
            const auto few = with_few(storage_buffers, kernel);
            CHECK(same_bits(image(*few, foggy_scene(), lit()), expected));
            if (storage_buffers != 4) continue;
            CHECK(same_bits(image(*few, full_scene(), lit()), full));
            CHECK(same_bits(image(*few, outdoor_scene(true), lit()), outdoor));
        }
    }
}

namespace {

// Both shapes against the stages of a device that has enough.
void check_fog(const RenderSettings& settings) {
    const auto enough = renderer("stages"), few = with_few(4, "stages"), few_whole = with_few(4, "megakernel");
    const Estimate expected = image(*enough, foggy_scene(), settings);
    CHECK(same_bits(image(*few, foggy_scene(), settings), expected));
    CHECK(same_bits(image(*few_whole, foggy_scene(), settings), expected));
}

}  // namespace

TEST_CASE("general kernels keep their bits with 4 storage buffers" * doctest::test_suite("full")) {
    RenderSettings settings = lit();
    settings.effects = EffectSet::all();
    check_fog(settings);
}

TEST_CASE("sums of each kind and trees keep their bits with 4 storage buffers" * doctest::test_suite("full")) {
    for (const Accumulation accumulation : {Accumulation::plain, Accumulation::compensated}) {
        RenderSettings settings = lit();
        settings.accumulation = accumulation;
        check_fog(settings);
    }
    const auto trees = [] { return vulkan_backend(Acceleration::trees).create({}); };
    const auto with_trees = trees(), few_trees = [&] {
        const FewBuffers fewer({});
        return trees();
    }();
    CHECK(same_bits(image(*few_trees, full_scene(), lit()), image(*with_trees, full_scene(), lit())));
}

TEST_CASE("lists of pixels keep their bits with 4 storage buffers" * doctest::test_suite("full")) {
    RenderSettings settings = lit();
    settings.sampling = Sampling::adaptive;
    const std::vector<std::uint32_t> pixels{0, 3, 4, 77, 168};
    const auto listed = [&](const std::unique_ptr<Renderer>& renderer) {
        return renderer->prepare(foggy_scene(), settings)->render_pixels({64, 131}, pixels).estimate;
    };
    const Estimate expected = listed(renderer("stages"));
    CHECK(same_bits(listed(with_few(4, "stages")), expected));
    CHECK(same_bits(listed(with_few(4, "megakernel")), expected));
}

TEST_CASE("half storage keeps its bits with 4 storage buffers") {
    const auto enough = renderer("stages", Precision::half_storage),
               few = with_few(4, "stages", Precision::half_storage);
    CHECK(same_bits(image(*few, foggy_scene(), lit()), image(*enough, foggy_scene(), lit())));
}

TEST_CASE("paths in mixed and double precision keep their bits with 4 storage buffers, rendered and traced" *
          doctest::test_suite("full")) {
    for (const Precision precision : {Precision::single_precision, Precision::mixed, Precision::double_precision}) {
        if (precision == Precision::mixed && !test::thorough()) continue;
        CAPTURE(static_cast<std::uint32_t>(precision));
        const auto enough = renderer("megakernel", precision), few = with_few(4, "megakernel", precision);
        const auto job = enough->prepare(foggy_scene(), lit()), few_job = few->prepare(foggy_scene(), lit());
        CHECK(same_bits(few_job->render({0, 70}).estimate, job->render({0, 70}).estimate));
        const std::vector<PathTrace> paths = job->trace(5, 6, {3, 40}), few_paths = few_job->trace(5, 6, {3, 40});
        REQUIRE(few_paths.size() == paths.size());
        for (std::size_t i = 0; i < paths.size(); ++i) {
            CHECK(few_paths[i].radiance == paths[i].radiance);
            REQUIRE(few_paths[i].vertices.size() == paths[i].vertices.size());
            CHECK(few_paths[i].vertices.back().position == paths[i].vertices.back().position);
        }
    }
}

TEST_CASE("given rays meet the same points with 4 storage buffers, in every precision") {
    std::vector<GivenRay> rays;
    for (int i = 0; i < 200; ++i) {
        GivenRay& ray = rays.emplace_back();
        ray.origin = {0.01 * i - 1.0, 0.003 * i, 3.0};
        ray.direction = {0.002 * i - 0.2, 0.1 - 0.001 * i, -1.0};
    }
    for (const Precision precision : {Precision::single_precision, Precision::mixed, Precision::double_precision}) {
        CAPTURE(static_cast<std::uint32_t>(precision));
        const auto enough = renderer("", precision), few = with_few(4, "", precision);
        const std::vector<RayHit> hits = enough->intersector(full_scene(), {})->intersect(rays).hits,
                                  few_hits = few->intersector(full_scene(), {})->intersect(rays).hits;
        std::size_t met = 0;
        for (std::size_t i = 0; i < rays.size(); ++i) {
            met += hits[i].primitive == no_index ? 0 : 1;
            CHECK(few_hits[i].primitive == hits[i].primitive);
            CHECK(few_hits[i].t == hits[i].t);
            CHECK(few_hits[i].normal == hits[i].normal);
            CHECK(few_hits[i].leaving_back == hits[i].leaving_back);
        }
        CHECK(met > 20);
    }
}

// Two shapes a scene, chosen by its name, for the time that drivers take: of stages, and of whole paths.
TEST_CASE("with 4 storage buffers every shipped scene keeps its bits, with kernels of two shapes" *
          doctest::test_suite("full")) {
    const auto turn_of = [](const std::string& name) { return std::accumulate(name.begin(), name.end(), 0) % 2; };
    const std::array<std::pair<const char*, int>, 4> shapes{
        {{"stages", 0}, {"fragment", 0}, {"image-stages", 1}, {"megakernel", 1}}};
    for (const auto& [kernel, turn] : shapes) {
        const auto enough = renderer(kernel), few = with_few(4, kernel);
        const std::filesystem::path folder = std::filesystem::path(TANDEM_SOURCE_DIR) / "scenes";
        for (const auto& entry : std::filesystem::directory_iterator(folder)) {
            if (entry.path().extension() != ".json" || turn_of(entry.path().stem()) != turn) continue;
            const Scene scene = load_scene(entry.path());
            RenderSettings settings = with_longer_side(default_settings(scene), 21);
            settings.bounces = std::min(settings.bounces, 6u);
            CAPTURE(kernel);
            CAPTURE(scene.name);
            const auto seven = [&](Renderer& renderer) {
                return renderer.prepare(scene, settings)->render({0, 7}).estimate;
            };
            CHECK(same_bits(seven(*few), seven(*enough)));
        }
    }
}

TEST_CASE("the validation layer, told of the least limits, has nothing to say") {
    for (const char* kernel : {"stages", "megakernel", "image-stages", "fragment"}) {
        CAPTURE(kernel);
        const auto few = with_few(4, kernel, Precision::single_precision, true);
        const auto job = few->prepare(foggy_scene(), lit());
        CHECK_NOTHROW(static_cast<void>(job->render({0, 70})));
        CHECK_NOTHROW(static_cast<void>(job->trace(1, 1, {0, 3})));
    }
}

TEST_CASE("ray tracing keeps its bits with 4 storage buffers, or is refused for the want of a descriptor set") {
    Machine enough(false);
    if (!enough.device.features().ray_tracing) return;  // tests/vulkan/test_ray_tracing.cpp says so
    JobPatterns patterns;
    patterns.tracer.kernel = KernelShape::ray_tracing;
    const Estimate expected = enough.job(patterns, full_scene(), lit()).render({0, 70}, {}).estimate;
    {
        const FewBuffers scope({.bound_sets = 5}, true);
        Machine few(true);
        CHECK(same_bits(few.job(patterns, full_scene(), lit()).render({0, 70}, {}).estimate, expected));
    }
    const FewBuffers scope({});
    Machine few(false);
    CHECK(contains(reason_of([&] { (void)few.job(patterns, full_scene(), lit()); }), "binds no more than 4"));
}

TEST_CASE("the list of devices tells of few storage buffers") {
    CHECK(devices_as_json().at("devices")[0].at("abilities").at("merges_storage_buffers") == false);
    const FewBuffers scope({.storage_buffers = 8});
    const nlohmann::json device = devices_as_json().at("devices")[0];
    CHECK(device.at("suitable") == true);
    CHECK(device.at("abilities").at("storage_buffers_per_stage") == 8);
    CHECK(device.at("abilities").at("merges_storage_buffers") == true);
}

TEST_CASE("the validation layer sees where more storage buffers are used than a stage may see") {
    const FewBuffers few({}, true);
    const Instance instance(true);
    const Device device(instance, "");
    const PipelineLayout layout(device, separate_bindings({}), settings_bytes);
    CHECK_THROWS_WITH_AS(instance.log().raise(), doctest::Contains("maxPerStageDescriptorStorageBuffers"), Error);
}

TEST_CASE(
    "patterns keep the image with 4 storage buffers, or are refused with the reason" * doctest::test_suite("full")) {
    Machine enough(false);
    const FewBuffers scope({}, true);
    Machine few(true);
    CHECK(few.device.description().abilities.storage_buffers_per_stage == 4);
    const Estimate expected = enough.job({}, foggy_scene(), lit()).render({0, 70}, {}).estimate;
    const auto attempt = [&](const JobPatterns& patterns) {
        return reason_of([&] {
            const Estimate found = few.job(patterns, foggy_scene(), lit()).render({0, 70}, {}).estimate;
            CHECK(same_bits(found, expected));
        });
    };
    JobPatterns patterns;
    for (const MemoryLayout layout : {MemoryLayout::per_set, MemoryLayout::one_buffer}) {
        patterns.vulkan.memory = layout;
        CHECK(attempt(patterns).empty());
    }
    for (const MemoryLayout layout : {MemoryLayout::per_buffer, MemoryLayout::dedicated, MemoryLayout::one_block,
             MemoryLayout::rays_per_set, MemoryLayout::others_per_set}) {
        patterns.vulkan.memory = layout;
        CHECK(contains(attempt(patterns), "lets a shader stage see 4 storage buffers"));
    }
    patterns = {};
    for (const DescriptorPattern pattern :
        {DescriptorPattern::rewritten, DescriptorPattern::templates, DescriptorPattern::push}) {
        patterns.vulkan.descriptors = pattern;
        CHECK(attempt(patterns).empty());
    }
    for (const DescriptorPattern pattern : {DescriptorPattern::arrays, DescriptorPattern::arrays_nonuniform}) {
        patterns.vulkan.descriptors = pattern;
        CHECK(!attempt(patterns).empty());
    }
    patterns = {};
    for (const ParameterPattern pattern : {ParameterPattern::device_address, ParameterPattern::specialisation}) {
        patterns.vulkan.parameters = pattern;
        CHECK(attempt(patterns).empty());
    }
    for (const ParameterPattern pattern :
        {ParameterPattern::uniform, ParameterPattern::dynamic_uniform, ParameterPattern::storage}) {
        patterns.vulkan.parameters = pattern;
        CHECK(contains(attempt(patterns), "binds no more than 4 descriptor sets"));
    }
    patterns = {};
    for (const BarrierPattern pattern : {BarrierPattern::buffer, BarrierPattern::buffer_apart}) {
        patterns.vulkan.barriers = pattern;
        CHECK(attempt(patterns).empty());
    }
}

TEST_CASE("a table that stages cannot see whole is refused, also where no buffers are merged") {
    const FewBuffers scope({.storage_buffers = 64, .storage_bytes = 1u << 16}, true);
    Machine many(true);
    Scene scene = outdoor_scene(false);
    CHECK(reason_of([&] { (void)many.job({}, scene, lit()); }).empty());
    constexpr std::uint32_t width = 128, height = 64;
    scene.background.image =
        std::make_shared<const Pixels>(Pixels{width, height, std::vector<float>(3 * width * height, 1.0f)});
    scene.background.sampled = true;
    const std::string reason = reason_of([&] { (void)many.job({}, scene, lit()); });
    CHECK(contains(reason, "lets shaders see 64 KiB of a buffer, and the scene's tables take 1"));
}

TEST_CASE("images are cut into tiles whose merged buffers a stage may see, larger scenes are refused") {
    constexpr std::uint32_t bytes = 1u << 16;
    const FewBuffers scope({.storage_bytes = bytes}, true);
    Machine few(true);
    const Scene scene = foggy_scene();
    RenderSettings settings = lit();
    settings.width = 64, settings.height = 48;
    const std::uint32_t tile = tile_size(few.device, 64 * 48, PathState{true, true, true});
    CHECK(tile < 64 * 48);
    CHECK(tile * bytes_per_pixel(PathState{true, true, true}) <= bytes);
    const auto enough = renderer("stages");
    CHECK(same_bits(few.job({}, scene, settings).render({0, 3}, {}).estimate,
        enough->prepare(scene, settings)->render({0, 3}).estimate));
    const auto refusal_of = [&](int spheres) {
        SceneBuilder large;
        for (int i = 0; i < spheres; ++i)
            large.sphere(large.material(diffuse(glm::dvec3(0.5))), {0.1 * i, 0.0, 0.0}, 0.04);
        return reason_of([&] { (void)few.job({}, large.scene(), settings); });
    };
    CHECK(contains(refusal_of(400), "use a smaller scene or image"));
    CHECK(contains(refusal_of(1000), "the scene's transforms take 110; use a smaller scene"));
    CHECK(contains(refusal_of(5000), "the tree of 5000 primitives"));
}
