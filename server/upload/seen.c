#include "upload/seen.h"

#include <math.h>
#include <stdlib.h>

#include "base/assert.h"
#include "shared/instance.h"

#define INSTANCES_PER_PIECE 4096u
#define ROW_FLOATS          (4 * BD_INSTANCE_VEC4S)

// Rows of view_from_mesh in render units, composed in double: relative to the viewpoint from the
// start, so that what is near it is precise wherever both are.
static void store_view_rows(const struct bd_viewpoint *viewpoint, double render_per_m,
                            const bd_dmat4 *world_from_mesh, float rows[12])
{
    const bd_dvec3 axes[3] = {viewpoint->axis_x, viewpoint->axis_y, viewpoint->axis_z};
    const double *m = world_from_mesh->m;
    const bd_dvec3 columns[3] = {{m[0], m[1], m[2]}, {m[4], m[5], m[6]}, {m[8], m[9], m[10]}};
    const bd_dvec3 offset = bd_dvec3_sub((bd_dvec3){m[12], m[13], m[14]}, viewpoint->position_m);
    for (int r = 0; r < 3; r++) {
        for (int c = 0; c < 3; c++)
            rows[4 * r + c] = (float)(bd_dvec3_dot(axes[r], columns[c]) * render_per_m);
        rows[4 * r + 3] = (float)(bd_dvec3_dot(axes[r], offset) * render_per_m);
    }
}

// Cofactors of the upper 3x3, scaled to a largest element of 1: lengths are renormalised per
// fragment, and squares of a scale of 1e-20 would leave the range of float.
static void store_normal_rows(const bd_dmat4 *world_from_mesh, float rows[12])
{
    const double *m = world_from_mesh->m;
    const bd_dvec3 x = {m[0], m[1], m[2]}, y = {m[4], m[5], m[6]}, z = {m[8], m[9], m[10]};
    double sign = bd_dmat4_determinant3(world_from_mesh) < 0 ? -1 : 1;
    const bd_dvec3 cofactor[3] = {bd_dvec3_cross(y, z), bd_dvec3_cross(z, x), bd_dvec3_cross(x, y)};
    double largest = 0;
    for (int c = 0; c < 3; c++)
        largest = fmax(largest,
                       fmax(fabs(cofactor[c].x), fmax(fabs(cofactor[c].y), fabs(cofactor[c].z))));
    double scale = largest > 0 ? sign / largest : 0;
    for (int c = 0; c < 3; c++) {
        rows[0 + c] = (float)(cofactor[c].x * scale);
        rows[4 + c] = (float)(cofactor[c].y * scale);
        rows[8 + c] = (float)(cofactor[c].z * scale);
    }
    rows[3] = rows[7] = rows[11] = 0;
}

// Of the instances of one group, which several runs may share.
struct group {
    const struct bd_gpu_mesh *mesh;
    uint32_t first, count;
};

// Where a view's instances are gathered.
struct gathering {
    const struct bd_gpu_scene *scene;
    const struct bd_viewpoint *viewpoint;
    struct bd_view_bounds bounds;
    enum bd_err (*pause)(void *user);
    void *user;
    uint32_t asked;      // instances
    uint32_t *attribute; // BD_INSTANCE_ATTRIBUTES each
};

static void add_instance(struct bd_seen *seen, const struct gathering *from,
                         const struct group *group, uint32_t place)
{
    const struct bd_scene *scene = from->scene->scene;
    const struct bd_instance *instance = &scene->instances[from->scene->order.instances[place]];
    float *rows = seen->rows + (size_t)seen->count * ROW_FLOATS;
    store_view_rows(from->viewpoint, from->scene->space.render_per_m, &instance->world_from_mesh,
                    rows);
    const struct bd_view_bounds bounds =
        bd_view_bounds_in_mesh(&from->bounds, rows, &group->mesh->box);
    enum bd_view_share share = bd_view_bounds_share(&bounds, &group->mesh->box);
    if (share == BD_VIEW_NONE) return; // the next one's rows come here
    store_normal_rows(&instance->world_from_mesh, rows + 12);
    uint32_t *attribute = from->attribute + (size_t)seen->count * BD_INSTANCE_ATTRIBUTES;
    attribute[0] = seen->count;
    attribute[1] = place - group->first;
    seen->instances[seen->count++] =
        (struct bd_seen_instance){.place = place, .is_all_seen = share == BD_VIEW_ALL};
}

