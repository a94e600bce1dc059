/* Two ways to fill a buffer, as arms of `tandem bench`:
     cc -shared -fPIC -o my.so template.c -lvulkan
     tandem bench --arm-library my.so */
#include <stdlib.h>
#include <tandem/arm.h>
typedef struct State { VkDevice device; VkBuffer buffer; VkDeviceMemory memory; VkDeviceSize size; void* bytes; } State;
static const char* make(const TandemDevice* on, double work, void** state) {
    State* s = (State*)(*state = calloc(1, sizeof(State)));
    s->device = on->device;
    s->size = (VkDeviceSize)work;
    const VkBufferCreateInfo info = {.sType = VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO, .size = s->size,
        .usage = VK_BUFFER_USAGE_TRANSFER_DST_BIT};
    if (vkCreateBuffer(s->device, &info, NULL, &s->buffer) != VK_SUCCESS) return "the buffer cannot be made";
    VkMemoryRequirements needs;
    VkPhysicalDeviceMemoryProperties has;
    vkGetBufferMemoryRequirements(s->device, s->buffer, &needs);
    vkGetPhysicalDeviceMemoryProperties(on->physical_device, &has);
    const VkMemoryPropertyFlags wanted = VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT;
    uint32_t type = 0;
    while (!(needs.memoryTypeBits >> type & 1) || (has.memoryTypes[type].propertyFlags & wanted) != wanted) ++type;
    const VkMemoryAllocateInfo own = {VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO, NULL, needs.size, type};
    if (vkAllocateMemory(s->device, &own, NULL, &s->memory) != VK_SUCCESS) return "there is no memory";
    if (vkBindBufferMemory(s->device, s->buffer, s->memory, 0) != VK_SUCCESS) return "memory cannot be bound";
    return vkMapMemory(s->device, s->memory, 0, VK_WHOLE_SIZE, 0, &s->bytes) == VK_SUCCESS ? NULL : "memory cannot be mapped";
}
static const char* fill(const State* s, VkCommandBuffer commands, unsigned parts) {
    for (unsigned i = 0; i < parts; ++i) vkCmdFillBuffer(commands, s->buffer, i * s->size / parts, s->size / parts, 7);
    const VkMemoryBarrier seen = {.sType = VK_STRUCTURE_TYPE_MEMORY_BARRIER, .srcAccessMask = VK_ACCESS_TRANSFER_WRITE_BIT,
        .dstAccessMask = VK_ACCESS_HOST_READ_BIT};
    vkCmdPipelineBarrier(commands, VK_PIPELINE_STAGE_TRANSFER_BIT, VK_PIPELINE_STAGE_HOST_BIT, 0, 1, &seen, 0, NULL, 0, NULL);
    return NULL;
}
static const char* record_one(void* state, VkCommandBuffer commands) { return fill((State*)state, commands, 1); }
static const char* record_many(void* state, VkCommandBuffer commands) { return fill((State*)state, commands, 1024); }
static const char* result(void* state, const void** bytes, size_t* size) {
    *bytes = ((State*)state)->bytes;
    *size = (size_t)((State*)state)->size;
    return NULL;
}
static void destroy(void* state) {
    vkDestroyBuffer(((State*)state)->device, ((State*)state)->buffer, NULL);
    vkFreeMemory(((State*)state)->device, ((State*)state)->memory, NULL);
    free(state);
}
static const double sizes[] = {65536, 1048576};
static const TandemArm arms[] = {{"one-fill", "one command", NULL, make, record_one, NULL, result, destroy},
    {"many-fills", "1024 commands, a part each", NULL, make, record_many, NULL, result, destroy}};
static const TandemArmLibrary library = {TANDEM_ARM_VERSION, "fills", "Does it matter how many commands fill a buffer?",
    "the buffer, its memory, its content", "bytes", 2, sizes, 10, 2, arms, 0, NULL};
const TandemArmLibrary* tandem_arm_library(void) { return &library; }
