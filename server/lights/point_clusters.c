#include "lights/point_clusters.h"

#include <math.h>
#include <stdlib.h>

#include "base/assert.h"
#include "kernel/projected_point.h"
#include "lights/sequence.h"

// Parts of so few are not divided.
#define PART_LEAST 4u
#define PAUSE_FROM 4096u // points

// Cells along an axis, of a cube about render space, and where that begins: none of its planes lies
// in a round place, where walls are and rounding would say on which side.
#define AXIS_BITS 10u
#define CODE_BITS (3 * AXIS_BITS)
#define CUBE_FROM 1.0371f
#define CUBE_SIDE 2.1173f

// Of a code, in each round of sorting.
#define DIGIT_BITS 10u
#define DIGITS     (1u << DIGIT_BITS)

struct coded {
    uint32_t code, point;
};

// Parts of up to so many points are as large as others.
#define STEPS_KEPT 4096u

struct clustering {
    struct bd_point_clusters *clusters;
    const struct bd_surface_points *points;
    struct coded *coded, *spare;
    uint32_t steps[STEPS_KEPT]; // of parts of so many points; 0: not found yet
    enum bd_err (*pause)(void *user);
    void *user;
    enum bd_err err;
};

// --- in order -----------------------------------------------------------------------------------

static uint32_t every_third_bit(uint32_t x)
{
    x = (x | x << 16) & 0x030000ffu;
    x = (x | x << 8) & 0x0300f00fu;
    x = (x | x << 4) & 0x030c30c3u;
    return (x | x << 2) & 0x09249249u;
}

static uint32_t cell_along(float x)
{
    const float cells = (float)(1u << AXIS_BITS);
    return (uint32_t)f_min(f_max((x + CUBE_FROM) * (cells / CUBE_SIDE), 0), cells - 1);
}

static uint32_t code_of(f3 at)
{
    return every_third_bit(cell_along(at.x)) | every_third_bit(cell_along(at.y)) << 1 |
           every_third_bit(cell_along(at.z)) << 2;
}

// By the digit, those that are equal as they were.
static void sort_by(const struct coded *from, struct coded *to, uint32_t count, uint32_t shift)
{
    uint32_t first[DIGITS + 1] = {0};
    for (uint32_t i = 0; i < count; i++) first[(from[i].code >> shift & (DIGITS - 1)) + 1]++;
    for (uint32_t d = 0; d < DIGITS; d++) first[d + 1] += first[d];
    for (uint32_t i = 0; i < count; i++)
        to[first[from[i].code >> shift & (DIGITS - 1)]++] = from[i];
}

_Static_assert(CODE_BITS == 3 * DIGIT_BITS, "three rounds");

static void put_in_order(struct clustering *c)
{
    const uint32_t count = c->points->count;
    for (uint32_t i = 0; i < count; i++)
        c->spare[i] = (struct coded){code_of(c->points->points[i].position), i};
    sort_by(c->spare, c->coded, count, 0);
    sort_by(c->coded, c->spare, count, DIGIT_BITS);
    sort_by(c->spare, c->coded, count, 2 * DIGIT_BITS);
}

// --- parts --------------------------------------------------------------------------------------

static void widen(struct bd_point_box *box, f3 at)
{
    box->least =
        f3_of(f_min(box->least.x, at.x), f_min(box->least.y, at.y), f_min(box->least.z, at.z));
    box->most = f3_of(f_max(box->most.x, at.x), f_max(box->most.y, at.y), f_max(box->most.z, at.z));
}

static struct bd_point_box box_of(const struct clustering *c, uint32_t first, uint32_t count)
{
    const f3 at = c->points->points[c->coded[first].point].position;
    struct bd_point_box box = {at, at};
    for (uint32_t i = first + 1; i < first + count; i++)
        widen(&box, c->points->points[c->coded[i].point].position);
    return box;
}

// Bits of a code below those that all of some have alike.
static uint32_t bits_unlike(uint32_t first, uint32_t last)
{
    uint32_t bits = 0;
    for (uint32_t unlike = first ^ last; unlike; unlike >>= 1) bits++;
    return bits;
}

