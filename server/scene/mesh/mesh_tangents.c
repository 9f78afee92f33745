// Tangents as MikkTSpace makes them, near enough: corners with equal position, normal and texture
// coordinates share one tangent a winding of the map, the sum of their triangles' tangents in the
// plane of the normal, weighted by the corner's angle. Unlike MikkTSpace, corners that meet in a
// point only (not along edges) share too. Debian has no package of the original.

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "scene/mesh/mesh.h"

struct corner_key {
    float values[8]; // position, normal, uv
    uint32_t vertex;
};

// Sums for the two windings of the map; MikkTSpace never mixes them.
struct sums {
    bd_dvec3 tangent[2];
    bool used[2];
};

static bd_dvec3 vec(const float *v)
{
    return (bd_dvec3){v[0], v[1], v[2]};
}

// Any unit vector in the plane of the normal.
static bd_dvec3 some_tangent(bd_dvec3 n)
{
    bd_dvec3 axis = fabs(n.x) < 0.6 ? (bd_dvec3){1, 0, 0} : (bd_dvec3){0, 1, 0};
    return bd_dvec3_normalize(bd_dvec3_cross(bd_dvec3_cross(n, axis), n), axis);
}

static bd_dvec3 in_plane(bd_dvec3 v, bd_dvec3 n)
{
    bd_dvec3 flat = bd_dvec3_sub(v, bd_dvec3_scale(n, bd_dvec3_dot(v, n)));
    return bd_dvec3_normalize(flat, (bd_dvec3){0, 0, 0});
}

void bd_mesh_repair_tangents(struct bd_primitive *primitive, struct bd_mesh_repairs *repairs)
{
    for (uint32_t v = 0; v < primitive->vertex_count; v++) {
        float *t = primitive->tangent + 4 * (size_t)v;
        bd_dvec3 n = vec(primitive->normal + 3 * (size_t)v);
        double length = bd_dvec3_length(vec(t));
        bool unit = fabs(length - 1) < 0.02, signed_ = t[3] == 1 || t[3] == -1;
        repairs->repaired_tangents += !unit || !signed_;
        t[3] = t[3] < 0 ? -1 : 1;
        if (fabs(length - 1) <= BD_UNIT_ROUNDING) continue; // as mesh_normals.c
        bd_dvec3 fixed = bd_dvec3_normalize(vec(t), some_tangent(n));
        t[0] = (float)fixed.x;
        t[1] = (float)fixed.y;
        t[2] = (float)fixed.z;
    }
}

static int compare_keys(const void *a, const void *b)
{
    const struct corner_key *left = a, *right = b;
    for (int i = 0; i < 8; i++)
        if (left->values[i] != right->values[i]) return left->values[i] < right->values[i] ? -1 : 1;
    return left->vertex < right->vertex ? -1 : left->vertex > right->vertex;
}

// For each vertex the first vertex that equals it.
static uint32_t *weld(const struct bd_primitive *primitive, const float *uv)
{
    size_t count = primitive->vertex_count;
    struct corner_key *keys = malloc((count + 1) * sizeof *keys);
    uint32_t *first = malloc((count + 1) * sizeof *first);
    if (!keys || !first) {
        free(keys);
        free(first);
        return NULL;
    }
    for (size_t v = 0; v < count; v++) {
        memcpy(keys[v].values, primitive->position + 3 * v, 3 * sizeof(float));
        memcpy(keys[v].values + 3, primitive->normal + 3 * v, 3 * sizeof(float));
        memcpy(keys[v].values + 6, uv + 2 * v, 2 * sizeof(float));
        keys[v].vertex = (uint32_t)v;
    }
    qsort(keys, count, sizeof *keys, compare_keys);
    uint32_t leader = 0;
    for (size_t i = 0; i < count; i++) {
        bool equal =
            i > 0 && memcmp(keys[i].values, keys[i - 1].values, sizeof keys[i].values) == 0;
        if (!equal) leader = keys[i].vertex;
        first[keys[i].vertex] = leader;
    }
    free(keys);
    return first;
}

struct face {
    bd_dvec3 tangent; // along growing u; zero if the map has no area here
    int winding;      // 1: the map is mirrored
};

static struct face face_of(const struct bd_primitive *primitive, const float *uv,
                           const uint32_t *corner)
{
    bd_dvec3 p0 = vec(primitive->position + 3 * (size_t)corner[0]);
    bd_dvec3 e1 = bd_dvec3_sub(vec(primitive->position + 3 * (size_t)corner[1]), p0);
    bd_dvec3 e2 = bd_dvec3_sub(vec(primitive->position + 3 * (size_t)corner[2]), p0);
    const float *uv0 = uv + 2 * (size_t)corner[0];
    const float *uv1 = uv + 2 * (size_t)corner[1], *uv2 = uv + 2 * (size_t)corner[2];
    double du1 = (double)uv1[0] - uv0[0], dv1 = (double)uv1[1] - uv0[1];
    double du2 = (double)uv2[0] - uv0[0], dv2 = (double)uv2[1] - uv0[1];
    double det = du1 * dv2 - du2 * dv1;
    bd_dvec3 t = bd_dvec3_sub(bd_dvec3_scale(e1, dv2), bd_dvec3_scale(e2, dv1));
    // v runs down in a picture, so a map that is not mirrored has a negative determinant.
    if (det == 0) return (struct face){{0, 0, 0}, 0};
    return (struct face){
        bd_dvec3_normalize(bd_dvec3_scale(t, det < 0 ? -1 : 1), (bd_dvec3){0, 0, 0}), det > 0};
}