static enum bd_err add_group(struct bd_seen *seen, struct gathering *from,
                             const struct group *group)
{
    enum bd_err err = BD_ERR_OK;
    for (uint32_t i = 0; !err && i < group->count; i++) {
        add_instance(seen, from, group, group->first + i);
        if (from->pause && ++from->asked % INSTANCES_PER_PIECE == 0) err = from->pause(from->user);
    }
    return err;
}

// Runs of one group stand one after the other, and see the same instances.
static enum bd_err add_all(struct bd_seen *seen, struct gathering *from)
{
    const struct bd_triangle_order *order = &from->scene->order;
    enum bd_err err = BD_ERR_OK;
    for (uint32_t r = 0; !err && r < order->run_count; r++) {
        const struct bd_triangle_run *run = &order->runs[r];
        const bool begins = r == 0 || run->first_instance != run[-1].first_instance;
        if (!begins) {
            seen->runs[r] = seen->runs[r - 1];
            continue;
        }
        const struct group group = {from->scene->meshes[run->mesh], run->first_instance,
                                    run->instance_count};
        const uint32_t first = seen->count;
        err = add_group(seen, from, &group);
        seen->runs[r] = (struct bd_seen_run){first, seen->count - first};
    }
    return err;
}

static enum bd_err bring(struct bd_seen *seen, struct bd_gpu *gpu, const uint32_t *attribute,
                         struct bd_err_detail *detail)
{
    const size_t count = seen->count ? seen->count : 1; // buffers are never empty
    enum bd_err err = bd_buf_create(gpu, "instances", count * ROW_FLOATS * sizeof *seen->rows,
                                    seen->rows, &seen->array, detail);
    if (err) return err;
    return bd_buf_create(gpu, "instance ids", count * BD_INSTANCE_ATTRIBUTES * sizeof *attribute,
                         attribute, &seen->attribute, detail);
}

enum bd_err bd_seen_init(struct bd_seen *seen, struct bd_gpu *gpu, const struct bd_gpu_scene *scene,
                         const struct bd_viewpoint *viewpoint, enum bd_err (*pause)(void *user),
                         void *user, struct bd_err_detail *detail)
{
    const size_t most = (size_t)scene->order.instance_count + 1;
    *seen = (struct bd_seen){
        .instances = calloc(most, sizeof *seen->instances),
        .runs = calloc((size_t)scene->order.run_count + 1, sizeof *seen->runs),
        .rows = calloc(most, ROW_FLOATS * sizeof *seen->rows),
    };
    struct gathering from = {
        .scene = scene,
        .viewpoint = viewpoint,
        .bounds = bd_view_bounds_of(viewpoint, &scene->space),
        .pause = pause,
        .user = user,
        .attribute = calloc(most, BD_INSTANCE_ATTRIBUTES * sizeof *from.attribute),
    };
    BD_ASSERT(seen->instances && seen->runs && seen->rows && from.attribute);
    enum bd_err err = add_all(seen, &from);
    if (!err) err = bring(seen, gpu, from.attribute, detail);
    free(from.attribute);
    return err;
}

void bd_seen_finish(struct bd_seen *seen, struct bd_gpu *gpu)
{
    bd_buf_destroy(gpu, &seen->array);
    bd_buf_destroy(gpu, &seen->attribute);
    free(seen->instances);
    free(seen->runs);
    free(seen->rows);
    *seen = (struct bd_seen){0};
}
