#include "frame/invalidate.h"

#include <string.h>

#include "frame/stage_rows.h"

// A plan with what its keys are about.
struct side {
    struct bd_plan plan;
    struct bd_report report;
    struct bd_subject subject;
};

static bool has_key(const struct bd_subject *subject, enum bd_stage stage, uint64_t key)
{
    if (!bd_plan_has(subject->plan, stage)) return false;
    if (bd_stage_rows[stage].of != BD_STAGE_OF_LIGHT)
        return bd_stage_key(subject, stage, NULL) == key;
    for (uint32_t i = 0; i < subject->light_count; i++)
        if (bd_stage_key(subject, stage, &subject->lights[i]) == key) return true;
    return false;
}

// Whether some output of the stage was not there before. Without a before, none was.
static bool runs(const struct bd_subject *before, const struct bd_subject *after,
                 enum bd_stage stage)
{
    if (!before || bd_stage_rows[stage].is_keyless) return true;
    if (bd_stage_rows[stage].of != BD_STAGE_OF_LIGHT)
        return !has_key(before, stage, bd_stage_key(after, stage, NULL));
    for (uint32_t i = 0; i < after->light_count; i++)
        if (!has_key(before, stage, bd_stage_key(after, stage, &after->lights[i]))) return true;
    return false;
}

static void compare(const struct bd_subject *before, const struct bd_subject *after,
                    struct bd_invalidation *out)
{
    for (enum bd_stage stage = 0; stage < BD_STAGE_COUNT; stage++) {
        const char *names[BD_STAGE_PASSES_MAX];
        if (!bd_plan_has(after->plan, stage)) continue;
        const uint32_t count = bd_stage_passes(after->plan, stage, names);
        const bool again = runs(before, after, stage);
        for (uint32_t i = 0; i < count; i++) {
            if (again)
                out->run[out->run_count++] = names[i];
            else
                out->kept[out->kept_count++] = names[i];
        }
    }
}

enum bd_err bd_invalidate(const struct bd_scene *before, const struct bd_scene *after,
                          const struct bd_frame_request *request, struct bd_invalidation *out,
                          struct bd_err_detail *detail)
{
    struct side was, is;
    *out = (struct bd_invalidation){0};
    enum bd_err err = bd_plan_make(after, request, &is.plan, &is.report, detail);
    if (err) return err;
    const bool had_plan = !bd_plan_make(before, request, &was.plan, &was.report, NULL);
    is.subject = bd_subject_of(after, &is.plan, request);
    if (had_plan) was.subject = bd_subject_of(before, &was.plan, request);
    compare(had_plan ? &was.subject : NULL, &is.subject, out);
    bd_subject_finish(&is.subject);
    if (had_plan) bd_subject_finish(&was.subject);
    return BD_ERR_OK;
}
