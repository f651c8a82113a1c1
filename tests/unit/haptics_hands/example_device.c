/* A device as palpate_device.h asks for it, without a maker's software: a handle that a spring pulls
 * to the middle and that the last force moves. What it is told to do wrong is for tests. */
#include "haptics/device/adapter/palpate_device.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

struct handle {
    double position_m[3], force_n[3];
};

static void* open_device(struct palpate_device_capabilities* c, char* why, size_t room) {
    const char* const fault = getenv("EXAMPLE_DEVICE");
    if (fault && strcmp(fault, "absent") == 0) {
        strncpy(why, "no example device is plugged in", room - 1);
        return NULL;
    }
    strcpy(c->name, "example");
    for (int axis = 0; axis < 3; ++axis)
        c->workspace_m[axis] = 0.05;
    c->max_force_n = 4.0;
    c->rate_hz = fault && strcmp(fault, "still") == 0 ? 0.0 : 1000.0;
    c->buttons = 2;
    return calloc(1, sizeof(struct handle));
}

static void close_device(void* device) {
    free(device);
}

static int read_device(void* device, struct palpate_device_sample* sample) {
    struct handle* const h = device;
    const char* const fault = getenv("EXAMPLE_DEVICE");
    if (fault && strcmp(fault, "gone") == 0)
        return PALPATE_DEVICE_GONE;
    for (int axis = 0; axis < 3; ++axis) {
        h->position_m[axis] = 0.9 * h->position_m[axis] + 1e-3 * h->force_n[axis];
        sample->position_m[axis] = h->position_m[axis];
    }
    if (fault && strcmp(fault, "nan") == 0)
        sample->position_m[1] = nan("");
    sample->buttons = 1;
    return PALPATE_DEVICE_OK;
}

static int write_device(void* device, const double force_n[3], const double torque_nm[3]) {
    struct handle* const h = device;
    (void)torque_nm;
    memcpy(h->force_n, force_n, sizeof(h->force_n));
    return PALPATE_DEVICE_OK;
}

static void halt_device(void* device) {
    struct handle* const h = device;
    memset(h->force_n, 0, sizeof(h->force_n));
}

const struct palpate_device* palpate_device_entry(void) {
    static const struct palpate_device entry = {PALPATE_DEVICE_ABI, open_device,  close_device,
                                                read_device,        write_device, halt_device};
    return &entry;
}
