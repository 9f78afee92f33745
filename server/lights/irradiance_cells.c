#include "lights/irradiance_cells.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "lights/directions.h"
#include "lights/sequence.h"

// Bits of a Morton code along each axis, and of all of it.
#define AXIS_BITS 20u
#define CODE_BITS (3 * AXIS_BITS)
// Of a number, in each round of sorting.
#define DIGIT_BITS 11u
#define DIGITS     (1u << DIGIT_BITS)

// --- numbers ------------------------------------------------------------------------------------

static uint64_t every_third_bit(uint64_t x)
{
    x = (x | x << 32) & 0x001f00000000ffffu;
    x = (x | x << 16) & 0x001f0000ff0000ffu;
    x = (x | x << 8) & 0x100f00f00f00f00fu;
    x = (x | x << 4) & 0x10c30c30c30c30c3u;
    return (x | x << 2) & 0x1249249249249249u;
}

static uint64_t step_of(float x, float radius)
{
    const float part = f_min(f_max(0.5f * (x / radius + 1), 0), 1);
    return (uint64_t)(part * (float)((1u << AXIS_BITS) - 1));
}

static uint64_t face_of(f3 n)
{
    const float x = fabsf(n.x), y = fabsf(n.y), z = fabsf(n.z);
    if (x >= y && x >= z) return n.x < 0;
    return y >= z ? 2 + (n.y < 0) : 4 + (n.z < 0);
}

uint64_t bd_irradiance_cell_at(f3 position, f3 normal, float radius)
{
    return face_of(normal) << CODE_BITS | every_third_bit(step_of(position.x, radius)) |
           every_third_bit(step_of(position.y, radius)) << 1 |
           every_third_bit(step_of(position.z, radius)) << 2;
}

// --- places in order ----------------------------------------------------------------------------

struct place {
    uint64_t number;
    uint32_t index;
};

// By the digit, those that are equal as they were.
static void sort_by(const struct place *from, struct place *to, uint32_t count, uint32_t shift)
{
    uint32_t first[DIGITS + 1] = {0};
    for (uint32_t i = 0; i < count; i++) first[(from[i].number >> shift & (DIGITS - 1)) + 1]++;
    for (uint32_t d = 0; d < DIGITS; d++) first[d + 1] += first[d];
    for (uint32_t i = 0; i < count; i++)
        to[first[from[i].number >> shift & (DIGITS - 1)]++] = from[i];
}

// `spare` has room for as many.
static void sort(struct place *places, struct place *spare, uint32_t count)
{
    for (uint32_t shift = 0; shift < CODE_BITS + 3; shift += 2 * DIGIT_BITS) {
        sort_by(places, spare, count, shift);
        sort_by(spare, places, count, shift + DIGIT_BITS);
    }
}

_Static_assert((CODE_BITS + 3 + DIGIT_BITS - 1) / DIGIT_BITS % 2 == 0, "rounds come in pairs");

// --- cells --------------------------------------------------------------------------------------

// A cell of so many halvings along each axis, and those of the places in order that lie in it.
struct cell {
    uint32_t first, end, level;
};

// Those that may be divided, the one with the most places first.
struct heap {
    uint32_t count;
    struct cell *cells;
};

static bool comes_before(const struct cell *a, const struct cell *b)
{
    const uint32_t of_a = a->end - a->first, of_b = b->end - b->first;
    return of_a != of_b ? of_a > of_b : a->first < b->first;
}

static void swap(struct cell *a, struct cell *b)
{
    const struct cell was = *a;
    *a = *b;
    *b = was;
}

static void push(struct heap *heap, struct cell cell)
{
    uint32_t at = heap->count++;
    heap->cells[at] = cell;
    for (; at > 0 && comes_before(&heap->cells[at], &heap->cells[(at - 1) / 2]); at = (at - 1) / 2)
        swap(&heap->cells[at], &heap->cells[(at - 1) / 2]);
}

static struct cell pop(struct heap *heap)
{
    const struct cell top = heap->cells[0];
    heap->cells[0] = heap->cells[--heap->count];
    for (uint32_t at = 0, next; (next = 2 * at + 1) < heap->count; at = next) {
        if (next + 1 < heap->count && comes_before(&heap->cells[next + 1], &heap->cells[next]))
            next++;
        if (!comes_before(&heap->cells[next], &heap->cells[at])) break;
        swap(&heap->cells[next], &heap->cells[at]);
    }
    return top;
}

