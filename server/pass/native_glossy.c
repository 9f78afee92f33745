#include "pass/native_glossy.h"

#include <stdlib.h>
#include <string.h>

static void copy3(const struct bd_lanes3 *from, uint32_t i, struct bd_lanes3 *to, uint32_t k)
{
    to->x[k] = from->x[i];
    to->y[k] = from->y[i];
    to->z[k] = from->z[i];
}

// Lane i of a part's group, as lane k.
static void copy_lane(const struct bd_receivers *receivers,
                      const struct bd_glossy_receivers *surfaces, uint32_t i,
                      struct bd_glossy_group *to, uint32_t k)
{
    copy3(&receivers->position, i, &to->receivers.position, k);
    copy3(&receivers->normal, i, &to->receivers.normal, k);
    copy3(&receivers->normal_geometric, i, &to->receivers.normal_geometric, k);
    copy3(&surfaces->viewer, i, &to->surfaces.viewer, k);
    copy3(&surfaces->base_color, i, &to->surfaces.base_color, k);
    to->surfaces.metallic[k] = surfaces->metallic[i];
    to->surfaces.roughness[k] = surfaces->roughness[i];
    to->surfaces.f0_dielectric[k] = surfaces->f0_dielectric[i];
    to->surfaces.has_lobe[k] = to->receivers.lit[k] = 1;
}

static enum bd_err make_room(struct bd_glossy_groups *groups, uint32_t count,
                             struct bd_err_detail *detail)
{
    if (count <= groups->room) return BD_ERR_OK;
    free(groups->groups);
    groups->groups = malloc(count * sizeof *groups->groups);
    groups->room = groups->groups ? count : 0;
    if (groups->groups) return BD_ERR_OK;
    return bd_err_set(detail, BD_ERR_NO_MEMORY, "size",
                      "no memory for %u groups of glossy receivers", count);
}

enum bd_err bd_glossy_groups_of(const struct bd_receiver_part *part, struct bd_glossy_groups *out,
                                struct bd_err_detail *detail)
{
    enum bd_err err = make_room(out, part->group_count, detail);
    out->count = 0;
    if (err) return err;
    uint32_t count = 0;
    for (uint32_t index = 0; index < part->group_count * BD_LANES; index++) {
        const uint32_t group = index / BD_LANES, i = index % BD_LANES, k = count % BD_LANES;
        const struct bd_glossy_receivers *surfaces = &part->surfaces[group];
        if (part->receivers[group].lit[i] == 0 || surfaces->has_lobe[i] == 0) continue;
        struct bd_glossy_group *to = &out->groups[count / BD_LANES];
        if (k == 0) memset(to, 0, sizeof *to);
        copy_lane(&part->receivers[group], surfaces, i, to, k);
        to->origin[k] = index;
        count++;
    }
    out->count = (count + BD_LANES - 1) / BD_LANES;
    return BD_ERR_OK;
}

void bd_glossy_groups_keep(const struct bd_glossy_groups *groups,
                           const struct bd_receiver_part *part)
{
    for (uint32_t g = 0; g < groups->count; g++) {
        const struct bd_glossy_group *group = &groups->groups[g];
        for (uint32_t k = 0; k < BD_LANES; k++) {
            const uint32_t origin = group->origin[k];
            if (group->receivers.lit[k] > 0)
                copy3(&group->light, k, &part->glossy[origin / BD_LANES], origin % BD_LANES);
        }
    }
}

void bd_glossy_groups_free(struct bd_glossy_groups *groups)
{
    free(groups->groups);
    *groups = (struct bd_glossy_groups){0};
}

void bd_glossy_hidden(const struct bd_glossy_group *group, const struct bd_native_hidden *of_part,
                      uint32_t *bits)
{
    const size_t words = of_part->words;
    for (uint32_t k = 0; k < BD_LANES; k++)
        memcpy(bits + k * words, of_part->bits + group->origin[k] * words, words * sizeof *bits);
}
