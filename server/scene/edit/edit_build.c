// Meshes of edits, built from the streams that were sent.

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "scene/edit/edit.h"
#include "scene/mesh/mesh.h"

// One primitive on its way: `path` is "ops[0].add_mesh.primitives[2]".
struct build {
    const struct bd_primitive_source *from;
    struct bd_primitive *to;
    char path[96];
    enum bd_err err;
    struct bd_err_detail *detail;
};

static void fail(struct build *build, enum bd_err err, const char *field, const char *what)
{
    char path[128];
    if (build->err != BD_ERR_OK) return;
    snprintf(path, sizeof path, "%s.%s", build->path, field);
    build->err = bd_err_set(build->detail, err, path, "%s: %s", path, what);
}

// Copies a stream whose numbers lie in [least, most]; nothing where there is none.
static void copy_floats(struct build *build, const char *field, const float *from, uint32_t width,
                        float least, float most, float **to)
{
    const size_t count = (size_t)build->from->vertex_count * width;
    char what[96];
    if (!from || build->err != BD_ERR_OK) return;
    *to = malloc(count ? count * sizeof **to : 1);
    if (!*to) {
        fail(build, BD_ERR_NO_MEMORY, field, "no memory");
        return;
    }
    for (size_t i = 0; i < count; i++) {
        (*to)[i] = from[i];
        if (from[i] >= least && from[i] <= most) continue;
        snprintf(what, sizeof what, "number %zu, %.9g, is not in [%.9g, %.9g]", i, (double)from[i],
                 (double)least, (double)most);
        fail(build, BD_ERR_USAGE, field, what);
        return;
    }
}

// Without indices the vertices are the corners, one after the other.
static void copy_indices(struct build *build)
{
    const struct bd_primitive_source *from = build->from;
    const uint32_t count = from->indices ? from->index_count : from->vertex_count;
    char what[64];
    if (count % 3 != 0) {
        snprintf(what, sizeof what, "%u corners are no triangles", count);
        fail(build, BD_ERR_USAGE, from->indices ? "indices" : "positions", what);
    }
    if (build->err != BD_ERR_OK) return;
    uint32_t *index = malloc((count + (size_t)1) * sizeof *index);
    if (!index) {
        fail(build, BD_ERR_NO_MEMORY, "indices", "no memory");
        return;
    }
    build->to->index = index;
    build->to->index_count = count;
    for (uint32_t i = 0; i < count; i++) {
        index[i] = from->indices ? from->indices[i] : i;
        if (index[i] < from->vertex_count) continue;
        snprintf(what, sizeof what, "index %u is %u, there are %u vertices", i, index[i],
                 from->vertex_count);
        fail(build, BD_ERR_USAGE, "indices", what);
        return;
    }
}

// Normals that are not given become smooth over the vertices that triangles share, and not flat as
// the importer's: a mesh whose vertices will be streamed keeps those that were sent.
static bool make_normals(struct build *build, struct bd_mesh_repairs *repairs)
{
    struct bd_primitive *to = build->to;
    if (!to->normal) to->normal = calloc(3 * (size_t)to->vertex_count + 1, sizeof *to->normal);
    return to->normal && bd_mesh_repair_normals(to, repairs); // zeros are made from the triangles
}

// What else is missing is made as the importer makes it.
static void complete(struct build *build, struct bd_mesh_repairs *repairs)
{
    struct bd_primitive *to = build->to;
    bd_mesh_clean_triangles(to, repairs);
    bool ok = make_normals(build, repairs);
    if (ok && to->tangent)
        bd_mesh_repair_tangents(to, repairs);
    else if (ok && to->uv[0])
        ok = bd_mesh_make_tangents(to, 0);
    if (!ok) fail(build, BD_ERR_NO_MEMORY, "positions", "no memory");
}

static void build_primitive(struct build *build)
{
    const float most_m = (float)BD_COORDINATE_MAX_M, most = 1e9f; // as the importer's
    const struct bd_primitive_source *from = build->from;
    struct bd_mesh_repairs repairs = {0};
    build->to->material = from->material;
    build->to->vertex_count = from->vertex_count;
    if (!from->positions) fail(build, BD_ERR_USAGE, "positions", "are needed");
    copy_floats(build, "positions", from->positions, 3, -most_m, most_m, &build->to->position);
    copy_floats(build, "normals", from->normals, 3, -most, most, &build->to->normal);
    // Tangents without normals mean nothing.
    copy_floats(build, "tangents", from->normals ? from->tangents : NULL, 4, -most, most,
                &build->to->tangent);
    copy_floats(build, "uv0", from->uv[0], 2, -most, most, &build->to->uv[0]);
    copy_floats(build, "uv1", from->uv[1], 2, -most, most, &build->to->uv[1]);
    copy_floats(build, "colors", from->colors, 4, 0, 1, &build->to->color);
    copy_indices(build);
    if (build->err == BD_ERR_OK) complete(build, &repairs);
}

enum bd_err bd_edit_build_mesh(const struct bd_primitive_source *primitives, uint32_t count,
                               const char *field, struct bd_mesh **out,
                               struct bd_err_detail *detail)
{
    *out = NULL;
    struct bd_mesh *mesh = calloc(1, sizeof *mesh);
    struct bd_primitive *made = calloc(count + (size_t)1, sizeof *made);
    if (!mesh || !made) {
        free(mesh);
        free(made);
        return bd_err_set(detail, BD_ERR_NO_MEMORY, field, "%s: no memory for the mesh", field);
    }
    *mesh = (struct bd_mesh){.reference_count = 1, .primitive_count = count, .primitives = made};
    enum bd_err err = BD_ERR_OK;
    for (uint32_t p = 0; p < count && err == BD_ERR_OK; p++) {
        struct build build = {.from = &primitives[p], .to = &made[p], .detail = detail};
        snprintf(build.path, sizeof build.path, "%.64s.primitives[%u]", field, p);
        build_primitive(&build);
        err = build.err;
    }
    if (err != BD_ERR_OK) {
        bd_mesh_release(&mesh);
        return err;
    }
    bd_mesh_seal(mesh);
    *out = mesh;
    return BD_ERR_OK;
}
