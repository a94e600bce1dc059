/* What a shared library tells `tandem bench --arm-library` of its arms. They are ways to do the same work with Vulkan,
   which Tandem runs in turn and times. Plain C; template.c is a whole library. */
#ifndef TANDEM_ARM_H
#define TANDEM_ARM_H

#include <stddef.h>
#include <stdint.h>
#include <vulkan/vulkan.h>

#ifdef __cplusplus
extern "C" {
#endif

#define TANDEM_ARM_VERSION 1

/* What arms work on, Tandem's own. The instance is of Vulkan 1.2. The device has the features that Tandem itself uses
   where there are any (DeviceFeatures in vulkan/core/device.h). Arms that need others make a device of their own from
   the physical one, and have run(). */
typedef struct TandemDevice {
    VkInstance instance;
    VkPhysicalDevice physical_device;
    VkDevice device;
    VkQueue queue;         /* nobody else uses it while a function of the library runs */
    uint32_t queue_family; /* the device's first with compute */
} TandemDevice;

/* Functions that return text return null where all is well, else a sentence that says why not. Its memory must last
   until the library's next call. All calls come from one thread. */
typedef struct TandemArm {
    const char* name; /* unique in the library: "many-fills" */
    const char* text; /* one line: what it does */
    /* Why this device cannot run the arm, which is then not applicable. Null: every device can. */
    const char* (*unsupported)(const TandemDevice* on);
    /* Makes all that runs of this much work need, and keeps it in *state. */
    const char* (*make)(const TandemDevice* on, double work, void** state);
    /* One of these two, the other is null. All runs do the same work; nothing of one may be left undone.
       record: records one run. Tandem submits the commands, waits for them, and reads the device's clock.
       run: submits by itself, and returns when the device has finished. */
    const char* (*record)(void* state, VkCommandBuffer commands);
    const char* (*run)(void* state);
    /* The bytes that the last run gave, which must be those of the first arm, or else nothing is timed. They must last
       until the next call. Null: nothing is compared. */
    const char* (*result)(void* state, const void** bytes, size_t* size);
    /* Frees *state; also where make() failed after it had set it. May be null. */
    void (*destroy)(void* state);
} TandemArm;

typedef struct TandemArmLibrary {
    uint32_t version;     /* TANDEM_ARM_VERSION */
    const char* name;     /* one word: "fills" */
    const char* question; /* what you want to know */
    const char* held;     /* what is the same in all arms */
    const char* unit;     /* of a run's work: "bytes", "pixels" */
    uint32_t work_count;
    const double* work;    /* how much a run is to do, ascending: the arms are measured at each */
    uint32_t warm_up_runs; /* of each arm before its clock counts; later warm-up is found by a test */
    uint32_t arm_count;    /* two or more */
    const TandemArm* arms; /* the first is the baseline */
    uint32_t extension_count;
    const char* const* extensions; /* of the device; Tandem refuses to begin without them */
} TandemArmLibrary;

/* The one symbol that the library exports. What it returns must last as long as the library. */
const TandemArmLibrary* tandem_arm_library(void);

#ifdef __cplusplus
}
#endif

#endif
