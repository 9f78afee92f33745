#include "pass/scene_spans.h"

#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "pass/scene_sieve.h"
#include "shared/instance.h"

#define BOXES_PER_PIECE 16384u
// Chunks that the sieve goes through between two questions whether to stop.
#define CHUNKS_PER_PIECE 32u
// Of a chunk of which the sieve leaves more, all is drawn. A list costs little, another draw as
// much as a hundred triangles.
#define KEPT_MOST       0.95
#define ROW_FLOATS      (4 * BD_INSTANCE_VEC4S)

struct walk {
    struct bd_scene_spans *to;
    const struct bd_gpu_scene *scene;
    const struct bd_viewpoint *viewpoint;
    const struct bd_seen *seen;
    struct bd_view_bounds bounds; // of the viewpoint
    enum bd_err (*pause)(void *user);
    void *user;
    uint32_t asked; // boxes, or chunks
};

static void append(struct bd_scene_spans *to, const struct bd_scene_span *span)
{
    if (to->count == to->count_max) {
        to->count_max = to->count_max ? 2 * to->count_max : 64;
        to->spans = realloc(to->spans, to->count_max * sizeof *to->spans);
        BD_ASSERT(to->spans);
    }
    to->spans[to->count++] = *span;
}

static bool continues(const struct bd_scene_span *last, const struct bd_scene_span *span)
{
    return last->run == span->run && last->instance_count == 1 &&
           last->is_listed == span->is_listed && last->first_instance == span->first_instance &&
           last->first_triangle + last->triangle_count == span->first_triangle;
}

static bool is_next_instance(const struct bd_scene_span *last, const struct bd_scene_span *span)
{
    return last->run == span->run && !last->is_listed &&
           last->triangle_count == span->triangle_count &&
           last->first_instance + last->instance_count == span->first_instance;
}

// The next triangles of an instance, joined to the last span where they continue it; whole
// instances are drawn together.
static void add_triangles(struct walk *walk, const struct bd_scene_span *span)
{
    struct bd_scene_spans *to = walk->to;
    struct bd_scene_span *last = to->count ? &to->spans[to->count - 1] : NULL;
    if (last && continues(last, span))
        last->triangle_count += span->triangle_count;
    else
        append(to, span);
    last = &to->spans[to->count - 1];
    const uint32_t all = walk->scene->order.runs[span->run].triangles_per_instance;
    if (last->is_listed || last->triangle_count != all) return;
    if (to->count < 2 || !is_next_instance(last - 1, last)) return;
    last[-1].instance_count += last->instance_count;
    to->count--;
}

static void add_chunks(struct walk *walk, uint32_t run, uint32_t instance)
{
    const struct bd_scene_draw *draw = &walk->scene->draws[run];
    const float *rows = walk->seen->rows + (size_t)instance * ROW_FLOATS;
    const struct bd_view_bounds bounds =
        bd_view_bounds_in_mesh(&walk->bounds, rows, &draw->mesh->box);
    const uint32_t all = draw->run->triangles_per_instance;
    for (uint32_t first = 0; first < all; first += BD_CHUNK_TRIANGLES) {
        const struct bd_box *box = &draw->primitive->chunks[first / BD_CHUNK_TRIANGLES];
        if (bd_view_bounds_share(&bounds, box) == BD_VIEW_NONE) continue;
        const uint32_t left = all - first;
        const struct bd_scene_span span = {
            .run = run,
            .first_instance = instance,
            .instance_count = 1,
            .first_triangle = first,
            .triangle_count = left < BD_CHUNK_TRIANGLES ? left : BD_CHUNK_TRIANGLES,
        };
        add_triangles(walk, &span);
    }
    walk->asked += all / BD_CHUNK_TRIANGLES;
}

static enum bd_err add_run(struct walk *walk, uint32_t run)
{
    const struct bd_seen_run *seen = &walk->seen->runs[run];
    const uint32_t all = walk->scene->order.runs[run].triangles_per_instance;
    if (seen->count && all <= BD_CHUNK_TRIANGLES) {
        append(walk->to, &(struct bd_scene_span){run, seen->first, seen->count, 0, all, false});
        return BD_ERR_OK;
    }
    enum bd_err err = BD_ERR_OK;
    for (uint32_t i = seen->first; !err && i < seen->first + seen->count; i++) {
        if (walk->seen->instances[i].is_all_seen)
            add_triangles(walk, &(struct bd_scene_span){run, i, 1, 0, all, false});
        else
            add_chunks(walk, run, i);
        if (!walk->pause || ++walk->asked < BOXES_PER_PIECE) continue;
        walk->asked = 0;
        err = walk->pause(walk->user);
    }
    return err;
}

