#include "vulkan/framework/device_arithmetic.h"

#include <array>
#include <cstring>

#include "self_test_shader.h"
#include "vulkan/command/barrier.h"
#include "vulkan/command/submission.h"
#include "vulkan/resources/buffer_group.h"

namespace tandem {

namespace {

const SetBindings two_buffers(2, vk::DescriptorType::eStorageBuffer);
constexpr std::uint32_t group_size = 64;  // local_size_x of the shader

}  // namespace

DeviceArithmetic::DeviceArithmetic(const Device& device)
    : device_(device),
      layout_(device, std::array{two_buffers}, sizeof(std::uint32_t)),
      pipeline_(make_compute_pipeline(device, nullptr, layout_.handle(), self_test_code, {})) {}

std::vector<float> DeviceArithmetic::compute(std::span<const ArithmeticTask> tasks) {
    const auto count = static_cast<std::uint32_t>(tasks.size());
    std::vector<float> results(count);
    constexpr auto storage = vk::BufferUsageFlagBits::eStorageBuffer;
    const BufferGroup input(device_, MemoryDomain::upload, std::array{BufferSpec{tasks.size_bytes(), storage}});
    const BufferGroup output(device_, MemoryDomain::readback, std::array{BufferSpec{count * sizeof(float), storage}});
    std::memcpy(input.mapped(0), tasks.data(), tasks.size_bytes());
    const DescriptorSets sets(
        device_, std::array{DescriptorSets::Request{layout_.set(0), two_buffers, {input.info(0), output.info(0)}}});
    Submission submission(device_, {});
    submission.add({}, [&](const vk::raii::CommandBuffer& commands) {
        commands.bindPipeline(vk::PipelineBindPoint::eCompute, *pipeline_);
        commands.bindDescriptorSets(vk::PipelineBindPoint::eCompute, layout_.handle(), 0, sets[0], {});
        commands.pushConstants<std::uint32_t>(layout_.handle(), vk::ShaderStageFlagBits::eCompute, 0, count);
        commands.dispatch((count + group_size - 1) / group_size, 1, 1);
        barrier(commands, compute_write, host_read);
    });
    (void)submission.run();
    std::memcpy(results.data(), output.mapped(0), count * sizeof(float));
    return results;
}

FloatControls DeviceArithmetic::float_controls() const {
    const auto chain =
        device_.physical().getProperties2<vk::PhysicalDeviceProperties2, vk::PhysicalDeviceFloatControlsProperties>();
    const auto& says = chain.get<vk::PhysicalDeviceFloatControlsProperties>();
    return {says.shaderDenormPreserveFloat32 == VK_TRUE, says.shaderDenormFlushToZeroFloat32 == VK_TRUE,
        says.shaderRoundingModeRTEFloat32 == VK_TRUE, says.shaderRoundingModeRTZFloat32 == VK_TRUE,
        says.shaderSignedZeroInfNanPreserveFloat32 == VK_TRUE,
        device_.physical().getFeatures().shaderFloat64 == VK_TRUE};
}

}  // namespace tandem
