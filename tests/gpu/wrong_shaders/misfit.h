#include "shaders/shared/types.h"
GPU_BEGIN
struct Misfit {
    uint first;
#ifdef __cplusplus
    uint of_cpp_alone;
#endif
    uint second;
};
GPU_END
