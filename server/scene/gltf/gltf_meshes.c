// Meshes of a document: primitives with all the streams that a scene's have.

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "scene/gltf/gltf_reader.h"
#include "scene/model/derive.h"
#include "scene/model/object_fields.h"
#include "scene/model/primitive.h"

// A primitive that shows nothing still has its streams: nobody has to ask whether they are there.
static bool make_empty(struct bd_primitive *out)
{
    out->vertex_count = 0;
    out->index_count = 0;
    out->position = calloc(1, sizeof *out->position);
    out->normal = calloc(1, sizeof *out->normal);
    out->index = calloc(1, sizeof *out->index);
    return out->position && out->normal && out->index;
}

// The first index that is used, and how many there are from it to the last.
static uint32_t index_range(const uint32_t *index, uint32_t index_count, uint32_t *first)
{
    uint32_t least = UINT32_MAX, most = 0;
    for (uint32_t i = 0; i < index_count; i++) {
        if (index[i] < least) least = index[i];
        if (index[i] > most) most = index[i];
    }
    *first = index_count ? least : 0;
    return index_count ? most - least + 1 : 0;
}

// Lists, ascending, the vertices that the triangles use, and renumbers the triangles to that list:
// files often share one long vertex list among many primitives, each of which uses a stretch of it.
static uint32_t *pick_vertices(uint32_t *index, uint32_t index_count, uint32_t *pick_count)
{
    uint32_t first, range = index_range(index, index_count, &first), count = 0;
    uint32_t *renumbered = calloc(range ? range : 1, sizeof *renumbered);
    if (!renumbered) return NULL;
    for (uint32_t i = 0; i < index_count; i++) renumbered[index[i] - first] = 1;
    for (uint32_t v = 0; v < range; v++) count += renumbered[v];
    uint32_t *pick = malloc((count ? count : 1) * sizeof *pick);
    if (pick) {
        uint32_t next = 0;
        for (uint32_t v = 0; v < range; v++)
            if (renumbered[v]) {
                pick[next] = first + v;
                renumbered[v] = next++;
            }
        for (uint32_t i = 0; i < index_count; i++) index[i] = renumbered[index[i] - first];
        *pick_count = count;
    }
    free(renumbered);
    return pick;
}

// A stream of `width` floats a vertex, all `fill`, then what the accessor has.
static enum bd_err read_stream(struct bd_gltf_reader *reader, int32_t accessor,
                               const uint32_t *pick, uint32_t count, uint32_t width, float fill,
                               float **out)
{
    *out = malloc((count ? (size_t)count * width : 1) * sizeof **out);
    if (!*out) return bd_gltf_no_memory(reader, "meshes");
    for (size_t i = 0; i < (size_t)count * width; i++) (*out)[i] = fill;
    return bd_gltf_read_floats(reader, accessor, pick, count, width, *out);
}

static bool uses_uv_slot(const struct bd_material *material, uint32_t slot)
{
    const struct bd_texture_ref *map;
    for (uint32_t n = 0; (map = bd_material_map(material, n)); n++)
        if (map->texture != BD_NONE && map->uv_set == slot) return true;
    return false;
}

static void repair_texcoords(struct bd_gltf_reader *reader, float *uv, uint32_t vertex_count)
{
    for (size_t i = 0; i < 2 * (size_t)vertex_count; i++)
        if (!(fabsf(uv[i]) <= 1e9f)) {
            uv[i] = 0;
            reader->repairs.nonfinite_texcoords++;
        }
}

// A map without coordinates samples its first texel's corner everywhere.
static enum bd_err read_texcoords(struct bd_gltf_reader *reader, const struct bd_gltf_primitive *in,
                                  const uint32_t *pick, struct bd_primitive *out)
{
    for (uint32_t slot = 0; slot < 2; slot++) {
        char name[32];
        snprintf(name, sizeof name, "TEXCOORD_%u", reader->uv_slots[out->material].set[slot]);
        int32_t accessor = bd_gltf_attribute(&in->attributes, name);
        if (accessor != BD_NONE) {
            enum bd_err err =
                read_stream(reader, accessor, pick, out->vertex_count, 2, 0, &out->uv[slot]);
            if (err != BD_ERR_OK) return err;
            repair_texcoords(reader, out->uv[slot], out->vertex_count);
        } else if (uses_uv_slot(&reader->scene->materials[out->material], slot)) {
            out->uv[slot] = calloc(2 * (size_t)out->vertex_count + 1, sizeof **out->uv);
            if (!out->uv[slot]) return bd_gltf_no_memory(reader, "meshes");
            reader->repairs.missing_texcoords++;
        }
    }
    return BD_ERR_OK;
}

