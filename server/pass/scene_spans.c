#include "pass/scene_spans.h"

#include <stdlib.h>

#include "base/assert.h"
#include "shared/instance.h"

#define BOXES_PER_PIECE 16384u
#define ROW_FLOATS      (4 * BD_INSTANCE_VEC4S)

struct walk {
    struct bd_scene_spans *to;
    const struct bd_gpu_scene *scene;
    const struct bd_seen *seen;
    struct bd_view_bounds bounds; // of the viewpoint
    enum bd_err (*pause)(void *user);
    void *user;
    uint32_t asked; // boxes
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
           last->first_instance == span->first_instance &&
           last->first_triangle + last->triangle_count == span->first_triangle;
}

static bool is_next_instance(const struct bd_scene_span *last, const struct bd_scene_span *span)
{
    return last->run == span->run && last->triangle_count == span->triangle_count &&
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
    if (to->count < 2 || last->triangle_count != all || !is_next_instance(last - 1, last)) return;
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
        const struct bd_scene_span span = {run, instance, 1, first,
                                           left < BD_CHUNK_TRIANGLES ? left : BD_CHUNK_TRIANGLES};
        add_triangles(walk, &span);
    }
    walk->asked += all / BD_CHUNK_TRIANGLES;
}

static enum bd_err add_run(struct walk *walk, uint32_t run)
{
    const struct bd_seen_run *seen = &walk->seen->runs[run];
    const uint32_t all = walk->scene->order.runs[run].triangles_per_instance;
    if (seen->count && all <= BD_CHUNK_TRIANGLES) {
        append(walk->to, &(struct bd_scene_span){run, seen->first, seen->count, 0, all});
        return BD_ERR_OK;
    }
    enum bd_err err = BD_ERR_OK;
    for (uint32_t i = seen->first; !err && i < seen->first + seen->count; i++) {
        if (walk->seen->instances[i].is_all_seen)
            add_triangles(walk, &(struct bd_scene_span){run, i, 1, 0, all});
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

void bd_scene_spans_finish(struct bd_scene_spans *spans)
{
    free(spans->spans);
    *spans = (struct bd_scene_spans){0};
}
