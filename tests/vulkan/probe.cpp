#include "tests/vulkan/probe.h"

#include <array>
#include <cstring>

#include "copy_probe.h"
#include "vulkan/command/barrier.h"
#include "vulkan/command/submission.h"
#include "vulkan/framework/pipeline.h"
#include "vulkan/resources/buffer_group.h"

namespace tandem::testing {

namespace {

const SetBindings two_buffers(2, vk::DescriptorType::eStorageBuffer);

void record(const vk::raii::CommandBuffer& commands, const vk::raii::Pipeline& pipeline, const PipelineLayout& layout,
    vk::DescriptorSet set, std::uint32_t invocations) {
    commands.bindPipeline(vk::PipelineBindPoint::eCompute, *pipeline);
    commands.bindDescriptorSets(vk::PipelineBindPoint::eCompute, layout.handle(), 0, set, {});
    commands.dispatch((invocations + 63) / 64, 1, 1);
}

}  // namespace

std::vector<std::uint32_t> run_probe(std::span<const std::uint32_t> code, std::span<const std::uint32_t> input,
    std::size_t output_words, std::uint32_t invocations) {
    // One for all probes: drivers allow a process few instances in its life.
    static const Instance instance(false);
    static const Device device(instance, "");
    const PipelineLayout layout(device, std::array{two_buffers}, 0);
    const vk::raii::Pipeline pipeline = make_compute_pipeline(device, nullptr, layout.handle(), code, {});
    constexpr auto storage = vk::BufferUsageFlagBits::eStorageBuffer;
    const BufferGroup buffers(device, MemoryDomain::upload,
        std::array{BufferSpec{input.size_bytes(), storage}, BufferSpec{output_words * 4, storage}});
    std::memcpy(buffers.mapped(0), input.data(), input.size_bytes());
    const DescriptorSets sets(
        device, std::array{DescriptorSets::Request{layout.set(0), two_buffers, {buffers.info(0), buffers.info(1)}}});
    Submission submission(device, {});
    submission.add({}, [&](const vk::raii::CommandBuffer& commands) {
        record(commands, pipeline, layout, sets[0], invocations);
        barrier(commands, compute_write, host_read);
    });
    (void)submission.run();
    std::vector<std::uint32_t> output(output_words);
    std::memcpy(output.data(), buffers.mapped(1), output_words * 4);
    return output;
}

std::vector<std::string> messages_about_copies(Ordering ordering) {
    const Instance instance(true);
    const Device device(instance, "");
    const PipelineLayout layout(device, std::array{two_buffers}, 0);
    const vk::raii::Pipeline pipeline = make_compute_pipeline(device, nullptr, layout.handle(), copy_probe_code, {});
    const BufferSpec spec{1024, vk::BufferUsageFlagBits::eStorageBuffer};
    const BufferGroup buffers(device, MemoryDomain::device, std::array{spec, spec, spec});
    const DescriptorSets sets(
        device, std::array{DescriptorSets::Request{layout.set(0), two_buffers, {buffers.info(0), buffers.info(1)}},
                    DescriptorSets::Request{layout.set(0), two_buffers, {buffers.info(1), buffers.info(2)}}});
    const vk::raii::CommandPool pool(device.handle(), vk::CommandPoolCreateInfo({}, device.queue_family()));
    const vk::raii::CommandBuffers commands(
        device.handle(), vk::CommandBufferAllocateInfo(*pool, vk::CommandBufferLevel::ePrimary, 2));
    const bool two_submits = ordering == Ordering::none_across_submits;
    commands[0].begin(vk::CommandBufferBeginInfo());
    record(commands[0], pipeline, layout, sets[0], 256);
    if (ordering == Ordering::barrier) barrier(commands[0], compute_write, compute_access);
    if (two_submits) {
        commands[0].end();
        commands[1].begin(vk::CommandBufferBeginInfo());
    }
    record(commands[two_submits ? 1 : 0], pipeline, layout, sets[1], 256);
    commands[two_submits ? 1 : 0].end();
    for (std::size_t i = 0; i < (two_submits ? 2u : 1u); ++i)
        device.queue().submit(vk::SubmitInfo({}, {}, *commands[i]));
    device.queue().waitIdle();
    return instance.log().take();
}

}  // namespace tandem::testing
