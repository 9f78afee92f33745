// Pictures made by hand, as a camera or a light would see them, for passes that look at where
// surfaces jump.

#ifndef BD_TESTS_PASS_PICTURE_H
#define BD_TESTS_PASS_PICTURE_H

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "pass/discontinuity.h"

#define COUNT(array) (sizeof(array) / sizeof *(array))

// --- the device ---------------------------------------------------------------------------

extern struct bd_pass_context context;

// Ends the process with 77, "skipped", where there is no device.
int open_device(void **state);
int close_device(void **state);

// --- pictures -----------------------------------------------------------------------------

enum cover { COVER_NOTHING, COVER_UNLIT, COVER_LIT };

struct pixel {
    enum cover cover;
    float depth;
    float normal[2]; // octahedral, whole multiples of 1/32767: both buffers keep them as they are
};

struct picture_size {
    uint32_t width, height;
};

struct picture_kind {
    const char *name;
    struct pixel (*look)(uint32_t x, uint32_t y, struct picture_size size);
};

// Noise, checkerboards, single pixels and the like, each unkind in its own way.
extern const struct picture_kind picture_kinds[];
extern const size_t picture_kind_count;

// Zeroed; fails the test without memory.
void *allocate(size_t count, size_t bytes);
// A repeatable number in [0, 1).
float noise(uint32_t x, uint32_t y, uint32_t stream);
// The octahedral coordinates of a direction, which need not be unit.
void set_normal(struct pixel *pixel, float x, float y, float z);

struct picture {
    struct picture_size size;
    struct pixel *pixels; // depth as the device finds it
    struct bd_viewpoint viewpoint;
    struct bd_render_space space;
    struct bd_gbuffer gbuffer; // of a camera
    struct bd_rsm rsm;         // of a light: the others of its faces hold noise
    bool is_light;
    uint32_t face;
};

// Looks everywhere and uploads. A light's map is as wide as high.
struct picture picture_of_camera(const struct picture_kind *kind, struct picture_size size);
struct picture picture_of_light(const struct picture_kind *kind, uint32_t side_px,
                                bool orthographic);
void picture_destroy(struct picture *picture);
struct bd_discontinuity_inputs picture_inputs(const struct picture *picture,
                                              const struct bd_discontinuity_settings *settings);
// What messages say of a picture under some settings; `kind` is its name.
struct picture_name {
    char text[120];
};
struct picture_name picture_name(const struct picture *picture,
                                 const struct bd_discontinuity_settings *settings,
                                 const char *kind);

// --- sweeps -------------------------------------------------------------------------------

// What is to be checked of a picture under some settings; `name` is the picture's.
typedef void picture_check(const struct picture *picture,
                           const struct bd_discontinuity_settings *settings, const char *name);

// Every kind of picture at every size, each under so many of the settings, which go on from one to
// the next; and the same of lights' maps, `step` settings at a time.
struct picture_sweep {
    struct bd_discontinuity_settings (*settings_of)(uint32_t turn);
    picture_check *check;
    int turns;
    uint32_t step;
};
void sweep_cameras(const struct picture_sweep *sweep, const struct picture_size *sizes,
                   size_t size_count);
// `orthographic`: every third is.
void sweep_lights(const struct picture_sweep *sweep, bool orthographic);
// The check of one picture with the slicer held to slices that are as short as can be; gives their
// number.
uint32_t check_in_slices(picture_check *check, const struct bd_discontinuity_settings *settings);

#endif
