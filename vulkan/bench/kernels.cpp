// How the work of paths is cut into kernels, and kernels into workgroups.
#include <fmt/format.h>

#include "common/error.h"
#include "vulkan/bench/families.h"

namespace tandem {

namespace {

// Arithmetic that a compiler may order otherwise from kernel to kernel: what is not the baseline's bits is judged.
Arm shape_arm(const SharedDevice& device, const Workload& workload, std::string name, std::string text,
    const JobPatterns& patterns) {
    Arm arm = render_arm(device, workload, std::move(name), std::move(text), patterns);
    arm.same_bits = false;
    return arm;
}

// Kernels for any scene, which CPUs' drivers take minutes and gigabytes to compile.
Arm general_arm(const SharedDevice& device, const Workload& workload, std::string name, std::string text,
    const JobPatterns& patterns) {
    if (device->device().description().type != DeviceType::cpu) {
        const Tuning everything = [](RenderSettings& settings) { settings.effects = EffectSet::all(); };
        Arm arm = tuned_arm(device, workload, std::move(name), std::move(text), patterns, everything);
        arm.same_bits = false;
        return arm;
    }
    return {std::move(name), std::move(text), []() -> std::unique_ptr<ArmRun> {
                throw UnsupportedError("kernels for any scene take a CPU's driver minutes to compile");
            }};
}

JobPatterns with_kernel(KernelShape kernel) {
    JobPatterns patterns;
    patterns.tracer.kernel = kernel;
    return patterns;
}

constexpr const char* megakernel_frame =
    "a frame of one kernel for whole paths, an invocation a pixel, in one submission, with a fence. One thread records "
    "it anew. Its total lasts from before recording to the end of the wait";

}  // namespace

Family kernels_family(const SharedDevice& device) {
    Family family;
    family.name = "kernels";
    family.question = "Into which kernels should the work of paths be cut?";
    family.hypothesis = "A wavefront with compaction beats the thesis's six dispatches over the image and a megakernel";
    family.source = "Ferreira 2019; Laine, Karras and Aila 2013 (36 to 220 %)";
    family.held = "the paths, the scene, one submission, memory, one recording thread";
    family.base = plain_frame;
    family.along = "pixels";
    for (const ImageSize& size : device->sizes()) family.workloads.push_back(workload_of({size, 4, device->bounces()}));
    family.arms = [device](const Workload& workload) {
        const auto arm = [&](const char* name, const char* text, const JobPatterns& patterns) {
            return shape_arm(device, workload, name, text, patterns);
        };
        JobPatterns tiles;
        tiles.tracer.tile_pixels = static_cast<std::uint32_t>(workload.factors.at("pixels") / 8.0) + 1;
        return std::vector<Arm>{
            arm("wavefront", "six stages, rays of each segment compacted in queues, dispatched indirectly", {}),
            arm("image-stages", "the thesis's six stages, each dispatched over the image, rays at their pixels",
                with_kernel(KernelShape::image_stages)),
            arm("megakernel", "whole paths in registers, pixel by pixel", with_kernel(KernelShape::megakernel)),
            arm("fragment", "the same in the fragment shader of a render pass", with_kernel(KernelShape::fragment)),
            arm("ray-tracing", "a ray-tracing pipeline (VK_KHR_ray_tracing_pipeline)",
                with_kernel(KernelShape::ray_tracing)),
            arm("ray-tracing-triangles", "the same with the device's own test of triangles",
                with_kernel(KernelShape::ray_tracing_triangles)),
            arm("ray-query", "whole paths in registers, hits by ray queries (VK_KHR_ray_query)",
                with_kernel(KernelShape::ray_query)),
            arm("ray-query-triangles", "the same with the device's own test of triangles",
                with_kernel(KernelShape::ray_query_triangles)),
            arm("tiles", "wavefront, an eighth of the image after the other, in the same buffers", tiles),
            general_arm(device, workload, "wavefront-general", "wavefront, its kernels made for any scene", {}),
            general_arm(device, workload, "megakernel-general", "megakernel, made for any scene",
                with_kernel(KernelShape::megakernel))};
    };
    return family;
}

Family workgroups_family(const SharedDevice& device) {
    Family family;
    family.name = "workgroups";
    family.question = "How large should workgroups be?";
    family.hypothesis = "64 or fewer (Arm), multiples of 64 (AMD)";
    family.source = "Arm; AMD";
    family.held = "the kernels, the paths, one submission, memory, one recording thread";
    family.base = plain_frame;
    family.along = "pixels";
    for (const ImageSize& size : {device->sizes().front(), device->sizes().back()})
        if (family.workloads.empty() || size.pixels() > family.workloads.front().factors.at("pixels"))
            family.workloads.push_back(workload_of({size, 4, device->bounces()}));
    family.arms = [device](const Workload& workload) {
        std::vector<Arm> arms;
        std::vector<std::uint32_t> sizes{128, 32, 64, 256, 512, 1024};
        if (device->device().description().type == DeviceType::cpu)
            sizes = {128, 64, 256};  // each takes seconds to build
        for (const KernelShape kernel : {KernelShape::stages, KernelShape::megakernel})
            for (const std::uint32_t size : sizes) {
                JobPatterns patterns = with_kernel(kernel);
                patterns.tracer.workgroup = size;
                const char* name = kernel == KernelShape::stages ? "stages" : "megakernel";
                arms.push_back(shape_arm(device, workload, fmt::format("{}-{}", name, size),
                    fmt::format("{}, {} invocations a workgroup", name, size), patterns));
            }
        return arms;
    };
    return family;
}

Family megakernel_family(const SharedDevice& device) {
    Family family;
    family.name = "megakernel";
    family.question = "Should a megakernel's invocations claim pixels, and share what hits need?";
    family.hypothesis =
        "Claims spare subgroups the wait for their longest pixel, shared copies the checks of buffers' bounds";
    family.source = "Aila and Laine 2009 (persistent threads)";
    family.held = "the paths, the scene, one submission, memory, one recording thread";
    family.base = megakernel_frame;
    family.along = "samples";
    for (const std::uint32_t samples : {1u, 4u, 16u})
        family.workloads.push_back(workload_of({device->sizes().back(), samples, device->bounces()}));
    family.arms = [device](const Workload& workload) {
        const auto arm = [&](const char* name, const char* text, PixelPattern pixels, HitDataPattern hit_data) {
            JobPatterns patterns = with_kernel(KernelShape::megakernel);
            patterns.tracer.pixels = pixels;
            patterns.tracer.hit_data = hit_data;
            return shape_arm(device, workload, name, text, patterns);
        };
        return std::vector<Arm>{arm("a-pixel-each", "an invocation a pixel, what hits need in buffers",
                                    PixelPattern::one_each, HitDataPattern::buffers),
            arm("claimed", "as many invocations as the device holds, which claim pixels one after the other",
                PixelPattern::claimed, HitDataPattern::buffers),
            arm("shared", "what hits need copied to each workgroup's shared memory", PixelPattern::one_each,
                HitDataPattern::shared),
            arm("claimed-shared", "both", PixelPattern::claimed, HitDataPattern::shared)};
    };
    return family;
}

Family candidates_family(const SharedDevice& device) {
    Family family;
    family.name = "candidates";
    family.question = "Should threads pick the triangles that their rays may meet before they test any?";
    family.hypothesis =
        "Threads of a subgroup meet different triangles: what few need is done once after all were looked over";
    family.source = "Aila and Laine 2009 (speculative traversal)";
    family.held = "the paths, the scene, a megakernel, one submission, memory, one recording thread";
    family.base = megakernel_frame;
    family.along = "samples";
    for (const std::uint32_t samples : {1u, 16u})
        family.workloads.push_back(workload_of({device->sizes().back(), samples, device->bounces()}));
    family.arms = [device](const Workload& workload) {
        const auto arm = [&](const char* name, const char* text, CandidatePattern candidates) {
            JobPatterns patterns = with_kernel(KernelShape::megakernel);
            patterns.tracer.candidates = candidates;
            return shape_arm(device, workload, name, text, patterns);
        };
        return std::vector<Arm>{arm("every", "every triangle tested in full, in turn", CandidatePattern::every),
            arm("edges", "those whose edges the ray passes between, the nearest plane's first",
                CandidatePattern::edges)};
    };
    return family;
}

}  // namespace tandem
