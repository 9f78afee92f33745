#include "lights/point_clusters.h"

#include <stdlib.h>

#include "kernel/projected_point.h"
#include "lights/point_halves.h"

// Parts of so few are not divided.
#define PART_LEAST 4u

// A part of all points, and its number in the tree.
struct part {
    uint32_t number, first, count;
};

struct clustering {
    struct bd_point_clusters *clusters;
    struct bd_point_node *nodes;
    struct part *parts; // of one level of the tree, the largest last
    uint32_t part_count, next;
    struct bd_pool *pool;
    enum bd_err (*pause)(void *user);
    void *user;
    enum bd_err err;
};

static struct part half_of(const struct part *part, bool is_second)
{
    const uint32_t half = part->count / 2;
    return is_second ? (struct part){2 * part->number + 2, part->first + half, part->count - half}
                     : (struct part){2 * part->number + 1, part->first, half};
}

static bool has_halves(const struct part *part)
{
    return part->count > PART_LEAST;
}

// Numbers of parts of so many points are below it.
static uint32_t numbers_of(uint32_t count)
{
    uint32_t numbers = 1;
    for (uint32_t largest = count; largest > PART_LEAST; largest = largest - largest / 2)
        numbers = 2 * numbers + 1;
    return numbers;
}

// --- making them --------------------------------------------------------------------------------

static void widen(struct bd_point_box *box, f3 at)
{
    box->least =
        f3_of(f_min(box->least.x, at.x), f_min(box->least.y, at.y), f_min(box->least.z, at.z));
    box->most = f3_of(f_max(box->most.x, at.x), f_max(box->most.y, at.y), f_max(box->most.z, at.z));
}

static struct bd_point_box box_of(const struct bd_point_node *nodes, uint32_t count)
{
    struct bd_point_box box = {nodes[0].position, nodes[0].position};
    for (uint32_t i = 1; i < count; i++) widen(&box, nodes[i].position);
    return box;
}

static void divide_once(const struct clustering *c, const struct part *part)
{
    struct bd_point_node *nodes = c->nodes + part->first;
    c->clusters->boxes[part->number] = box_of(nodes, part->count);
    if (part->count > 1) bd_point_halves(nodes, part->count, part->count / 2);
}

static void divide_whole(const struct clustering *c, const struct part *part)
{
    divide_once(c, part);
    if (!has_halves(part)) return;
    const struct part first = half_of(part, false), second = half_of(part, true);
    divide_whole(c, &first);
    divide_whole(c, &second);
}

static void divide_large(void *user, uint32_t i)
{
    const struct clustering *c = user;
    divide_once(c, &c->parts[c->next + i]);
}

static void divide_small(void *user, uint32_t i)
{
    const struct clustering *c = user;
    divide_whole(c, &c->parts[c->next + i]);
}

// As many small parts between two pauses as take no longer than a large one.
#define SMALL_AT_ONCE 4u

static void divide_parts(struct clustering *c, void (*divide)(void *user, uint32_t i),
                         uint32_t at_once)
{
    const uint32_t most = at_once * bd_pool_thread_count(c->pool);
    for (c->next = 0; !c->err && c->next < c->part_count; c->next += most) {
        const uint32_t left = c->part_count - c->next;
        c->err = c->pause(c->user);
        if (!c->err) c->err = bd_pool_run(c->pool, left < most ? left : most, divide, NULL, c);
    }
}

static void go_down(struct clustering *c)
{
    for (uint32_t i = c->part_count; i-- > 0;) {
        const struct part whole = c->parts[i];
        c->parts[2 * i] = half_of(&whole, false);
        c->parts[2 * i + 1] = half_of(&whole, true);
    }
    c->part_count *= 2;
}

// Level by level where parts are large, so that threads have some each; small ones whole.
static void divide(struct clustering *c)
{
    while (!c->err && c->parts[c->part_count - 1].count >= BD_POINTS_TO_PAUSE) {
        divide_parts(c, divide_large, 1);
        go_down(c);
    }
    divide_parts(c, divide_small, SMALL_AT_ONCE);
}

// Parts of a level are alike but for one point: the last that is divided has no part below this.
static size_t parts_most(uint32_t count)
{
    return count / ((BD_POINTS_TO_PAUSE - 1) / 2) + 2;
}

static void keep_points(struct clustering *c, const struct bd_surface_points *points)
{
    for (uint32_t i = 0; i < points->count; i++) {
        const uint32_t point = c->nodes[i].point;
        const struct bd_surface_point *from = &points->points[point];
        c->clusters->order[i] = point;
        c->clusters->points[i] = (struct bd_projected_point){
            .x = from->position.x,
            .y = from->position.y,
            .z = from->position.z,
            .normal = bits_of_normal(from->normal),
        };
    }
}

