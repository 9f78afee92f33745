#include "scene/sky_map.h"

#include <math.h>
#include <stdlib.h>

#include "base/assert.h"
#include "image/exr.h"

// Interleaves the planes; -1 if all is well, else the first texel that is not finite.
static int64_t fill(struct bd_sky_map *map, const float *const planes[3], uint64_t *negative_count)
{
    size_t texels = (size_t)map->width_px * map->height_px;
    *negative_count = 0;
    for (size_t i = 0; i < texels; i++) {
        bool negative = false;
        for (int c = 0; c < 3; c++) {
            float value = planes[c][i];
            if (!isfinite(value)) return (int64_t)i;
            negative |= value < 0;
            map->rgb[3 * i + (size_t)c] = value > 0 ? value : 0;
        }
        *negative_count += negative;
    }
    return -1;
}

static enum bd_err make(const struct bd_exr *exr, const char *field, struct bd_sky_map **out,
                        uint64_t *negative_count, struct bd_fault *fault)
{
    const float *planes[3] = {bd_exr_channel(exr, "R"), bd_exr_channel(exr, "G"),
                              bd_exr_channel(exr, "B")};
    if (!planes[0] || !planes[1] || !planes[2])
        return bd_fault_set(fault, BD_ERR_BAD_INPUT, field, "%s: has no channels R, G, B", field);
    struct bd_sky_map *map = calloc(1, sizeof *map);
    BD_ASSERT(map);
    map->reference_count = 1;
    map->width_px = exr->width_px;
    map->height_px = exr->height_px;
    map->rgb = malloc((size_t)exr->width_px * exr->height_px * 3 * sizeof *map->rgb);
    enum bd_err err = BD_ERR_OK;
    if (!map->rgb) {
        err = bd_fault_set(fault, BD_ERR_NO_MEMORY, field, "%s: no memory for the map", field);
    } else {
        int64_t bad = fill(map, planes, negative_count);
        if (bad >= 0)
            err = bd_fault_set(fault, BD_ERR_BAD_INPUT, field,
                               "%s: the texel in column %lld of row %lld is not finite", field,
                               (long long)(bad % map->width_px), (long long)(bad / map->width_px));
    }
    if (err) {
        bd_sky_map_release(&map);
        return err;
    }
    *out = map;
    return BD_ERR_OK;
}

enum bd_err bd_sky_map_read(const void *bytes, size_t size_bytes, const char *field,
                            struct bd_sky_map **out, uint64_t *negative_count,
                            struct bd_fault *fault)
{
    const struct bd_exr_limits limits = {
        .side_px_max = BD_SKY_MAP_SIDE_MAX_PX,
        .size_bytes_max = bd_exr_limits_default.size_bytes_max,
    };
    struct bd_exr *exr = NULL;
    struct bd_fault inner = {0};
    enum bd_err err = bd_exr_read(bytes, size_bytes, &limits, &exr, &inner);
    if (err) return bd_fault_set(fault, err, field, "%s: %s", field, inner.message);
    err = make(exr, field, out, negative_count, fault);
    bd_exr_destroy(&exr);
    return err;
}
