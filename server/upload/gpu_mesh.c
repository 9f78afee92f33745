#include "upload/gpu_mesh.h"

#include <math.h>
#include <search.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"

#define PIECE_BYTES      ((size_t)1 << 20)
#define CHUNKS_PER_PIECE 64u

const uint32_t bd_stream_component_count[BD_STREAM_COUNT] = {3, 3, 4, 2, 2, 4};

static const float *stream_of(const struct bd_primitive *primitive, enum bd_stream stream)
{
    switch (stream) {
    case BD_STREAM_POSITION: return primitive->position;
    case BD_STREAM_NORMAL: return primitive->normal;
    case BD_STREAM_TANGENT: return primitive->tangent;
    case BD_STREAM_UV0: return primitive->uv[0];
    case BD_STREAM_UV1: return primitive->uv[1];
    case BD_STREAM_COLOR: return primitive->color;
    case BD_STREAM_COUNT: break;
    }
    return NULL;
}

static size_t stream_bytes(const struct bd_primitive *primitive, enum bd_stream stream)
{
    return (size_t)primitive->vertex_count * bd_stream_component_count[stream] * sizeof(float);
}

// Lays out the streams of all primitives one after the other; returns the sizes of both buffers.
static void lay_out(const struct bd_mesh *mesh, struct bd_gpu_primitive *out, size_t *vertex_bytes,
                    size_t *index_bytes)
{
    *vertex_bytes = *index_bytes = 0;
    for (uint32_t p = 0; p < mesh->primitive_count; p++) {
        const struct bd_primitive *primitive = &mesh->primitives[p];
        for (int s = 0; s < BD_STREAM_COUNT; s++) {
            out[p].has[s] = stream_of(primitive, (enum bd_stream)s) != NULL;
            if (!out[p].has[s]) continue;
            out[p].offset_bytes[s] = *vertex_bytes;
            *vertex_bytes += stream_bytes(primitive, (enum bd_stream)s);
        }
        out[p].index_offset_bytes = *index_bytes;
        out[p].index_count = primitive->index_count;
        *index_bytes += primitive->index_count * sizeof(uint32_t);
    }
}

static enum bd_err upload_bytes(struct bd_uploader *uploader, struct bd_buf *to, size_t offset,
                                const void *bytes, size_t size_bytes)
{
    enum bd_err err = BD_ERR_OK;
    for (size_t at = 0; !err && at < size_bytes; at += PIECE_BYTES) {
        size_t piece = size_bytes - at < PIECE_BYTES ? size_bytes - at : PIECE_BYTES;
        bd_buf_upload(uploader->gpu, to, offset + at, (const char *)bytes + at, piece);
        err = bd_uploader_pause(uploader);
    }
    return err;
}

static enum bd_err upload_primitive(struct bd_uploader *uploader,
                                    const struct bd_primitive *primitive,
                                    const struct bd_gpu_mesh *to,
                                    const struct bd_gpu_primitive *where)
{
    enum bd_err err = upload_bytes(uploader, to->indices, where->index_offset_bytes,
                                   primitive->index, primitive->index_count * sizeof(uint32_t));
    for (int s = 0; !err && s < BD_STREAM_COUNT; s++)
        if (where->has[s])
            err = upload_bytes(uploader, to->vertices, where->offset_bytes[s],
                               stream_of(primitive, (enum bd_stream)s),
                               stream_bytes(primitive, (enum bd_stream)s));
    return err;
}

// --- bounds --------------------------------------------------------------------------------

