#include "pass/occluders.h"

#include <stdlib.h>

#include "base/assert.h"

// Some milliseconds of any bus.
#define UPLOAD_BYTES ((size_t)8 << 20)

bool bd_occluders_on_device(const struct bd_gpu *gpu, enum bd_rays_executor executor)
{
    return executor == BD_RAYS_DEVICE || (executor == BD_RAYS_AUTO && !bd_gpu_caps(gpu)->software);
}

static struct bd_occluders *create(void)
{
    struct bd_occluders *occluders = calloc(1, sizeof *occluders);
    BD_ASSERT(occluders);
    return occluders;
}

struct bd_occluders *bd_occluders_of_rays(struct bd_rays **rays)
{
    struct bd_occluders *occluders = create();
    occluders->rays = *rays;
    *rays = NULL;
    return occluders;
}

// A buffer even of nothing.
static enum bd_err upload(const struct bd_pass_context *context, const char *name,
                          const void *bytes, size_t size, struct bd_buf **out,
                          struct bd_err_detail *detail)
{
    enum bd_err err = bd_buf_create_unset(context->gpu, name, size ? size : 16, out, detail);
    for (size_t at = 0, part; !err && at < size; at += part) {
        part = size - at < UPLOAD_BYTES ? size - at : UPLOAD_BYTES;
        bd_buf_upload(context->gpu, *out, at, (const char *)bytes + at, part);
        err = bd_slicer_checkpoint(context->slicer, (double)part);
    }
    return err;
}

enum bd_err bd_occluders_upload(const struct bd_pass_context *context,
                                const struct bd_ray_nodes *nodes, struct bd_occluders **out,
                                struct bd_err_detail *detail)
{
    struct bd_occluders *occluders = *out = create();
    occluders->node_count = nodes->node_count;
    occluders->cutout_triangles = nodes->cutout_triangles;
    bd_slicer_work(context->slicer, "upload of nodes");
    enum bd_err err = upload(context, "ray nodes", nodes->nodes,
                             nodes->node_count * sizeof *nodes->nodes, &occluders->nodes, detail);
    if (!err)
        err =
            upload(context, "ray triangles", nodes->triangles,
                   nodes->triangle_count * sizeof *nodes->triangles, &occluders->triangles, detail);
    if (!err && nodes->cutouts)
        err = upload(context, "ray cutouts", nodes->cutouts,
                     nodes->cutout_count * sizeof *nodes->cutouts, &occluders->cutouts, detail);
    if (!err && nodes->cutouts)
        err = upload(context, "ray texels", nodes->texels,
                     nodes->texel_word_count * sizeof *nodes->texels, &occluders->texels, detail);
    if (err) bd_occluders_destroy(context->gpu, out);
    return err;
}

void bd_occluders_destroy(struct bd_gpu *gpu, struct bd_occluders **occluders)
{
    struct bd_occluders *o = *occluders;
    *occluders = NULL;
    if (!o) return;
    bd_rays_destroy(&o->rays);
    bd_buf_destroy(gpu, &o->nodes);
    bd_buf_destroy(gpu, &o->triangles);
    bd_buf_destroy(gpu, &o->cutouts);
    bd_buf_destroy(gpu, &o->texels);
    free(o);
}

uint64_t bd_occluders_bytes(const struct bd_occluders *occluders)
{
    if (occluders->rays) return bd_rays_bytes(occluders->rays);
    uint64_t bytes = bd_buf_size_bytes(occluders->nodes) + bd_buf_size_bytes(occluders->triangles);
    if (occluders->cutouts)
        bytes += bd_buf_size_bytes(occluders->cutouts) + bd_buf_size_bytes(occluders->texels);
    return bytes;
}
