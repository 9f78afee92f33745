// New places for a mesh's vertices: what follows from them, made again.

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/vec.h"
#include "scene/edit/edit.h"
#include "scene/model/primitive.h"

static enum bd_err check_vectors(const float *values, uint32_t vertex_count, const char *field,
                                 const char *stream, struct bd_err_detail *detail)
{
    const float most = (float)BD_COORDINATE_MAX_M;
    for (size_t i = 0; i < 3 * (size_t)vertex_count; i++) {
        if (fabsf(values[i]) <= most) continue;
        char path[128];
        snprintf(path, sizeof path, "%.80s.%s", field, stream);
        return bd_err_set(detail, BD_ERR_USAGE, path, "%s: number %zu, %.9g, is not in [%g, %g]",
                          path, i, (double)values[i], (double)-most, (double)most);
    }
    return BD_ERR_OK;
}

static struct bd_mesh *copy_mesh(const struct bd_mesh *from)
{
    struct bd_mesh *to = calloc(1, sizeof *to);
    if (!to) return NULL;
    to->reference_count = 1;
    memcpy(to->name, from->name, sizeof to->name);
    to->primitives = calloc(from->primitive_count + (size_t)1, sizeof *to->primitives);
    bool ok = to->primitives != NULL;
    for (uint32_t p = 0; ok && p < from->primitive_count; p++) {
        to->primitive_count = p + 1;
        ok = bd_primitive_copy(&from->primitives[p], &to->primitives[p]);
    }
    if (!ok) bd_mesh_release(&to);
    return to;
}

// --- smooth where it was --------------------------------------------------------------------

// Vertices that lay at one place with one normal were one: they share a normal afterwards too. (An
// importer splits vertices at the seams of texture coordinates and of tangents.)
struct place {
    float values[6]; // position and normal, as they were
    uint32_t vertex;
};

// By value: a zero is one place, whichever sign it has.
static int compare_values(const struct place *a, const struct place *b)
{
    for (int i = 0; i < 6; i++)
        if (a->values[i] != b->values[i]) return a->values[i] < b->values[i] ? -1 : 1;
    return 0;
}

static int compare_places(const void *a, const void *b)
{
    const struct place *left = a, *right = b;
    int order = compare_values(left, right);
    return order ? order : (left->vertex > right->vertex) - (left->vertex < right->vertex);
}

// The first vertex of each vertex's place. NULL without memory.
static uint32_t *weld(const struct bd_primitive *before)
{
    const uint32_t count = before->vertex_count;
    struct place *places = malloc((count + (size_t)1) * sizeof *places);
    uint32_t *first = malloc((count + (size_t)1) * sizeof *first);
    for (uint32_t v = 0; places && first && v < count; v++) {
        memcpy(places[v].values, before->position + 3 * (size_t)v, 3 * sizeof(float));
        memcpy(places[v].values + 3, before->normal + 3 * (size_t)v, 3 * sizeof(float));
        places[v].vertex = v;
    }
    if (places && first && count) {
        qsort(places, count, sizeof *places, compare_places);
        for (uint32_t i = 0, head = 0; i < count; i++) {
            if (compare_values(&places[i], &places[head]) != 0) head = i;
            first[places[i].vertex] = places[head].vertex;
        }
    }
    bool ok = places && first;
    free(places);
    if (ok) return first;
    free(first);
    return NULL;
}

static bd_dvec3 at(const float *stream, uint32_t v)
{
    const float *p = stream + 3 * (size_t)v;
    return (bd_dvec3){p[0], p[1], p[2]};
}