// The first place from `first` on whose number is at least that.
static uint32_t first_from(const struct place *places, uint32_t first, uint32_t end,
                           uint64_t number)
{
    while (first < end) {
        const uint32_t middle = first + (end - first) / 2;
        if (places[middle].number < number)
            first = middle + 1;
        else
            end = middle;
    }
    return first;
}

static uint64_t least_in(const struct place *places, const struct cell *cell)
{
    const uint32_t shift = 3 * (AXIS_BITS - cell->level);
    return places[cell->first].number >> shift << shift;
}

static void divide(struct heap *heap, const struct place *places, const struct cell *cell)
{
    const uint32_t shift = 3 * (AXIS_BITS - cell->level - 1);
    const uint64_t least = least_in(places, cell);
    for (uint32_t part = 0, first = cell->first; part < 8 && first < cell->end; part++) {
        const uint64_t beyond = least + ((uint64_t)(part + 1) << shift);
        const uint32_t end = first_from(places, first, cell->end, beyond);
        if (end > first) push(heap, (struct cell){first, end, cell->level + 1});
        first = end;
    }
}

// One of many rays that met the same, too: whoever ends beside it finds it.
static bool is_of_one_place(const struct place *places, const struct cell *cell)
{
    return places[cell->first].number == places[cell->end - 1].number;
}

// The parts of one are at most eight. What cannot be divided any more is set aside.
static uint32_t find_cells(struct heap *heap, const struct place *places, uint32_t count,
                           uint32_t most, struct cell *whole)
{
    uint32_t wholes = 0;
    for (uint64_t face = 0, first = 0; face < 6 && first < count; face++) {
        const uint32_t end = first_from(places, (uint32_t)first, count, (face + 1) << CODE_BITS);
        if (end > first) push(heap, (struct cell){(uint32_t)first, end, 0});
        first = end;
    }
    while (heap->count > 0 && wholes + heap->count + 7 <= most) {
        const struct cell cell = pop(heap);
        if (is_of_one_place(places, &cell))
            whole[wholes++] = cell;
        else
            divide(heap, places, &cell);
    }
    while (heap->count > 0) whole[wholes++] = pop(heap);
    return wholes;
}

static int by_first(const void *a, const void *b)
{
    const struct cell *x = a, *y = b;
    return (x->first > y->first) - (x->first < y->first);
}

static void keep(struct bd_irradiance_cells *cells, const struct place *places,
                 const struct cell *cell)
{
    const uint64_t least = least_in(places, cell);
    const uint32_t stirred = bd_stirred((uint32_t)(least >> 32) ^ bd_stirred((uint32_t)least));
    const uint64_t places_of_cell = cell->end - cell->first;
    const uint32_t chosen = cell->first + (uint32_t)(stirred * places_of_cell >> 32);
    cells->first[cells->count] = least;
    cells->beyond[cells->count] = least + ((uint64_t)1 << 3 * (AXIS_BITS - cell->level));
    cells->number[cells->count] = (uint32_t)(least >> 3 * (AXIS_BITS - cell->level));
    cells->chosen[cells->count++] = places[chosen].index;
}

static bool make_room(struct bd_irradiance_cells *cells, uint32_t most)
{
    cells->first = malloc(most * sizeof *cells->first);
    cells->beyond = malloc(most * sizeof *cells->beyond);
    cells->chosen = malloc(most * sizeof *cells->chosen);
    cells->number = malloc(most * sizeof *cells->number);
    cells->places = calloc(most, sizeof *cells->places);
    cells->irradiance = calloc(most, sizeof *cells->irradiance);
    return cells->first && cells->beyond && cells->chosen && cells->number && cells->places &&
           cells->irradiance;
}