static enum bd_err read_colors(struct bd_gltf_reader *reader, const struct bd_gltf_primitive *in,
                               const uint32_t *pick, struct bd_primitive *out)
{
    int32_t accessor = bd_gltf_attribute(&in->attributes, "COLOR_0");
    if (accessor == BD_NONE) return BD_ERR_OK;
    enum bd_err err = read_stream(reader, accessor, pick, out->vertex_count, 4, 1, &out->color);
    if (err != BD_ERR_OK) return err;
    for (size_t i = 0; i < 4 * (size_t)out->vertex_count; i++) {
        float value = out->color[i];
        if (value >= 0 && value <= 1) continue;
        out->color[i] = value < 0 ? 0 : 1;
        reader->repairs.clamped_factors++;
    }
    return BD_ERR_OK;
}

static enum bd_err read_attributes(struct bd_gltf_reader *reader,
                                   const struct bd_gltf_primitive *in, const uint32_t *pick,
                                   struct bd_primitive *out)
{
    const struct bd_gltf_attributes *from = &in->attributes;
    enum bd_err err = read_stream(reader, bd_gltf_attribute(from, "POSITION"), pick,
                                  out->vertex_count, 3, 0, &out->position);
    int32_t normal = bd_gltf_attribute(from, "NORMAL");
    if (err == BD_ERR_OK && normal != BD_NONE)
        err = read_stream(reader, normal, pick, out->vertex_count, 3, 0, &out->normal);
    int32_t tangent = bd_gltf_attribute(from, "TANGENT");
    bool wants_tangents = reader->scene->materials[out->material].normal_map.texture != BD_NONE;
    // Without normals given, the specification ignores given tangents.
    if (err == BD_ERR_OK && tangent != BD_NONE && normal != BD_NONE && wants_tangents)
        err = read_stream(reader, tangent, pick, out->vertex_count, 4, 1, &out->tangent);
    if (err == BD_ERR_OK) err = read_texcoords(reader, in, pick, out);
    if (err == BD_ERR_OK) err = read_colors(reader, in, pick, out);
    return err;
}

static enum bd_err complete(struct bd_gltf_reader *reader, struct bd_primitive *out)
{
    const struct bd_texture_ref *normal_map = &reader->scene->materials[out->material].normal_map;
    const bool has_normals = out->normal != NULL;
    bool ok = has_normals ? bd_mesh_repair_normals(out, &reader->repairs.mesh) : bd_mesh_flat_normals(out);
    if (ok && has_normals)
        reader->repairs.normals_against_winding += bd_primitive_count_against_winding(out);
    if (ok && out->tangent)
        bd_mesh_repair_tangents(out, &reader->repairs.mesh);
    else if (ok && normal_map->texture != BD_NONE)
        ok = bd_mesh_make_tangents(out, normal_map->uv_set);
    return ok ? BD_ERR_OK : bd_gltf_no_memory(reader, "meshes");
}

static enum bd_err spend(struct bd_gltf_reader *reader, const char *path, uint64_t bytes)
{
    if (bytes > reader->vertex_bytes_left)
        return bd_err_set(reader->detail, BD_ERR_LIMIT, path,
                          "the scene's triangles need more than %llu bytes",
                          (unsigned long long)reader->limits->scene_bytes);
    reader->vertex_bytes_left -= bytes;
    return BD_ERR_OK;
}

// All streams that a vertex can have. Flat normals unshare the vertices: one for each corner.
static enum bd_err spend_vertices(struct bd_gltf_reader *reader, const char *path,
                                  const struct bd_gltf_primitive *in,
                                  const struct bd_primitive *out)
{
    const uint64_t vertex_bytes = (3 + 3 + 4 + 2 + 2 + 4) * sizeof(float);
    bool flat = bd_gltf_attribute(&in->attributes, "NORMAL") == BD_NONE;
    return spend(reader, path, vertex_bytes * (flat ? out->index_count : out->vertex_count));
}

