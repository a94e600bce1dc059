// Single operations of a device, by shaders/kernels/self_test.comp, for its self-test.
#pragma once

#include "common/self_test/arithmetic_probe.h"
#include "vulkan/framework/pipeline.h"

namespace tandem {

class DeviceArithmetic : public ArithmeticProbe {
public:
    explicit DeviceArithmetic(const Device& device);  // which must outlive it

    [[nodiscard]] std::vector<float> compute(std::span<const ArithmeticTask> tasks) override;
    [[nodiscard]] FloatControls float_controls() const override;

private:
    const Device& device_;
    PipelineLayout layout_;
    vk::raii::Pipeline pipeline_;
};

}  // namespace tandem
