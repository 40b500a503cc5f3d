// A Vulkan layer that simulates driver failures: with FOLIAGE_LOD_TEST_FAILURE="vkQueueSubmit 3 -4"
// the third call of vkQueueSubmit and every later one return VkResult -4 (VK_ERROR_DEVICE_LOST),
// like a driver whose device is lost.
//
// Supports one instance and one device at a time. Built by tests/gpu_faults.rs.

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <vulkan/vk_layer.h>
#include <vulkan/vulkan.h>

#define EXPORT __attribute__((visibility("default")))

static PFN_vkGetInstanceProcAddr instance_proc;
static PFN_vkGetDeviceProcAddr device_proc;
static VkInstance the_instance;

// Whether this call of `name` must fail; sets `result` to the code that it returns then.
static int fails(const char *name, VkResult *result) {
    static int calls, last;
    static char function[64];
    static int code;
    if (!function[0]) {
        const char *plan = getenv("FOLIAGE_LOD_TEST_FAILURE");
        if (!plan || sscanf(plan, "%63s %d %d", function, &last, &code) != 3) strcpy(function, "none");
    }
    if (strcmp(name, function) != 0) return 0;
    *result = code;
    return __atomic_add_fetch(&calls, 1, __ATOMIC_RELAXED) >= last;
}

#define WRAP(name, parameters, arguments)                   \
    static PFN_##name next_##name;                          \
    static VKAPI_ATTR VkResult VKAPI_CALL my_##name parameters { \
        VkResult result;                                    \
        return fails(#name, &result) ? result : next_##name arguments; \
    }

WRAP(vkAllocateMemory, (VkDevice d, const VkMemoryAllocateInfo *i, const VkAllocationCallbacks *a, VkDeviceMemory *m), (d, i, a, m))
WRAP(vkMapMemory, (VkDevice d, VkDeviceMemory m, VkDeviceSize o, VkDeviceSize s, VkMemoryMapFlags f, void **p), (d, m, o, s, f, p))
WRAP(vkCreateBuffer, (VkDevice d, const VkBufferCreateInfo *i, const VkAllocationCallbacks *a, VkBuffer *b), (d, i, a, b))
WRAP(vkCreateImage, (VkDevice d, const VkImageCreateInfo *i, const VkAllocationCallbacks *a, VkImage *m), (d, i, a, m))
WRAP(vkCreateImageView, (VkDevice d, const VkImageViewCreateInfo *i, const VkAllocationCallbacks *a, VkImageView *v), (d, i, a, v))
WRAP(vkCreateShaderModule, (VkDevice d, const VkShaderModuleCreateInfo *i, const VkAllocationCallbacks *a, VkShaderModule *s), (d, i, a, s))

static PFN_vkCreateGraphicsPipelines next_vkCreateGraphicsPipelines;
static VKAPI_ATTR VkResult VKAPI_CALL my_vkCreateGraphicsPipelines(VkDevice d, VkPipelineCache c, uint32_t n, const VkGraphicsPipelineCreateInfo *i, const VkAllocationCallbacks *a, VkPipeline *p) {
    VkResult result;
    if (!fails("vkCreateGraphicsPipelines", &result)) return next_vkCreateGraphicsPipelines(d, c, n, i, a, p);
    for (uint32_t made = 0; made < n; made++) p[made] = VK_NULL_HANDLE;
    return result;
}
WRAP(vkCreateCommandPool, (VkDevice d, const VkCommandPoolCreateInfo *i, const VkAllocationCallbacks *a, VkCommandPool *p), (d, i, a, p))
WRAP(vkAllocateCommandBuffers, (VkDevice d, const VkCommandBufferAllocateInfo *i, VkCommandBuffer *b), (d, i, b))
WRAP(vkBeginCommandBuffer, (VkCommandBuffer b, const VkCommandBufferBeginInfo *i), (b, i))
WRAP(vkEndCommandBuffer, (VkCommandBuffer b), (b))
WRAP(vkQueueSubmit, (VkQueue q, uint32_t n, const VkSubmitInfo *i, VkFence f), (q, n, i, f))
WRAP(vkWaitSemaphores, (VkDevice d, const VkSemaphoreWaitInfo *i, uint64_t t), (d, i, t))
WRAP(vkGetSemaphoreCounterValue, (VkDevice d, VkSemaphore s, uint64_t *v), (d, s, v))