enum bd_err bd_irradiance_cells_create(const uint64_t *numbers, uint32_t place_count, uint32_t most,
                                       float radius, struct bd_irradiance_cells **out,
                                       struct bd_err_detail *detail)
{
    struct bd_irradiance_cells *cells = calloc(1, sizeof *cells);
    struct place *places = malloc((place_count + 1) * sizeof *places);
    struct place *spare = malloc((place_count + 1) * sizeof *spare);
    struct heap heap = {0, malloc((most + 8) * sizeof *heap.cells)};
    struct cell *whole = malloc((most + 8) * sizeof *whole);
    enum bd_err err = BD_ERR_OK;
    BD_ASSERT(cells);
    cells->radius = radius;
    if (!places || !spare || !heap.cells || !whole || !make_room(cells, most + 8))
        err = bd_err_set(detail, BD_ERR_NO_MEMORY, "cache_cells", "no memory for %u", most);
    for (uint32_t i = 0; !err && i < place_count; i++) places[i] = (struct place){numbers[i], i};
    if (!err) {
        sort(places, spare, place_count);
        const uint32_t count = find_cells(&heap, places, place_count, most, whole);
        qsort(whole, count, sizeof *whole, by_first);
        for (uint32_t i = 0; i < count; i++) keep(cells, places, &whole[i]);
    }
    free(places);
    free(spare);
    free(heap.cells);
    free(whole);
    if (err) bd_irradiance_cells_destroy(&cells);
    *out = cells;
    return err;
}

void bd_irradiance_cells_destroy(struct bd_irradiance_cells **cells)
{
    if (!*cells) return;
    free((*cells)->first);
    free((*cells)->beyond);
    free((*cells)->chosen);
    free((*cells)->number);
    free((*cells)->places);
    free((*cells)->irradiance);
    free((*cells)->beside);
    free(*cells);
    *cells = NULL;
}

uint64_t bd_irradiance_cells_bytes(const struct bd_irradiance_cells *cells)
{
    return sizeof *cells +
           cells->count *
               (2 * sizeof *cells->first + sizeof *cells->chosen + sizeof *cells->number +
                sizeof *cells->places + sizeof *cells->irradiance +
                (cells->beside ? BD_CELLS_BESIDE : 0) * sizeof *cells->beside);
}

// The last that begins at that number or before, of some.
static uint32_t last_until(const struct bd_irradiance_cells *cells, uint64_t number)
{
    uint32_t first = 0, count = cells->count;
    while (count > 1) {
        const uint32_t half = count / 2;
        if (cells->first[first + half] <= number) first += half;
        count -= half;
    }
    return first;
}

static uint32_t cell_with(const struct bd_irradiance_cells *cells, uint64_t number)
{
    const uint32_t cell = last_until(cells, number);
    return cells->first[cell] <= number && number < cells->beyond[cell] ? cell : BD_NO_CELL;
}

// Faces by how far the normal leans to each.
static uint64_t take_next_face(f3 normal, bool was[6])
{
    const float lean[6] = {normal.x, -normal.x, normal.y, -normal.y, normal.z, -normal.z};
    uint64_t next = 6;
    for (uint64_t face = 0; face < 6; face++)
        if (!was[face] && (next == 6 || lean[face] > lean[next])) next = face;
    was[next] = true;
    return next;
}

uint32_t bd_irradiance_cells_find(const struct bd_irradiance_cells *cells, f3 position, f3 normal)
{
    bool was[6] = {false};
    if (cells->count == 0) return BD_NO_CELL;
    const uint64_t number = bd_irradiance_cell_at(position, normal, cells->radius);
    const uint64_t place = number & (((uint64_t)1 << CODE_BITS) - 1);
    uint32_t found = cell_with(cells, number);
    // The face opposite, and those beside it, look elsewhere.
    for (int i = 0; found == BD_NO_CELL && i < 3; i++)
        found = cell_with(cells, take_next_face(normal, was) << CODE_BITS | place);
    return found;
}

// --- cells about a place ------------------------------------------------------------------------

// At least that cosine between normals: a cell may be of a wall's other side, or of another wall
// that meets it there.
#define ALIKE_LEAST 0.01f

static bool is_alike(const struct bd_irradiance_cells *cells, uint32_t cell, f3 normal)
{
    return f3_dot(cells->places[cell].normal, normal) >= ALIKE_LEAST;
}

uint32_t bd_irradiance_cells_of(const struct bd_irradiance_cells *cells, f3 position, f3 normal)
{
    const uint32_t cell = bd_irradiance_cells_find(cells, position, normal);
    return cell != BD_NO_CELL && is_alike(cells, cell, normal) ? cell : BD_NO_CELL;
}

