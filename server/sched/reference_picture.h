// The layers of a traced picture from the sums over its pixels' samples.
//
// Private to sched/. Thread: one at a time; different pixels may be stored from different threads.

#ifndef BD_SCHED_REFERENCE_PICTURE_H
#define BD_SCHED_REFERENCE_PICTURE_H

#include <stdbool.h>
#include <stdint.h>

#include "base/err.h"
#include "frame/request.h"
#include "image/image.h"
#include "reference/reference.h"

// Makes `wanted` layers (bits) of the request's size: black, with nothing at any depth. Asks
// `should_stop` between them, since clearing all takes its time. All NULL after a failure.
BD_MUST_CHECK
enum bd_err bd_reference_picture_create(const struct bd_frame_request *request, uint32_t wanted,
                                        enum bd_err (*should_stop)(void *user), void *user,
                                        struct bd_image *layers[BD_LAYER_COUNT],
                                        struct bd_err_detail *detail);

// Means, variances and guides of one pixel into the layers that are there.
void bd_reference_picture_store(struct bd_image *const layers[BD_LAYER_COUNT], uint32_t x_px,
                                uint32_t y_px, const struct bd_reference_pixel *pixel);

#endif
