#include "pass/vpl_order.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "pass/vpl_groups.h"
#include "shared/types.h"
#include "shared/vpl.h"

struct vpl {
    struct bd_vec4 light[BD_VPL_VEC4S], quad[BD_VPL_QUAD_VEC4S];
};

struct entry {
    uint64_t key; // face of the normal, Morton code
    uint32_t vpl; // as it was: of equals the first stays the first
};

struct box {
    float least[3], most[3];
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

static struct box box_of(const struct vpl *vpls, size_t count)
{
    struct box box = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
    for (size_t i = 0; i < count; i++)
        for (int c = 0; c < 3; c++) {
            box.least[c] = fminf(box.least[c], position_of(&vpls[i])[c]);
            box.most[c] = fmaxf(box.most[c], position_of(&vpls[i])[c]);
        }
    return box;
}

static uint64_t face_of(const struct bd_vec4 *normal)
{
    const float n[3] = {normal->x, normal->y, normal->z};
    int axis = 0;
    for (int c = 1; c < 3; c++)
        if (fabsf(n[c]) > fabsf(n[axis])) axis = c;
    return (uint64_t)(2 * axis + (n[axis] < 0));
}

#define MORTON_BITS 18

static uint64_t key_of(const struct vpl *vpl, const struct box *box)
{
    uint64_t key = face_of(&vpl->light[1]) << (3 * MORTON_BITS);
    for (int c = 0; c < 3; c++) {
        const float size = box->most[c] - box->least[c];
        const float at = size > 0 ? (position_of(vpl)[c] - box->least[c]) / size : 0;
        const uint32_t step = (uint32_t)(at * (float)((1 << MORTON_BITS) - 1));
        for (int bit = 0; bit < MORTON_BITS; bit++)
            key |= (uint64_t)(step >> bit & 1) << (3 * bit + c);
    }
    return key;
}

static int compare(const void *a, const void *b)
{
    const struct entry *x = a, *y = b;
    if (x->key != y->key) return x->key < y->key ? -1 : 1;
    return (x->vpl > y->vpl) - (x->vpl < y->vpl);
}

// Those of a list that send anything, appended.
static enum bd_err read_list(struct bd_gpu *gpu, const struct bd_vpl_list *list, struct vpl *vpls,
                             size_t *count)
{
    const size_t light_bytes = sizeof vpls->light, quad_bytes = sizeof vpls->quad;
    char *bytes = malloc(list->count * (light_bytes + quad_bytes) + 1);
    BD_ASSERT(bytes);
    char *quads = bytes + list->count * light_bytes;
    enum bd_err err = bd_buf_read(gpu, list->vpls, 0, bytes, list->count * light_bytes);
    if (!err) err = bd_buf_read(gpu, list->quads, 0, quads, list->count * quad_bytes);
    for (uint32_t i = 0; !err && i < list->count; i++) {
        struct vpl *to = &vpls[*count];
        memcpy(to->light, bytes + i * light_bytes, light_bytes);
        memcpy(to->quad, quads + i * quad_bytes, quad_bytes);
        *count += sends(to);
    }
    free(bytes);
    return err;
}

// --- soft ---------------------------------------------------------------------------------------

// Areas of VPLs that the disk of a soft one has. It hardly matters: 1, 2 and 5 of them, 1,024 VPLs
// and four rays of either kind, leave 9.3, 9.3 and 9.6 % of indirect light under a spot, 9.8, 10.0
// and 10.3 in Sponza.
#define SOFT_AREAS 2.0f
// Of the light comes from VPLs of at most that area, before they are soft.
#define SOFT_SHARE 0.75

struct part {
    float area, flux;
};

static int compare_areas(const void *a, const void *b)
{
    const struct part *x = a, *y = b;
    return (x->area > y->area) - (x->area < y->area);
}

static float distance2(const struct vpl *a, const struct vpl *b)
{
    const float *p = position_of(a), *q = position_of(b);
    float sum = 0;
    for (int c = 0; c < 3; c++) sum += (p[c] - q[c]) * (p[c] - q[c]);
    return sum;
}

// Of those in order: a VPL's own area is about the square of its neighbour's distance.
static float soft_area_of(const struct vpl *vpls, const struct entry *entries, size_t count)
{
    struct part *parts = malloc((count + 1) * sizeof *parts);
    BD_ASSERT(parts);
    double flux = 0, below = 0;
    for (size_t i = 0; i < count; i++) {
        const struct vpl *vpl = &vpls[entries[i].vpl];
        const struct vpl *next = &vpls[entries[i + 1 < count ? i + 1 : 0].vpl];
        const struct bd_vec4 *f = &vpl->light[2];
        parts[i] = (struct part){distance2(vpl, next), f->x + f->y + f->z};
        flux += parts[i].flux;
    }
    qsort(parts, count, sizeof *parts, compare_areas);
    size_t at = 0;
    for (; at + 1 < count && below + parts[at].flux < SOFT_SHARE * flux; at++)
        below += parts[at].flux;
    const float area = count ? parts[at].area : 0;
    free(parts);
    return SOFT_AREAS * area;
}

static float soften(struct vpl *vpls, const struct entry *entries, size_t count)
{
    const float area = soft_area_of(vpls, entries, count);
    for (size_t i = 0; i < count; i++) {
        vpls[i].light[0].w = area;
        vpls[i].light[1].w = 0;
    }
    return area;
}

// --- the list -----------------------------------------------------------------------------------

static enum bd_err write_groups(struct bd_gpu *gpu, const struct bd_vec4 *lights,
                                struct bd_vpl_list *list, struct bd_fault *fault)
{
    const uint32_t size = bd_vpl_group_size(list->count);
    if (size == 0) return BD_ERR_OK;
    const size_t vec4s = (size_t)((list->count + size - 1) / size) * BD_VPL_GROUP_VEC4S;
    struct bd_vec4 *groups = malloc(vec4s * sizeof *groups);
    BD_ASSERT(groups);
    bd_vpl_groups_make(lights, list->count, size, groups);
    enum bd_err err =
        bd_buf_create(gpu, "groups of vpls", vec4s * sizeof *groups, groups, &list->groups, fault);
    free(groups);
    return err;
}

static enum bd_err write_list(struct bd_gpu *gpu, const struct vpl *vpls,
                              const struct entry *entries, size_t count, struct bd_vpl_list **out,
                              struct bd_fault *fault)
{
    enum bd_err err = bd_vpl_list_create(gpu, (uint32_t)count, out, fault);
    if (err || count == 0) return err;
    struct bd_vec4(*lights)[BD_VPL_VEC4S] = malloc(count * sizeof *lights);
    struct bd_vec4(*quads)[BD_VPL_QUAD_VEC4S] = malloc(count * sizeof *quads);
    BD_ASSERT(lights && quads);
    for (size_t i = 0; i < count; i++) {
        memcpy(lights[i], vpls[entries[i].vpl].light, sizeof *lights);
        memcpy(quads[i], vpls[entries[i].vpl].quad, sizeof *quads);
    }
    bd_buf_upload(gpu, (*out)->vpls, 0, lights, count * sizeof *lights);
    bd_buf_upload(gpu, (*out)->quads, 0, quads, count * sizeof *quads);
    err = write_groups(gpu, lights[0], *out, fault);
    free(lights);
    free(quads);
    if (err) bd_vpl_list_destroy(gpu, out);
    return err;
}

// Beyond what a shader can index, reads are undefined.
static enum bd_err room_for(const struct bd_gpu *gpu, size_t count, struct bd_fault *fault)
{
    const uint64_t most = bd_gpu_caps(gpu)->array_max_bytes / sizeof((struct vpl *)0)->light;
    if (count <= most && count <= UINT32_MAX) return BD_ERR_OK;
    return bd_fault_set(fault, BD_ERR_LIMIT, "vpls",
                        "%zu over all lights; with few rays this device takes %llu", count,
                        (unsigned long long)most);
}

enum bd_err bd_vpl_order_run(const struct bd_pass_context *context,
                             const struct bd_vpl_list *const *lists, uint32_t list_count, bool soft,
                             struct bd_vpl_list **out, struct bd_fault *fault)
{
    size_t room = 1, count = 0;
    for (uint32_t l = 0; l < list_count; l++) room += lists[l]->count;
    struct vpl *vpls = malloc(room * sizeof *vpls);
    struct entry *entries = malloc(room * sizeof *entries);
    enum bd_err err = room_for(context->gpu, room, fault);
    if (!err && !(vpls && entries))
        err = bd_fault_set(fault, BD_ERR_NO_MEMORY, "vpls", "no memory to put %zu in order", room);
    for (uint32_t l = 0; !err && l < list_count; l++)
        err = read_list(context->gpu, lists[l], vpls, &count);
    // A list of none would be a case of its own to everybody: one that sends nothing is none.
    if (!err && count == 0 && room > 1) count = 1;
    const struct box box = box_of(vpls, err ? 0 : count);
    for (size_t i = 0; !err && i < count; i++)
        entries[i] = (struct entry){key_of(&vpls[i], &box), (uint32_t)i};
    if (!err) qsort(entries, count, sizeof *entries, compare);
    const float soft_area = !err && soft ? soften(vpls, entries, count) : 0;
    if (!err) err = write_list(context->gpu, vpls, entries, count, out, fault);
    if (!err) (*out)->soft_area = soft_area;
    free(vpls);
    free(entries);
    return err;
}
