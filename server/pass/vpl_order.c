#include "pass/vpl_order.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "base/radix.h"
#include "kernel/math.h"
#include "pass/vpl_groups.h"
#include "shared/types.h"
#include "shared/vpl.h"

struct vpl {
    struct bd_vec4 light[BD_VPL_VEC4S], quad[BD_VPL_QUAD_VEC4S];
};

static const float *position_of(const struct vpl *vpl)
{
    return &vpl->light[0].x;
}

static bool sends(const struct vpl *vpl)
{
    const struct bd_vec4 flux = vpl->light[2];
    return flux.x > 0 || flux.y > 0 || flux.z > 0;
}

static uint64_t face_of(const struct bd_vec4 *normal)
{
    const float n[3] = {normal->x, normal->y, normal->z};
    int axis = 0;
    for (int c = 1; c < 3; c++)
        if (fabsf(n[c]) > fabsf(n[axis])) axis = c;
    return (uint64_t)(2 * axis + (n[axis] < 0));
}

#define MORTON_BITS 20

// In a grid over the scene: one over the VPLs would give all of them other places where one moves.
static uint64_t key_of(const struct vpl *vpl, float radius)
{
    uint64_t key = face_of(&vpl->light[1]) << (3 * MORTON_BITS);
    for (int c = 0; c < 3; c++) {
        const float at = f_min(f_max(0.5f * (position_of(vpl)[c] / radius + 1), 0), 1);
        const uint32_t step = (uint32_t)(at * (float)((1 << MORTON_BITS) - 1));
        for (int bit = 0; bit < MORTON_BITS; bit++)
            key |= (uint64_t)(step >> bit & 1) << (3 * bit + c);
    }
    return key;
}

#define KEY_BITS (3 * MORTON_BITS + 3)

// What loops over VPLs do between two looks at the clock.
#define AT_ONCE 4096u

static enum bd_err pause_at(const struct bd_pass_context *context, size_t i)
{
    return i % AT_ONCE == AT_ONCE - 1 ? bd_slicer_pause(context->slicer) : BD_ERR_OK;
}

// Those of a list that send anything, appended.
static enum bd_err read_list(const struct bd_pass_context *context, const struct bd_vpl_list *list,
                             struct vpl *vpls, size_t *count)
{
    const size_t light_bytes = sizeof vpls->light, quad_bytes = sizeof vpls->quad;
    char *bytes = malloc(list->count * (light_bytes + quad_bytes) + 1);
    BD_ASSERT(bytes);
    char *quads = bytes + list->count * light_bytes;
    enum bd_err err = bd_buf_read(context->gpu, list->vpls, 0, bytes, list->count * light_bytes);
    if (!err) err = bd_buf_read(context->gpu, list->quads, 0, quads, list->count * quad_bytes);
    for (uint32_t i = 0; !err && i < list->count; i++) {
        struct vpl *to = &vpls[*count];
        memcpy(to->light, bytes + i * light_bytes, light_bytes);
        memcpy(to->quad, quads + i * quad_bytes, quad_bytes);
        *count += sends(to);
        err = pause_at(context, i);
    }
    free(bytes);
    return err;
}

static enum bd_err make_entries(size_t count, struct bd_radix_entry **out,
                                struct bd_err_detail *detail)
{
    *out = malloc((count + 1) * sizeof **out);
    if (*out) return BD_ERR_OK;
    return bd_err_set(detail, BD_ERR_NO_MEMORY, "vpls", "no memory to put %zu in order", count);
}

// By keys of so many bits, of equals the first stays the first.
static enum bd_err put_in_order(const struct bd_pass_context *context,
                                struct bd_radix_entry **entries, size_t count, uint32_t bits,
                                struct bd_err_detail *detail)
{
    struct bd_radix_entry *spare;
    enum bd_err err = make_entries(count, &spare, detail);
    for (uint32_t shift = 0; !err && shift < bits; shift += BD_RADIX_BITS) {
        struct bd_radix_entry *from = *entries;
        bd_radix_pass(from, spare, count, shift);
        *entries = spare;
        spare = from;
        err = bd_slicer_pause(context->slicer);
    }
    free(spare);
    return err;
}

// --- soft ---------------------------------------------------------------------------------------

