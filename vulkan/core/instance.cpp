#include "vulkan/core/instance.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <optional>
#include <string_view>

#include "common/error.h"
#include "vulkan/core/driver_remedy.h"

namespace tandem {

namespace {

constexpr const char* validation_layer = "VK_LAYER_KHRONOS_validation";

// The queue-submit check of synchronisation validation has no enum in VkValidationFeaturesEXT yet. This layer takes it
// from the environment, which it reads while the instance is made. The old value returns with the scope's end.
class ScopedEnvironment {
public:
    ScopedEnvironment(const char* name, const char* value) : name_(name) {
        if (const char* old = std::getenv(name)) old_ = old;
        ::setenv(name, value, 1);
    }
    ~ScopedEnvironment() {
        if (old_)
            ::setenv(name_, old_->c_str(), 1);
        else
            ::unsetenv(name_);
    }
    ScopedEnvironment(const ScopedEnvironment&) = delete;
    ScopedEnvironment& operator=(const ScopedEnvironment&) = delete;

private:
    const char* name_;
    std::optional<std::string> old_;
};

VKAPI_ATTR VkBool32 VKAPI_CALL keep_message(VkDebugUtilsMessageSeverityFlagBitsEXT,
    VkDebugUtilsMessageTypeFlagsEXT type, const VkDebugUtilsMessengerCallbackDataEXT* data, void* log) {
    // What the loader says about drivers that it skips is general, not validation.
    if ((type & VK_DEBUG_UTILS_MESSAGE_TYPE_VALIDATION_BIT_EXT) != 0)
        static_cast<ValidationLog*>(log)->add(data->pMessage);
    return VK_FALSE;
}

vk::DebugUtilsMessengerCreateInfoEXT messenger_info(ValidationLog& log) {
    using Severity = vk::DebugUtilsMessageSeverityFlagBitsEXT;
    return vk::DebugUtilsMessengerCreateInfoEXT({}, Severity::eWarning | Severity::eError,
        vk::DebugUtilsMessageTypeFlagBitsEXT::eValidation, keep_message, &log);
}

vk::raii::Context load_vulkan() {
    try {
        return vk::raii::Context();
    } catch (const std::exception& failure) {
        throw DeviceError(std::string("no Vulkan loader on this machine (") + failure.what() + "); install libvulkan1");
    }
}

vk::ApplicationInfo application_info() { return vk::ApplicationInfo("tandem", 1, "tandem", 1, VK_API_VERSION_1_2); }

// Devices that lack parts of Vulkan, as those of MoltenVK, are listed for those alone who ask for them. Adds the
// extension to ask with.
vk::InstanceCreateFlags asking_for_all(const vk::raii::Context& context, std::vector<const char*>& extensions) {
    const auto known = context.enumerateInstanceExtensionProperties();
    const auto is_it = [](const vk::ExtensionProperties& one) {
        return one.extensionName == std::string_view(VK_KHR_PORTABILITY_ENUMERATION_EXTENSION_NAME);
    };
    if (std::ranges::none_of(known, is_it)) return {};
    extensions.push_back(VK_KHR_PORTABILITY_ENUMERATION_EXTENSION_NAME);
    return vk::InstanceCreateFlagBits::eEnumeratePortabilityKHR;
}

vk::raii::Instance make_plain_instance(const vk::raii::Context& context, std::vector<const char*> extensions) {
    const vk::ApplicationInfo application = application_info();
    const vk::InstanceCreateFlags flags = asking_for_all(context, extensions);
    return vk::raii::Instance(context, vk::InstanceCreateInfo(flags, &application, {}, extensions));
}

vk::raii::Instance make_validated_instance(
    const vk::raii::Context& context, std::vector<const char*> extensions, ValidationLog& log) {
    const auto layers = context.enumerateInstanceLayerProperties();
    const bool installed = std::ranges::any_of(
        layers, [](const vk::LayerProperties& layer) { return layer.layerName == std::string_view(validation_layer); });
    if (!installed)
        throw DeviceError(
            "validation was asked for, but VK_LAYER_KHRONOS_validation is not installed; install "
            "vulkan-validationlayers");
    const ScopedEnvironment enables(
        "VK_LAYER_ENABLES", "VALIDATION_CHECK_ENABLE_SYNCHRONIZATION_VALIDATION_QUEUE_SUBMIT");
    const vk::ApplicationInfo application = application_info();
    extensions.push_back(VK_EXT_DEBUG_UTILS_EXTENSION_NAME);
    const vk::InstanceCreateFlags flags = asking_for_all(context, extensions);
    const vk::ValidationFeatureEnableEXT synchronisation = vk::ValidationFeatureEnableEXT::eSynchronizationValidation;
    const vk::StructureChain info(vk::InstanceCreateInfo(flags, &application, validation_layer, extensions),
        vk::ValidationFeaturesEXT(synchronisation), messenger_info(log));
    return vk::raii::Instance(context, info.get<vk::InstanceCreateInfo>());
}

vk::raii::Instance make_instance(
    const vk::raii::Context& context, bool validation, const std::vector<const char*>& extensions, ValidationLog& log) {
    try {
        return validation ? make_validated_instance(context, extensions, log)
                          : make_plain_instance(context, extensions);
    } catch (const vk::SystemError& failure) {
        const bool no_driver = failure.code() == vk::make_error_code(vk::Result::eErrorIncompatibleDriver);
        throw DeviceError(std::string("Vulkan cannot be started: ") + failure.what() +
                          (no_driver ? "; " + driver_remedy() : std::string()));
    }
}

DeviceType type_of(vk::PhysicalDeviceType type) {
    switch (type) {
        case vk::PhysicalDeviceType::eIntegratedGpu:
            return DeviceType::integrated;
        case vk::PhysicalDeviceType::eDiscreteGpu:
            return DeviceType::discrete;
        case vk::PhysicalDeviceType::eVirtualGpu:
            return DeviceType::virtual_gpu;
        case vk::PhysicalDeviceType::eCpu:
            return DeviceType::cpu;
        default:
            return DeviceType::other;
    }
}

std::uint64_t largest_device_heap(const vk::PhysicalDeviceMemoryProperties& memory) {
    std::uint64_t largest = 0;
    for (std::uint32_t i = 0; i < memory.memoryHeapCount; ++i)
        if (memory.memoryHeaps[i].flags & vk::MemoryHeapFlagBits::eDeviceLocal)
            largest = std::max<std::uint64_t>(largest, memory.memoryHeaps[i].size);
    return largest;
}

DeviceAbilities abilities_of(const vk::raii::PhysicalDevice& device, const vk::PhysicalDeviceLimits& limits) {
    DeviceAbilities abilities;
    const std::optional<std::uint32_t> family = compute_queue_family(device);
    abilities.compute_queue = family.has_value();
    if (family) abilities.timestamp_bits = device.getQueueFamilyProperties()[*family].timestampValidBits;
    abilities.storage_buffers_per_stage = limits.maxPerStageDescriptorStorageBuffers;
    abilities.storage_buffers_per_set = limits.maxDescriptorSetStorageBuffers;
    abilities.uniform_buffers_per_stage = limits.maxPerStageDescriptorUniformBuffers;
    abilities.uniform_buffers_per_set = limits.maxDescriptorSetUniformBuffers;
    abilities.uniform_buffer_bytes = limits.maxUniformBufferRange;
    abilities.bound_sets = limits.maxBoundDescriptorSets;
    abilities.push_constant_bytes = limits.maxPushConstantsSize;
    abilities.workgroup_invocations = limits.maxComputeWorkGroupInvocations;
    abilities.storage_buffer_bytes = limits.maxStorageBufferRange;
    abilities.device_memory_bytes = largest_device_heap(device.getMemoryProperties());
    return abilities;
}

bool has_extension(const vk::raii::PhysicalDevice& device, std::string_view name) {
    return std::ranges::any_of(device.enumerateDeviceExtensionProperties(),
        [name](const vk::ExtensionProperties& one) { return one.extensionName == name; });
}

std::string pci_address(const vk::raii::PhysicalDevice& device) {
    if (!has_extension(device, VK_EXT_PCI_BUS_INFO_EXTENSION_NAME)) return {};
    const auto at = device.getProperties2<vk::PhysicalDeviceProperties2, vk::PhysicalDevicePCIBusInfoPropertiesEXT>()
                        .get<vk::PhysicalDevicePCIBusInfoPropertiesEXT>();
    return fmt::format("{:04x}:{:02x}:{:02x}.{:x}", at.pciDomain, at.pciBus, at.pciDevice, at.pciFunction);
}

// Streaming multiprocessors, the subgroups that each holds, and their size; NVIDIA's drivers alone tell.
std::uint32_t resident_invocations(const vk::raii::PhysicalDevice& device) {
    if (!has_extension(device, VK_NV_SHADER_SM_BUILTINS_EXTENSION_NAME)) return 0;
    const auto chain = device.getProperties2<vk::PhysicalDeviceProperties2, vk::PhysicalDeviceSubgroupProperties,
        vk::PhysicalDeviceShaderSMBuiltinsPropertiesNV>();
    const auto& has = chain.get<vk::PhysicalDeviceShaderSMBuiltinsPropertiesNV>();
    return has.shaderSMCount * has.shaderWarpsPerSM * chain.get<vk::PhysicalDeviceSubgroupProperties>().subgroupSize;
}

}  // namespace

Instance::Instance(bool validation, const std::vector<const char*>& extensions)
    : context_(load_vulkan()),
      log_(std::make_unique<ValidationLog>()),
      instance_(make_instance(context_, validation, extensions, *log_)),
      messenger_(nullptr) {
    if (validation) messenger_ = vk::raii::DebugUtilsMessengerEXT(instance_, messenger_info(*log_));
}

std::optional<std::uint32_t> compute_queue_family(const vk::raii::PhysicalDevice& device) {
    const auto families = device.getQueueFamilyProperties();
    for (std::uint32_t i = 0; i < families.size(); ++i)
        if (families[i].queueFlags & vk::QueueFlagBits::eCompute) return i;
    return std::nullopt;
}

DeviceDescription describe(const vk::raii::PhysicalDevice& device, std::uint32_t index) {
    DeviceDescription result;
    const vk::PhysicalDeviceProperties plain = device.getProperties();
    result.index = index;
    result.name = plain.deviceName.data();
    result.type = type_of(plain.deviceType);
    result.api_major = VK_API_VERSION_MAJOR(plain.apiVersion);
    result.api_minor = VK_API_VERSION_MINOR(plain.apiVersion);
    result.api_patch = VK_API_VERSION_PATCH(plain.apiVersion);
    result.abilities = abilities_of(device, plain.limits);
    if (plain.apiVersion >= VK_API_VERSION_1_2) {
        const auto chain = device.getProperties2<vk::PhysicalDeviceProperties2, vk::PhysicalDeviceIDProperties,
            vk::PhysicalDeviceDriverProperties, vk::PhysicalDeviceMaintenance3Properties>();
        const auto& driver = chain.get<vk::PhysicalDeviceDriverProperties>();
        result.driver_name = driver.driverName.data();
        result.driver_version = driver.driverInfo.data();
        for (const std::uint8_t byte : chain.get<vk::PhysicalDeviceIDProperties>().deviceUUID)
            for (const int digit : {byte >> 4, byte & 15}) result.uuid += "0123456789abcdef"[digit];
        result.abilities.allocation_bytes =
            chain.get<vk::PhysicalDeviceMaintenance3Properties>().maxMemoryAllocationSize;
        result.abilities.resident_invocations = resident_invocations(device);
        result.pci = pci_address(device);
    }
    if (result.abilities.timestamp_bits > 0) result.features_used.push_back("timestamps");
    return result;
}

}  // namespace tandem
