// What the camera sees, as senders of light: levels of parts (shared/screen.h), each the sum of up
// to four of the level below, so that what is far is a few parts and what is near its pixels
// (algorithms.md A3, hierarchy with S4 mended: means by area, power is conserved exactly).
//
// A pixel stands for the surface that it covers: across depth^2 / cosine, which is held, and fades,
// where it grazes; at a crease up to there. Surfaces that are hidden or outside of the picture are
// not there.
//
// On the processor, whatever the device. 150 bytes, and 48 for lobes, a pixel. Private to pass/.
//
// Thread: render thread, and the pool's.

#ifndef BD_PASS_SCREEN_H
#define BD_PASS_SCREEN_H

#include "pass/gather.h"
#include "pass/native/native.h"

// All of it as the device's arrays have it, too (shared/screen.h).
struct bd_screen {
    bool printed;
    uint32_t width_px, height_px, level_count;
    struct bd_uvec4 levels[BD_SCREEN_LEVELS_MAX];
    size_t part_count;
    struct bd_screen_part *parts;
    struct bd_screen_patch *patches;
    struct bd_screen_receiver *receivers;
    struct bd_screen_surface *surfaces; // or NULL
    // Of each part, whether it hides something, as far as one can see: the surface breaks off in it
    // or grazes, or nothing is there.
    uint8_t *torn;
    f3 *sends; // of a pixel: radiance for a unit of irradiance
    struct bd_viewpoint viewpoint;
    bd_dvec3 eye; // render space
    double per_m; // of an orthographic viewpoint's sizes, render units; else 1
};

struct bd_screen_inputs {
    const struct bd_gather_inputs *gather;
    struct bd_pool *pool;
    bool lambert;
    bool mirrors; // light goes on at metals (lights/interface.h): their pixels send none of it
    bool glossy;  // lobes are asked for
    // As the paper has it: plain means of colours beside sums of areas (S4), pixels that end where
    // they end, and the radius of a sphere's projection that is right on the axis far away (S3).
    bool printed;
    uint32_t levels;
    // Of render units, within which the screen must be seen to hold all, or the pixel asks for
    // nothing; 0: all ask.
    float reach;
};

// `levels`: how many there are at most, 1 to BD_SCREEN_LEVELS_MAX.
// BD_ERR_NO_MEMORY, or what the slicer returns. Nothing is sent yet.
BD_MUST_CHECK
enum bd_err bd_screen_create(const struct bd_pass_context *context,
                             const struct bd_screen_inputs *inputs, struct bd_screen **out,
                             struct bd_err_detail *detail);
void bd_screen_destroy(struct bd_screen **screen);

// Of a sphere the pixels before which it begins and ends: left, right, top, bottom. Exact, or as
// printed.
void bd_screen_bounds(const struct bd_screen *screen, f3 position, float radius,
                      uint32_t bounds[4]);

// Whether all surfaces so near to a place that is in the picture are there, too, as far as one can
// see: where the sphere may be seen nothing breaks off, nor is it the picture's edge.
bool bd_screen_holds_about(const struct bd_screen *screen, f3 position, float radius);

// What all parts send, of the irradiance of pixels: three floats each.
BD_MUST_CHECK
enum bd_err bd_screen_shine(const struct bd_pass_context *context, struct bd_screen *screen,
                            const float *irradiance);

#endif
