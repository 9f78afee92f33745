// From traced pixels to a figure and its interval. Private to reference/: check.h tells the method.

#ifndef BD_REFERENCE_CHECK_ESTIMATE_H
#define BD_REFERENCE_CHECK_ESTIMATE_H

#include "reference/check_cache.h"
#include "reference/check_plan.h"

// What was traced of one pixel: sums over `sample_count` > 0 samples of each half.
struct bd_check_traced {
    uint32_t sample_count;
    struct bd_check_sums sums;
};

// `traced[i]` belongs to plan->samples[i]. Fills everything but sample_count. A plan without pixels
// measures nothing: value 0, low 0, high infinite.
void bd_check_estimate(const struct bd_check_plan *plan, const struct bd_image *beauty,
                       const struct bd_check_traced *traced, struct bd_check_result *out);

// Two-sided 95 % quantile of Student's t.
double bd_check_student_t(double degrees_of_freedom);

#endif
