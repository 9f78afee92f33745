#include "frame/cost.h"

#include <math.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include "frame/plan.h"

// Times go as (parameter + base)^power, from the cheapest to the best rung of `many_light` within
// 1.3 (two boxes, 128x96).
static const struct growth {
    const char *pass;
    size_t param; // where in the parameters, an uint32_t
    double base, power;
    bool of_places; // of each pixel, or of each block of them
} growths[] = {
    {"light_paths", offsetof(struct bd_params, walk_vpls), 1100, 1, false},
    {"area_light", offsetof(struct bd_params, light_rays), 0, 0.9, false},
    {"weigh", offsetof(struct bd_params, vpls), 0, 0.6, true},
    {"choose", offsetof(struct bd_params, rays), 0, 1.1, true},
    {"visibility", offsetof(struct bd_params, rays), 0, 0.9, true},
    {"gather", offsetof(struct bd_params, rays), 0, 0.4, true},
    {"cache", offsetof(struct bd_params, cache_cells), 900, 1.05, false},
    {"far", offsetof(struct bd_params, far_rays), 0, 0.95, true},
    {"gloss", offsetof(struct bd_params, far_rays), 0, 0.95, false},
    {"filter", offsetof(struct bd_params, noise_filter), 0, 1, true},
    {"rough", offsetof(struct bd_params, far_rays), 0, 0.95, true},
};

static double number_at(const struct bd_params *params, size_t at)
{
    uint32_t number;
    memcpy(&number, (const char *)params + at, sizeof number);
    return number;
}

// `places`: as many more places are lit.
static double times_as_long(const char *pass, const struct bd_params *was,
                            const struct bd_params *is, double places)
{
    for (size_t i = 0; i < sizeof growths / sizeof *growths; i++) {
        const struct growth *growth = &growths[i];
        if (strcmp(pass, growth->pass) != 0) continue;
        const double from = number_at(was, growth->param), to = number_at(is, growth->param);
        const double times = growth->of_places ? places : 1;
        if (!(from > 0 && to > from)) return times;
        return times * pow((to + growth->base) / (from + growth->base), growth->power);
    }
    return 1;
}

static double places_of(const struct bd_report *report, const struct bd_technique *technique,
                        const struct bd_params *params)
{
    const double side_px =
        bd_plan_block_px(technique, params, report->width_px, report->height_px, report->aa);
    return 1 / (side_px * side_px);
}

bool bd_cost_ms(const struct bd_report *report, double frame_ms,
                const struct bd_technique *technique, const struct bd_param_list *given,
                const struct bd_param_list *better, double *out_ms)
{
    struct bd_params was, is;
    struct bd_err_detail detail;
    if (bd_params_read(given, technique, &was, &detail) ||
        bd_params_read(better, technique, &is, &detail))
        return false;
    const double places = places_of(report, technique, &is) / places_of(report, technique, &was);
    *out_ms = frame_ms;
    for (uint32_t i = 0; i < report->pass_count; i++) {
        const double times = times_as_long(report->passes[i].name, &was, &is, places);
        if (times > 1 && report->passes[i].state == BD_PASS_REUSED) return false;
        *out_ms += (times - 1) * report->passes[i].ms;
    }
    return true;
}