#define FOR_EACH(DO)                                                                                               \
    DO(vkAllocateMemory) DO(vkMapMemory) DO(vkCreateBuffer) DO(vkCreateImage) DO(vkCreateImageView)                 \
    DO(vkCreateShaderModule) DO(vkCreateGraphicsPipelines) DO(vkCreateCommandPool) DO(vkAllocateCommandBuffers)     \
    DO(vkBeginCommandBuffer) DO(vkEndCommandBuffer) DO(vkQueueSubmit) DO(vkWaitSemaphores)      \
    DO(vkGetSemaphoreCounterValue)

// Finds the next layer's link in the pNext chain of `info` and names it `link`.
#define LINK(TYPE, s_type, info)                                                            \
    TYPE *link = (TYPE *)(info)->pNext;                                                     \
    while (link && !(link->sType == s_type && link->function == VK_LAYER_LINK_INFO))        \
        link = (TYPE *)link->pNext;                                                         \
    if (!link) return VK_ERROR_INITIALIZATION_FAILED;

static VKAPI_ATTR VkResult VKAPI_CALL my_vkCreateInstance(const VkInstanceCreateInfo *info, const VkAllocationCallbacks *a, VkInstance *instance) {
    LINK(VkLayerInstanceCreateInfo, VK_STRUCTURE_TYPE_LOADER_INSTANCE_CREATE_INFO, info)
    instance_proc = link->u.pLayerInfo->pfnNextGetInstanceProcAddr;
    link->u.pLayerInfo = link->u.pLayerInfo->pNext;
    PFN_vkCreateInstance create = (PFN_vkCreateInstance)instance_proc(NULL, "vkCreateInstance");
    VkResult result = create(info, a, instance);
    if (result == VK_SUCCESS) the_instance = *instance;
    return result;
}

static VKAPI_ATTR VkResult VKAPI_CALL my_vkCreateDevice(VkPhysicalDevice physical, const VkDeviceCreateInfo *info, const VkAllocationCallbacks *a, VkDevice *device) {
    VkResult result;
    if (fails("vkCreateDevice", &result)) return result;
    LINK(VkLayerDeviceCreateInfo, VK_STRUCTURE_TYPE_LOADER_DEVICE_CREATE_INFO, info)
    device_proc = link->u.pLayerInfo->pfnNextGetDeviceProcAddr;
    PFN_vkGetInstanceProcAddr next = link->u.pLayerInfo->pfnNextGetInstanceProcAddr;
    link->u.pLayerInfo = link->u.pLayerInfo->pNext;
    PFN_vkCreateDevice create = (PFN_vkCreateDevice)next(the_instance, "vkCreateDevice");
    result = create(physical, info, a, device);
    if (result != VK_SUCCESS) return result;
#define RESOLVE(name) next_##name = (PFN_##name)device_proc(*device, #name);
    FOR_EACH(RESOLVE)
    return VK_SUCCESS;
}

static PFN_vkVoidFunction mine(const char *name) {
#define FIND(wrapped) if (strcmp(name, #wrapped) == 0) return (PFN_vkVoidFunction)my_##wrapped;
    FOR_EACH(FIND)
    FIND(vkCreateDevice)
    return NULL;
}

EXPORT VKAPI_ATTR PFN_vkVoidFunction VKAPI_CALL vkGetDeviceProcAddr(VkDevice device, const char *name) {
    if (strcmp(name, "vkGetDeviceProcAddr") == 0) return (PFN_vkVoidFunction)vkGetDeviceProcAddr;
    PFN_vkVoidFunction found = mine(name);
    return found ? found : device_proc(device, name);
}

EXPORT VKAPI_ATTR PFN_vkVoidFunction VKAPI_CALL vkGetInstanceProcAddr(VkInstance instance, const char *name) {
    if (strcmp(name, "vkGetInstanceProcAddr") == 0) return (PFN_vkVoidFunction)vkGetInstanceProcAddr;
    if (strcmp(name, "vkGetDeviceProcAddr") == 0) return (PFN_vkVoidFunction)vkGetDeviceProcAddr;
    if (strcmp(name, "vkCreateInstance") == 0) return (PFN_vkVoidFunction)my_vkCreateInstance;
    PFN_vkVoidFunction found = mine(name);
    return found || !instance ? found : instance_proc(instance, name);
}
