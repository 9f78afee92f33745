#include "pass/receiver_sets.h"

#include <stdlib.h>

#include "lights/irradiance_cells.h"
#include "pass/f3_arrays.h"

// A cube about render space, whose planes lie in no round place.
#define CUBE_RADIUS 1.0553f
static const f3 cube_middle = {0.0123f, 0.0171f, 0.0093f};

struct numbered {
    uint64_t number; // of the smallest cell that it lies in
    uint32_t place;
};

static int by_number(const void *a, const void *b)
{
    const struct numbered *x = a, *y = b;
    if (x->number != y->number) return x->number < y->number ? -1 : 1;
    return (x->place > y->place) - (x->place < y->place);
}

static uint32_t list_lit(const struct bd_receiver_part *part, struct numbered *list)
{
    uint32_t count = 0;
    for (uint32_t i = 0; i < part->count; i++) {
        const uint32_t group = i / BD_LANES, lane = i % BD_LANES;
        const struct bd_ray_starts *starts = &part->starts[group];
        if (!(part->receivers[group].lit[lane] > 0)) continue;
        const f3 position = f3_sub(f3_at(&starts->position, lane), cube_middle);
        const f3 normal = f3_at(&starts->normal_geometric, lane);
        list[count++] = (struct numbered){bd_irradiance_cell_at(position, normal, CUBE_RADIUS), i};
    }
    qsort(list, count, sizeof *list, by_number);
    return count;
}

// The first of some in the upper half of the smallest cell that holds them; of those in one cell
// that in the middle.
static uint32_t upper_half(const struct numbered *list, uint32_t first, uint32_t end)
{
    const uint64_t unlike = list[first].number ^ list[end - 1].number;
    uint64_t bit = (uint64_t)1 << 63;
    if (unlike == 0) return first + (end - first) / 2;
    while (!(unlike & bit)) bit >>= 1;
    while (!(list[first].number & bit)) first++;
    return first;
}

static void add_sets(struct bd_receiver_sets *sets, const struct numbered *list, uint32_t first,
                     uint32_t end)
{
    if (end - first <= BD_SET_MOST) {
        sets->first[sets->count++] = first;
        return;
    }
    const uint32_t upper = upper_half(list, first, end);
    add_sets(sets, list, first, upper);
    add_sets(sets, list, upper, end);
}

enum bd_err bd_receiver_sets_init(struct bd_receiver_sets *sets,
                                  const struct bd_receiver_part *part, struct bd_err_detail *detail)
{
    const size_t most = part->count + 1;
    struct numbered *list = malloc(most * sizeof *list);
    *sets = (struct bd_receiver_sets){0, malloc(most * sizeof *sets->first),
                                      malloc(most * sizeof *sets->places)};
    if (!list || !sets->first || !sets->places) {
        free(list);
        bd_receiver_sets_finish(sets);
        return bd_err_set(detail, BD_ERR_NO_MEMORY, "size", "no memory for %u receivers",
                          part->count);
    }
    const uint32_t count = list_lit(part, list);
    for (uint32_t i = 0; i < count; i++) sets->places[i] = list[i].place;
    if (count > 0) add_sets(sets, list, 0, count);
    sets->first[sets->count] = count;
    free(list);
    return BD_ERR_OK;
}

void bd_receiver_sets_finish(struct bd_receiver_sets *sets)
{
    free(sets->first);
    free(sets->places);
    *sets = (struct bd_receiver_sets){0};
}
