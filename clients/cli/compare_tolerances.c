// `bounce compare`: which tolerances hold.

#include <math.h>
#include <stdio.h>

#include "clients/cli/compare.h"

// The end of an interval that is farther from 0.
static double farther(const struct bd_figure *figure)
{
    return fabs(figure->low) > fabs(figure->high) ? figure->low : figure->high;
}

struct verdict {
    double value; // what the tolerance looks at
    bool missed;
    const char *end, *side; // for people: of the interval, of the limit
};

static struct verdict judge(const struct bd_cli_tolerance *tolerance,
                            const struct bd_figure *figure)
{
    struct verdict verdict = {.value = figure->value, .end = ""};
    bool at_end = tolerance->at_end;
    switch (bd_metric_goal(tolerance->metric)) {
    case BD_GOAL_MORE:
        if (at_end) verdict = (struct verdict){.value = figure->low, .end = ".low"};
        verdict.missed = !(verdict.value >= tolerance->limit);
        verdict.side = "below";
        break;
    case BD_GOAL_ZERO:
        if (at_end) verdict = (struct verdict){.value = farther(figure), .end = ".high"};
        verdict.missed = !(fabs(verdict.value) <= tolerance->limit);
        verdict.side = "farther from 0 than";
        break;
    case BD_GOAL_LESS:
    case BD_GOAL_NONE:
        if (at_end) verdict = (struct verdict){.value = figure->high, .end = ".high"};
        verdict.missed = !(verdict.value <= tolerance->limit);
        verdict.side = "above";
        break;
    }
    return verdict;
}

static enum bd_err check_one(const struct bd_cli_tolerance *tolerance, const char *layer,
                             const struct bd_metrics *metrics,
                             void (*tell)(void *user, const char *what), void *user,
                             struct bd_err_detail *detail)
{
    enum bd_metric metric = tolerance->metric;
    if (metrics->states[metric] == BD_METRIC_ABSENT) {
        // Of a picture without one finite pixel nothing is known; `nonfinite` says so.
        if (!metrics->pixel_count) return BD_ERR_OK;
        return bd_err_set(detail, BD_ERR_USAGE, "tolerance",
                          "--tolerance %.60s: layer %.40s has no %s here", tolerance->text, layer,
                          bd_metric_name(metric));
    }
    if (tolerance->at_end && metrics->states[metric] != BD_METRIC_WITH_INTERVAL)
        return bd_err_set(detail, BD_ERR_USAGE, "tolerance",
                          "--tolerance %.60s: %s has no interval", tolerance->text,
                          bd_metric_name(metric));
    struct verdict verdict = judge(tolerance, &metrics->figures[metric]);
    if (!verdict.missed) return BD_ERR_OK;
    char text[200];
    snprintf(text, sizeof text, "%s: %s%s is %.6g, which is %s its tolerance %.6g", layer,
             bd_metric_name(metric), verdict.end, verdict.value, verdict.side, tolerance->limit);
    tell(user, text);
    return BD_ERR_OK;
}

enum bd_err bd_cli_tolerances_check(const struct bd_cli_compare *compare, const char *layer,
                                    const struct bd_metrics *metrics,
                                    void (*tell)(void *user, const char *what), void *user,
                                    struct bd_err_detail *detail)
{
    static const struct bd_cli_tolerance all_finite = {"nonfinite=0", BD_METRIC_NONFINITE, false,
                                                       0};
    bool nonfinite = false;
    for (uint32_t i = 0; i < compare->tolerance_count; i++) {
        const struct bd_cli_tolerance *tolerance = &compare->tolerances[i];
        enum bd_err err = check_one(tolerance, layer, metrics, tell, user, detail);
        if (err) return err;
        nonfinite = nonfinite || tolerance->metric == BD_METRIC_NONFINITE;
    }
    if (nonfinite || !compare->tolerance_count) return BD_ERR_OK;
    return check_one(&all_finite, layer, metrics, tell, user, detail);
}
