#include "sched/reference_sums.h"

#include <pthread.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"

#define KEPT_MAX          8
#define KEPT_BYTES_MAX    (UINT64_C(256) << 20)
#define PICTURE_BYTES_MAX (KEPT_BYTES_MAX / 2) // some 400,000 pixels

struct bd_reference_sums {
    pthread_mutex_t lock;
    struct bd_traced kept[KEPT_MAX]; // without pixels: free; the last used one first
};

struct bd_reference_sums *bd_reference_sums_create(void)
{
    struct bd_reference_sums *sums = calloc(1, sizeof *sums);
    BD_ASSERT(sums);
    BD_ASSERT(pthread_mutex_init(&sums->lock, NULL) == 0);
    return sums;
}

void bd_reference_sums_destroy(struct bd_reference_sums **sums)
{
    struct bd_reference_sums *s = *sums;
    *sums = NULL;
    if (!s) return;
    for (int i = 0; i < KEPT_MAX; i++) free(s->kept[i].pixels);
    pthread_mutex_destroy(&s->lock);
    free(s);
}

// --- keeping ------------------------------------------------------------------------------------

static uint64_t bytes_of(const struct bd_traced *traced)
{
    return traced->pixels ? traced->pixel_count * sizeof *traced->pixels : 0;
}

bool bd_reference_sums_may_keep(uint64_t pixel_count)
{
    return pixel_count <= PICTURE_BYTES_MAX / sizeof(struct bd_reference_pixel);
}

static int find(const struct bd_reference_sums *sums, const uint8_t name[BD_SHA256_BYTES])
{
    for (int i = 0; i < KEPT_MAX; i++)
        if (sums->kept[i].pixels && memcmp(sums->kept[i].name, name, BD_SHA256_BYTES) == 0)
            return i;
    return -1;
}

// Closes the gap.
static struct bd_traced take_out(struct bd_reference_sums *sums, int at)
{
    const struct bd_traced traced = sums->kept[at];
    memmove(&sums->kept[at], &sums->kept[at + 1],
            (size_t)(KEPT_MAX - 1 - at) * sizeof sums->kept[0]);
    sums->kept[KEPT_MAX - 1] = (struct bd_traced){0};
    return traced;
}

static struct bd_traced copy_of(const struct bd_traced *traced)
{
    struct bd_traced copy = *traced;
    copy.pixels = malloc(bytes_of(traced));
    if (!copy.pixels) return (struct bd_traced){0};
    memcpy(copy.pixels, traced->pixels, bytes_of(traced));
    return copy;
}

bool bd_reference_sums_copy(struct bd_reference_sums *sums, const uint8_t name[BD_SHA256_BYTES],
                            uint32_t samples_max, struct bd_traced *out)
{
    *out = (struct bd_traced){0};
    pthread_mutex_lock(&sums->lock);
    const int at = find(sums, name);
    if (at >= 0 && sums->kept[at].samples <= samples_max) *out = copy_of(&sums->kept[at]);
    pthread_mutex_unlock(&sums->lock);
    return out->pixels != NULL;
}

static uint64_t kept_bytes(const struct bd_reference_sums *sums)
{
    uint64_t bytes = 0;
    for (int i = 0; i < KEPT_MAX; i++) bytes += bytes_of(&sums->kept[i]);
    return bytes;
}

static void drop_last(struct bd_reference_sums *sums)
{
    int last = KEPT_MAX - 1;
    while (last > 0 && !sums->kept[last].pixels) last--;
    free(take_out(sums, last).pixels);
}

void bd_reference_sums_keep(struct bd_reference_sums *sums, const struct bd_traced *traced)
{
    pthread_mutex_lock(&sums->lock);
    const int earlier = find(sums, traced->name);
    if (earlier >= 0) free(take_out(sums, earlier).pixels);
    if (sums->kept[KEPT_MAX - 1].pixels) drop_last(sums);
    while (kept_bytes(sums) > 0 && kept_bytes(sums) + bytes_of(traced) > KEPT_BYTES_MAX)
        drop_last(sums);
    memmove(&sums->kept[1], &sums->kept[0], (KEPT_MAX - 1) * sizeof sums->kept[0]);
    sums->kept[0] = *traced;
    pthread_mutex_unlock(&sums->lock);
}

uint64_t bd_reference_sums_bytes(struct bd_reference_sums *sums)
{
    pthread_mutex_lock(&sums->lock);
    const uint64_t bytes = kept_bytes(sums);
    pthread_mutex_unlock(&sums->lock);
    return bytes;
}
