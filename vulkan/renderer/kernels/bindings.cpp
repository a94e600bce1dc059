#include "vulkan/renderer/kernels/bindings.h"

#include <cstring>

#include "common/error.h"
#include "vulkan/renderer/kernels/constant_ids.h"

namespace tandem {

namespace {

// Dispatches in one submission that can be told apart: a frame of 64 samples and 12 bounces has 1793.
constexpr std::uint32_t slot_count = 2048;

constexpr auto scene_set = static_cast<std::uint32_t>(SetIndex::scene);
constexpr auto rays_set = static_cast<std::uint32_t>(SetIndex::rays);
constexpr auto image_set = static_cast<std::uint32_t>(SetIndex::image);
constexpr auto settings_set = static_cast<std::uint32_t>(SetIndex::settings);

bool writes_sets(const VulkanPatterns& patterns) {
    return patterns.descriptors == DescriptorPattern::rewritten || patterns.descriptors == DescriptorPattern::templates;
}

bool writes_parameters(const VulkanPatterns& patterns) {
    return patterns.parameters != ParameterPattern::push_constants &&
           patterns.parameters != ParameterPattern::specialisation;
}

bool has_arrays(const VulkanPatterns& patterns) { return KernelForm(patterns).has_arrays(); }

vk::raii::DescriptorUpdateTemplate make_template(
    const Device& device, const PipelineLayout& layout, std::uint32_t set) {
    std::vector<vk::DescriptorUpdateTemplateEntry> entries;
    const SetBindings& bindings = layout.bindings(set);
    std::uint32_t first = 0;
    for (std::uint32_t binding = 0; binding < bindings.size(); ++binding) {
        if (bindings[binding].count == 0) continue;
        entries.emplace_back(binding, 0, bindings[binding].count, bindings[binding].type,
            first * sizeof(vk::DescriptorBufferInfo), sizeof(vk::DescriptorBufferInfo));
        first += bindings[binding].count;
    }
    return vk::raii::DescriptorUpdateTemplate(
        device.handle(), vk::DescriptorUpdateTemplateCreateInfo(
                             {}, entries, vk::DescriptorUpdateTemplateType::eDescriptorSet, layout.set(set)));
}

}  // namespace

Bindings::Bindings(
    const Device& device, const PipelineLayout& layout, const FrameResources& resources, const VulkanPatterns& patterns)
    : device_(device), layout_(layout), patterns_(patterns) {
    if (hands_out() && patterns.recording == RecordingPattern::pre_recorded)
        throw UnsupportedError(
            "what this pattern writes is handed out when commands are recorded: they cannot be pre-recorded");
    for (std::uint32_t parity = 0; parity < 2; ++parity) {
        rays_[parity] =
            resources.buffers(SetIndex::rays, has_arrays(patterns) ? FrameResources::both_parities : parity);
        images_[parity] = resources.buffers(SetIndex::image, parity);
    }
    const auto request = [&](SetIndex set) {
        const auto i = static_cast<std::size_t>(set);
        return DescriptorSets::Request{layout.set(i), layout.bindings(i), resources.buffers(set)};
    };
    fixed_.emplace(device, std::array{request(SetIndex::scene), request(SetIndex::camera)});
    make_rays_and_images();
    make_parameters();
}

bool Bindings::hands_out() const { return writes_sets(patterns_) || writes_parameters(patterns_); }

std::uint32_t Bindings::take() const {
    const std::uint32_t slot = used_.fetch_add(1);
    if (slot >= slot_count)
        throw UnsupportedError("a submission has too many dispatches for the pattern; use fewer samples");
    return slot;
}

// In pairs: a set of rays and one of sums. Pushed descriptors have no set.
void Bindings::make_rays_and_images() {
    std::vector<DescriptorSets::Request> requests;
    const auto add = [&](std::uint32_t set, const std::vector<vk::DescriptorBufferInfo>& buffers) {
        requests.push_back({layout_.set(set), layout_.bindings(set), buffers});
    };
    const bool pushed = patterns_.descriptors == DescriptorPattern::push;
    if (writes_sets(patterns_)) {
        for (std::uint32_t slot = 0; slot < slot_count; ++slot)
            for (const std::uint32_t set : {rays_set, image_set}) add(set, {});
    } else {
        for (std::uint32_t parity = 0; parity < 2; ++parity) {
            if (!pushed) add(rays_set, rays_[parity]);
            add(image_set, images_[parity]);
        }
    }
    moving_.emplace(device_, requests);
    if (patterns_.descriptors == DescriptorPattern::templates)
        for (const std::uint32_t set : {rays_set, image_set})
            templates_.push_back(make_template(device_, layout_, set));
}

void Bindings::make_parameters() {
    if (!writes_parameters(patterns_)) return;
    const bool storage = patterns_.parameters == ParameterPattern::storage;
    const bool address = patterns_.parameters == ParameterPattern::device_address;
    const vk::PhysicalDeviceLimits& limits = device_.limits();
    stride_ =
        std::max<vk::DeviceSize>({128, limits.minUniformBufferOffsetAlignment, limits.minStorageBufferOffsetAlignment});
    vk::BufferUsageFlags usage =
        storage ? vk::BufferUsageFlagBits::eStorageBuffer : vk::BufferUsageFlagBits::eUniformBuffer;
    if (address) usage = vk::BufferUsageFlagBits::eShaderDeviceAddress | vk::BufferUsageFlagBits::eStorageBuffer;
    // Mapped ones are in the device's memory where the host can reach that; the thesis's are in the host's.
    const MemoryDomain domain =
        patterns_.scene == BufferPlacement::host_visible ? MemoryDomain::upload : MemoryDomain::mapped;
    parameters_.emplace(device_, domain, std::array{BufferSpec{slot_count * stride_, usage}});
    if (address) {
        address_ = device_.handle().getBufferAddress(vk::BufferDeviceAddressInfo((*parameters_)[0]));
        return;
    }
    std::vector<DescriptorSets::Request> requests;
    const std::uint32_t sets = patterns_.parameters == ParameterPattern::dynamic_uniform ? 1 : slot_count;
    for (std::uint32_t slot = 0; slot < sets; ++slot)
        requests.push_back({layout_.set(settings_set), layout_.bindings(settings_set),
            {vk::DescriptorBufferInfo(
                (*parameters_)[0], parameters_->offset(0) + slot * stride_, sizeof(gpu::Settings))}});
    parameter_sets_.emplace(device_, requests);
}

void Bindings::rewrite(std::uint32_t slot, std::uint32_t ray_parity, std::uint32_t sum_parity) const {
    const vk::DescriptorSet rays = (*moving_)[2 * std::size_t{slot}], image = (*moving_)[2 * std::size_t{slot} + 1];
    if (patterns_.descriptors == DescriptorPattern::templates) {
        const auto& dispatcher = *device_.handle().getDispatcher();
        const vk::Device device = *device_.handle();
        device.updateDescriptorSetWithTemplate(
            rays, *templates_[0], static_cast<const void*>(rays_[ray_parity].data()), dispatcher);
        device.updateDescriptorSetWithTemplate(
            image, *templates_[1], static_cast<const void*>(images_[sum_parity].data()), dispatcher);
        return;
    }
    std::vector<vk::WriteDescriptorSet> writes = writes_of(rays, layout_.bindings(rays_set), rays_[ray_parity]);
    const std::vector<vk::WriteDescriptorSet> more = writes_of(image, layout_.bindings(image_set), images_[sum_parity]);
    writes.insert(writes.end(), more.begin(), more.end());
    device_.handle().updateDescriptorSets(writes, {});
}

void Bindings::push_rays(const vk::raii::CommandBuffer& commands, std::uint32_t ray_parity) const {
    commands.pushDescriptorSetKHR(vk::PipelineBindPoint::eCompute, layout_.handle(), rays_set,
        writes_of({}, layout_.bindings(rays_set), rays_[ray_parity]));
}

void Bindings::bind_sets(const vk::raii::CommandBuffer& commands, std::uint32_t ray_parity, std::uint32_t sum_parity,
    std::uint32_t slot, vk::PipelineBindPoint point) const {
    const vk::DescriptorSet scene = (*fixed_)[0], camera = (*fixed_)[1];
    if (patterns_.descriptors == DescriptorPattern::push) {
        commands.bindDescriptorSets(point, layout_.handle(), scene_set, {scene, camera}, {});
        push_rays(commands, ray_parity);
        commands.bindDescriptorSets(point, layout_.handle(), image_set, (*moving_)[sum_parity], {});
        return;
    }
    std::size_t rays = 2 * std::size_t{ray_parity}, image = 2 * std::size_t{sum_parity} + 1;
    if (writes_sets(patterns_)) {
        rewrite(slot, ray_parity, sum_parity);
        rays = 2 * std::size_t{slot};
        image = rays + 1;
    }
    commands.bindDescriptorSets(
        point, layout_.handle(), scene_set, {scene, camera, (*moving_)[rays], (*moving_)[image]}, {});
}

void Bindings::tell(const vk::raii::CommandBuffer& commands, const gpu::Settings& settings, std::uint32_t slot) const {
    std::memcpy(parameters_->mapped(0) + slot * stride_, &settings, sizeof settings);
    if (patterns_.parameters == ParameterPattern::device_address) {
        commands.pushConstants<vk::DeviceAddress>(layout_.handle(), layout_.visible(), 0, address_ + slot * stride_);
    } else if (patterns_.parameters == ParameterPattern::dynamic_uniform) {
        commands.bindDescriptorSets(vk::PipelineBindPoint::eCompute, layout_.handle(), settings_set,
            (*parameter_sets_)[0], static_cast<std::uint32_t>(slot * stride_));
    } else {
        commands.bindDescriptorSets(
            vk::PipelineBindPoint::eCompute, layout_.handle(), settings_set, (*parameter_sets_)[slot], {});
    }
}

void Bindings::bind(const vk::raii::CommandBuffer& commands, const gpu::Settings& settings, std::uint32_t ray_parity,
    std::uint32_t sum_parity, bool plain, vk::PipelineBindPoint point) const {
    const std::uint32_t slot = hands_out() ? take() : 0;
    bind_sets(commands, ray_parity, sum_parity, slot, point);
    if (writes_parameters(patterns_) && !plain)
        tell(commands, settings, slot);
    else
        commands.pushConstants<gpu::Settings>(layout_.handle(), layout_.visible(), 0, settings);
}

std::vector<SpecialisationConstant> fixed_parameters(const gpu::Settings& settings) {
    return {constant(ConstantId::fixed_width, settings.width), constant(ConstantId::fixed_height, settings.height),
        constant(ConstantId::fixed_bounces, settings.bounces),
        constant(ConstantId::fixed_roulette_start, settings.roulette_start),
        constant(ConstantId::fixed_light_count, settings.light_count),
        constant(ConstantId::fixed_triangle_count, settings.triangle_count),
        constant(ConstantId::fixed_sphere_count, settings.sphere_count),
        constant(ConstantId::fixed_cuboid_count, settings.cuboid_count),
        constant(ConstantId::fixed_direct_only, settings.direct_only)};
}

}  // namespace tandem
