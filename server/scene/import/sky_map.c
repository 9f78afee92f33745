#include "scene/import/sky_map.h"

#include <math.h>
#include <stdlib.h>

#include "base/assert.h"
#include "image/exr.h"
#include "image/rgbe.h"

// Where red, green and blue are: texel i of each is plane[i * stride].
struct planes {
    uint32_t width_px, height_px;
    const float *plane[3];
    size_t stride;
};

// Interleaves the planes; -1 if all is well, else the first texel that is not finite.
static int64_t fill(struct bd_sky_map *map, const struct planes *from, uint64_t *negative_count)
{
    size_t texels = (size_t)map->width_px * map->height_px;
    *negative_count = 0;
    for (size_t i = 0; i < texels; i++) {
        bool negative = false;
        for (int c = 0; c < 3; c++) {
            float value = from->plane[c][i * from->stride];
            if (!isfinite(value)) return (int64_t)i;
            negative |= value < 0;
            map->rgb[3 * i + (size_t)c] = value > 0 ? value : 0;
        }
        *negative_count += negative;
    }
    return -1;
}

static enum bd_err make(const struct planes *from, const char *field, struct bd_sky_map **out,
                        uint64_t *negative_count, struct bd_err_detail *detail)
{
    struct bd_sky_map *map = calloc(1, sizeof *map);
    BD_ASSERT(map);
    map->reference_count = 1;
    map->width_px = from->width_px;
    map->height_px = from->height_px;
    map->rgb = malloc((size_t)map->width_px * map->height_px * 3 * sizeof *map->rgb);
    enum bd_err err = BD_ERR_OK;
    if (!map->rgb) {
        err = bd_err_set(detail, BD_ERR_NO_MEMORY, field, "%s: no memory for the map", field);
    } else {
        int64_t bad = fill(map, from, negative_count);
        if (bad >= 0)
            err = bd_err_set(detail, BD_ERR_BAD_INPUT, field,
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

static enum bd_err read_exr(const void *bytes, size_t size_bytes, const char *field,
                            struct bd_sky_map **out, uint64_t *negative_count,
                            struct bd_err_detail *detail)
{
    const struct bd_exr_limits limits = {
        .side_px_max = BD_SKY_MAP_SIDE_MAX_PX,
        .size_bytes_max = bd_exr_limits_default.size_bytes_max,
    };
    struct bd_exr *exr = NULL;
    struct bd_err_detail inner = {0};
    enum bd_err err = bd_exr_read(bytes, size_bytes, &limits, &exr, &inner);
    if (err) return bd_err_set(detail, err, field, "%s: %s", field, inner.message);
    struct planes planes = {exr->width_px, exr->height_px, {0}, 1};
    for (int c = 0; c < 3; c++)
        planes.plane[c] = bd_exr_channel(exr, (const char *const[]){"R", "G", "B"}[c]);
    // Y beside X is no luminance alone.
    const float *grey = bd_exr_channel(exr, "X") ? NULL : bd_exr_channel(exr, "Y");
    if (!planes.plane[0] && !planes.plane[1] && !planes.plane[2])
        for (int c = 0; c < 3; c++) planes.plane[c] = grey;
    if (planes.plane[0] && planes.plane[1] && planes.plane[2])
        err = make(&planes, field, out, negative_count, detail);
    else
        err = bd_err_set(detail, BD_ERR_BAD_INPUT, field, "%s: has no channels R, G, B, nor Y",
                         field);
    bd_exr_destroy(&exr);
    return err;
}

static enum bd_err read_rgbe(const void *bytes, size_t size_bytes, const char *field,
                             struct bd_sky_map **out, uint64_t *negative_count,
                             struct bd_err_detail *detail)
{
    struct bd_image *image = NULL;
    struct bd_err_detail inner = {0};
    enum bd_err err = bd_rgbe_read(bytes, size_bytes, BD_SKY_MAP_SIDE_MAX_PX, &image, &inner);
    if (err) return bd_err_set(detail, err, field, "%s: %s", field, inner.message);
    const float *rgb = image->pixels;
    const struct planes planes = {image->width_px, image->height_px, {rgb, rgb + 1, rgb + 2}, 3};
    err = make(&planes, field, out, negative_count, detail);
    bd_image_destroy(&image);
    return err;
}

enum bd_err bd_sky_map_read(const void *bytes, size_t size_bytes, const char *field,
                            struct bd_sky_map **out, uint64_t *negative_count,
                            struct bd_err_detail *detail)
{
    return bd_rgbe_is(bytes, size_bytes)
               ? read_rgbe(bytes, size_bytes, field, out, negative_count, detail)
               : read_exr(bytes, size_bytes, field, out, negative_count, detail);
}
