/* A device that a maker's closed software drives, for Palpate to use.
 *
 * Fill in these functions in a shared library, link that with the maker's software, and open it as
 * the device `adapter:FILE`. Palpate contains none of that software and needs none to be built.
 *
 * Units are metres, newtons, newton metres, seconds. Axes: x to the right, y up, z towards the
 * person; the origin is the middle of the workspace.
 *
 * read, write and wait are called by one thread, 1000 times a second or more. They may not wait for
 * longer than the device's own transport needs. halt may be called by any thread at any time, also
 * while another function runs.
 */
#ifndef PALPATE_DEVICE_H
#define PALPATE_DEVICE_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define PALPATE_DEVICE_ABI 1u

struct palpate_device_capabilities {
    char name[64];                /* ends with 0 */
    double workspace_m[3];        /* half of the reachable box on each axis; > 0 */
    double resolution_m;          /* of positions; 0: exact */
    double max_force_n;           /* in every direction; 0: it gives no force */
    double max_torque_nm;         /* 0: no torque */
    double max_stiffness_n_per_m; /* 0: unknown */
    double max_damping_n_s_per_m; /* 0: unknown */
    double rate_hz;               /* of samples; > 0 */
    double watchdog_s;            /* without a write for so long it gives no force; 0: never */
    uint32_t buttons;             /* how many; at most 32 */
    uint32_t senses_rotation;     /* 0 or 1 */
};

struct palpate_device_sample {
    double position_m[3];
    double rotation[4]; /* a unit quaternion, w x y z; 1 0 0 0 where it senses none */
    uint32_t buttons;   /* bit b: button b is pressed */
};

enum palpate_device_status {
    PALPATE_DEVICE_OK = 0,
    PALPATE_DEVICE_STALE = 1,     /* nothing new came */
    PALPATE_DEVICE_NOT_HOMED = 2, /* positions mean nothing yet */
    PALPATE_DEVICE_GONE = 3       /* unplugged, or does not answer */
};

struct palpate_device {
    uint32_t abi; /* PALPATE_DEVICE_ABI */
    /* Opens the device, without force. Null: it cannot, and `why` holds a sentence of at most
     * `room` bytes, the last of which is 0. */
    void* (*open)(struct palpate_device_capabilities* capabilities, char* why, size_t room);
    void (*close)(void* device);                                     /* without force afterwards */
    int (*read)(void* device, struct palpate_device_sample* sample); /* palpate_device_status */
    int (*write)(void* device, const double force_n[3], const double torque_nm[3]);
    void (*halt)(void* device); /* no force until the next write */
};

/* The only symbol that is looked for. The structure lives as long as the library. */
const struct palpate_device* palpate_device_entry(void);

#ifdef __cplusplus
}
#endif
#endif
