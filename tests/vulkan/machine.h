// A device with its pipelines, for tests that make jobs by patterns.
#pragma once

#include "tests/vulkan/scenes.h"
#include "vulkan/renderer/job/job.h"

namespace tandem::testing {

struct Machine {
    explicit Machine(bool validation) : instance(validation) {}

    Instance instance;
    Device device{instance, ""};
    Stages stages{device};

    [[nodiscard]] VulkanJob job(const JobPatterns& patterns, const Scene& scene, const RenderSettings& settings) {
        return VulkanJob(
            instance, device, stages, scene, settings, Acceleration::automatic, PlantedBug::none, patterns);
    }
};

}  // namespace tandem::testing
