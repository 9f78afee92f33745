// Sums over sub-frames: what a frame of more of them goes on from.

#include <stdlib.h>

#include "base/assert.h"
#include "frame/memo.h"
#include "frame/stages.h"

static void destroy_sums(void *owner, void *output)
{
    struct bd_frame_sums *sums = output;
    for (uint32_t l = 0; l < BD_LAYER_RENDERED_COUNT; l++)
        bd_tex_destroy(((struct bd_renderer *)owner)->gpu, &sums->layers[l]);
    free(sums);
}

static uint64_t sums_bytes(const struct bd_frame_sums *sums)
{
    uint64_t bytes = 0;
    for (uint32_t l = 0; l < BD_LAYER_RENDERED_COUNT; l++)
        if (sums->layers[l]) bytes += bd_tex_bytes(sums->layers[l]);
    return bytes;
}

// The layers asked for, and the first sub-frame, of which the others follow. Not how many.
static uint64_t key_sums(const struct bd_frame *frame)
{
    static const enum bd_stage of[] = {BD_STAGE_GBUFFER,  BD_STAGE_DIRECT, BD_STAGE_AREA_LIGHT,
                                       BD_STAGE_INDIRECT, BD_STAGE_SHARE,  BD_STAGE_GLASS};
    uint64_t key = bd_key_begin("sums");
    for (size_t i = 0; i < sizeof of / sizeof *of; i++)
        key = bd_key_number(key, frame->keys[of[i]]);
    return bd_key_number(key, frame->plan->layers | 1u << BD_LAYER_BEAUTY);
}

static enum bd_err create_sums(struct bd_frame *frame, struct bd_frame_sums **out)
{
    struct bd_frame_sums *sums = *out = calloc(1, sizeof *sums);
    BD_ASSERT(sums);
    enum bd_err err = BD_ERR_OK;
    for (uint32_t l = 0; !err && l < BD_LAYER_RENDERED_COUNT; l++) {
        const struct bd_tex_desc desc = {
            .name = "sum of sub-frames",
            .format = BD_FORMAT_RGBA32F,
            .width_px = frame->request->width_px,
            .height_px = frame->request->height_px,
        };
        if (l == BD_LAYER_BEAUTY || (frame->plan->layers >> l & 1))
            err = bd_tex_create(frame->context.gpu, &desc, &sums->layers[l], frame->detail);
    }
    return err;
}

enum bd_err bd_stage_take_sums(struct bd_frame *frame, struct bd_frame_sums **out)
{
    struct bd_memo *memo = frame->renderer->memo;
    frame->sums_key = key_sums(frame);
    *out = bd_memo_take(memo, frame->sums_key);
    if (*out && ((*out)->count > frame->request->aa || frame->anew)) {
        destroy_sums(frame->renderer, *out);
        *out = NULL;
    }
    return *out ? BD_ERR_OK : create_sums(frame, out);
}

void bd_stage_keep_sums(struct bd_frame *frame, struct bd_frame_sums **sums, bool whole)
{
    if (whole)
        bd_memo_store(frame->renderer->memo, frame->sums_key, *sums, sums_bytes(*sums),
                      destroy_sums);
    else
        destroy_sums(frame->renderer, *sums);
    *sums = NULL;
}
