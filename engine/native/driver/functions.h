#pragma once

// Vulkan's functions whose first argument is an instance, a physical device, a device, a queue or a
// command buffer. The engine, the programs and the tests call none but these and the four that ask
// for no handle (vkCreateInstance, vkEnumerateInstance*): a name that is in neither list is a null
// pointer on every device, so that a call that nobody listed is found by the first test.

// The private driver has these.
#define PALPATE_DRIVER_FUNCTIONS(F)                    \
    F(vkAllocateCommandBuffers)                        \
    F(vkAllocateDescriptorSets)                        \
    F(vkAllocateMemory)                                \
    F(vkBeginCommandBuffer)                            \
    F(vkBindBufferMemory)                              \
    F(vkBindBufferMemory2)                             \
    F(vkBindImageMemory)                               \
    F(vkBindImageMemory2)                              \
    F(vkCmdBeginDebugUtilsLabelEXT)                    \
    F(vkCmdBeginRendering)                             \
    F(vkCmdBindDescriptorSets)                         \
    F(vkCmdBindIndexBuffer)                            \
    F(vkCmdBindPipeline)                               \
    F(vkCmdBindVertexBuffers)                          \
    F(vkCmdClearAttachments)                           \
    F(vkCmdClearColorImage)                            \
    F(vkCmdCopyBuffer)                                 \
    F(vkCmdCopyBufferToImage)                          \
    F(vkCmdCopyImage)                                  \
    F(vkCmdCopyImageToBuffer)                          \
    F(vkCmdDispatch)                                   \
    F(vkCmdDispatchBase)                               \
    F(vkCmdDispatchIndirect)                           \
    F(vkCmdDrawIndexed)                                \
    F(vkCmdEndDebugUtilsLabelEXT)                      \
    F(vkCmdEndRendering)                               \
    F(vkCmdFillBuffer)                                 \
    F(vkCmdPipelineBarrier)                            \
    F(vkCmdPipelineBarrier2)                           \
    F(vkCmdPushConstants)                              \
    F(vkCmdResetQueryPool)                             \
    F(vkCmdSetScissor)                                 \
    F(vkCmdSetViewport)                                \
    F(vkCmdUpdateBuffer)                               \
    F(vkCmdWriteTimestamp2)                            \
    F(vkCreateBuffer)                                  \
    F(vkCreateCommandPool)                             \
    F(vkCreateComputePipelines)                        \
    F(vkCreateDebugUtilsMessengerEXT)                  \
    F(vkCreateDescriptorPool)                          \
    F(vkCreateDescriptorSetLayout)                     \
    F(vkCreateDevice)                                  \
    F(vkCreateFence)                                   \
    F(vkCreateGraphicsPipelines)                       \
    F(vkCreateImage)                                   \
    F(vkCreateImageView)                               \
    F(vkCreatePipelineLayout)                          \
    F(vkCreateQueryPool)                               \
    F(vkCreateSampler)                                 \
    F(vkCreateSemaphore)                               \
    F(vkCreateShaderModule)                            \
    F(vkDestroyBuffer)                                 \
    F(vkDestroyCommandPool)                            \
    F(vkDestroyDebugUtilsMessengerEXT)                 \
    F(vkDestroyDescriptorPool)                         \
    F(vkDestroyDescriptorSetLayout)                    \
    F(vkDestroyDevice)                                 \
    F(vkDestroyFence)                                  \
    F(vkDestroyImage)                                  \
    F(vkDestroyImageView)                              \
    F(vkDestroyInstance)                               \
    F(vkDestroyPipeline)                               \
    F(vkDestroyPipelineLayout)                         \
    F(vkDestroyQueryPool)                              \
    F(vkDestroySampler)                                \
    F(vkDestroySemaphore)                              \
    F(vkDestroyShaderModule)                           \
    F(vkDeviceWaitIdle)                                \
    F(vkEndCommandBuffer)                              \
    F(vkEnumerateDeviceExtensionProperties)            \
    F(vkEnumerateDeviceLayerProperties)                \
    F(vkEnumeratePhysicalDevices)                      \
    F(vkFreeCommandBuffers)                            \
    F(vkFreeDescriptorSets)                            \
    F(vkFreeMemory)                                    \
    F(vkGetBufferMemoryRequirements)                   \
    F(vkGetBufferMemoryRequirements2)                  \
    F(vkGetCalibratedTimestampsEXT)                    \
    F(vkGetDeviceProcAddr)                             \
    F(vkGetDeviceQueue)                                \
    F(vkGetFenceStatus)                                \
    F(vkGetImageMemoryRequirements)                    \
    F(vkGetImageMemoryRequirements2)                   \
    F(vkGetPhysicalDeviceCalibrateableTimeDomainsEXT)  \
    F(vkGetPhysicalDeviceFeatures)                     \
    F(vkGetPhysicalDeviceFeatures2)                    \
    F(vkGetPhysicalDeviceFormatProperties)             \
    F(vkGetPhysicalDeviceFormatProperties2)            \
    F(vkGetPhysicalDeviceImageFormatProperties)        \
    F(vkGetPhysicalDeviceImageFormatProperties2)       \
    F(vkGetPhysicalDeviceMemoryProperties)             \
    F(vkGetPhysicalDeviceMemoryProperties2)            \
    F(vkGetPhysicalDeviceProperties)                   \
    F(vkGetPhysicalDeviceProperties2)                  \
    F(vkGetPhysicalDeviceQueueFamilyProperties)        \
    F(vkGetPhysicalDeviceQueueFamilyProperties2)       \
    F(vkGetPhysicalDeviceSparseImageFormatProperties)  \
    F(vkGetPhysicalDeviceSparseImageFormatProperties2) \
    F(vkGetQueryPoolResults)                           \
    F(vkGetSemaphoreCounterValue)                      \
    F(vkMapMemory)                                     \
    F(vkQueueSubmit2)                                  \
    F(vkQueueWaitIdle)                                 \
    F(vkResetCommandPool)                              \
    F(vkResetDescriptorPool)                           \
    F(vkResetFences)                                   \
    F(vkSetDebugUtilsObjectNameEXT)                    \
    F(vkSignalSemaphore)                               \
    F(vkUnmapMemory)                                   \
    F(vkUpdateDescriptorSets)                          \
    F(vkWaitForFences)                                 \
    F(vkWaitSemaphores)

// The programs call these as well. On the private driver they fail with a sentence.
#define PALPATE_REFUSED_FUNCTIONS(F)             \
    F(vkAcquireNextImageKHR)                     \
    F(vkCreateBufferView)                        \
    F(vkCreateEvent)                             \
    F(vkCreateFramebuffer)                       \
    F(vkCreatePipelineCache)                     \
    F(vkCreateRenderPass)                        \
    F(vkCreateSwapchainKHR)                      \
    F(vkDestroySurfaceKHR)                       \
    F(vkDestroySwapchainKHR)                     \
    F(vkGetPhysicalDeviceSurfaceCapabilitiesKHR) \
    F(vkGetPhysicalDeviceSurfaceFormatsKHR)      \
    F(vkGetSwapchainImagesKHR)                   \
    F(vkQueuePresentKHR)

#define PALPATE_VULKAN_FUNCTIONS(F) PALPATE_DRIVER_FUNCTIONS(F) PALPATE_REFUSED_FUNCTIONS(F)
