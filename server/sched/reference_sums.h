// Sums of references that were traced, for who asks for more samples of the same picture: a view
// that refines from 4 samples a pixel to 8 traces 4 of them.
//
// Samples are functions of their index and sums are added up in its order, so a picture that goes
// on has the bytes of one that is traced at once. The last used ones are kept, up to a count and an
// amount of memory; larger pictures are traced from the start each time.
//
// Private to sched/. Thread: any.

#ifndef BD_SCHED_REFERENCE_SUMS_H
#define BD_SCHED_REFERENCE_SUMS_H

#include <stdint.h>

#include "base/hash.h"
#include "reference/reference.h"

struct bd_reference_sums;

struct bd_reference_sums *bd_reference_sums_create(void);
void bd_reference_sums_destroy(struct bd_reference_sums **sums);

// Of a whole picture, or region of one.
struct bd_traced {
    uint8_t name[BD_SHA256_BYTES]; // of all that it depends on but for the number of samples
    uint32_t samples;              // of each half
    uint64_t pixel_count;
    struct bd_reference_pixel *pixels; // malloc's
};

// Whether so many pixels would be kept at all.
bool bd_reference_sums_may_keep(uint64_t pixel_count);
// A copy of the sums of that name, where they have no more samples than that: the caller's to go on
// with, and to keep in their place once all pixels have as many. False and pixels of NULL where
// there are none, or no memory.
bool bd_reference_sums_copy(struct bd_reference_sums *sums, const uint8_t name[BD_SHA256_BYTES],
                            uint32_t samples_max, struct bd_traced *out);
// Takes the pixels over; earlier ones of that name go.
void bd_reference_sums_keep(struct bd_reference_sums *sums, const struct bd_traced *traced);
uint64_t bd_reference_sums_bytes(struct bd_reference_sums *sums);

#endif