// The first of some whose bit is set, which comes after those whose is not; of those in one cell
// that in the middle.
static uint32_t second_half(const struct clustering *c, uint32_t first, uint32_t count,
                            uint32_t bits)
{
    if (bits == 0) return first + count / 2;
    uint32_t end = first + count - 1;
    while (end - first > 1) {
        const uint32_t middle = first + (end - first) / 2;
        *(c->coded[middle].code >> (bits - 1) & 1 ? &end : &first) = middle;
    }
    return end;
}

// The largest quotient of Euclid's algorithm: the larger, the less evenly steps lie in between
// (three gaps). UINT32_MAX: they come to some points alone.
static uint32_t unevenness_of(uint32_t step, uint32_t count)
{
    uint32_t a = count, b = step, largest = 0;
    while (b > 0) {
        const uint32_t quotient = a / b, rest = a - quotient * b;
        largest = quotient > largest ? quotient : largest;
        a = b;
        b = rest;
    }
    return a == 1 ? largest : UINT32_MAX;
}

// Of many points less, so that products with how many are drawn have 32 bits.
#define STEP_MOST 260000u
#define TRIES     16

// The most even one about the golden section of all.
static uint32_t find_step(uint32_t count)
{
    const uint32_t golden = (uint32_t)(0.618034f * (float)count + 0.5f);
    const uint32_t about = golden < STEP_MOST ? golden : STEP_MOST;
    uint32_t best = 1, least = UINT32_MAX;
    for (uint32_t i = 0; i < 2 * TRIES; i++) {
        const uint32_t step = i % 2 ? about + i / 2 : about - i / 2;
        if (step == 0 || step >= count) continue; // below 0, too
        const uint32_t unevenness = unevenness_of(step, count);
        if (unevenness >= least) continue;
        least = unevenness;
        best = step;
    }
    return best;
}

static uint32_t step_of(struct clustering *c, uint32_t count)
{
    if (count >= STEPS_KEPT) return find_step(count);
    if (c->steps[count] == 0) c->steps[count] = find_step(count);
    return c->steps[count];
}

static void add_part(struct clustering *c, uint32_t first, uint32_t count)
{
    if (count >= PAUSE_FROM && !c->err) c->err = c->pause(c->user);
    if (c->err) return;
    struct bd_point_part *part = &c->clusters->parts[c->clusters->part_count++];
    const uint32_t code = c->coded[first].code;
    const uint32_t bits = bits_unlike(code, c->coded[first + count - 1].code);
    *part = (struct bd_point_part){.first = first,
                                   .count = count,
                                   .step = step_of(c, count),
                                   .name = bd_stirred((code >> bits) + bits * 0x9e3779b9u)};
    if (count <= PART_LEAST) {
        part->box = box_of(c, first, count);
        return;
    }
    const uint32_t second = second_half(c, first, count, bits);
    add_part(c, first, second - first);
    part->second = c->clusters->part_count;
    add_part(c, second, first + count - second);
    if (c->err) return;
    part->box = part[1].box;
    widen(&part->box, c->clusters->parts[part->second].box.least);
    widen(&part->box, c->clusters->parts[part->second].box.most);
}

static void keep_points(struct clustering *c)
{
    for (uint32_t i = 0; i < c->points->count; i++) {
        const uint32_t point = c->coded[i].point;
        const struct bd_surface_point *from = &c->points->points[point];
        c->clusters->order[i] = point;
        c->clusters->names[i] = from->number;
        c->clusters->points[i] = (struct bd_projected_point){
            .x = from->position.x,
            .y = from->position.y,
            .z = from->position.z,
            .normal = bits_of_normal(from->normal),
        };
    }
}

// Parts are fewer than they might be.
static void shrink(struct bd_point_clusters *clusters)
{
    const size_t bytes = (clusters->part_count + 1) * sizeof *clusters->parts;
    struct bd_point_part *parts = realloc(clusters->parts, bytes);
    if (parts) clusters->parts = parts;
}