enum bd_err bd_point_clusters_init(struct bd_point_clusters *clusters,
                                   const struct bd_surface_points *points, struct bd_pool *pool,
                                   enum bd_err (*pause)(void *user), void *user,
                                   struct bd_err_detail *detail)
{
    const uint32_t count = points->count;
    struct clustering c = {
        .clusters = clusters,
        .nodes = malloc((count + 1) * sizeof *c.nodes),
        .parts = malloc(parts_most(count) * sizeof *c.parts),
        .part_count = 1,
        .pool = pool,
        .pause = pause,
        .user = user,
    };
    *clusters = (struct bd_point_clusters){
        .count = count,
        .area = points->area,
        .points = malloc((count + 1) * sizeof *clusters->points),
        .order = malloc((count + 1) * sizeof *clusters->order),
        .boxes = malloc(numbers_of(count) * sizeof *clusters->boxes),
    };
    if (!c.nodes || !c.parts || !clusters->points || !clusters->order || !clusters->boxes)
        c.err = bd_err_set(detail, BD_ERR_NO_MEMORY, "points", "no memory for %u", count);
    for (uint32_t i = 0; !c.err && i < count; i++)
        c.nodes[i] = (struct bd_point_node){points->points[i].position, points->points[i].normal,
                                            i & 0x3fffffffu, 0};
    if (!c.err) c.parts[0] = (struct part){0, 0, count};
    if (!c.err && count > 0) divide(&c);
    if (!c.err) keep_points(&c, points);
    free(c.nodes);
    free(c.parts);
    if (c.err) bd_point_clusters_finish(clusters);
    return c.err;
}

void bd_point_clusters_finish(struct bd_point_clusters *clusters)
{
    free(clusters->points);
    free(clusters->order);
    free(clusters->boxes);
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
        struct part part;
    } entries[BD_CLUSTERS_MAX];
};

static bool comes_before(const struct entry *a, const struct entry *b)
{
    return a->size != b->size ? a->size > b->size : a->part.first < b->part.first;
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
static struct entry entry_of(const struct bd_point_clusters *clusters, struct part part,
                             const struct bd_point_view *view)
{
    const float area = clusters->area * (float)part.count;
    if (!has_halves(&part)) return (struct entry){0, part};
    if (!view) return (struct entry){area, part};
    const struct bd_point_box *box = &clusters->boxes[part.number];
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

void bd_point_clusters_cut(const struct bd_point_clusters *clusters, uint32_t most,
                           const struct bd_point_view *view, struct bd_point_cut *cut)
{
    struct heap heap;
    heap.count = 0;
    cut->count = 0;
    if (clusters->count > 0)
        push(&heap, entry_of(clusters, (struct part){0, 0, clusters->count}, view));
    while (heap.count > 0 && heap.count < most && heap.entries[0].size > 0) {
        const struct part part = pop(&heap).part;
        push(&heap, entry_of(clusters, half_of(&part, false), view));
        push(&heap, entry_of(clusters, half_of(&part, true), view));
    }
    for (; cut->count < heap.count; cut->count++) {
        const struct part *part = &heap.entries[cut->count].part;
        cut->clusters[cut->count] = (struct bd_point_cluster){part->first, part->count};
    }
    qsort(cut->clusters, cut->count, sizeof *cut->clusters, by_first);
}

// --- the nearest --------------------------------------------------------------------------------

struct search {
    const struct bd_point_clusters *clusters;
    f3 position, normal;
    float alike_least; // of the cosine between normals
    float r2;          // of the nearest so far
    uint32_t found;
};

#define FACES_ALIKE 0.7f

static void look_at_points(struct search *s, const struct part *part)
{
    for (uint32_t i = part->first; i < part->first + part->count; i++) {
        const struct bd_projected_point *point = &s->clusters->points[i];
        const f3 way = f3_sub(f3_of(point->x, point->y, point->z), s->position);
        const float r2 = f3_dot(way, way), alike = f3_dot(normal_of_bits(point->normal), s->normal);
        if (r2 >= s->r2 || f_abs(alike) < s->alike_least) continue;
        s->r2 = r2;
        s->found = 2 * i + (alike < 0);
    }
}

static float distance2_to(const struct search *s, const struct part *part)
{
    const struct bd_point_box at = {s->position, s->position};
    return distance2(&s->clusters->boxes[part->number], &at);
}

static void look_in(struct search *s, const struct part *part)
{
    if (!has_halves(part)) {
        look_at_points(s, part);
        return;
    }
    const struct part first = half_of(part, false), second = half_of(part, true);
    const float to_first = distance2_to(s, &first), to_second = distance2_to(s, &second);
    const bool is_second_nearer = to_second < to_first;
    if (f_min(to_first, to_second) < s->r2) look_in(s, is_second_nearer ? &second : &first);
    if (f_max(to_first, to_second) < s->r2) look_in(s, is_second_nearer ? &first : &second);
}

uint32_t bd_point_clusters_near(const struct bd_point_clusters *clusters, f3 position, f3 normal,
                                float reach)
{
    const struct part all = {0, 0, clusters->count};
    struct search search = {.clusters = clusters,
                            .position = position,
                            .normal = normal,
                            .alike_least = FACES_ALIKE * f3_dot(normal, normal),
                            .r2 = reach * reach,
                            .found = BD_NO_POINT_NEAR};
    if (clusters->count > 0) look_in(&search, &all);
    return search.found;
}
