// Types with one meaning in C++ and in GLSL. Blocks use scalar layout, so offsets agree.
#ifdef __cplusplus
#pragma once
#include <cstdint>
#include <glm/glm.hpp>
#define GPU_BEGIN           \
    namespace palpate::gpu { \
    using glm::ivec2;       \
    using glm::ivec3;       \
    using glm::mat3;        \
    using glm::uvec2;       \
    using glm::uvec3;       \
    using glm::vec2;        \
    using glm::vec3;        \
    using glm::vec4;        \
    using uint = uint32_t;
#define GPU_END }
#else
#define GPU_BEGIN
#define GPU_END
#endif
