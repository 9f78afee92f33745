// A world as passes see it: its scene on the device, and what one of its cameras sees of it.

#ifndef BD_TESTS_ANALYTIC_VIEW_H
#define BD_TESTS_ANALYTIC_VIEW_H

#include "pass/gbuffer.h"
#include "pass/pass.h"
#include "pass/vpl_grid.h"
#include "shared/types.h"
#include "world.h"

struct view {
    struct world *world; // borrowed
    struct bd_pass_context context;
    struct bd_gpu_scene *scene;
    struct bd_viewpoint viewpoint;
    struct bd_gbuffer *gbuffer; // NULL until a camera looks
};

// Finishes the scene.
struct view view_open(struct world *world);
void view_look(struct view *view, uint32_t camera, uint32_t width_px, uint32_t height_px,
               bool lambert);
void view_close(struct view *view);

// All of a texture, which is as large as `out`.
void view_read(const struct view *view, const struct bd_tex *tex, void *out, size_t size_bytes);

// VPLs made by hand (shared/vpl.h), none of them a patch, instead of those that the list holds.
void view_set_vpls(const struct view *view, const struct bd_vec4 *vpls, uint32_t count,
                   struct bd_vpl_list *list);
void view_forget_vpls(const struct view *view, struct bd_vpl_list *list);

#endif