static struct bd_box empty_box(void)
{
    return (struct bd_box){{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
}

static void add_point(struct bd_box *box, const float p[3])
{
    for (int a = 0; a < 3; a++) {
        box->min[a] = p[a] < box->min[a] ? p[a] : box->min[a];
        box->max[a] = p[a] > box->max[a] ? p[a] : box->max[a];
    }
}

static uint32_t chunk_count_of(const struct bd_primitive *primitive)
{
    return (primitive->index_count / 3 + BD_CHUNK_TRIANGLES - 1) / BD_CHUNK_TRIANGLES;
}

static enum bd_err bound_chunks(struct bd_uploader *uploader, const struct bd_primitive *primitive,
                                struct bd_gpu_primitive *to)
{
    const uint32_t count = chunk_count_of(primitive);
    to->chunks = calloc(count + 1, sizeof *to->chunks);
    BD_ASSERT(to->chunks);
    enum bd_err err = BD_ERR_OK;
    for (uint32_t c = 0; !err && c < count; c++) {
        uint32_t at = 3 * BD_CHUNK_TRIANGLES * c, left = primitive->index_count - at;
        uint32_t end = at + (left < 3 * BD_CHUNK_TRIANGLES ? left : 3 * BD_CHUNK_TRIANGLES);
        struct bd_box box = empty_box();
        for (; at < end; at++)
            add_point(&box, primitive->position + 3 * (size_t)primitive->index[at]);
        to->chunks[c] = box;
        if ((c + 1) % CHUNKS_PER_PIECE == 0) err = bd_uploader_pause(uploader);
    }
    return err;
}

static enum bd_err bound_mesh(struct bd_uploader *uploader, const struct bd_mesh *mesh,
                              struct bd_gpu_mesh *to)
{
    enum bd_err err = BD_ERR_OK;
    to->box = empty_box();
    for (uint32_t p = 0; !err && p < mesh->primitive_count; p++) {
        err = bound_chunks(uploader, &mesh->primitives[p], &to->primitives[p]);
        for (uint32_t c = 0; !err && c < chunk_count_of(&mesh->primitives[p]); c++) {
            add_point(&to->box, to->primitives[p].chunks[c].min);
            add_point(&to->box, to->primitives[p].chunks[c].max);
        }
    }
    return err;
}

// -------------------------------------------------------------------------------------------

static enum bd_err upload_mesh(struct bd_uploader *uploader, const struct bd_mesh *mesh,
                               struct bd_gpu_mesh *to, struct bd_err_detail *detail)
{
    size_t vertex_bytes, index_bytes;
    lay_out(mesh, to->primitives, &vertex_bytes, &index_bytes);
    enum bd_err err = bd_buf_create_unset(uploader->gpu, "mesh vertices",
                                          vertex_bytes ? vertex_bytes : 4, &to->vertices, detail);
    if (!err)
        err = bd_buf_create_unset(uploader->gpu, "mesh indices", index_bytes ? index_bytes : 4,
                                  &to->indices, detail);
    for (uint32_t p = 0; !err && p < mesh->primitive_count; p++)
        err = upload_primitive(uploader, &mesh->primitives[p], to, &to->primitives[p]);
    return err ? err : bound_mesh(uploader, mesh, to);
}

static int mesh_order(const void *a, const void *b)
{
    uint64_t x = ((const struct bd_gpu_mesh *)a)->content_hash;
    uint64_t y = ((const struct bd_gpu_mesh *)b)->content_hash;
    return (x > y) - (x < y);
}

static void destroy_mesh(struct bd_uploader *uploader, struct bd_gpu_mesh *mesh)
{
    bd_buf_destroy(uploader->gpu, &mesh->vertices);
    bd_buf_destroy(uploader->gpu, &mesh->indices);
    for (uint32_t p = 0; p < mesh->primitive_count; p++) free(mesh->primitives[p].chunks);
    free(mesh->primitives);
    free(mesh);
}

// Or the one that another scene, uploaded in a pause of this one's, brought in the meantime.
static struct bd_gpu_mesh *share_mesh(struct bd_uploader *uploader, struct bd_gpu_mesh *made)
{
    struct bd_gpu_mesh **shared = tsearch(made, &uploader->meshes, mesh_order);
    BD_ASSERT(shared);
    if (*shared != made) destroy_mesh(uploader, made);
    (*shared)->reference_count++;
    return *shared;
}

enum bd_err bd_gpu_mesh_acquire(struct bd_uploader *uploader, const struct bd_mesh *mesh,
                                struct bd_gpu_mesh **out, struct bd_err_detail *detail)
{
    const struct bd_gpu_mesh wanted = {.content_hash = mesh->content_hash};
    struct bd_gpu_mesh **known = tfind(&wanted, &uploader->meshes, mesh_order);
    if (known) {
        (*known)->reference_count++;
        *out = *known;
        return BD_ERR_OK;
    }
    struct bd_gpu_mesh *made = calloc(1, sizeof *made);
    BD_ASSERT(made);
    made->primitives = calloc(mesh->primitive_count + 1, sizeof *made->primitives);
    BD_ASSERT(made->primitives);
    made->content_hash = mesh->content_hash;
    made->primitive_count = mesh->primitive_count;
    enum bd_err err = upload_mesh(uploader, mesh, made, detail);
    if (err) {
        destroy_mesh(uploader, made);
        return err;
    }
    *out = share_mesh(uploader, made);
    return BD_ERR_OK;
}

void bd_gpu_mesh_drop(struct bd_uploader *uploader, struct bd_gpu_mesh **mesh)
{
    struct bd_gpu_mesh *m = *mesh;
    *mesh = NULL;
    if (!m || --m->reference_count > 0) return;
    tdelete(m, &uploader->meshes, mesh_order);
    destroy_mesh(uploader, m);
}

static enum bd_err upload_rows(struct bd_uploader *uploader, const struct bd_picture *picture,
                               struct bd_tex *to)
{
    const size_t row_bytes = (size_t)picture->width_px * 4;
    const uint32_t rows_max = row_bytes < PIECE_BYTES ? (uint32_t)(PIECE_BYTES / row_bytes) : 1;
    enum bd_err err = BD_ERR_OK;
    for (uint32_t row = 0; !err && row < picture->height_px; row += rows_max) {
        uint32_t left = picture->height_px - row, rows = left < rows_max ? left : rows_max;
        bd_tex_upload_rows(uploader->gpu, to, 0, row, rows, picture->rgba + row * row_bytes,
                           rows * row_bytes);
        err = bd_uploader_pause(uploader);
    }
    return err;
}

static int picture_order(const void *a, const void *b)
{
    const struct bd_gpu_picture *x = a, *y = b;
    if (x->content_hash != y->content_hash) return x->content_hash < y->content_hash ? -1 : 1;
    return x->srgb - y->srgb;
}

static void destroy_picture(struct bd_uploader *uploader, struct bd_gpu_picture *picture)
{
    bd_tex_destroy(uploader->gpu, &picture->tex);
    free(picture);
}

// As share_mesh.
static struct bd_gpu_picture *share_picture(struct bd_uploader *uploader,
                                            struct bd_gpu_picture *made)
{
    struct bd_gpu_picture **shared = tsearch(made, &uploader->pictures, picture_order);
    BD_ASSERT(shared);
    if (*shared != made) destroy_picture(uploader, made);
    (*shared)->reference_count++;
    return *shared;
}

enum bd_err bd_gpu_picture_acquire(struct bd_uploader *uploader, const struct bd_picture *picture,
                                   bool srgb, struct bd_gpu_picture **out,
                                   struct bd_err_detail *detail)
{
    const struct bd_gpu_picture wanted = {.content_hash = picture->content_hash, .srgb = srgb};
    struct bd_gpu_picture **known = tfind(&wanted, &uploader->pictures, picture_order);
    if (known) {
        (*known)->reference_count++;
        *out = *known;
        return BD_ERR_OK;
    }
    const struct bd_tex_desc desc = {
        .name = "picture",
        .format = srgb ? BD_FORMAT_RGBA8_SRGB : BD_FORMAT_RGBA8,
        .width_px = picture->width_px,
        .height_px = picture->height_px,
    };
    struct bd_tex *tex;
    enum bd_err err = bd_tex_create(uploader->gpu, &desc, &tex, detail);
    if (err) return err;
    err = upload_rows(uploader, picture, tex);
    if (err) {
        bd_tex_destroy(uploader->gpu, &tex);
        return err;
    }
    struct bd_gpu_picture *made = calloc(1, sizeof *made);
    BD_ASSERT(made);
    *made = (struct bd_gpu_picture){picture->content_hash, srgb, 0, tex};
    *out = share_picture(uploader, made);
    return BD_ERR_OK;
}

void bd_gpu_picture_drop(struct bd_uploader *uploader, struct bd_gpu_picture **picture)
{
    struct bd_gpu_picture *p = *picture;
    *picture = NULL;
    if (!p || --p->reference_count > 0) return;
    tdelete(p, &uploader->pictures, picture_order);
    destroy_picture(uploader, p);
}