enum bd_err bd_point_clusters_init(struct bd_point_clusters *clusters,
                                   const struct bd_surface_points *points,
                                   enum bd_err (*pause)(void *user), void *user,
                                   struct bd_err_detail *detail)
{
    const size_t count = points->count;
    struct clustering c = {.clusters = clusters,
                           .points = points,
                           .coded = malloc((count + 1) * sizeof *c.coded),
                           .spare = malloc((count + 1) * sizeof *c.spare),
                           .pause = pause,
                           .user = user};
    *clusters = (struct bd_point_clusters){
        .count = points->count,
        .area = points->area,
        .points = malloc((count + 1) * sizeof *clusters->points),
        .order = malloc((count + 1) * sizeof *clusters->order),
        .names = malloc((count + 1) * sizeof *clusters->names),
        .parts = malloc((2 * count + 1) * sizeof *clusters->parts),
    };
    if (!c.coded || !c.spare || !clusters->points || !clusters->order || !clusters->names ||
        !clusters->parts)
        c.err = bd_err_set(detail, BD_ERR_NO_MEMORY, "points", "no memory for %u", points->count);
    if (!c.err) put_in_order(&c);
    if (!c.err && count > 0) add_part(&c, 0, points->count);
    if (!c.err) keep_points(&c);
    if (!c.err) shrink(clusters);
    free(c.coded);
    free(c.spare);
    if (c.err) bd_point_clusters_finish(clusters);
    return c.err;
}

void bd_point_clusters_finish(struct bd_point_clusters *clusters)
{
    free(clusters->points);
    free(clusters->order);
    free(clusters->names);
    free(clusters->parts);
    *clusters = (struct bd_point_clusters){0};
}

// --- views --------------------------------------------------------------------------------------

// Normals that are one but for so much are one.
#define ONE_NORMAL 0.99999f

void bd_points_about_add(struct bd_points_about *about, f3 position, f3 normal)
{
    struct bd_point_view *view = &about->view;
    if (about->count++ == 0) *view = (struct bd_point_view){{position, position}, normal};
    widen(&view->box, position);
    if (f3_dot(view->normal, normal) < ONE_NORMAL) view->normal = f3_of(0, 0, 0);
}

// --- cuts ---------------------------------------------------------------------------------------

// Parts by how much is to be seen of each, the largest first.
struct heap {
    uint32_t count;
    struct entry {
        float size;
        const struct bd_point_part *part;
    } entries[BD_CLUSTERS_MAX];
};

static bool comes_before(const struct entry *a, const struct entry *b)
{
    return a->size != b->size ? a->size > b->size : a->part->first < b->part->first;
}

static void swap(struct entry *a, struct entry *b)
{
    const struct entry was = *a;
    *a = *b;
    *b = was;
}

static void push(struct heap *heap, struct entry entry)
{
    uint32_t at = heap->count++;
    heap->entries[at] = entry;
    for (; at > 0 && comes_before(&heap->entries[at], &heap->entries[(at - 1) / 2]);
         at = (at - 1) / 2)
        swap(&heap->entries[at], &heap->entries[(at - 1) / 2]);
}

static struct entry pop(struct heap *heap)
{
    const struct entry top = heap->entries[0];
    heap->entries[0] = heap->entries[--heap->count];
    for (uint32_t at = 0, next; (next = 2 * at + 1) < heap->count; at = next) {
        if (next + 1 < heap->count && comes_before(&heap->entries[next + 1], &heap->entries[next]))
            next++;
        if (!comes_before(&heap->entries[next], &heap->entries[at])) break;
        swap(&heap->entries[next], &heap->entries[at]);
    }
    return top;
}

static float gap(float least, float most, float other_least, float other_most)
{
    return f_max(f_max(other_least - most, least - other_most), 0);
}

static float distance2(const struct bd_point_box *a, const struct bd_point_box *b)
{
    const float x = gap(a->least.x, a->most.x, b->least.x, b->most.x);
    const float y = gap(a->least.y, a->most.y, b->least.y, b->most.y);
    const float z = gap(a->least.z, a->most.z, b->least.z, b->most.z);
    return x * x + y * y + z * z;
}