struct about {
    const struct bd_irradiance_cells *cells;
    f3 position, normal;
    uint32_t count;
    uint32_t found[9];
    float distances2[9];
};

// But for the first, which the place lies in, in order of distance.
static void add_about(struct about *about, uint32_t cell)
{
    if (cell == BD_NO_CELL || !is_alike(about->cells, cell, about->normal)) return;
    const f3 way = f3_sub(about->cells->places[cell].position, about->position);
    const float distance2 = f3_dot(way, way);
    for (uint32_t i = 0; i < about->count; i++)
        if (about->found[i] == cell) return;
    uint32_t at = about->count++;
    for (; at > 0 && about->distances2[at - 1] > distance2; at--) {
        about->found[at] = about->found[at - 1];
        about->distances2[at] = about->distances2[at - 1];
    }
    about->found[at] = cell;
    about->distances2[at] = distance2;
}

static float side_of(const struct bd_irradiance_cells *cells, uint32_t cell)
{
    const uint64_t codes = cells->beyond[cell] - cells->first[cell];
    const float steps = cbrtf((float)codes);
    return steps * 2 * cells->radius / (float)(1u << AXIS_BITS);
}

uint32_t bd_irradiance_cells_about(const struct bd_irradiance_cells *cells, f3 position, f3 normal,
                                   uint32_t *found, uint32_t most)
{
    struct about about = {.cells = cells, .position = position, .normal = normal};
    if (cells->count == 0) return 0;
    const uint32_t last = last_until(cells, bd_irradiance_cell_at(position, normal, cells->radius));
    const uint32_t own = bd_irradiance_cells_find(cells, position, normal);
    add_about(&about, own);
    if (about.count > 0) about.distances2[0] = -1;
    if (most > 1 || about.count == 0) {
        const float side = side_of(cells, own == BD_NO_CELL ? last : own);
        const struct bd_basis basis = bd_basis_of(normal);
        for (int v = -1; v <= 1; v++)
            for (int u = -1; u <= 1; u++) {
                const f3 step =
                    f3_add(f3_scale(basis.x, side * (float)u), f3_scale(basis.y, side * (float)v));
                add_about(&about, bd_irradiance_cells_find(cells, f3_add(position, step), normal));
            }
    }
    if (about.count == 0) { // those next to it in their order
        add_about(&about, last);
        add_about(&about, last + 1 < cells->count ? last + 1 : BD_NO_CELL);
    }
    const uint32_t count = about.count < most ? about.count : most;
    memcpy(found, about.found, count * sizeof *found);
    return count;
}

// --- between cells ------------------------------------------------------------------------------

// A cell tells of places up to so many of its sides away; below the root of that part of the reach,
// nearness counts no more.
#define BETWEEN_REACH    1.5f
#define BETWEEN_NEAREST2 0.05f

// Grows with nearness: by the reach alone, all places of a large cell would get one mean.
static float share_of(const struct bd_irradiance_cells *cells, uint32_t cell, f3 position,
                      f3 normal, float reach2)
{
    const f3 way = f3_sub(cells->places[cell].position, position);
    const float distance2 = f3_dot(way, way), near = f_max(1 - distance2 / reach2, 0);
    const float facing = f_max(f3_dot(cells->places[cell].normal, normal), 0);
    return near * near * facing / (distance2 + BETWEEN_NEAREST2 * reach2);
}

f3 bd_irradiance_cells_between(const struct bd_irradiance_cells *cells, uint32_t cell, f3 position,
                               f3 normal)
{
    const float reach = BETWEEN_REACH * side_of(cells, cell);
    f3 sum = f3_of(0, 0, 0);
    float shares = 0;
    for (uint32_t i = 0; i <= BD_CELLS_BESIDE; i++) {
        const uint32_t other = i == 0 ? cell : cells->beside[BD_CELLS_BESIDE * cell + i - 1];
        if (other == BD_NO_CELL) break;
        const float share = share_of(cells, other, position, normal, reach * reach);
        sum = f3_add(sum, f3_scale(cells->irradiance[other], share));
        shares += share;
    }
    return shares > 0 ? f3_scale(sum, 1 / shares) : cells->irradiance[cell];
}
