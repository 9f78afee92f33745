// The noise of a traced picture's light, filtered (image/light_filter.h): its layers direct and
// indirect, and beauty as their sum with emission. Halves and variances stay as they were traced.
//
// Private to sched/. Thread: the references' worker; rows run on the runner's pool.

#ifndef BD_SCHED_REFERENCE_FILTER_H
#define BD_SCHED_REFERENCE_FILTER_H

#include "frame/request.h"
#include "image/image.h"
#include "sched/reference_runner.h"

// The layers that it reads and writes, as bits.
uint32_t bd_reference_filter_layers(void);

// `layers` has them. What `should_stop` answers is returned; the layers are then partly filtered.
BD_MUST_CHECK
enum bd_err bd_reference_filter(struct bd_reference_runner *runner,
                                const struct bd_runner_caller *caller,
                                struct bd_image *const layers[BD_LAYER_COUNT],
                                bd_reference_should_stop should_stop, void *user,
                                struct bd_err_detail *detail);

#endif