static float farther(float a, float normal, float b, float other)
{
    return f_max(a * normal, b * normal) - other;
}

// How high the box reaches over the lowest plane, at most.
static float height_over(const struct bd_point_box *box, const struct bd_point_view *view)
{
    const f3 n = view->normal, a = view->box.least, b = view->box.most;
    return farther(box->least.x, n.x, box->most.x, f_min(a.x * n.x, b.x * n.x)) +
           farther(box->least.y, n.y, box->most.y, f_min(a.y * n.y, b.y * n.y)) +
           farther(box->least.z, n.z, box->most.z, f_min(a.z * n.z, b.z * n.z));
}

// To one in a thousand: of parts that are as large, as in rooms with a symmetry, the first comes
// first, and not what rounding says. The factor takes round numbers off the steps' edges.
static float roughly(float size)
{
    return f_of_bits(f_bits(size * 1.2345f) & ~0x1fffu);
}

// At most a solid angle, weighed by the cosine, from somewhere in the box; what it touches is
// divided by its points.
static struct entry entry_of(const struct bd_point_clusters *clusters, uint32_t number,
                             const struct bd_point_view *view)
{
    const struct bd_point_part *part = &clusters->parts[number];
    const struct bd_point_box *box = &part->box;
    const float area = clusters->area * (float)part->count;
    if (part->second == 0) return (struct entry){0, part};
    const float r2 = f_max(distance2(box, &view->box), clusters->area);
    if (f3_dot(view->normal, view->normal) == 0) return (struct entry){roughly(area / r2), part};
    const float height = f_max(height_over(box, view), 0);
    // What nobody sees (is_point_seen): of a wall in the plane rounding would say how it is
    // divided.
    if (height * height <= FLAT_2 * r2) return (struct entry){0, part};
    return (struct entry){roughly(area / r2 * f_min(height / f_sqrt(r2), 1)), part};
}

static int by_first(const void *a, const void *b)
{
    const struct bd_point_cluster *x = a, *y = b;
    return (x->first > y->first) - (x->first < y->first);
}

static void cut_evenly(const struct bd_point_clusters *clusters, uint32_t most,
                       struct bd_point_cut *cut)
{
    cut->count = most < clusters->count ? most : clusters->count;
    if (cut->count == 0) return;
    const uint32_t least = clusters->count / cut->count;
    const uint32_t steps[2] = {find_step(least), find_step(least + 1)};
    for (uint32_t k = 0, first = 0; k < cut->count; k++) {
        const uint32_t end = (uint32_t)((uint64_t)clusters->count * (k + 1) / cut->count);
        const uint32_t count = end - first;
        cut->clusters[k] =
            (struct bd_point_cluster){first, count, bd_stirred(k), steps[count - least]};
        first = end;
    }
}

void bd_point_clusters_cut(const struct bd_point_clusters *clusters, uint32_t most,
                           const struct bd_point_view *view, struct bd_point_cut *cut)
{
    struct heap heap;
    heap.count = 0;
    cut->count = 0;
    if (!view) {
        cut_evenly(clusters, most, cut);
        return;
    }
    if (clusters->count > 0) push(&heap, entry_of(clusters, 0, view));
    while (heap.count > 0 && heap.count < most && heap.entries[0].size > 0) {
        const struct bd_point_part *part = pop(&heap).part;
        push(&heap, entry_of(clusters, (uint32_t)(part - clusters->parts) + 1, view));
        push(&heap, entry_of(clusters, part->second, view));
    }
    for (; cut->count < heap.count; cut->count++) {
        const struct bd_point_part *part = heap.entries[cut->count].part;
        cut->clusters[cut->count] =
            (struct bd_point_cluster){part->first, part->count, part->name, part->step};
    }
    qsort(cut->clusters, cut->count, sizeof *cut->clusters, by_first);
}

// --- the nearest --------------------------------------------------------------------------------

struct search {
    const struct bd_point_clusters *clusters;
    f3 position, normal;
    float alike_least; // of the cosine between normals
    float reach2;      // nobody beyond
    float nearest2;    // of the last that is kept, more for what is off the plane
    uint32_t found, *sides, most;
    float *distances2; // of those, in order; NULL: all are kept as they come
};