static enum bd_err read_picked(struct bd_gltf_reader *reader, const struct bd_gltf_primitive *in,
                               const struct bd_gltf_deform *deform, const uint32_t *pick,
                               struct bd_primitive *out)
{
    enum bd_err err = read_attributes(reader, in, pick, out);
    if (err == BD_ERR_OK) err = bd_gltf_deform(reader, deform, in, pick, out);
    if (err != BD_ERR_OK) return err;
    const uint32_t indices_given = out->index_count, vertices_given = out->vertex_count;
    bd_mesh_clean_triangles(out, &reader->repairs.mesh);
    err = complete(reader, out);
    if (err != BD_ERR_OK) return err;
    // Triangles that went leave vertices behind, and so does parting those of mirrored maps.
    bool may_have_unused = out->index_count < indices_given || out->vertex_count > vertices_given;
    if (may_have_unused && !bd_primitive_drop_unused(out))
        return bd_gltf_no_memory(reader, "meshes");
    return BD_ERR_OK;
}

static enum bd_err read_primitive(struct bd_gltf_reader *reader, const char *path,
                                  const struct bd_gltf_primitive *in,
                                  const struct bd_gltf_deform *deform, struct bd_primitive *out)
{
    int32_t position = bd_gltf_attribute(&in->attributes, "POSITION");
    out->material = in->material == BD_NONE ? (int32_t)reader->doc->material_count : in->material;
    bool is_shown = position != BD_NONE && in->mode >= 4;
    if (!is_shown) {
        if (in->mode < 4)
            reader->repairs.skipped_primitives++;
        else
            reader->repairs.missing_positions++;
        return make_empty(out) ? BD_ERR_OK : bd_gltf_no_memory(reader, path);
    }
    uint32_t vertex_count = (uint32_t)reader->doc->accessors[position].count;
    enum bd_err err =
        bd_gltf_read_triangles(reader, path, in, vertex_count, &out->index, &out->index_count);
    if (err == BD_ERR_OK)
        err = spend(reader, path, out->index_count * (uint64_t)sizeof *out->index);
    if (err != BD_ERR_OK) return err;
    uint32_t *pick = pick_vertices(out->index, out->index_count, &out->vertex_count);
    if (!pick) return bd_gltf_no_memory(reader, path);
    err = spend_vertices(reader, path, in, out);
    if (err == BD_ERR_OK) err = read_picked(reader, in, deform, pick, out);
    free(pick);
    return err;
}

static struct bd_mesh *make_mesh(struct bd_scene *scene, const struct bd_gltf_mesh *in,
                                 uint32_t primitive_count)
{
    struct bd_mesh *mesh = calloc(1, sizeof *mesh);
    if (!mesh) return NULL;
    mesh->reference_count = 1;
    bd_gltf_copy_name(mesh->name, in->name);
    mesh->primitives = calloc(primitive_count + (size_t)1, sizeof *mesh->primitives);
    if (!mesh->primitives) {
        free(mesh);
        return NULL;
    }
    mesh->primitive_count = primitive_count;
    scene->meshes[scene->mesh_count++] = mesh;
    return mesh;
}

static enum bd_err read_mesh(struct bd_gltf_reader *reader, uint32_t m,
                             const struct bd_gltf_deform *deform)
{
    const struct bd_gltf_mesh *in = &reader->doc->meshes[m];
    struct bd_mesh *mesh = make_mesh(reader->scene, in, in->primitive_count);
    if (!mesh) return bd_gltf_no_memory(reader, "meshes");
    enum bd_err err = BD_ERR_OK;
    for (uint32_t p = 0; err == BD_ERR_OK && p < in->primitive_count; p++)
        err = read_primitive(reader, bd_gltf_path("meshes[%u].primitives[%u]", m, p).text,
                             &in->primitives[p], deform, &mesh->primitives[p]);
    return err;
}

static bool has_targets(const struct bd_gltf_mesh *mesh)
{
    for (uint32_t p = 0; p < mesh->primitive_count; p++)
        if (mesh->primitives[p].target_count > 0) return true;
    return false;
}

// A node with a skin, or with weights of its own for morph targets, shows a mesh of its own.
static bool is_deformed(const struct bd_gltf_document *doc, const struct bd_gltf_node *node)
{
    if (node->mesh == BD_NONE) return false;
    if (node->skin != BD_NONE && doc->skins[node->skin].joint_count > 0) return true;
    return node->weight_count > 0 && has_targets(&doc->meshes[node->mesh]);
}

