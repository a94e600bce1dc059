#include "vulkan/bench/frame_image.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "common/error.h"
#include "shown_shaders.h"
#include "vulkan/command/barrier.h"
#include "vulkan/framework/fullscreen.h"
#include "vulkan/framework/shader_library.h"

namespace tandem {

namespace {

using Access = vk::AccessFlagBits;
using Layout = vk::ImageLayout;
using At = vk::PipelineStageFlagBits;
using Usage = vk::ImageUsageFlagBits;

constexpr std::uint32_t store_group = 8, pack_group = 64;  // local sizes of shaders/shown
constexpr std::size_t codes = 256;

constexpr ImageUse drawn{At::eColorAttachmentOutput, Access::eColorAttachmentWrite, Layout::eColorAttachmentOptimal};

// One's own image was copied by the frame before. The host has waited for that, but the layer (1.3.239) does not know
// of waits for timeline semaphores.
constexpr ImageUse copied_before{At::eTransfer, Access::eTransferRead, Layout::eUndefined};

double decoded(double code) {  // IEC 61966-2-1
    return code <= 0.04045 ? code / 12.92 : std::pow((code + 0.055) / 1.055, 2.4);
}

// From which mean on a channel is 1, 2, … 255.
std::array<float, codes - 1> code_steps() {
    std::array<float, codes - 1> list{};
    for (std::size_t i = 0; i < list.size(); ++i)
        list[i] = static_cast<float>(decoded((static_cast<double>(i) + 0.5) / (codes - 1)));
    return list;
}

bool blue_first(vk::Format format) { return format == vk::Format::eB8G8R8A8Unorm; }

void check_queue(const Device& device) {
    const auto families = device.physical().getQueueFamilyProperties();
    if (!(families[device.queue_family()].queueFlags & vk::QueueFlagBits::eGraphics))
        throw UnsupportedError(device.description().name + " has no graphics on the queue that renders");
}

void check_blits(const Device& device, vk::Format format, vk::ImageTiling tiling, vk::FormatFeatureFlagBits wanted) {
    const vk::FormatProperties has = device.physical().getFormatProperties(format);
    const bool linear = tiling == vk::ImageTiling::eLinear;
    if (!((linear ? has.linearTilingFeatures : has.optimalTilingFeatures) & wanted))
        throw UnsupportedError(device.description().name + " has no " + vk::to_string(format) + " images of " +
                               (linear ? "linear" : "optimal") + " tiling with " + vk::to_string(wanted));
}

}  // namespace

vk::ImageUsageFlags shown_usage(const ImagePattern& pattern) {
    if (pattern.move != ImageMove::none) return Usage::eTransferDst;
    return pattern.writer == ImageWriter::kernel ? Usage::eStorage : Usage::eColorAttachment;
}

vk::PipelineStageFlags shown_stage(const ImagePattern& pattern) {
    if (pattern.move != ImageMove::none) return At::eTransfer;
    return pattern.writer == ImageWriter::kernel ? At::eComputeShader : At::eColorAttachmentOutput;
}

bool FrameImage::draws_means() const {
    return pattern_.writer == ImageWriter::sub_passes || pattern_.writer == ImageWriter::two_passes;
}
bool FrameImage::draws() const { return pattern_.writer == ImageWriter::pass || draws_means(); }
bool FrameImage::stores_directly() const {
    return pattern_.writer == ImageWriter::kernel && pattern_.move == ImageMove::none;
}

FrameImage::FrameImage(const Device& device, const ImagePattern& pattern, const ShownImages& shown,
    const std::array<vk::DescriptorBufferInfo, 2>& sums, std::uint32_t samples)
    : device_(device),
      pattern_(pattern),
      shown_(shown),
      words_{shown.size.width, shown.size.width * shown.size.height, 1.0f / static_cast<float>(samples)},
      steps_(device, MemoryDomain::mapped,
          std::array{BufferSpec{(codes - 1) * sizeof(float), vk::BufferUsageFlagBits::eStorageBuffer}}) {
    const auto list = code_steps();
    std::memcpy(steps_.mapped(0), list.data(), sizeof list);
    if (draws()) check_queue(device);
    if (stores_directly() && !device.features().stores_any_format)
        throw UnsupportedError(device.description().name +
                               " has no kernels that store to images of any format "
                               "(shaderStorageImageWriteWithoutFormat)");
    if (pattern.move == ImageMove::blit) {
        check_blits(device, vk::Format::eR8G8B8A8Unorm, pattern.tiling, vk::FormatFeatureFlagBits::eBlitSrc);
        check_blits(device, shown.format, vk::ImageTiling::eOptimal, vk::FormatFeatureFlagBits::eBlitDst);
    }
    if (pattern.writer == ImageWriter::packer) {
        const auto usage = vk::BufferUsageFlagBits::eStorageBuffer | vk::BufferUsageFlagBits::eTransferSrc;
        packed_.emplace(device, MemoryDomain::device, std::array{BufferSpec{4ull * words_.pixels, usage}});
    } else if (draws_means()) {
        own_.emplace(device, ImageSpec{.size = shown.size,
                                 .format = vk::Format::eR32G32B32A32Sfloat,
                                 .usage = Usage::eColorAttachment | Usage::eInputAttachment});
    } else if (pattern.writer == ImageWriter::kernel && pattern.move != ImageMove::none) {
        own_.emplace(device,
            ImageSpec{.size = shown.size, .usage = Usage::eStorage | Usage::eTransferSrc, .tiling = pattern.tiling});
    }
    make_sets(sums);
    if (draws()) {
        make_passes();
        make_framebuffers();
    }
    make_pipelines();
}

void FrameImage::make_sets(const std::array<vk::DescriptorBufferInfo, 2>& sums) {
    using Type = vk::DescriptorType;
    using Binding = vk::DescriptorSetLayoutBinding;
    const vk::ShaderStageFlags visible =
        draws() ? vk::ShaderStageFlagBits::eFragment : vk::ShaderStageFlagBits::eCompute;
    std::vector<Binding> bindings{
        Binding(0, Type::eStorageBuffer, 1, visible), Binding(1, Type::eStorageBuffer, 1, visible)};
    if (packed_)
        bindings.emplace_back(2, Type::eStorageBuffer, 1, visible);
    else if (draws_means())
        bindings.emplace_back(2, Type::eInputAttachment, 1, visible);
    else if (!draws())
        bindings.emplace_back(2, Type::eStorageImage, 1, visible);
    set_layout_ = vk::raii::DescriptorSetLayout(device_.handle(), vk::DescriptorSetLayoutCreateInfo({}, bindings));
    const vk::PushConstantRange range(visible, 0, sizeof(Words));
    layout_ = vk::raii::PipelineLayout(device_.handle(), vk::PipelineLayoutCreateInfo({}, *set_layout_, range));

    const std::size_t targets = stores_directly() ? shown_.images.size() : 1;
    const auto count = static_cast<std::uint32_t>(sums.size() * targets);
    std::vector<vk::DescriptorPoolSize> sizes{{Type::eStorageBuffer, 3 * count}};
    if (bindings.size() > 2) sizes.emplace_back(bindings.back().descriptorType, count);
    pool_ = vk::raii::DescriptorPool(device_.handle(), vk::DescriptorPoolCreateInfo({}, count, sizes));
    const std::vector<vk::DescriptorSetLayout> layouts(count, *set_layout_);
    sets_ =
        (*device_.handle())
            .allocateDescriptorSets(vk::DescriptorSetAllocateInfo(*pool_, layouts), *device_.handle().getDispatcher());
    for (std::size_t i = 0; i < sets_.size(); ++i) {
        const std::array buffers{sums[i / targets], steps_.info(0)};
        std::vector<vk::WriteDescriptorSet> writes{{sets_[i], 0, 0, Type::eStorageBuffer, {}, buffers}};
        const vk::DescriptorBufferInfo packed = packed_ ? packed_->info(0) : vk::DescriptorBufferInfo();
        const vk::ImageView view = own_ ? own_->view() : shown_.images[i % targets].view;
        const vk::DescriptorImageInfo image(
            nullptr, view, draws_means() ? Layout::eShaderReadOnlyOptimal : Layout::eGeneral);
        if (packed_)
            writes.emplace_back(sets_[i], 2, 0, Type::eStorageBuffer, nullptr, packed);
        else if (bindings.size() > 2)
            writes.emplace_back(sets_[i], 2, 0, bindings.back().descriptorType, image);
        device_.handle().updateDescriptorSets(writes, {});
    }
}

// The image that is shown is the last attachment of the last pass; means are the first one, if there are any.
void FrameImage::make_passes() {
    using Load = vk::AttachmentLoadOp;
    using Store = vk::AttachmentStoreOp;
    constexpr auto once = vk::SampleCountFlagBits::e1;
    const auto attachment = [&](vk::Format format, Load load, Store store, Layout from, Layout to) {
        return vk::AttachmentDescription({}, format, once, load, store, Load::eDontCare, Store::eDontCare, from, to);
    };
    const bool loads = pattern_.load == Load::eLoad;
    const vk::AttachmentDescription shown = attachment(shown_.format, pattern_.load, Store::eStore,
        loads ? shown_.left.layout : Layout::eUndefined, shown_.left.layout);
    const vk::Format floats = vk::Format::eR32G32B32A32Sfloat;
    const vk::AttachmentReference first(0, Layout::eColorAttachmentOptimal), second(1, Layout::eColorAttachmentOptimal),
        read(0, Layout::eShaderReadOnlyOptimal);
    const vk::AccessFlags colour = Access::eColorAttachmentRead | Access::eColorAttachmentWrite;
    const vk::SubpassDependency begin(VK_SUBPASS_EXTERNAL, 0, drawn.stage, drawn.stage, {}, colour);
    const auto end = [&](std::uint32_t subpass) {
        return vk::SubpassDependency(
            subpass, VK_SUBPASS_EXTERNAL, drawn.stage, shown_.left.stage, drawn.access, shown_.left.access);
    };
    const auto between = [&](std::uint32_t from, std::uint32_t to) {
        return vk::SubpassDependency(from, to, drawn.stage, At::eFragmentShader, drawn.access,
            Access::eInputAttachmentRead, vk::DependencyFlagBits::eByRegion);
    };
    const auto add = [&](const std::vector<vk::AttachmentDescription>& attachments,
                         const std::vector<vk::SubpassDescription>& subpasses,
                         const std::vector<vk::SubpassDependency>& dependencies) {
        passes_.emplace_back(device_.handle(), vk::RenderPassCreateInfo({}, attachments, subpasses, dependencies));
    };
    constexpr auto graphics = vk::PipelineBindPoint::eGraphics;
    const vk::SubpassDescription draw({}, graphics, {}, first), encode({}, graphics, read, second);
    switch (pattern_.writer) {
        case ImageWriter::sub_passes:
            add({attachment(
                     floats, Load::eDontCare, pattern_.store, Layout::eUndefined, Layout::eShaderReadOnlyOptimal),
                    shown},
                {draw, encode},
                {begin, between(0, 1),
                    vk::SubpassDependency(VK_SUBPASS_EXTERNAL, 1, drawn.stage, drawn.stage, {}, colour), end(1)});
            break;
        case ImageWriter::two_passes:
            add({attachment(
                    floats, Load::eDontCare, Store::eStore, Layout::eUndefined, Layout::eShaderReadOnlyOptimal)},
                {draw},
                {begin, vk::SubpassDependency(0, VK_SUBPASS_EXTERNAL, drawn.stage, At::eFragmentShader, drawn.access,
                            Access::eInputAttachmentRead)});
            add({attachment(floats, Load::eLoad, Store::eDontCare, Layout::eShaderReadOnlyOptimal,
                     Layout::eShaderReadOnlyOptimal),
                    shown},
                {encode}, {begin, between(VK_SUBPASS_EXTERNAL, 0), end(0)});
            break;
        default:
            add({shown}, {draw}, {begin, end(0)});
    }
}

void FrameImage::make_framebuffers() {
    for (std::size_t pass = 0; pass < passes_.size(); ++pass) {
        std::vector<vk::raii::Framebuffer>& framebuffers = framebuffers_.emplace_back();
        for (const ShownImages::One& image : shown_.images) {
            std::vector<vk::ImageView> views;
            if (draws_means()) views.push_back(own_->view());
            if (pass + 1 == passes_.size()) views.push_back(image.view);
            framebuffers.emplace_back(device_.handle(),
                vk::FramebufferCreateInfo({}, *passes_[pass], views, shown_.size.width, shown_.size.height, 1));
        }
    }
}

void FrameImage::make_pipelines() {
    // Copies take bytes as they are; stores to views, blits and attachments know what their format's channels are.
    const bool swaps = pattern_.move == ImageMove::copy && blue_first(shown_.format);
    const std::array constants{SpecialisationConstant{0, swaps ? 1u : 0u}};
    if (!draws()) {
        const std::span<const std::uint32_t> code = packed_ ? std::span<const std::uint32_t>(pack_words)
                                                    : stores_directly()
                                                        ? std::span<const std::uint32_t>(store_any_words)
                                                        : std::span<const std::uint32_t>(store_words);
        pipelines_.push_back(make_compute_pipeline(device_, nullptr, *layout_, code, constants));
        return;
    }
    const auto add = [&](vk::RenderPass pass, std::uint32_t subpass, std::span<const std::uint32_t> code) {
        pipelines_.push_back(make_fullscreen_pipeline(
            device_, *layout_, {pass, subpass, 1}, shader_code(tandem::Stage::fullscreen), code, constants));
    };
    if (pattern_.writer == ImageWriter::pass) {
        add(*passes_.front(), 0, draw_words);
        return;
    }
    add(*passes_.front(), 0, draw_means_words);
    add(*passes_.back(), pattern_.writer == ImageWriter::sub_passes ? 1 : 0, encode_words);
}

void FrameImage::bind(const vk::raii::CommandBuffer& commands, vk::PipelineBindPoint point, std::size_t set) const {
    commands.bindDescriptorSets(point, *layout_, 0, sets_[set], {});
    const vk::ShaderStageFlags visible =
        draws() ? vk::ShaderStageFlagBits::eFragment : vk::ShaderStageFlagBits::eCompute;
    commands.pushConstants<Words>(*layout_, visible, 0, words_);
}

void FrameImage::record_first(const vk::raii::CommandBuffer& commands) const {
    if (pattern_.transition_first) transition(commands, own_->handle(), copied_before, written_by_compute);
}

void FrameImage::record_last(
    const vk::raii::CommandBuffer& commands, std::uint32_t sums_place, std::size_t image) const {
    const vk::Image target = shown_.images[image].image;
    if (draws()) {
        record_passes(commands, sums_place, image);
        return;
    }
    if (stores_directly()) {
        transition(commands, target, acquired_image(At::eComputeShader), written_by_compute);
        record_kernel(commands, sums_place * shown_.images.size() + image);
        transition(commands, target, written_by_compute, shown_.left);
        return;
    }
    if (own_ && !pattern_.transition_first) transition(commands, own_->handle(), copied_before, written_by_compute);
    record_kernel(commands, sums_place);
    if (own_)
        transition(commands, own_->handle(), written_by_compute, copied_from);
    else
        barrier(commands, compute_write, transfer_read);
    transition(commands, target, acquired_image(At::eTransfer), copied_to);
    record_move(commands, target);
    transition(commands, target, copied_to, shown_.left);
}

void FrameImage::record_kernel(const vk::raii::CommandBuffer& commands, std::size_t set) const {
    barrier(commands, compute_write, {At::eComputeShader, Access::eShaderRead});
    commands.bindPipeline(vk::PipelineBindPoint::eCompute, *pipelines_.front());
    bind(commands, vk::PipelineBindPoint::eCompute, set);
    const auto groups = [](std::uint32_t count, std::uint32_t size) { return (count + size - 1) / size; };
    if (packed_)
        commands.dispatch(groups(words_.pixels, pack_group), 1, 1);
    else
        commands.dispatch(groups(shown_.size.width, store_group), groups(shown_.size.height, store_group), 1);
}

void FrameImage::record_move(const vk::raii::CommandBuffer& commands, vk::Image target) const {
    const vk::Extent3D size(shown_.size.width, shown_.size.height, 1);
    if (packed_) {
        commands.copyBufferToImage((*packed_)[0], target, copied_to.layout,
            vk::BufferImageCopy(packed_->offset(0), 0, 0, first_layer, {}, size));
    } else if (pattern_.move == ImageMove::copy) {
        commands.copyImage(own_->handle(), copied_from.layout, target, copied_to.layout,
            vk::ImageCopy(first_layer, {}, first_layer, {}, size));
    } else {
        const std::array corners{vk::Offset3D(0, 0, 0),
            vk::Offset3D(static_cast<std::int32_t>(size.width), static_cast<std::int32_t>(size.height), 1)};
        commands.blitImage(own_->handle(), copied_from.layout, target, copied_to.layout,
            vk::ImageBlit(first_layer, corners, first_layer, corners), vk::Filter::eNearest);
    }
}

void FrameImage::record_passes(const vk::raii::CommandBuffer& commands, std::size_t set, std::size_t image) const {
    barrier(commands, compute_write, {At::eFragmentShader, Access::eShaderRead});
    const vk::Rect2D area({0, 0}, shown_.size);
    commands.setViewport(0, vk::Viewport(0.0f, 0.0f, static_cast<float>(area.extent.width),
                                static_cast<float>(area.extent.height), 0.0f, 1.0f));
    commands.setScissor(0, area);
    const std::array<vk::ClearValue, 2> black{};
    for (std::size_t i = 0; i < pipelines_.size(); ++i) {
        const bool begins = i == 0 || passes_.size() > 1;
        const std::size_t pass = std::min(i, passes_.size() - 1);
        if (begins)
            commands.beginRenderPass(vk::RenderPassBeginInfo(*passes_[pass], *framebuffers_[pass][image], area, black),
                vk::SubpassContents::eInline);
        else
            commands.nextSubpass(vk::SubpassContents::eInline);
        commands.bindPipeline(vk::PipelineBindPoint::eGraphics, *pipelines_[i]);
        bind(commands, vk::PipelineBindPoint::eGraphics, set);
        commands.draw(3, 1, 0, 0);
        if (i + 1 == pipelines_.size() || passes_.size() > 1) commands.endRenderPass();
    }
}

FetchedImage::FetchedImage(const Device& device, const ShownImages& shown)
    : shown_(shown),
      buffer_(device, MemoryDomain::readback,
          std::array{BufferSpec{4ull * shown.size.width * shown.size.height, vk::BufferUsageFlagBits::eTransferDst}}) {}

void FetchedImage::record(const vk::raii::CommandBuffer& commands, std::size_t image) const {
    constexpr vk::AccessFlags all = Access::eMemoryRead | Access::eMemoryWrite;
    const ImageUse anything{At::eAllCommands, all, shown_.left.layout};
    const vk::Image source = shown_.images[image].image;
    transition(commands, source, anything, copied_from);
    commands.copyImageToBuffer(source, copied_from.layout, buffer_[0],
        vk::BufferImageCopy(buffer_.offset(0), 0, 0, first_layer, {}, {shown_.size.width, shown_.size.height, 1}));
    transition(commands, source, copied_from, shown_.left);
    barrier(commands, transfer_write, host_read);
}

std::vector<std::uint8_t> FetchedImage::pixels() const {
    std::vector<std::uint8_t> bytes(4ull * shown_.size.width * shown_.size.height);
    std::memcpy(bytes.data(), buffer_.mapped(0), bytes.size());
    if (blue_first(shown_.format))
        for (std::size_t i = 0; i < bytes.size(); i += 4) std::swap(bytes[i], bytes[i + 2]);
    return bytes;
}

std::vector<std::uint8_t> shown_pixels(const Estimate& estimate) {
    const auto list = code_steps();
    const Estimate::Plane totals = estimate.totals();
    const double share = 1.0 / static_cast<double>(estimate.count());
    std::vector<std::uint8_t> pixels;
    for (std::size_t i = 0; i < totals.size(); ++i) {
        const auto mean = static_cast<float>(totals[i].sum * share);
        pixels.push_back(static_cast<std::uint8_t>(std::ranges::upper_bound(list, mean) - list.begin()));
        if (i % channel_count == channel_count - 1) pixels.push_back(0xff);
    }
    return pixels;
}

std::uint64_t digest_of(const std::vector<std::uint8_t>& pixels) {  // FNV-1a
    std::uint64_t digest = 0xcbf29ce484222325u;
    for (const std::uint8_t byte : pixels) digest = (digest ^ byte) * 0x100000001b3u;
    return digest;
}

}  // namespace tandem
