#include "net/command/environment.h"

#include <float.h>
#include <math.h>

#include "net/command/import_files.h"
#include "scene/import/import.h"

// Of a quaternion before it is normalised.
#define ROTATION_MAX 1e15

static enum bd_err read_radiance(const Bounced__Environment *message, float out[3],
                                 struct bd_err_detail *detail)
{
    static const char field[] = "environment.radiance";
    if (message->n_radiance == 0 && !message->map && message->n_rotation == 0)
        return bd_err_set(detail, BD_ERR_USAGE, field,
                          "an environment has a radiance of three numbers, a map, or both");
    if (message->n_radiance != 0 && message->n_radiance != 3)
        return bd_err_set(detail, BD_ERR_USAGE, field, "%s is three numbers, not %zu", field,
                          message->n_radiance);
    for (size_t c = 0; c < 3; c++) {
        double value = message->n_radiance ? message->radiance[c] : 1;
        if (!(value >= 0 && value <= (double)FLT_MAX))
            return bd_err_set(detail, BD_ERR_USAGE, field,
                              "%s[%zu] is %g; it must be from 0 to %g cd/m^2", field, c, value,
                              (double)FLT_MAX);
        out[c] = (float)value;
    }
    return BD_ERR_OK;
}

static enum bd_err read_rotation(const Bounced__Environment *message, double out[4],
                                 struct bd_err_detail *detail)
{
    static const char field[] = "environment.rotation";
    double largest = 0;
    if (message->n_rotation == 0) return BD_ERR_OK;
    if (message->n_rotation != 4)
        return bd_err_set(detail, BD_ERR_USAGE, field, "%s is four numbers, not %zu", field,
                          message->n_rotation);
    for (size_t c = 0; c < 4; c++) {
        out[c] = message->rotation[c];
        if (!(fabs(out[c]) <= ROTATION_MAX))
            return bd_err_set(detail, BD_ERR_USAGE, field,
                              "%s[%zu] is %g; it must be from %g to %g", field, c, out[c],
                              -ROTATION_MAX, ROTATION_MAX);
        largest = fmax(largest, fabs(out[c]));
    }
    if (!(largest > 1e-15)) return bd_err_set(detail, BD_ERR_USAGE, field, "%s is zero", field);
    return BD_ERR_OK;
}

static enum bd_err read_map(const char *blob, struct bd_blobs *blobs, struct bd_import_pool *pool,
                            const struct bd_limits *limits, struct bd_net_environment *out,
                            struct bd_err_detail *detail)
{
    static const char field[] = "environment.map";
    struct bd_blob_map map;
    enum bd_err err = bd_net_map_blob(blobs, field, blob, &map, detail);
    if (err) return err;
    const struct bd_import_limits import_limits = bd_import_limits_of(limits);
    const struct bd_import_file file = {field, map.bytes, map.size_bytes};
    err = bd_import_sky_map(pool, &file, &import_limits, &out->environment.map,
                            &out->negative_count, detail);
    bd_blob_unmap(&map);
    return err;
}

enum bd_err bd_net_environment_read(const Bounced__Environment *message, struct bd_blobs *blobs,
                                    struct bd_import_pool *pool, const struct bd_limits *limits,
                                    struct bd_net_environment *out, struct bd_err_detail *detail)
{
    *out = (struct bd_net_environment){0};
    out->turns_alone = message->n_radiance == 0 && !message->map;
    enum bd_err err = read_radiance(message, out->environment.radiance, detail);
    if (!err) err = read_rotation(message, out->rotation, detail);
    if (!err && message->n_rotation) bd_environment_turn(&out->environment, out->rotation);
    if (!err && message->map) err = read_map(message->map, blobs, pool, limits, out, detail);
    return err;
}

void bd_net_environment_finish(struct bd_net_environment *environment)
{
    bd_sky_map_release(&environment->environment.map);
}