static double corner_angle(const struct bd_primitive *primitive, const uint32_t *corner, int c,
                           bd_dvec3 n)
{
    bd_dvec3 at = vec(primitive->position + 3 * (size_t)corner[c]);
    bd_dvec3 to_next = bd_dvec3_sub(vec(primitive->position + 3 * (size_t)corner[(c + 1) % 3]), at);
    bd_dvec3 to_last = bd_dvec3_sub(vec(primitive->position + 3 * (size_t)corner[(c + 2) % 3]), at);
    double cosine = bd_dvec3_dot(in_plane(to_next, n), in_plane(to_last, n));
    return acos(fmin(fmax(cosine, -1), 1));
}

static void add_face(const struct bd_primitive *primitive, const float *uv, const uint32_t *corner,
                     const uint32_t *first, struct sums *sums)
{
    struct face face = face_of(primitive, uv, corner);
    for (int c = 0; c < 3; c++) {
        struct sums *sum = &sums[first[corner[c]]];
        bd_dvec3 n = vec(primitive->normal + 3 * (size_t)corner[c]);
        double weight = corner_angle(primitive, corner, c, n);
        sum->used[face.winding] = true;
        sum->tangent[face.winding] = bd_dvec3_add(
            sum->tangent[face.winding], bd_dvec3_scale(in_plane(face.tangent, n), weight));
    }
}

static bool grow(float **stream, uint32_t vertex_count, uint32_t extra, uint32_t width)
{
    if (!*stream) return true;
    float *longer = realloc(*stream, ((size_t)vertex_count + extra + 1) * width * sizeof *longer);
    if (!longer) return false;
    *stream = longer;
    return true;
}

static bool grow_all(struct bd_primitive *primitive, uint32_t extra)
{
    uint32_t count = primitive->vertex_count;
    return grow(&primitive->position, count, extra, 3) &&
           grow(&primitive->normal, count, extra, 3) && grow(&primitive->uv[0], count, extra, 2) &&
           grow(&primitive->uv[1], count, extra, 2) && grow(&primitive->color, count, extra, 4);
}

static void copy_vertex(float *stream, uint32_t to, uint32_t from, uint32_t width)
{
    if (stream)
        memcpy(stream + (size_t)to * width, stream + (size_t)from * width, width * sizeof *stream);
}

// A vertex that both windings use gets a twin for the mirrored one; `twin[v]` is v itself where
// there is none.
static bool split(struct bd_primitive *primitive, const struct sums *sums, const uint32_t *first,
                  uint32_t *twin)
{
    uint32_t count = primitive->vertex_count, extra = 0;
    for (uint32_t v = 0; v < count; v++) extra += sums[first[v]].used[0] && sums[first[v]].used[1];
    if (!grow_all(primitive, extra)) return false;
    uint32_t next = count;
    for (uint32_t v = 0; v < count; v++) {
        twin[v] = v;
        if (!sums[first[v]].used[0] || !sums[first[v]].used[1]) continue;
        twin[v] = next;
        copy_vertex(primitive->position, next, v, 3);
        copy_vertex(primitive->normal, next, v, 3);
        copy_vertex(primitive->uv[0], next, v, 2);
        copy_vertex(primitive->uv[1], next, v, 2);
        copy_vertex(primitive->color, next, v, 4);
        next++;
    }
    primitive->vertex_count = next;
    return true;
}

static void store_tangent(struct bd_primitive *primitive, uint32_t v, const struct sums *sum,
                          int winding)
{
    float *out = primitive->tangent + 4 * (size_t)v;
    bd_dvec3 n = vec(primitive->normal + 3 * (size_t)v);
    bd_dvec3 t = bd_dvec3_normalize(sum->tangent[winding], some_tangent(n));
    out[0] = (float)t.x;
    out[1] = (float)t.y;
    out[2] = (float)t.z;
    out[3] = winding ? -1 : 1;
}

static bool finish(struct bd_primitive *primitive, const float *uv, const struct sums *sums,
                   const uint32_t *first, uint32_t *twin)
{
    uint32_t shared_count = primitive->vertex_count;
    int *winding = malloc((primitive->index_count / 3 + (size_t)1) * sizeof *winding);
    if (!winding) return false;
    for (uint32_t i = 0; i < primitive->index_count; i += 3)
        winding[i / 3] = face_of(primitive, uv, primitive->index + i).winding;
    bool ok = split(primitive, sums, first, twin);
    primitive->tangent =
        ok ? malloc((4 * (size_t)primitive->vertex_count + 1) * sizeof(float)) : NULL;
    for (uint32_t v = 0; primitive->tangent && v < shared_count; v++) {
        const struct sums *sum = &sums[first[v]];
        store_tangent(primitive, v, sum, sum->used[1] && !sum->used[0]);
        if (twin[v] != v) store_tangent(primitive, twin[v], sum, 1);
    }
    for (uint32_t i = 0; primitive->tangent && i < primitive->index_count; i++)
        if (winding[i / 3]) primitive->index[i] = twin[primitive->index[i]];
    free(winding);
    return primitive->tangent != NULL;
}

bool bd_mesh_make_tangents(struct bd_primitive *primitive, uint32_t uv_set)
{
    const float *uv = primitive->uv[uv_set];
    size_t count = primitive->vertex_count;
    uint32_t *first = weld(primitive, uv);
    uint32_t *twin = malloc((count + 1) * sizeof *twin);
    struct sums *sums = calloc(count + 1, sizeof *sums);
    bool ok = first && twin && sums;
    for (uint32_t i = 0; ok && i < primitive->index_count; i += 3)
        add_face(primitive, uv, primitive->index + i, first, sums);
    if (ok) ok = finish(primitive, uv, sums, first, twin);
    free(sums);
    free(twin);
    free(first);
    return ok;
}
