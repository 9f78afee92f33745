// Meshes as the importer would make them of the file: what it would not keep is not written, so
// that the second export is the first.

#include <stdlib.h>
#include <string.h>

#include "scene/gltf/gltf_write_parts.h"
#include "scene/mesh/mesh.h"
#include "scene/model/primitive.h"

static bool wants_tangents(const struct bd_gltf_writer *writer, int32_t material)
{
    return writer->materials[material].normal_map.texture != BD_NONE;
}

// False only without memory; `*all` says whether each vertex belongs to some triangle.
static bool all_are_used(const struct bd_primitive *primitive, bool *all)
{
    bool *used = calloc(primitive->vertex_count + (size_t)1, sizeof *used);
    if (!used) return false;
    *all = bd_primitive_mark_used(primitive, used) == primitive->vertex_count;
    free(used);
    return true;
}

// Sets of texture coordinates begin with the first: before a second one alone stand zeros.
static bool lacks_first_set(const struct bd_primitive *primitive)
{
    return !primitive->uv[0] && primitive->uv[1];
}

static bool clean(struct bd_gltf_writer *writer, struct bd_primitive *primitive)
{
    struct bd_mesh_repairs repairs = {0};
    const uint32_t before = primitive->vertex_count;
    if (!bd_primitive_drop_unused(primitive)) return false;
    writer->left_out.unused_vertices += before - primitive->vertex_count;
    bd_mesh_clean_triangles(primitive, &repairs);
    writer->left_out.degenerate_triangles += repairs.degenerate_triangles;
    return bd_primitive_drop_unused(primitive);
}

static bool settle_copy(struct bd_gltf_writer *writer, struct bd_primitive *primitive)
{
    if (!clean(writer, primitive)) return false;
    if (primitive->tangent && !wants_tangents(writer, primitive->material)) {
        writer->left_out.unread_tangents++;
        free(primitive->tangent);
        primitive->tangent = NULL;
    }
    if (!lacks_first_set(primitive)) return true;
    primitive->uv[0] = calloc(2 * (size_t)primitive->vertex_count + 1, sizeof *primitive->uv[0]);
    return primitive->uv[0] != NULL;
}

// `*out` is the primitive itself where it is settled, else a copy that is.
static bool settle(struct bd_gltf_writer *writer, const struct bd_primitive *in,
                   struct bd_primitive *out, bool *owns)
{
    bool all_used;
    *out = *in;
    out->material = bd_gltf_plan_material(writer, in);
    if (out->material == BD_NONE || !all_are_used(in, &all_used)) return false;
    if (all_used && bd_mesh_count_unclean(in) == 0 && !lacks_first_set(in) &&
        !(in->tangent && !wants_tangents(writer, out->material)))
        return true;
    const int32_t material = out->material;
    *owns = true;
    if (!bd_primitive_copy(in, out)) return false;
    out->material = material;
    return settle_copy(writer, out);
}

static void free_mesh(struct bd_gltf_out_mesh *out)
{
    for (uint32_t p = 0; p < out->mesh.primitive_count; p++)
        if (out->owns_streams[p]) bd_primitive_free_streams(&out->mesh.primitives[p]);
    free(out->mesh.primitives);
    free(out->owns_streams);
    free(out->accessors);
}

static bool settle_primitives(struct bd_gltf_writer *writer, const struct bd_mesh *in,
                              struct bd_gltf_out_mesh *out, bool *is_changed)
{
    for (uint32_t p = 0; p < in->primitive_count; p++) {
        struct bd_primitive *primitive = &out->mesh.primitives[out->mesh.primitive_count];
        bool *owns = &out->owns_streams[out->mesh.primitive_count];
        *owns = false;
        if (in->primitives[p].index_count > 0) {
            out->mesh.primitive_count++;
            if (!settle(writer, &in->primitives[p], primitive, owns)) return false;
            *is_changed |= *owns;
            if (primitive->index_count > 0) continue;
            out->mesh.primitive_count--;
            bd_primitive_free_streams(primitive); // nothing is left of it, so it was changed
        }
        *is_changed = true;
        writer->left_out.empty_primitives++;
    }
    return true;
}

static bool settle_mesh(struct bd_gltf_writer *writer, const struct bd_mesh *in,
                        struct bd_gltf_out_mesh *out)
{
    const size_t count = in->primitive_count;
    bool is_changed = false;
    *out = (struct bd_gltf_out_mesh){.mesh = *in};
    out->mesh.primitive_count = 0;
    out->mesh.primitives = malloc((count + 1) * sizeof *out->mesh.primitives);
    out->owns_streams = calloc(count + 1, sizeof *out->owns_streams);
    out->accessors = malloc((count + 1) * sizeof *out->accessors);
    if (!out->mesh.primitives || !out->owns_streams || !out->accessors) return false;
    if (!settle_primitives(writer, in, out, &is_changed)) return false;
    if (is_changed && out->mesh.primitive_count) bd_mesh_seal(&out->mesh);
    return true;
}

// --- the same streams -----------------------------------------------------------------------

static int compare_content(const void *a, const void *b)
{
    const struct bd_gltf_out_mesh *left = *(const struct bd_gltf_out_mesh *const *)a;
    const struct bd_gltf_out_mesh *right = *(const struct bd_gltf_out_mesh *const *)b;
    int content = memcmp(left->mesh.sha256, right->mesh.sha256, sizeof left->mesh.sha256);
    return content ? content : (left > right) - (left < right);
}

static bool find_same(struct bd_gltf_writer *writer)
{
    const uint32_t count = writer->mesh_count;
    struct bd_gltf_out_mesh **sorted = malloc((count + (size_t)1) * sizeof(void *));
    if (!sorted) return false;
    for (uint32_t m = 0; m < count; m++) sorted[m] = &writer->meshes[m];
    qsort(sorted, count, sizeof(void *), compare_content);
    for (uint32_t m = 0, first = 0; m < count; m++) {
        if (memcmp(sorted[m]->mesh.sha256, sorted[first]->mesh.sha256, 32) != 0) first = m;
        sorted[m]->same_as = (int32_t)(sorted[first] - writer->meshes);
    }
    free(sorted);
    return true;
}

bool bd_gltf_settle_meshes(struct bd_gltf_writer *writer)
{
    writer->meshes = malloc((writer->slots.meshes + (size_t)1) * sizeof *writer->meshes);
    if (!writer->meshes) return false;
    for (uint32_t i = 0; i < writer->slots.meshes; i++) {
        const struct bd_mesh *mesh = writer->scene->meshes[i];
        struct bd_gltf_out_mesh *out = &writer->meshes[writer->mesh_count];
        if (mesh->is_removed) continue;
        writer->mesh_count++;
        if (!settle_mesh(writer, mesh, out)) return false;
        if (out->mesh.primitive_count > 0) {
            writer->numbers.meshes[i] = (int32_t)writer->mesh_count - 1;
            continue;
        }
        free_mesh(out);
        writer->mesh_count--;
        writer->left_out.empty_meshes++;
    }
    return find_same(writer);
}

void bd_gltf_free_meshes(struct bd_gltf_writer *writer)
{
    for (uint32_t m = 0; m < writer->mesh_count; m++) free_mesh(&writer->meshes[m]);
    free(writer->meshes);
}