enum bd_err bd_scene_spans_init(struct bd_scene_spans *spans, const struct bd_gpu_scene *scene,
                                const struct bd_viewpoint *viewpoint, const struct bd_seen *seen,
                                enum bd_err (*pause)(void *user), void *user)
{
    struct walk walk = {
        .to = spans,
        .scene = scene,
        .viewpoint = viewpoint,
        .seen = seen,
        .bounds = bd_view_bounds_of(viewpoint, &scene->space),
        .pause = pause,
        .user = user,
    };
    *spans = (struct bd_scene_spans){0};
    enum bd_err err = BD_ERR_OK;
    for (uint32_t r = 0; !err && r < scene->order.run_count; r++) err = add_run(&walk, r);
    return err;
}

double bd_scene_spans_triangles(const struct bd_scene_spans *spans)
{
    double count = 0;
    for (uint32_t s = 0; s < spans->count; s++)
        count += (double)spans->spans[s].triangle_count * spans->spans[s].instance_count;
    return count;
}

// --- the sieve -----------------------------------------------------------------------------

static void make_room(struct bd_scene_spans *to)
{
    if (to->listed + BD_CHUNK_TRIANGLES <= to->listed_max) return;
    to->listed_max = 2 * to->listed_max + 16 * BD_CHUNK_TRIANGLES;
    to->index = realloc(to->index, 3 * sizeof *to->index * to->listed_max);
    to->number = realloc(to->number, sizeof *to->number * to->listed_max);
    BD_ASSERT(to->index && to->number);
}

// `part` is of one instance, and no longer than a chunk.
static void sieve_part(struct walk *walk, const struct bd_sieve *sieve, struct bd_scene_span part)
{
    struct bd_scene_spans *to = walk->to;
    const struct bd_triangle_run *run = &walk->scene->order.runs[part.run];
    const struct bd_primitive *from =
        &walk->scene->scene->meshes[run->mesh]->primitives[run->primitive];
    make_room(to);
    uint32_t kept = bd_sieve_triangles(sieve, from->position, from->index, part.first_triangle,
                                       part.triangle_count, to->index + 3 * (size_t)to->listed,
                                       to->number + to->listed);
    if (kept == 0) return;
    if (kept <= KEPT_MOST * part.triangle_count) {
        part.is_listed = true;
        part.first_triangle = to->listed;
        part.triangle_count = kept;
        to->listed += kept;
    }
    add_triangles(walk, &part);
}

static enum bd_err sieve_instance(struct walk *walk, struct bd_scene_span part)
{
    const struct bd_scene_draw *draw = &walk->scene->draws[part.run];
    const struct bd_sieve sieve =
        bd_sieve_of(walk->viewpoint, &walk->scene->space,
                    walk->seen->rows + (size_t)part.first_instance * ROW_FLOATS, &draw->mesh->box);
    const uint32_t end = part.first_triangle + part.triangle_count;
    enum bd_err err = BD_ERR_OK;
    while (!err && part.first_triangle < end) {
        const uint32_t left = end - part.first_triangle;
        part.triangle_count = left < BD_CHUNK_TRIANGLES ? left : BD_CHUNK_TRIANGLES;
        sieve_part(walk, &sieve, part);
        part.first_triangle += part.triangle_count;
        if (!walk->pause || ++walk->asked < CHUNKS_PER_PIECE) continue;
        walk->asked = 0;
        err = walk->pause(walk->user);
    }
    return err;
}

static enum bd_err sieve_span(struct walk *walk, const struct bd_scene_span *span)
{
    const uint32_t all = walk->scene->order.runs[span->run].triangles_per_instance;
    if (all <= BD_CHUNK_TRIANGLES || all > BD_SIEVE_TRIANGLES_MAX) {
        append(walk->to, span);
        return BD_ERR_OK;
    }
    enum bd_err err = BD_ERR_OK;
    struct bd_scene_span part = *span;
    part.instance_count = 1;
    for (uint32_t i = 0; !err && i < span->instance_count; i++, part.first_instance++)
        err = sieve_instance(walk, part);
    return err;
}

enum bd_err bd_scene_spans_sieve(struct bd_scene_spans *spans, const struct bd_gpu_scene *scene,
                                 const struct bd_viewpoint *viewpoint, const struct bd_seen *seen,
                                 enum bd_err (*pause)(void *user), void *user)
{
    struct bd_scene_spans sieved = {0};
    struct walk walk = {
        .to = &sieved,
        .scene = scene,
        .viewpoint = viewpoint,
        .seen = seen,
        .pause = pause,
        .user = user,
    };
    enum bd_err err = BD_ERR_OK;
    for (uint32_t s = 0; !err && s < spans->count; s++) err = sieve_span(&walk, &spans->spans[s]);
    // The device reads four at a time.
    if (sieved.listed) memset(sieved.number + sieved.listed, 0, 3 * sizeof *sieved.number);
    bd_scene_spans_finish(spans);
    *spans = sieved;
    return err;
}

void bd_scene_spans_finish(struct bd_scene_spans *spans)
{
    free(spans->spans);
    free(spans->index);
    free(spans->number);
    *spans = (struct bd_scene_spans){0};
}
