// Traced pixels of one view, kept between checks of frames that show it: the second rung of a
// ladder traces little more than what the first did not choose.
//
// Whoever holds a cache makes sure that scene, camera, size, integrand and seed stay the same.
// Thread: one at a time.

#ifndef BD_REFERENCE_CHECK_CACHE_H
#define BD_REFERENCE_CHECK_CACHE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

// Levels of samples: the first has BD_CHECK_LEVEL_SAMPLES in each half, each further one as many as
// all before it. They are kept apart, so that a check that wants few samples of a pixel gets the
// same ones whether or not another check traced more of it.
#define BD_CHECK_LEVEL_SAMPLES 16u
#define BD_CHECK_LEVEL_MAX     8u // 2048 samples in each half

struct bd_check_sums {
    double sum[2][3];     // by half, beauty, cd/m^2
    double square_sum[3]; // of single samples, both halves
    uint64_t refused_ray_count;
};

struct bd_check_pixel {
    uint32_t index;        // y * width + x
    uint32_t level_count;  // that are traced
    double pilot_variance; // of single samples, mean over channels; by samples that are not in the
                           // levels: those that decide how many there are take no part
    struct bd_check_sums levels[BD_CHECK_LEVEL_MAX];
};

struct bd_check_cache;

// `pixel_count_max` bounds what is kept; when it is reached, the cache starts anew.
struct bd_check_cache *bd_check_cache_create(uint32_t pixel_count_max);
void bd_check_cache_destroy(struct bd_check_cache **cache);

// NULL if that pixel is not held. Valid until the next put.
const struct bd_check_pixel *bd_check_cache_get(const struct bd_check_cache *cache, uint32_t index);
void bd_check_cache_put(struct bd_check_cache *cache, const struct bd_check_pixel *pixel);

// What a first look saw of the view (check_scout.c), `count` times three numbers: kept with the
// cache, whatever else it forgets. `*is_known`: somebody has filled them; else who asks does.
float *bd_check_cache_scouts(struct bd_check_cache *cache, uint32_t count, bool *is_known);

void bd_check_cache_forget_scouts(struct bd_check_cache *cache);

uint32_t bd_check_cache_count(const struct bd_check_cache *cache);

#endif
