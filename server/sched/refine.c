#include "sched/refine.h"

#include <math.h>

// Refinements in a row that do not lower the error before it counts as its floor; and what counts
// as lowering: the samples are the same pixels from rung to rung, so that little of it is chance.
#define NOT_LOWERED_MAX 3
#define LOWERED         0.99

// Pixels beyond which an interval that is too wide is not narrowed any more.
#define PIXELS_MOST 8192u

void bd_refine_init(struct bd_refinement *refinement, double target, uint32_t pixel_count)
{
    *refinement =
        (struct bd_refinement){.target = target, .pixel_count = pixel_count, .lowest = INFINITY};
}

// A wider look may do: the figure is below the target and its upper end is not, or so few pixels
// carry it that there is none.
static bool should_look(const struct bd_refinement *refinement,
                        const struct bd_check_result *result)
{
    bool may_do = !result->black && (result->value < refinement->target || isinf(result->high));
    return may_do && result->pixel_count == refinement->pixel_count &&
           2 * refinement->pixel_count <= PIXELS_MOST;
}

// Nothing is a part of black: there the only error below a target is none.
static bool is_reached(const struct bd_refinement *refinement, const struct bd_check_result *result)
{
    return result->black ? result->high == 0 : result->high < refinement->target;
}

enum bd_refine_next bd_refine_decide(struct bd_refinement *refinement,
                                     const struct bd_check_result *result, bool has_next_rung,
                                     bool *is_better)
{
    // An absolute figure and a relative one cannot be compared: it begins anew.
    if (result->black != refinement->black) refinement->lowest = INFINITY;
    refinement->black = result->black;
    *is_better = result->high < refinement->lowest || isinf(refinement->lowest);
    if (is_reached(refinement, result)) return BD_REFINE_REACHED;
    if (should_look(refinement, result)) {
        refinement->pixel_count *= 2;
        return BD_REFINE_LOOK;
    }
    bool lowered = !refinement->begun || result->high < LOWERED * refinement->lowest;
    refinement->begun = true;
    refinement->not_lowered = lowered ? 0 : refinement->not_lowered + 1;
    if (result->high < refinement->lowest) refinement->lowest = result->high;
    if (!has_next_rung || refinement->not_lowered >= NOT_LOWERED_MAX) return BD_REFINE_FLOOR;
    return BD_REFINE_CLIMB;
}