// Areas of VPLs that the disk of a soft one has. It hardly matters: 1, 2 and 5 of them, 1,024 VPLs
// and four rays of either kind, leave 9.3, 9.3 and 9.6 % of indirect light under a spot, 9.8, 10.0
// and 10.3 in Sponza.
#define SOFT_AREAS 2.0f
// Of the light comes from VPLs of at most that area, before they are soft.
#define SOFT_SHARE 0.75
// Areas of a soft one that a clamped one is as bright at most as a disk of. 1, 4 and 16
// leave 7.6, 6.9 and 6.5 % of indirect light under a spot, 7.9, 6.3 and 5.4 in a box, where the
// picture shows what is near; 11.6, 12.5 and 14.6 in Sponza, where rays have to find it (`ssbc` at
// its defaults).
#define CLAMPED_AREAS 4.0f

static float flux_of(const struct vpl *vpl)
{
    const struct bd_vec4 *flux = &vpl->light[2];
    return flux->x + flux->y + flux->z;
}

static float distance2(const struct vpl *a, const struct vpl *b)
{
    const float *p = position_of(a), *q = position_of(b);
    float sum = 0;
    for (int c = 0; c < 3; c++) sum += (p[c] - q[c]) * (p[c] - q[c]);
    return sum;
}

// Not below 0, and so in the order of its bits.
static uint32_t bits_of(float area)
{
    uint32_t bits;
    memcpy(&bits, &area, sizeof bits);
    return bits;
}

static float area_of(uint64_t bits)
{
    const uint32_t low = (uint32_t)bits;
    float area;
    memcpy(&area, &low, sizeof area);
    return area;
}

// Of those in order, smallest first: a VPL's own area is about the square of its neighbour's
// distance.
static enum bd_err areas_of(const struct bd_pass_context *context, const struct vpl *vpls,
                            const struct bd_radix_entry *entries, size_t count,
                            struct bd_radix_entry **out, struct bd_err_detail *detail)
{
    enum bd_err err = make_entries(count, out, detail);
    for (size_t i = 0; !err && i < count; i++) {
        const uint32_t own = entries[i].number, next = entries[i + 1 < count ? i + 1 : 0].number;
        (*out)[i] = (struct bd_radix_entry){bits_of(distance2(&vpls[own], &vpls[next])), own};
        err = pause_at(context, i);
    }
    return err ? err : put_in_order(context, out, count, 32, detail);
}

static float soft_area_of(const struct vpl *vpls, const struct bd_radix_entry *areas, size_t count)
{
    double flux = 0, below = 0;
    for (size_t i = 0; i < count; i++) flux += flux_of(&vpls[areas[i].number]);
    size_t at = 0;
    for (; at + 1 < count; at++) {
        const float own = flux_of(&vpls[areas[at].number]);
        if (!(below + own < SOFT_SHARE * flux)) break;
        below += own;
    }
    return count ? SOFT_AREAS * area_of(areas[at].key) : 0;
}

// `soft_area` or `clamp` of the list, and of its VPLs.
static enum bd_err soften(const struct bd_pass_context *context, struct vpl *vpls,
                          const struct bd_radix_entry *entries, size_t count,
                          const struct bd_vpl_order_how *how, struct bd_vpl_list *list,
                          struct bd_err_detail *detail)
{
    const bool clamped = how->softness == BD_VPLS_CLAMPED;
    struct bd_radix_entry *areas = NULL;
    enum bd_err err = BD_ERR_OK;
    float area = 0;
    if (!clamped || how->clamp == 0) {
        err = areas_of(context, vpls, entries, count, &areas, detail);
        area = err ? 0 : soft_area_of(vpls, areas, count);
    }
    const float clamp = how->clamp > 0 ? how->clamp
                        : area > 0     ? F_PI / (CLAMPED_AREAS * area)
                                       : (float)BD_VPL_CLAMP_MAX;
    for (size_t i = 0; !err && i < count; i++) {
        vpls[i].light[0].w = clamped ? 0 : area;
        vpls[i].light[1].w = clamped ? -clamp / F_PI : 0;
    }
    free(areas);
    *(clamped ? &list->clamp : &list->soft_area) = clamped ? clamp : area;
    return err;
}

// --- the list -----------------------------------------------------------------------------------

static enum bd_err write_groups(struct bd_gpu *gpu, const struct bd_vec4 *lights,
                                struct bd_vpl_list *list, struct bd_err_detail *detail)
{
    const uint32_t size = bd_vpl_group_size(list->count);
    if (size == 0) return BD_ERR_OK;
    const size_t vec4s = (size_t)((list->count + size - 1) / size) * BD_VPL_GROUP_VEC4S;
    struct bd_vec4 *groups = malloc(vec4s * sizeof *groups);
    BD_ASSERT(groups);
    bd_vpl_groups_make(lights, list->count, size, groups);
    enum bd_err err =
        bd_buf_create(gpu, "groups of vpls", vec4s * sizeof *groups, groups, &list->groups, detail);
    free(groups);
    return err;
}

