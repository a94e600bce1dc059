#include "vulkan/framework/list_shader.h"

#include <array>
#include <cstring>
#include <string>

#include "vulkan/command/barrier.h"
#include "vulkan/command/submission.h"
#include "vulkan/devices.h"
#include "vulkan/framework/pipeline.h"
#include "vulkan/resources/buffer_group.h"

namespace tandem {

namespace {

const SetBindings list_buffers(2, vk::DescriptorType::eStorageBuffer);
constexpr std::uint32_t list_group_size = 64;  // local_size_x of the shader

std::string software_device() {
    for (const DeviceDescription& device : list_devices())
        if (device.suitable && device.type == DeviceType::cpu) return std::to_string(device.index);
    return {};
}

}  // namespace

std::vector<float> run_list_shader(
    std::span<const std::uint32_t> code, std::span<const float> arguments, std::uint32_t count, std::uint32_t results) {
    const Instance instance(false);
    const Device device(instance, software_device());
    const PipelineLayout layout(device, std::array{list_buffers}, sizeof(std::uint32_t));
    const vk::raii::Pipeline pipeline = make_compute_pipeline(device, nullptr, layout.handle(), code, {});
    std::vector<float> answers(std::size_t{count} * results);
    constexpr auto storage = vk::BufferUsageFlagBits::eStorageBuffer;
    const BufferGroup input(device, MemoryDomain::upload, std::array{BufferSpec{arguments.size_bytes(), storage}});
    const BufferGroup output(
        device, MemoryDomain::readback, std::array{BufferSpec{answers.size() * sizeof(float), storage}});
    std::memcpy(input.mapped(0), arguments.data(), arguments.size_bytes());
    // What the shader leaves out is NaN.
    std::memset(output.mapped(0), 0xFF, answers.size() * sizeof(float));
    const DescriptorSets sets(
        device, std::array{DescriptorSets::Request{layout.set(0), list_buffers, {input.info(0), output.info(0)}}});
    Submission submission(device, {});
    submission.add({}, [&](const vk::raii::CommandBuffer& commands) {
        commands.bindPipeline(vk::PipelineBindPoint::eCompute, *pipeline);
        commands.bindDescriptorSets(vk::PipelineBindPoint::eCompute, layout.handle(), 0, sets[0], {});
        commands.pushConstants<std::uint32_t>(layout.handle(), vk::ShaderStageFlagBits::eCompute, 0, count);
        commands.dispatch((count + list_group_size - 1) / list_group_size, 1, 1);
        barrier(commands, compute_write, host_read);
    });
    (void)submission.run();
    std::memcpy(answers.data(), output.mapped(0), answers.size() * sizeof(float));
    return answers;
}

}  // namespace tandem
