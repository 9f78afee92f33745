// What the reference traces, but for how much of it, and its name: for those who keep what was
// traced.
//
// Private to sched/. Thread: any.

#ifndef BD_SCHED_REFERENCE_SUBJECT_H
#define BD_SCHED_REFERENCE_SUBJECT_H

#include <stdbool.h>
#include <stdint.h>

#include "base/hash.h"
#include "reference/reference.h"

struct bd_reference_subject {
    const struct bd_scene *scene;
    const struct bd_integrand *integrand;
    const struct bd_reference_view *view;
    uint32_t region[4]; // x, y, width, height; all 0: pixels here and there
    uint64_t seed;
    uint32_t first_sample;
};

// Two of one name have the same samples. False where it has none: of a snapshot that was built by
// hand, nothing says that two of them are the same.
bool bd_reference_subject_name(const struct bd_reference_subject *subject,
                               uint8_t name[BD_SHA256_BYTES]);

#endif