static enum bd_err write_list(const struct bd_pass_context *context, const struct vpl *vpls,
                              const struct bd_radix_entry *entries, size_t count,
                              struct bd_vpl_list **out, struct bd_err_detail *detail)
{
    struct bd_gpu *gpu = context->gpu;
    enum bd_err err = bd_vpl_list_create(gpu, (uint32_t)count, out, detail);
    if (err || count == 0) return err;
    struct bd_vec4(*lights)[BD_VPL_VEC4S] = malloc(count * sizeof *lights);
    struct bd_vec4(*quads)[BD_VPL_QUAD_VEC4S] = malloc(count * sizeof *quads);
    BD_ASSERT(lights && quads);
    for (size_t i = 0; !err && i < count; i++) {
        memcpy(lights[i], vpls[entries[i].number].light, sizeof *lights);
        memcpy(quads[i], vpls[entries[i].number].quad, sizeof *quads);
        err = pause_at(context, i);
    }
    if (!err) bd_buf_upload(gpu, (*out)->vpls, 0, lights, count * sizeof *lights);
    if (!err) bd_buf_upload(gpu, (*out)->quads, 0, quads, count * sizeof *quads);
    if (!err) err = bd_slicer_pause(context->slicer);
    if (!err) err = write_groups(gpu, lights[0], *out, detail);
    free(lights);
    free(quads);
    if (err) bd_vpl_list_destroy(gpu, out);
    return err;
}

// Beyond what a shader can index, reads are undefined.
static enum bd_err room_for(const struct bd_gpu *gpu, size_t count, struct bd_err_detail *detail)
{
    const uint64_t most = bd_gpu_caps(gpu)->array_max_bytes / sizeof((struct vpl *)0)->light;
    if (count <= most && count <= UINT32_MAX) return BD_ERR_OK;
    return bd_err_set(detail, BD_ERR_LIMIT, "vpls",
                      "%zu over all lights; with few rays this device takes %llu", count,
                      (unsigned long long)most);
}

// A list of none would be a case of its own to everybody: one that sends nothing is none.
static enum bd_err read_lists(const struct bd_pass_context *context,
                              const struct bd_vpl_list *const *lists, uint32_t list_count,
                              struct vpl *vpls, size_t *count)
{
    size_t all = 0;
    enum bd_err err = BD_ERR_OK;
    *count = 0;
    for (uint32_t l = 0; !err && l < list_count; l++) {
        all += lists[l]->count;
        err = read_list(context, lists[l], vpls, count);
    }
    if (!err && *count == 0 && all > 0) *count = 1;
    return err;
}

static enum bd_err order(const struct bd_pass_context *context, const struct vpl *vpls,
                         size_t count, float radius, struct bd_radix_entry **entries,
                         struct bd_err_detail *detail)
{
    enum bd_err err = BD_ERR_OK;
    for (size_t i = 0; !err && i < count; i++) {
        (*entries)[i] = (struct bd_radix_entry){key_of(&vpls[i], radius), (uint32_t)i};
        err = pause_at(context, i);
    }
    return err ? err : put_in_order(context, entries, count, KEY_BITS, detail);
}

enum bd_err bd_vpl_order_run(const struct bd_pass_context *context,
                             const struct bd_vpl_list *const *lists, uint32_t list_count,
                             const struct bd_vpl_order_how *how, struct bd_vpl_list **out,
                             struct bd_err_detail *detail)
{
    size_t room = 1, count = 0;
    struct bd_vpl_list softened = {0};
    for (uint32_t l = 0; l < list_count; l++) room += lists[l]->count;
    struct vpl *vpls = malloc(room * sizeof *vpls);
    struct bd_radix_entry *entries;
    enum bd_err err = make_entries(room, &entries, detail);
    if (!err) err = room_for(context->gpu, room, detail);
    if (!err && !vpls)
        err = bd_err_set(detail, BD_ERR_NO_MEMORY, "vpls", "no memory to put %zu in order", room);
    if (!err) err = read_lists(context, lists, list_count, vpls, &count);
    if (!err) err = order(context, vpls, count, how->radius, &entries, detail);
    if (!err && how->softness != BD_VPLS_AS_THEY_ARE)
        err = soften(context, vpls, entries, count, how, &softened, detail);
    if (!err) err = write_list(context, vpls, entries, count, out, detail);
    if (!err) (*out)->soft_area = softened.soft_area;
    if (!err) (*out)->clamp = softened.clamp;
    free(vpls);
    free(entries);
    return err;
}