// Meshes that only deformed nodes show are left empty: their baked copies are what is drawn.
static void mark_plain(const struct bd_gltf_document *doc, bool *plain)
{
    for (uint32_t m = 0; m < doc->mesh_count; m++) plain[m] = true;
    for (uint32_t i = 0; i < doc->node_count; i++)
        if (is_deformed(doc, &doc->nodes[i])) plain[doc->nodes[i].mesh] = false;
    for (uint32_t i = 0; i < doc->node_count; i++)
        if (doc->nodes[i].mesh != BD_NONE && !is_deformed(doc, &doc->nodes[i]))
            plain[doc->nodes[i].mesh] = true;
}

static enum bd_err read_plain_meshes(struct bd_gltf_reader *reader)
{
    const struct bd_gltf_document *doc = reader->doc;
    bool *plain = calloc(doc->mesh_count + (size_t)1, sizeof *plain);
    if (!plain) return bd_gltf_no_memory(reader, "meshes");
    mark_plain(doc, plain);
    enum bd_err err = BD_ERR_OK;
    for (uint32_t m = 0; err == BD_ERR_OK && m < doc->mesh_count; m++) {
        const struct bd_gltf_mesh *in = &doc->meshes[m];
        struct bd_gltf_deform deform = {in->weight_count, in->weights, 0, NULL};
        if (plain[m])
            err = read_mesh(reader, m, &deform);
        else if (!make_mesh(reader->scene, in, 0))
            err = bd_gltf_no_memory(reader, "meshes");
    }
    free(plain);
    return err;
}

// Inverse bind matrices are identity where the skin has none.
static enum bd_err pose_skin(struct bd_gltf_reader *reader, const struct bd_gltf_skin *skin,
                             struct bd_gltf_deform *deform)
{
    deform->world_from_bind = calloc(skin->joint_count, sizeof *deform->world_from_bind);
    if (!deform->world_from_bind) return bd_gltf_no_memory(reader, "skins");
    deform->joint_count = skin->joint_count;
    for (uint32_t j = 0; j < skin->joint_count; j++) {
        bd_dmat4 joint_from_bind = bd_dmat4_identity();
        if (skin->inverse_bind_matrices != BD_NONE) {
            float m[16];
            enum bd_err err =
                bd_gltf_read_floats(reader, skin->inverse_bind_matrices, &j, 1, 16, m);
            if (err != BD_ERR_OK) return err;
            for (int i = 0; i < 16; i++) joint_from_bind.m[i] = (double)m[i];
        }
        deform->world_from_bind[j] =
            bd_dmat4_mul(&reader->scene->nodes[skin->joints[j]].world_from_node, &joint_from_bind);
    }
    return BD_ERR_OK;
}

// A skinned mesh is baked in world space and its node's transform does not count; a morphed one
// stays in its node's space.
static enum bd_err read_deformed_mesh(struct bd_gltf_reader *reader, uint32_t node_index)
{
    const struct bd_gltf_document *doc = reader->doc;
    const struct bd_gltf_node *in = &doc->nodes[node_index];
    struct bd_node *node = &reader->scene->nodes[node_index];
    const struct bd_gltf_mesh *mesh = &doc->meshes[in->mesh];
    struct bd_gltf_deform deform = {mesh->weight_count, mesh->weights, 0, NULL};
    if (in->weight_count > 0) {
        deform.weight_count = in->weight_count;
        deform.weights = in->weights;
    }
    enum bd_err err = BD_ERR_OK;
    if (in->skin != BD_NONE && doc->skins[in->skin].joint_count > 0) {
        err = pose_skin(reader, &doc->skins[in->skin], &deform);
        node->mesh_is_world_space = true;
    }
    if (err == BD_ERR_OK) {
        node->mesh = (int32_t)reader->scene->mesh_count;
        err = read_mesh(reader, (uint32_t)in->mesh, &deform);
    }
    free(deform.world_from_bind);
    return err;
}

enum bd_err bd_gltf_read_meshes(struct bd_gltf_reader *reader)
{
    const struct bd_gltf_document *doc = reader->doc;
    struct bd_scene *scene = reader->scene;
    uint64_t most = 1 + (uint64_t)doc->mesh_count + doc->node_count;
    scene->meshes = calloc(most, sizeof(struct bd_mesh *));
    if (!scene->meshes || !bd_derive_world_matrices(scene))
        return bd_gltf_no_memory(reader, "meshes");
    enum bd_err err = read_plain_meshes(reader);
    for (uint32_t i = 0; err == BD_ERR_OK && i < doc->node_count; i++)
        if (is_deformed(doc, &doc->nodes[i])) err = read_deformed_mesh(reader, i);
    return err;
}
