#include "pass/vpl_groups.h"

#include <math.h>

#include "kernel/all_channels.h"
#include "pass/f3_arrays.h"
#include "shared/vpl.h"

// Shorter lists are looked at in the time that groups of them would take (rsm, Cornell box and
// Sponza).
#define GROUPED_MIN 2048u
#define GROUP_LEAST 16u
#define GROUPS_MANY 1024u // more only where groups are as large as they may be

// A group is as good as one VPL from so many of its radii on.
#define FAR_RADII 5.0f
// Of a radius: for rounding. Render space is about 1 wide.
#define RADIUS_PART  1.001f
#define RADIUS_LEAST 1e-6f

uint32_t bd_vpl_group_size(uint32_t vpl_count)
{
    if (vpl_count <= GROUPED_MIN) return 0;
    uint32_t size = GROUP_LEAST;
    while (vpl_count / size > GROUPS_MANY && size < BD_VPL_GROUP_MAX) size *= 2;
    return size;
}

// Of the box about their places.
static f3 middle_of(const struct bd_vec4 *vpls, uint32_t count)
{
    f3 least = f3_from(vpls), most = least;
    for (uint32_t i = 1; i < count; i++) {
        const f3 at = f3_from(&vpls[(size_t)i * BD_VPL_VEC4S]);
        least = f3_of(fminf(least.x, at.x), fminf(least.y, at.y), fminf(least.z, at.z));
        most = f3_of(fmaxf(most.x, at.x), fmaxf(most.y, at.y), fmaxf(most.z, at.z));
    }
    return f3_between(least, most, 0.5f);
}

static struct bd_vec4 normals_of(const struct bd_vec4 *vpls, uint32_t count, float flux)
{
    f3 sum = f3_of(0, 0, 0);
    float farthest = 0;
    for (uint32_t i = 0; flux > 0 && i < count; i++) {
        const struct bd_vec4 *vpl = &vpls[(size_t)i * BD_VPL_VEC4S];
        sum = f3_add(sum, f3_scale(f3_from(vpl + 1), all_channels(f3_from(vpl + 2)) / flux));
    }
    for (uint32_t i = 0; i < count; i++) {
        const struct bd_vec4 *vpl = &vpls[(size_t)i * BD_VPL_VEC4S];
        farthest = fmaxf(farthest, f3_length(f3_sub(f3_from(vpl + 1), sum)));
    }
    return (struct bd_vec4){sum.x, sum.y, sum.z, farthest * RADIUS_PART};
}

static void make_group(const struct bd_vec4 *vpls, uint32_t count, struct bd_vec4 *group)
{
    const f3 middle = middle_of(vpls, count);
    float radius = 0, near2 = 0, area = 0, flux = 0;
    for (uint32_t i = 0; i < count; i++) {
        const struct bd_vec4 *vpl = &vpls[(size_t)i * BD_VPL_VEC4S];
        radius = fmaxf(radius, f3_length(f3_sub(f3_from(vpl), middle)));
        near2 = fmaxf(near2, vpl[1].w < 0 ? -1 / (F_PI * vpl[1].w) : vpl[1].w);
        area += vpl->w / (float)count;
        flux += all_channels(f3_from(vpl + 2));
    }
    radius = radius * RADIUS_PART + RADIUS_LEAST;
    const float one_by_one = fmaxf(FAR_RADII * radius, radius + sqrtf(near2));
    group[0] = (struct bd_vec4){middle.x, middle.y, middle.z, area};
    group[1] = normals_of(vpls, count, flux);
    group[2] = (struct bd_vec4){radius, one_by_one * one_by_one, flux, 0};
}

void bd_vpl_groups_make(const struct bd_vec4 *vpls, uint32_t vpl_count, uint32_t group_vpls,
                        struct bd_vec4 *groups)
{
    for (uint32_t first = 0; first < vpl_count; first += group_vpls) {
        const uint32_t left = vpl_count - first, count = left < group_vpls ? left : group_vpls;
        make_group(&vpls[(size_t)first * BD_VPL_VEC4S], count,
                   &groups[(size_t)(first / group_vpls) * BD_VPL_GROUP_VEC4S]);
    }
}