#define FACES_ALIKE 0.7f
// Of a layer behind or before the place's own a point is ten times as far as in its plane: the
// walls of cupboards are nearer to each other than points.
#define OFF_PLANE 99.0f

// Before those that are farther, of which the last may be too many.
static void keep_in_order(struct search *s, float r2, uint32_t side)
{
    uint32_t at = s->found < s->most ? s->found++ : s->most - 1;
    for (; at > 0 && s->distances2[at - 1] > r2; at--) {
        s->distances2[at] = s->distances2[at - 1];
        s->sides[at] = s->sides[at - 1];
    }
    s->distances2[at] = r2;
    s->sides[at] = side;
    if (s->found == s->most) s->nearest2 = s->distances2[s->most - 1];
}

static void take(struct search *s, float r2, uint32_t side)
{
    if (s->distances2)
        keep_in_order(s, r2, side);
    else if (s->found < s->most)
        s->sides[s->found++] = side;
}

static void look_at_points(struct search *s, const struct bd_point_part *part)
{
    for (uint32_t i = part->first; i < part->first + part->count; i++) {
        const struct bd_projected_point *point = &s->clusters->points[i];
        const f3 way = f3_sub(f3_of(point->x, point->y, point->z), s->position);
        const float off = f3_dot(way, s->normal), r2 = f3_dot(way, way);
        const float more2 = r2 + OFF_PLANE * off * off;
        if (r2 >= s->reach2 || more2 >= s->nearest2) continue;
        const float alike = f3_dot(normal_of_bits(point->normal), s->normal);
        if (f_abs(alike) >= s->alike_least) take(s, more2, 2 * i + (alike < 0));
    }
}

static float distance2_to(const struct search *s, const struct bd_point_part *part)
{
    const struct bd_point_box at = {s->position, s->position};
    return distance2(&part->box, &at);
}

static void look_in(struct search *s, const struct bd_point_part *part)
{
    if (part->second == 0) {
        look_at_points(s, part);
        return;
    }
    const struct bd_point_part *first = part + 1, *second = &s->clusters->parts[part->second];
    const float to_first = distance2_to(s, first), to_second = distance2_to(s, second);
    const bool is_second_nearer = to_second < to_first;
    if (f_min(to_first, to_second) < f_min(s->nearest2, s->reach2))
        look_in(s, is_second_nearer ? second : first);
    if (f_max(to_first, to_second) < f_min(s->nearest2, s->reach2))
        look_in(s, is_second_nearer ? first : second);
}

static uint32_t find(struct search *s, f3 position, f3 normal, float reach)
{
    s->position = position;
    s->normal = normal;
    s->alike_least = FACES_ALIKE * f3_dot(normal, normal);
    s->reach2 = reach * reach;
    s->nearest2 = INFINITY;
    if (s->clusters->count > 0) look_in(s, &s->clusters->parts[0]);
    return s->found;
}

uint32_t bd_point_clusters_nearest(const struct bd_point_clusters *clusters, f3 position, f3 normal,
                                   float reach, uint32_t *sides, uint32_t most)
{
    float distances2[BD_NEAREST_MOST];
    struct search search = {
        .clusters = clusters, .sides = sides, .most = most, .distances2 = distances2};
    BD_ASSERT_CMP(most, <=, BD_NEAREST_MOST);
    return find(&search, position, normal, reach);
}

uint32_t bd_point_clusters_near(const struct bd_point_clusters *clusters, f3 position, f3 normal,
                                float reach)
{
    uint32_t side;
    const uint32_t found = bd_point_clusters_nearest(clusters, position, normal, reach, &side, 1);
    return found > 0 ? side : BD_NO_POINT_NEAR;
}

uint32_t bd_point_clusters_within(const struct bd_point_clusters *clusters, f3 position, f3 normal,
                                  float reach, uint32_t *sides, uint32_t most)
{
    struct search search = {.clusters = clusters, .sides = sides, .most = most};
    return find(&search, position, normal, reach);
}