// Sums of the triangles' normals by area. What no triangle gives one keeps the one it had.
static bool make_normals(const struct bd_primitive *before, struct bd_primitive *primitive)
{
    uint32_t *first = weld(before);
    bd_dvec3 *sums = calloc(primitive->vertex_count + (size_t)1, sizeof *sums);
    bool ok = first && sums;
    for (uint32_t i = 0; ok && i < primitive->index_count; i += 3) {
        const uint32_t *corner = primitive->index + i;
        bd_dvec3 a = at(primitive->position, corner[0]);
        bd_dvec3 n = bd_dvec3_cross(bd_dvec3_sub(at(primitive->position, corner[1]), a),
                                    bd_dvec3_sub(at(primitive->position, corner[2]), a));
        for (int c = 0; c < 3; c++)
            sums[first[corner[c]]] = bd_dvec3_add(sums[first[corner[c]]], n);
    }
    for (uint32_t v = 0; ok && v < primitive->vertex_count; v++) {
        bd_dvec3 n = bd_dvec3_normalize(sums[first[v]], at(before->normal, v));
        float *out = primitive->normal + 3 * (size_t)v;
        out[0] = (float)n.x, out[1] = (float)n.y, out[2] = (float)n.z;
    }
    free(first);
    free(sums);
    return ok;
}

static void take_normals(const float *normals, struct bd_primitive *primitive)
{
    for (uint32_t v = 0; v < primitive->vertex_count; v++) {
        bd_dvec3 n = bd_dvec3_normalize(at(normals, v), at(primitive->normal, v));
        float *out = primitive->normal + 3 * (size_t)v;
        out[0] = (float)n.x, out[1] = (float)n.y, out[2] = (float)n.z;
    }
}

// A tangent keeps its handedness and its way along the surface: it is turned as its normal turned,
// by being laid into the new plane. That keeps every vertex, which making them anew need not.
static void turn_tangents(struct bd_primitive *primitive)
{
    for (uint32_t v = 0; primitive->tangent && v < primitive->vertex_count; v++) {
        float *t = primitive->tangent + 4 * (size_t)v;
        bd_dvec3 n = at(primitive->normal, v), was = {t[0], t[1], t[2]};
        bd_dvec3 flat = bd_dvec3_sub(was, bd_dvec3_scale(n, bd_dvec3_dot(was, n)));
        bd_dvec3 turned = bd_dvec3_normalize(flat, was);
        t[0] = (float)turned.x, t[1] = (float)turned.y, t[2] = (float)turned.z;
    }
}

static enum bd_err deform(const struct bd_mesh *mesh, uint32_t index, const float *positions,
                          const float *normals, const char *field, struct bd_mesh **out,
                          struct bd_err_detail *detail)
{
    struct bd_mesh *made = copy_mesh(mesh);
    bool ok = made != NULL;
    if (ok) {
        struct bd_primitive *primitive = &made->primitives[index];
        memcpy(primitive->position, positions,
               3 * (size_t)primitive->vertex_count * sizeof *positions);
        if (normals)
            take_normals(normals, primitive);
        else
            ok = make_normals(&mesh->primitives[index], primitive);
        turn_tangents(primitive);
    }
    if (!ok) {
        bd_mesh_release(&made);
        return bd_err_set(detail, BD_ERR_NO_MEMORY, field, "%s: no memory for the mesh", field);
    }
    bd_mesh_seal(made);
    *out = made;
    return BD_ERR_OK;
}

enum bd_err bd_edit_deform_mesh(const struct bd_mesh *mesh, uint32_t primitive,
                                const float *positions, const float *normals, uint32_t vertex_count,
                                const char *field, struct bd_mesh **out,
                                struct bd_err_detail *detail)
{
    char path[128];
    *out = NULL;
    snprintf(path, sizeof path, "%.80s.primitive", field);
    if (primitive >= mesh->primitive_count)
        return bd_err_set(detail, BD_ERR_NOT_FOUND, path, "%s: the mesh has %u primitives", path,
                          mesh->primitive_count);
    snprintf(path, sizeof path, "%.80s.positions", field);
    if (vertex_count != mesh->primitives[primitive].vertex_count)
        return bd_err_set(detail, BD_ERR_USAGE, path, "%s: %u vertices, the primitive has %u", path,
                          vertex_count, mesh->primitives[primitive].vertex_count);
    enum bd_err err = check_vectors(positions, vertex_count, field, "positions", detail);
    if (err == BD_ERR_OK && normals)
        err = check_vectors(normals, vertex_count, field, "normals", detail);
    if (err != BD_ERR_OK) return err;
    return deform(mesh, primitive, positions, normals, field, out, detail);
}
