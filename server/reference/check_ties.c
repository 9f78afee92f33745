#include "reference/check_ties.h"

#include <math.h>
#include <stdlib.h>

#include "reference/check_plan.h"

// Pixels in one item of a loop.
#define ITEM_PIXELS 256u

struct looking {
    const struct bd_check_frame *frame;
    const struct bd_check_tracer *tracer;
    uint32_t *pixels; // that are looked at
    uint32_t count;
    uint8_t *differs;
};

static struct bd_check_surface surface_of_reference(const struct bd_reference_pixel *seen)
{
    struct bd_check_surface out = {.depth_m = BD_CHECK_DEPTH_OF_NOTHING_M};
    if (seen->coverage == 0) return out;
    out.depth_m = (float)(seen->depth_m / seen->coverage);
    for (int k = 0; k < 3; k++) {
        out.normal[k] = (float)(seen->normal[k] / seen->coverage);
        out.albedo[k] = (float)(seen->albedo[k] / seen->coverage);
    }
    return out;
}

static void look(const struct looking *l, uint32_t pixel)
{
    const uint32_t width = l->frame->beauty->width_px, x = pixel % width, y = pixel / width;
    struct bd_reference_pixel seen = {0};
    l->tracer->first_surface(l->tracer->user, x, y, &seen);
    const struct bd_check_surface ours = bd_check_surface_at(l->frame, x, y),
                                  theirs = surface_of_reference(&seen);
    l->differs[pixel] = bd_check_is_other_surface(&ours, &theirs);
}

static void look_item(void *user, uint32_t item)
{
    const struct looking *l = user;
    uint32_t end = (item + 1) * ITEM_PIXELS;
    if (end > l->count) end = l->count;
    for (uint32_t i = item * ITEM_PIXELS; i < end; i++) look(l, l->pixels[i]);
}

// --- edges ----------------------------------------------------------------------------------

static void find_edges_of_row(void *user, uint32_t row)
{
    const struct looking *l = user;
    const uint32_t width = l->frame->beauty->width_px;
    for (uint32_t x = 0; x < width; x++)
        l->differs[(size_t)row * width + x] = bd_check_is_edge(l->frame, x, row);
}

// All pixels on edges, or, where there are too many, every second, third, ... of them; and none of
// them is different yet.
static bool choose(struct looking *l)
{
    const size_t pixel_count = (size_t)l->frame->beauty->width_px * l->frame->beauty->height_px;
    size_t edges = 0, passed = 0;
    for (size_t i = 0; i < pixel_count; i++) edges += l->differs[i];
    const size_t step = edges / BD_CHECK_TIES_MAX + 1;
    l->pixels = malloc((edges / step + 1) * sizeof *l->pixels);
    for (size_t i = 0; i < pixel_count && l->pixels; i++) {
        if (l->differs[i] && passed++ % step == 0) l->pixels[l->count++] = (uint32_t)i;
        l->differs[i] = 0;
    }
    return l->pixels != NULL;
}

static enum bd_err no_memory(struct bd_err_detail *detail)
{
    return bd_err_set(detail, BD_ERR_NO_MEMORY, "check", "no memory to look at edges");
}

enum bd_err bd_check_find_ties(const struct bd_check_frame *frame,
                               const struct bd_check_tracer *tracer, struct bd_check_ties *out,
                               struct bd_err_detail *detail)
{
    *out = (struct bd_check_ties){0};
    if (!tracer->first_surface || !frame->depth || !frame->normal || !frame->albedo)
        return BD_ERR_OK;
    const uint32_t width = frame->beauty->width_px, height = frame->beauty->height_px;
    struct looking l = {.frame = frame, .tracer = tracer};
    out->differs = l.differs = calloc(width, height);
    if (!out->differs) return no_memory(detail);
    enum bd_err err = tracer->loop(tracer->user, height, find_edges_of_row, &l);
    if (!err && !choose(&l)) err = no_memory(detail);
    if (!err && l.count > 0)
        err = tracer->loop(tracer->user, (l.count + ITEM_PIXELS - 1) / ITEM_PIXELS, look_item, &l);
    free(l.pixels);
    return err;
}
