#include "common/cost/knobs.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/cost/reference.h"

namespace tandem {

namespace {

constexpr std::uint32_t reference_roulette = 4;  // scattering events before it may end a path

bool has_kind(const Scene& scene, bool triangles) {
    for (const PlacedPrimitive placed : placed_primitives(scene))
        if ((scene.primitives[placed.primitive].kind == PrimitiveKind::triangle) == triangles) return true;
    return false;
}

struct LightCount {
    std::uint32_t near = 0, far = 0;  // suns and the sampled background are far
};

// Those that next events sample (MODEL.md section 9.2), but for their areas.
LightCount sampled_lights(const Scene& scene) {
    const auto shines = [](const glm::dvec3& light) { return light != glm::dvec3(0.0); };
    LightCount count;
    for (const PlacedPrimitive placed : placed_primitives(scene)) {
        const Material& material = scene.materials[scene.entities[placed.entity].material];
        const bool tracked = material.translucent && (material.interior != no_index || material.priority);
        if (shines(material.radiance) && !tracked) ++count.near;
    }
    for (const PunctualLight& light : scene.lights)
        if (shines(light.intensity)) ++(light.kind == PunctualKind::sun ? count.far : count.near);
    if (scene.background.sampled) ++count.far;
    return count;
}

void add_light_samplings(std::vector<KnobSetting>& all, const Scene& scene, const ArmSettings& baseline) {
    const LightCount lights = sampled_lights(scene);
    const std::string bring = chooses_lights(baseline.render.integrator) ? "" : "--integrator next-event ";
    for (std::size_t i = 0; i < light_sampling_names.size(); ++i) {
        const auto sampling = static_cast<LightSampling>(i);
        if (sampling == baseline.render.light_sampling) continue;
        const std::string name(light_sampling_names[i]);
        std::string reason;
        if (lights.near + lights.far < 2) reason = "the scene has no two lights to choose from";
        if (reason.empty() && lights.near < 2 && sampling == LightSampling::tree)
            reason = "the scene has no two lights in a tree, which suns and the background are not in";
        all.push_back({"light-sampling", name, bring + "--light-sampling " + name,
            [sampling](ArmSettings& arm) {
                if (!chooses_lights(arm.render.integrator)) arm.render.integrator = Integrator::next_event;
                arm.render.light_sampling = sampling;
            },
            reason});
    }
}

void add_integrators(std::vector<KnobSetting>& all, const ArmSettings& baseline) {
    const std::string weigh = baseline.render.mis ? "" : " --mis on";  // only next-event does without
    const bool by_power = baseline.render.light_sampling == LightSampling::power;
    const std::string unchosen = by_power ? "" : " --light-sampling power";  // of those that choose no light
    for (std::size_t i = 0; i < integrator_names.size(); ++i) {
        const auto integrator = static_cast<Integrator>(i);
        if (integrator == baseline.render.integrator) continue;
        const std::string name(integrator_names[i]);
        all.push_back(
            {"integrator", name, "--integrator " + name + weigh + (chooses_lights(integrator) ? "" : unchosen),
                [integrator](ArmSettings& arm) {
                    arm.render.integrator = integrator;
                    arm.render.mis = true;
                    if (!chooses_lights(integrator)) arm.render.light_sampling = LightSampling::power;
                },
                ""});
    }
    // MIS is a setting of next events alone, so this knob brings them with it.
    const bool next_events = baseline.render.integrator == Integrator::next_event;
    const std::string bring = next_events ? "" : "--integrator next-event ";
    for (const bool mis : {true, false})
        if (mis != baseline.render.mis && (!mis || next_events))
            all.push_back({"mis", mis ? "on" : "off", bring + "--mis " + (mis ? "on" : "off"),
                [mis](ArmSettings& arm) {
                    arm.render.integrator = Integrator::next_event;
                    arm.render.mis = mis;
                },
                ""});
    // The thesis's table of renderers beside path tracing: what the eye meets, and the light that it receives
    // unblocked.
    all.push_back({"integrator", "ray-casting", "--integrator path --bounces 0" + weigh + unchosen,
        [](ArmSettings& arm) {
            arm.render.integrator = Integrator::path;
            arm.render.mis = true;
            arm.render.light_sampling = LightSampling::power;
            arm.render.bounces = 0;
        },
        ""});
    all.push_back({"integrator", "ray-casting-with-shadows", "--integrator whitted --bounces 1" + weigh,
        [](ArmSettings& arm) {
            arm.render.integrator = Integrator::whitted;
            arm.render.mis = true;
            arm.render.bounces = 1;
        },
        ""});
}

void add_path_lengths(std::vector<KnobSetting>& all, const ArmSettings& baseline) {
    for (const std::uint32_t bounces : {1u, 2u, 4u, 8u, 16u, 32u})
        if (bounces != baseline.render.bounces)
            all.push_back({"bounces", std::to_string(bounces), fmt::format("--bounces {}", bounces),
                [bounces](ArmSettings& arm) { arm.render.bounces = bounces; }, ""});
    for (const std::uint32_t start : {1u, 4u, 8u})
        all.push_back(
            {"roulette", std::to_string(start), fmt::format("--roulette {} --bounces {}", start, unlimited_bounces),
                [start](ArmSettings& arm) {
                    arm.render.roulette_start = start;
                    arm.render.bounces = unlimited_bounces;
                },
                ""});
}

void add_intersections(
    std::vector<KnobSetting>& all, const Scene& scene, const ArmSettings& baseline, const std::string& backend) {
    const IntersectionSettings& base = baseline.render.intersection;
    const std::string no_triangles = has_kind(scene, true) ? "" : "the scene has no triangles";
    const std::string no_convex = has_kind(scene, false) ? "" : "the scene has no spheres or cuboids";
    for (std::size_t i = 0; i < triangle_kernel_names.size(); ++i) {
        const auto kernel = static_cast<TriangleKernel>(i);
        const bool of_embree = kernel == TriangleKernel::embree || kernel == TriangleKernel::embree_robust;
        if (kernel == base.triangles || (of_embree && backend != "cpu")) continue;
        const std::string name(triangle_kernel_names[i]);
        all.push_back({"triangle-test", name, "--triangle-test " + name,
            [kernel](ArmSettings& arm) { arm.render.intersection.triangles = kernel; }, no_triangles});
    }
    for (std::size_t i = 0; i < convex_kernel_names.size(); ++i) {
        const auto kernel = static_cast<ConvexKernel>(i);
        if (kernel == base.convex) continue;
        const std::string name(convex_kernel_names[i]);
        all.push_back({"convex-test", name, "--convex-test " + name,
            [kernel](ArmSettings& arm) { arm.render.intersection.convex = kernel; }, no_convex});
    }
    for (std::size_t i = 0; i < guard_names.size(); ++i) {
        const auto guard = static_cast<SelfIntersectionGuard>(i);
        if (guard == base.guard) continue;
        const std::string name(guard_names[i]);
        all.push_back({"guard", name, "--guard " + name,
            [guard](ArmSettings& arm) { arm.render.intersection.guard = guard; }, ""});
    }
}

void add_hierarchies(std::vector<KnobSetting>& all, const Scene& scene, const ArmSettings& baseline) {
    // Fewer primitives are tested one by one, on either backend.
    constexpr std::uint32_t fewest = 64;
    const std::string reason =
        placed_primitives(scene).size() < fewest ? "the scene has too few primitives for a hierarchy" : "";
    for (std::size_t i = 0; i < hierarchy_quality_names.size(); ++i) {
        const auto quality = static_cast<HierarchyQuality>(i);
        if (quality == baseline.render.hierarchy) continue;
        const std::string name(hierarchy_quality_names[i]);
        all.push_back({hierarchy_knob, name, "--hierarchy-quality " + name,
            [quality](ArmSettings& arm) { arm.render.hierarchy = quality; }, reason});
    }
}

void add_precisions(std::vector<KnobSetting>& all, const ArmSettings& baseline) {
    for (std::size_t i = 0; i < precision_names.size(); ++i) {
        const auto precision = static_cast<Precision>(i);
        if (precision == baseline.backend.precision.value_or(Precision::single_precision)) continue;
        const std::string name(precision_names[i]);
        all.push_back({"precision", name, "--precision " + name,
            [precision](ArmSettings& arm) { arm.backend.precision = precision; }, ""});
    }
}

void add_samplings(
    std::vector<KnobSetting>& all, const Scene& scene, const ArmSettings& baseline, Accumulation own, double mean) {
    for (std::size_t i = 0; i < generator_names.size(); ++i) {
        const auto generator = static_cast<Generator>(i);
        if (generator == baseline.render.generator) continue;
        const std::string name(generator_names[i]);
        all.push_back({"generator", name, "--generator " + name,
            [generator](ArmSettings& arm) { arm.render.generator = generator; }, ""});
    }
    for (std::size_t i = 0; i < accumulation_names.size(); ++i) {
        const auto accumulation = static_cast<Accumulation>(i);
        if (accumulation == baseline.render.accumulation.value_or(own)) continue;
        const std::string name(accumulation_names[i]);
        all.push_back({"accumulation", name, "--accumulation " + name,
            [accumulation](ArmSettings& arm) { arm.render.accumulation = accumulation; }, ""});
    }
    for (std::size_t i = 0; i < sampling_names.size(); ++i) {
        const auto sampling = static_cast<Sampling>(i);
        if (sampling == baseline.render.sampling) continue;
        const std::string name(sampling_names[i]);
        all.push_back({"sampling", name, "--sampling " + name,
            [sampling](ArmSettings& arm) { arm.render.sampling = sampling; }, ""});
    }
    for (const double means : {4.0, 16.0, 64.0}) {
        const std::string setting = fmt::format("{:g} means", means);
        // So that what is measured is what the option says.
        const std::string value = fmt::format("{:.3g}", means * mean);
        const double clamp = std::stod(value);
        all.push_back({"clamp", setting, mean > 0.0 ? "--clamp " + value : "--clamp at that many means of the image",
            [clamp](ArmSettings& arm) { arm.render.clamp = clamp; }, ""});
    }
    const auto translucent = [](const Material& material) { return material.translucent; };
    const bool any = std::ranges::any_of(scene.materials, translucent);
    for (const Fresnel fresnel : {Fresnel::exact, Fresnel::schlick}) {
        const auto has = [&](const Material& material) {
            return translucent(material) && baseline.render.fresnel.value_or(material.fresnel) != fresnel;
        };
        if (any && std::ranges::none_of(scene.materials, has)) continue;
        const std::string name = fresnel == Fresnel::exact ? "exact" : "schlick";
        all.push_back(
            {"fresnel", name, "--fresnel " + name, [fresnel](ArmSettings& arm) { arm.render.fresnel = fresnel; },
                any ? "" : "the scene has no translucent materials"});
    }
}

// Another filter is another image: what it differs by from the baseline's is a bias, however many samples there are.
void add_filters(std::vector<KnobSetting>& all, const ArmSettings& baseline) {
    for (std::size_t i = 0; i < pixel_filter_names.size(); ++i) {
        const auto filter = static_cast<PixelFilter>(i);
        if (filter == baseline.render.filter) continue;
        const std::string name(pixel_filter_names[i]);
        all.push_back(
            {"filter", name, "--filter " + name, [filter](ArmSettings& arm) { arm.render.filter = filter; }, ""});
    }
}

// Not on top of a baseline whose samples do not tell the noise.
void add_denoising(std::vector<KnobSetting>& all, const ArmSettings& baseline) {
    const bool scattered = baseline.render.generator != Generator::sobol;
    all.push_back({"denoise", "on", "--aov albedo,normal,depth, then tandem denoise",
        [](ArmSettings& arm) { arm.denoise = true; },
        scattered ? "" : "Sobol points do not tell the variance that the filter needs"});
}

}  // namespace

std::vector<KnobSetting> knob_settings(
    const Scene& scene, const ArmSettings& baseline, const RendererInfo& renderer, double mean) {
    std::vector<KnobSetting> all;
    add_integrators(all, baseline);
    add_light_samplings(all, scene, baseline);
    add_path_lengths(all, baseline);
    add_samplings(all, scene, baseline, renderer.accumulation, mean);
    add_filters(all, baseline);
    add_precisions(all, baseline);
    add_intersections(all, scene, baseline, renderer.backend);
    add_hierarchies(all, scene, baseline);
    add_denoising(all, baseline);
    return all;
}

bool keeps_estimate(const Scene& scene, const ArmSettings& baseline, const ArmSettings& arm) {
    const RenderSettings& render = arm.render;
    const auto is_as_reflected = [&](const Material& material) {
        return !material.translucent || render.fresnel.value_or(material.fresnel) == material.fresnel;
    };
    // The reference finds punctual lights by next events. Scattering does not, and paths from both ends find more of
    // their light: what mirrors throw (MODEL.md section 8.3).
    const bool finds_light = render.integrator == Integrator::next_event || scene.lights.empty();
    return render.integrator != Integrator::whitted && finds_light && render.bounces >= baseline.render.bounces &&
           render.clamp == std::numeric_limits<double>::infinity() &&
           std::ranges::all_of(scene.materials, is_as_reflected) && render.filter == baseline.render.filter &&
           render.accumulation != Accumulation::plain && render.intersection == IntersectionSettings{} &&
           arm.backend.precision != Precision::half_storage && !arm.denoise;
}

bool have_one_mean(const ArmSettings& a, const ArmSettings& b) {
    const auto without = [](ArmSettings arm) {
        const RenderSettings any;
        arm.render.generator = any.generator;
        arm.render.sampling = any.sampling;
        arm.render.hierarchy = any.hierarchy;
        if (std::isfinite(arm.render.clamp)) return text_of(arm, {});  // what it cuts depends on how samples scatter
        arm.render.light_sampling = any.light_sampling;
        arm.render.roulette_start = any.roulette_start;
        return text_of(arm, {});
    };
    return without(a) == without(b);
}

ArmSettings reference_settings(const ArmSettings& baseline, const std::string& reference_backend) {
    ArmSettings reference = baseline;
    // What converges fastest. Next events with MIS never make an estimate wrong. Sobol points of different upper halves
    // of the sample number are scrambled independently, so that the two halves are independent.
    reference.render.integrator = Integrator::next_event;
    reference.render.mis = true;
    reference.render.light_sampling = LightSampling::power;
    reference.render.bounces = unlimited_bounces;
    reference.render.roulette_start = reference_roulette;
    reference.render.intersection = IntersectionSettings{};
    reference.render.hierarchy = HierarchyQuality::high;
    reference.render.generator = Generator::sobol;
    reference.render.clamp = std::numeric_limits<double>::infinity();
    reference.render.fresnel.reset();
    reference.render.effects.reset();
    reference.render.accumulation.reset();
    reference.render.sampling = Sampling::uniform;
    reference.backend = BackendOptions{};
    if (reference_backend == "cpu") reference.backend.precision = Precision::double_precision;
    return reference;
}

}  // namespace tandem
