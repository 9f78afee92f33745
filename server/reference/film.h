// What light paths (reference.h) bring to the pixels of a region: sums in fixed point, so that
// neither threads nor the order or number of calls show.
//
// Thread: made and destroyed on one; traced by any number at once; taken by one at a time a pixel,
// when nobody traces.

#ifndef BD_REFERENCE_FILM_H
#define BD_REFERENCE_FILM_H

#include "reference/reference.h"

struct bd_film;

// Keeps the reference, which must live as long. 72 bytes a pixel; BD_ERR_NO_MEMORY.
BD_MUST_CHECK
enum bd_err bd_film_create(const struct bd_reference *reference,
                           const struct bd_integrand *integrand,
                           const struct bd_reference_view *view, const uint32_t region[4],
                           struct bd_film **out, struct bd_err_detail *detail);
// Destroys and nulls; takes NULL.
void bd_film_destroy(struct bd_film **film);

// Paths of the samples from `first_sample` on, of both halves in turn: as many a sample and half as
// the whole picture has pixels.
void bd_film_trace(struct bd_film *film, uint64_t seed, uint32_t first_sample, uint64_t first_path,
                   uint32_t count);
// Adds a pixel's sums to what has landed there, and clears them.
void bd_film_take(struct bd_film *film, uint32_t x_px, uint32_t y_px,
                  struct bd_reference_pixel *pixel);

#endif
