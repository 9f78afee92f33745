// A first look for a spot check: one sample of each half all over the picture, before pixels are
// chosen. What the frame itself does not hint at (a lamp that it leaves out, light from behind the
// camera, a pole thinner than a pixel) is seen here, roughly; the samples take no part in the
// estimate. Private to reference/.

#ifndef BD_REFERENCE_CHECK_SCOUT_H
#define BD_REFERENCE_CHECK_SCOUT_H

#include "reference/check.h"
#include "reference/check_cache.h"

// What `cache` (or NULL) has of the view is not traced again.
//
// `*out`: two channels, how far the frame is off there squared, and the same over the
// neighbourhood; the caller destroys it. A picture of more than 16,384 pixels is looked at on a
// grid. The same frame, seed and tracer make the same picture. Adds what was traced to
// `*sample_count`.
BD_MUST_CHECK
enum bd_err bd_check_scout(const struct bd_check_frame *frame, uint64_t seed,
                           const struct bd_check_tracer *tracer, struct bd_check_cache *cache,
                           uint64_t *sample_count, struct bd_image **out, struct bd_fault *fault);

#endif
