// Barrier mutations. Every barrier that the renderer records is taken out or weakened in turn, beneath the renderer, in
// the table of Vulkan's functions. The validation layer or the image must notice. What the layer cannot see is listed.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <optional>

#include "common/error.h"
#include "tests/vulkan/machine.h"

using namespace tandem;
using namespace tandem::testing;

namespace {

using Stage2 = vk::PipelineStageFlagBits;
using Access = vk::AccessFlagBits;

struct BarrierCall {
    vk::PipelineStageFlags from, to;
    std::vector<vk::MemoryBarrier> memory;
    std::vector<vk::BufferMemoryBarrier> buffers;
    bool after_wait = false;   // nothing was dispatched in this submission before
    bool after_queue = false;  // what was last dispatched was a queue of rays, which may have filled another

    void for_each_access(const std::function<void(vk::AccessFlags& from, vk::AccessFlags& to)>& change) {
        for (vk::MemoryBarrier& barrier : memory) change(barrier.srcAccessMask, barrier.dstAccessMask);
        for (vk::BufferMemoryBarrier& barrier : buffers) change(barrier.srcAccessMask, barrier.dstAccessMask);
    }
    [[nodiscard]] bool orders_before(vk::AccessFlags access) {
        bool any = false;
        for_each_access([&](vk::AccessFlags&, vk::AccessFlags& to_access) { any = any || (to_access & access); });
        return any;
    }
};

// A weaker barrier than the one recorded. `change` says false where it would leave the barrier as it is.
struct Mutation {
    const char* name;
    std::function<bool(BarrierCall&)> change;  // empty: the barrier is left out
};

bool drop_access(BarrierCall& call, vk::AccessFlags dropped) {
    if (!call.orders_before(dropped)) return false;
    call.for_each_access([&](vk::AccessFlags&, vk::AccessFlags& to) { to &= ~dropped; });
    return true;
}

bool drop_stage(BarrierCall& call, vk::PipelineStageFlags stage, vk::AccessFlags of_stage) {
    if (!(call.to & stage) || !(call.to & ~stage)) return false;
    call.to &= ~stage;
    call.for_each_access([&](vk::AccessFlags&, vk::AccessFlags& to) { to &= ~of_stage; });
    return true;
}

const std::vector<Mutation>& mutations() {
    static const std::vector<Mutation> all{{"left out", {}},
        {"execution only",
            [](BarrierCall& call) {
                call.for_each_access([](vk::AccessFlags& from, vk::AccessFlags& to) { from = to = {}; });
                return true;
            }},
        {"nothing made available",
            [](BarrierCall& call) {
                call.for_each_access([](vk::AccessFlags& from, vk::AccessFlags&) { from = {}; });
                return true;
            }},
        {"from the top of the pipe",
            [](BarrierCall& call) {
                call.from = Stage2::eTopOfPipe;
                call.for_each_access([](vk::AccessFlags& from, vk::AccessFlags&) { from = {}; });
                return true;
            }},
        {"not before shader reads", [](BarrierCall& call) { return drop_access(call, Access::eShaderRead); }},
        {"not before shader writes", [](BarrierCall& call) { return drop_access(call, Access::eShaderWrite); }},
        {"not before uniform reads", [](BarrierCall& call) { return drop_access(call, Access::eUniformRead); }},
        {"not before indirect arguments",
            [](BarrierCall& call) { return drop_stage(call, Stage2::eDrawIndirect, Access::eIndirectCommandRead); }},
        {"before indirect arguments alone", [](BarrierCall& call) {
             return drop_stage(
                 call, Stage2::eComputeShader, Access::eShaderRead | Access::eShaderWrite | Access::eUniformRead);
         }}};
    return all;
}

constexpr std::size_t nowhere = ~std::size_t{0}, everywhere = nowhere - 1;

// What is done to which call; Vulkan's functions have no room for it among their arguments.
struct Interception {
    PFN_vkCmdPipelineBarrier barrier = nullptr;
    PFN_vkCmdDispatch dispatch = nullptr;
    PFN_vkCmdDispatchIndirect dispatch_indirect = nullptr;
    PFN_vkQueueSubmit submit = nullptr;
    const Mutation* mutation = nullptr;
    std::size_t target = nowhere;
    std::vector<BarrierCall> calls;          // as they were recorded
    bool fresh = true, after_queue = false;  // BarrierCall's
    bool changed = false;
};
Interception interception;

VKAPI_ATTR void VKAPI_CALL mutated_barrier(VkCommandBuffer commands, VkPipelineStageFlags from, VkPipelineStageFlags to,
    VkDependencyFlags flags, std::uint32_t memory_count, const VkMemoryBarrier* memory, std::uint32_t buffer_count,
    const VkBufferMemoryBarrier* buffers, std::uint32_t image_count, const VkImageMemoryBarrier* images) {
    BarrierCall call{vk::PipelineStageFlags(from), vk::PipelineStageFlags(to), {memory, memory + memory_count},
        {buffers, buffers + buffer_count}, interception.fresh, interception.after_queue};
    const std::size_t number = interception.calls.size();
    interception.calls.push_back(call);
    if (number == interception.target || interception.target == everywhere) {
        const auto& change = interception.mutation->change;
        interception.changed = !change || change(call) || interception.changed;
        if (!change) return;
    }
    const std::vector<VkMemoryBarrier> new_memory(call.memory.begin(), call.memory.end());
    const std::vector<VkBufferMemoryBarrier> new_buffers(call.buffers.begin(), call.buffers.end());
    interception.barrier(commands, static_cast<VkPipelineStageFlags>(call.from),
        static_cast<VkPipelineStageFlags>(call.to), flags, memory_count, new_memory.data(), buffer_count,
        new_buffers.data(), image_count, images);
}

VKAPI_ATTR void VKAPI_CALL seen_dispatch(VkCommandBuffer commands, std::uint32_t x, std::uint32_t y, std::uint32_t z) {
    interception.fresh = interception.after_queue = false;
    interception.dispatch(commands, x, y, z);
}

VKAPI_ATTR void VKAPI_CALL seen_dispatch_indirect(VkCommandBuffer commands, VkBuffer buffer, VkDeviceSize offset) {
    interception.fresh = false;
    interception.after_queue = true;
    interception.dispatch_indirect(commands, buffer, offset);
}

VKAPI_ATTR VkResult VKAPI_CALL seen_submit(
    VkQueue queue, std::uint32_t count, const VkSubmitInfo* infos, VkFence fence) {
    interception.fresh = true;
    return interception.submit(queue, count, infos, fence);
}

// While it lives, barriers, dispatches and submissions of the device pass through the functions above.
class Interceptor {
public:
    explicit Interceptor(const Device& device)
        // The table is the device's own and not const; there is but no other way to it.
        : table_(const_cast<vk::raii::DeviceDispatcher&>(*device.handle().getDispatcher())) {
        interception = {};
        interception.barrier = std::exchange(table_.vkCmdPipelineBarrier, mutated_barrier);
        interception.dispatch = std::exchange(table_.vkCmdDispatch, seen_dispatch);
        interception.dispatch_indirect = std::exchange(table_.vkCmdDispatchIndirect, seen_dispatch_indirect);
        interception.submit = std::exchange(table_.vkQueueSubmit, seen_submit);
    }
    ~Interceptor() {
        table_.vkCmdPipelineBarrier = interception.barrier;
        table_.vkCmdDispatch = interception.dispatch;
        table_.vkCmdDispatchIndirect = interception.dispatch_indirect;
        table_.vkQueueSubmit = interception.submit;
    }
    Interceptor(const Interceptor&) = delete;
    Interceptor& operator=(const Interceptor&) = delete;

private:
    vk::raii::DeviceDispatcher& table_;
};

// Everything that a path can carry from vertex to vertex. A frame and a render are one submission each (the
// megakernel's frame of two blocks in two dispatches), and the download of the image another.
Estimate image(Machine& machine, const JobPatterns& patterns) {
    interception.calls.clear();
    interception.fresh = true;
    VulkanJob job = machine.job(patterns, foggy_scene(), settings_of(8, 2, Integrator::next_event));
    (void)job.frame(patterns.tracer.kernel == KernelShape::megakernel ? 66 : 2);
    return job.render({0, 2}, {}).estimate;
}

// Whether layer or image notice the mutation; nothing where it changes nothing.
std::optional<bool> notices(Machine& machine, const JobPatterns& patterns, const Estimate& expected,
    const Mutation& mutation, std::size_t target) {
    interception.mutation = &mutation;
    interception.target = target;
    interception.changed = false;
    bool noticed = false;
    try {
        noticed = !same_bits(image(machine, patterns), expected);
    } catch (const Error&) {
        noticed = true;
        (void)machine.instance.log().take();
    }
    interception.target = nowhere;
    if (!interception.changed) return std::nullopt;
    return noticed;
}

bool speaks_of_access(const Mutation& mutation, const char* what) {
    return std::string_view(mutation.name).find(what) != std::string_view::npos;
}

// Why synchronisation validation (layer 1.3.239) may be silent about one barrier, and the device's image too.
std::string excuse(const Mutation& mutation, std::size_t target, const BarrierCall& call) {
    if (call.to & Stage2::eHost) return "it knows nothing of what the host reads";
    if (call.after_wait && target > 0) return "it takes a wait for a fence for a barrier of everything";
    if (speaks_of_access(mutation, "uniform reads")) return "it takes uniform reads for shader reads";
    if (speaks_of_access(mutation, "shader writes")) return "two writes of a buffer have several barriers between them";
    if (speaks_of_access(mutation, "not before indirect") && call.after_queue)
        return "it takes what a kernel reads and writes, such as the queues, for what it reads";
    return {};
}

struct Counts {
    std::size_t noticed = 0, excused = 0;
};

// All barriers of this way to record, each mutated in each way. What is noticed in spite of an excuse fails too: the
// list of blind spots stays true.
Counts check_all(const JobPatterns& patterns) {
    Machine machine(true);
    const Interceptor interceptor(machine.device);
    const Estimate expected = image(machine, patterns);
    const std::vector<BarrierCall> calls = interception.calls;
    REQUIRE(calls.size() >= 5);
    Counts counts;
    for (const Mutation& mutation : mutations())
        for (std::size_t target = 0; target < calls.size(); ++target) {
            const std::optional<bool> noticed = notices(machine, patterns, expected, mutation, target);
            if (!noticed) continue;
            const std::string blind = excuse(mutation, target, calls[target]);
            ++(*noticed ? counts.noticed : counts.excused);
            const std::string what = fmt::format("barrier {} of {}, {}; blind spot: {}", target, calls.size(),
                mutation.name, blind.empty() ? "none" : blind);
            CHECK_MESSAGE(*noticed == blind.empty(), what);
        }
    // What no single barrier shows all of them together do, where a buffer is written twice: the megakernel writes
    // none.
    const auto writes = std::ranges::find_if(
        mutations(), [](const Mutation& mutation) { return speaks_of_access(mutation, "shader writes"); });
    CHECK(notices(machine, patterns, expected, *writes, everywhere) ==
          (patterns.tracer.kernel != KernelShape::megakernel));
    MESSAGE(counts.noticed << " mutations noticed, " << counts.excused << " in known blind spots");
    return counts;
}

JobPatterns in_one_submission(KernelShape kernel) {
    JobPatterns patterns;
    patterns.tracer.kernel = kernel;
    patterns.vulkan.segments_per_submission = 1000;
    return patterns;
}

}  // namespace

TEST_CASE("each barrier of the six stages is missed where it is left out or weakened") {
    const Counts counts = check_all(in_one_submission(KernelShape::stages));
    CHECK(counts.noticed > 150);
}

TEST_CASE("each barrier of the six stages over the whole image is missed where it is left out or weakened") {
    const Counts counts = check_all(in_one_submission(KernelShape::image_stages));
    CHECK(counts.noticed > 130);
}

TEST_CASE("each barrier of the megakernel is missed where it is left out or weakened") {
    const Counts counts = check_all(in_one_submission(KernelShape::megakernel));
    CHECK(counts.noticed >= 15);
}
