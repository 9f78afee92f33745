#include "reference/check_cache.h"

#include <stdlib.h>
#include <string.h>

#include "base/assert.h"

#define EMPTY UINT32_MAX

// Open addressing, at most half full. A slot is the place of a pixel.
struct bd_check_cache {
    uint32_t count, count_max, room, slot_mask;
    uint32_t *slots;
    struct bd_check_pixel *pixels; // room for `room`, grown as needed
    float *scouts;
    uint32_t scout_count;
};

static void forget_all(struct bd_check_cache *cache)
{
    memset(cache->slots, 0xff, ((size_t)cache->slot_mask + 1) * sizeof *cache->slots);
    cache->count = 0;
}

struct bd_check_cache *bd_check_cache_create(uint32_t pixel_count_max)
{
    struct bd_check_cache *cache = calloc(1, sizeof *cache);
    BD_ASSERT(cache);
    BD_ASSERT_CMP(pixel_count_max, >, 0);
    BD_ASSERT_CMP(pixel_count_max, <=, UINT32_C(1) << 24);
    uint32_t slot_count = 64;
    while (slot_count < 2 * pixel_count_max) slot_count *= 2;
    cache->count_max = pixel_count_max;
    cache->slot_mask = slot_count - 1;
    cache->slots = malloc((size_t)slot_count * sizeof *cache->slots);
    BD_ASSERT(cache->slots);
    forget_all(cache);
    return cache;
}

void bd_check_cache_destroy(struct bd_check_cache **cache)
{
    if (!*cache) return;
    free((*cache)->slots);
    free((*cache)->pixels);
    free((*cache)->scouts);
    free(*cache);
    *cache = NULL;
}

// The slot that names pixel `index`, or the empty one where it belongs.
static uint32_t *slot_of(const struct bd_check_cache *cache, uint32_t index)
{
    uint32_t at = (index * UINT32_C(2654435769) >> 7) & cache->slot_mask;
    while (cache->slots[at] != EMPTY && cache->pixels[cache->slots[at]].index != index)
        at = (at + 1) & cache->slot_mask;
    return &cache->slots[at];
}

const struct bd_check_pixel *bd_check_cache_get(const struct bd_check_cache *cache, uint32_t index)
{
    uint32_t slot = *slot_of(cache, index);
    return slot == EMPTY ? NULL : &cache->pixels[slot];
}

static void make_room(struct bd_check_cache *cache)
{
    if (cache->count == cache->count_max) forget_all(cache);
    if (cache->count < cache->room) return;
    cache->room = cache->room ? 2 * cache->room : 256;
    cache->pixels = realloc(cache->pixels, (size_t)cache->room * sizeof *cache->pixels);
    BD_ASSERT(cache->pixels);
}

void bd_check_cache_put(struct bd_check_cache *cache, const struct bd_check_pixel *pixel)
{
    uint32_t *slot = slot_of(cache, pixel->index);
    if (*slot == EMPTY) {
        make_room(cache);
        slot = slot_of(cache, pixel->index);
        *slot = cache->count++;
    }
    cache->pixels[*slot] = *pixel;
}

float *bd_check_cache_scouts(struct bd_check_cache *cache, uint32_t count, bool *is_known)
{
    *is_known = cache->scout_count == count;
    if (*is_known) return cache->scouts;
    free(cache->scouts);
    cache->scouts = calloc((size_t)count * 3, sizeof *cache->scouts);
    BD_ASSERT(cache->scouts);
    cache->scout_count = count;
    return cache->scouts;
}

void bd_check_cache_forget_scouts(struct bd_check_cache *cache)
{
    cache->scout_count = 0;
}

uint32_t bd_check_cache_count(const struct bd_check_cache *cache)
{
    return cache->count;
}
