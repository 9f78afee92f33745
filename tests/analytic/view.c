#include "view.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "shared/vpl.h"

struct view view_open(struct world *world)
{
    struct view view = {.world = world};
    struct bd_err_detail detail = {0};
    world_finish(world);
    bd_slicer_init(&world->renderer.slicer, world->gpu, NULL, NULL);
    view.context = (struct bd_pass_context){.gpu = world->gpu, .slicer = &world->renderer.slicer};
    if (bd_gpu_scene_create(&world->renderer.uploader, world->scene, &view.scene, &detail))
        fail_msg("upload: %s", detail.message);
    return view;
}

void view_look(struct view *view, uint32_t camera, uint32_t width_px, uint32_t height_px,
               bool lambert)
{
    struct bd_err_detail detail = {0};
    view->viewpoint =
        bd_viewpoint_of(view->world->scene, &(struct bd_pose){0}, camera, width_px, height_px);
    const struct bd_gbuffer_inputs inputs = {
        .scene = view->scene, .viewpoint = &view->viewpoint, .lambert = lambert};
    if (bd_gbuffer_render(&view->context, &inputs, &view->gbuffer, &detail))
        fail_msg("gbuffer: %s", detail.message);
}

void view_close(struct view *view)
{
    bd_gbuffer_destroy(view->world->gpu, &view->gbuffer);
    bd_gpu_scene_destroy(&view->world->renderer.uploader, &view->scene);
}

void view_read(const struct view *view, const struct bd_tex *tex, void *out, size_t size_bytes)
{
    struct bd_readback *readback;
    struct bd_err_detail detail = {0};
    if (bd_gpu_readback_start(view->world->gpu, tex, 0, &readback, &detail))
        fail_msg("readback: %s", detail.message);
    assert_int_equal(bd_gpu_readback_finish(view->world->gpu, &readback, out, size_bytes),
                     BD_ERR_OK);
}

void view_set_vpls(const struct view *view, const struct bd_vec4 *vpls, uint32_t count,
                   struct bd_vpl_list *list)
{
    struct bd_gpu *gpu = view->world->gpu;
    struct bd_err_detail detail = {0};
    view_forget_vpls(view, list);
    list->count = count;
    if (bd_buf_create(gpu, "vpls", count * BD_VPL_VEC4S * sizeof *vpls, vpls, &list->vpls, &detail))
        fail_msg("%s", detail.message);
    if (bd_buf_create(gpu, "quads", count * BD_VPL_QUAD_VEC4S * sizeof *vpls, NULL, &list->quads,
                      &detail))
        fail_msg("%s", detail.message);
}

void view_forget_vpls(const struct view *view, struct bd_vpl_list *list)
{
    bd_buf_destroy(view->world->gpu, &list->vpls);
    bd_buf_destroy(view->world->gpu, &list->quads);
    list->count = 0;
}
