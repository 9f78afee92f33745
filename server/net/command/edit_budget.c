#include "net/command/edit_budget.h"

#include "scene/model/content.h"

#define TEXEL_BYTES 4

struct bd_edit_budget bd_edit_budget(const struct bd_limits *limits, uint64_t quota_bytes)
{
    return (struct bd_edit_budget){
        .bytes = limits->scene_bytes, .texels = limits->picture_texels, .quota_bytes = quota_bytes};
}

static enum bd_err take_quota(struct bd_edit_budget *left, uint64_t bytes, struct bd_fault *fault)
{
    if (bytes > left->quota_bytes)
        return bd_fault_set(fault, BD_ERR_LIMIT, "max_bytes",
                            "the batch alone would take more than max_bytes");
    left->quota_bytes -= bytes;
    return BD_ERR_OK;
}

enum bd_err bd_edit_budget_hold(struct bd_edit_budget *left, uint64_t bytes, const char *field,
                                struct bd_fault *fault)
{
    if (bytes > left->bytes)
        return bd_fault_set(fault, BD_ERR_LIMIT, field,
                            "with it the batch is larger than the limit scene_bytes");
    left->bytes -= bytes;
    return BD_ERR_OK;
}

enum bd_err bd_edit_budget_take(struct bd_edit_budget *left, uint64_t bytes, const char *field,
                                struct bd_fault *fault)
{
    enum bd_err err = bd_edit_budget_hold(left, bytes, field, fault);
    return err ? err : take_quota(left, bytes, fault);
}

static uint64_t texels_of(const struct bd_picture *picture)
{
    return (uint64_t)picture->width_px * picture->height_px;
}

// A reader's limits are not to the byte what a scene counts for.
static void take_most(uint64_t *left, uint64_t amount)
{
    *left -= amount < *left ? amount : *left;
}

enum bd_err bd_edit_budget_take_picture(struct bd_edit_budget *left,
                                        const struct bd_picture *picture, struct bd_fault *fault)
{
    const uint64_t texels = texels_of(picture);
    take_most(&left->texels, texels);
    return take_quota(left, TEXEL_BYTES * texels, fault);
}

enum bd_err bd_edit_budget_take_scene(struct bd_edit_budget *left, const struct bd_scene *scene,
                                      struct bd_fault *fault)
{
    const uint64_t bytes = bd_scene_bytes(scene);
    uint64_t texels = 0;
    for (uint32_t i = 0; i < scene->picture_count; i++) texels += texels_of(scene->pictures[i]);
    take_most(&left->texels, texels);
    take_most(&left->bytes, bytes - TEXEL_BYTES * texels);
    return take_quota(left, bytes, fault);
}
