// Nodes and the one scene that lists those that show.
//
// A mesh that was baked in world space has no transform: glTF says that by a root without one. Its
// node keeps the rest, and the mesh gets a root of its own behind all nodes, unless the node is
// such a root itself.

#include <stdlib.h>
#include <string.h>

#include "scene/gltf/gltf_write_parts.h"

static bool is_untransformed(const struct bd_node *node)
{
    const bd_dmat4 identity = bd_dmat4_identity();
    return memcmp(&node->parent_from_node, &identity, sizeof identity) == 0;
}

static int32_t written_mesh(const struct bd_gltf_writer *writer, const struct bd_node *node)
{
    return node->mesh == BD_NONE ? BD_NONE : writer->numbers.meshes[node->mesh];
}

static bool needs_root(const struct bd_gltf_writer *writer, const struct bd_node *node)
{
    return !node->is_removed && node->mesh_is_world_space &&
           written_mesh(writer, node) != BD_NONE &&
           !(node->parent == BD_NONE && is_untransformed(node));
}

// --- children -------------------------------------------------------------------------------

// Children of all nodes, one list after the other: those of node i from first[i] to first[i + 1].
struct children {
    uint32_t *first;
    int32_t *numbers;
};

static bool list_children(const struct bd_gltf_writer *writer, struct children *out)
{
    const uint32_t count = writer->slots.nodes;
    const struct bd_node *nodes = writer->scene->nodes;
    *out = (struct children){.first = calloc(count + (size_t)2, sizeof *out->first),
                             .numbers = malloc((count + (size_t)1) * sizeof *out->numbers)};
    if (!out->first || !out->numbers) return false;
    // Shifted by one, so that filling moves each start to where it belongs.
    uint32_t *end = out->first + 1;
    for (uint32_t i = 0; i < count; i++)
        if (!nodes[i].is_removed && nodes[i].parent != BD_NONE) end[nodes[i].parent + 1]++;
    for (uint32_t i = 1; i <= count; i++) end[i] += end[i - 1];
    for (uint32_t i = 0; i < count; i++)
        if (!nodes[i].is_removed && nodes[i].parent != BD_NONE)
            out->numbers[end[nodes[i].parent]++] = writer->numbers.nodes[i];
    return true;
}

static void free_children(struct children *children)
{
    free(children->first);
    free(children->numbers);
}

static void write_children(struct bd_gltf_json *json, const struct children *children, uint32_t i)
{
    if (children->first[i] == children->first[i + 1]) return;
    bd_gltf_json_open(json, "children", '[');
    for (uint32_t c = children->first[i]; c < children->first[i + 1]; c++)
        bd_gltf_json_uint(json, NULL, (uint64_t)children->numbers[c]);
    bd_gltf_json_close(json, '[');
}

// --- nodes ----------------------------------------------------------------------------------

// A hidden root is listed in no scene; what is hidden further down has to say so itself.
static bool is_hidden_below(const struct bd_node *node)
{
    return node->is_hidden && node->parent != BD_NONE;
}

static void write_extensions(struct bd_gltf_writer *writer, const struct bd_node *node)
{
    struct bd_gltf_json *json = &writer->json;
    if (node->light == BD_NONE && !is_hidden_below(node)) return;
    bd_gltf_json_open(json, "extensions", '{');
    if (node->light != BD_NONE) {
        bd_gltf_open_extension(writer, BD_GLTF_EXTENSION_LIGHTS);
        bd_gltf_json_uint(json, "light", (uint64_t)writer->numbers.lights[node->light]);
        bd_gltf_json_close(json, '{');
    }
    if (is_hidden_below(node)) {
        bd_gltf_open_extension(writer, BD_GLTF_EXTENSION_VISIBILITY);
        bd_gltf_json_bool(json, "visible", false);
        bd_gltf_json_close(json, '{');
    }
    bd_gltf_json_close(json, '{');
}

static void write_node(struct bd_gltf_writer *writer, uint32_t i, const struct children *children)
{
    struct bd_gltf_json *json = &writer->json;
    const struct bd_node *node = &writer->scene->nodes[i];
    const int32_t mesh = needs_root(writer, node) ? BD_NONE : written_mesh(writer, node);
    bd_gltf_json_open(json, NULL, '{');
    if (node->name[0]) bd_gltf_json_text(json, "name", node->name);
    write_children(json, children, i);
    if (!is_untransformed(node)) bd_gltf_json_f64s(json, "matrix", node->parent_from_node.m, 16);
    if (mesh != BD_NONE) bd_gltf_json_uint(json, "mesh", (uint64_t)mesh);
    if (node->camera != BD_NONE)
        bd_gltf_json_uint(json, "camera", (uint64_t)writer->numbers.cameras[node->camera]);
    write_extensions(writer, node);
    bd_gltf_json_close(json, '{');
}

static void write_root_of_mesh(struct bd_gltf_writer *writer, const struct bd_node *node)
{
    struct bd_gltf_json *json = &writer->json;
    bd_gltf_json_open(json, NULL, '{');
    if (node->name[0]) bd_gltf_json_text(json, "name", node->name);
    bd_gltf_json_uint(json, "mesh", (uint64_t)written_mesh(writer, node));
    bd_gltf_json_close(json, '{');
    writer->left_out.world_space_meshes++;
}

// --- the scene ------------------------------------------------------------------------------

static void list_root(struct bd_gltf_json *json, bool *any, uint32_t number)
{
    if (!*any) bd_gltf_json_open(json, "nodes", '[');
    *any = true;
    bd_gltf_json_uint(json, NULL, number);
}

// A scene without nodes shows none, which a document without a scene would not.
static void write_scene(struct bd_gltf_writer *writer)
{
    struct bd_gltf_json *json = &writer->json;
    const struct bd_node *nodes = writer->scene->nodes;
    uint32_t next = writer->node_count;
    bool any = false;
    bd_gltf_json_uint(json, "scene", 0);
    bd_gltf_json_open(json, "scenes", '[');
    bd_gltf_json_open(json, NULL, '{');
    for (uint32_t i = 0; i < writer->slots.nodes; i++)
        if (!nodes[i].is_removed && nodes[i].parent == BD_NONE && !nodes[i].is_hidden)
            list_root(json, &any, (uint32_t)writer->numbers.nodes[i]);
    for (uint32_t i = 0; i < writer->slots.nodes; i++) {
        if (!needs_root(writer, &nodes[i])) continue;
        if (nodes[i].in_scene) list_root(json, &any, next);
        next++;
    }
    if (any) bd_gltf_json_close(json, '[');
    bd_gltf_json_close(json, '{');
    bd_gltf_json_close(json, '[');
}

void bd_gltf_write_nodes(struct bd_gltf_writer *writer)
{
    struct bd_gltf_json *json = &writer->json;
    struct children children;
    write_scene(writer);
    if (writer->node_count == 0) return;
    if (!list_children(writer, &children)) {
        json->no_memory = true;
        free_children(&children);
        return;
    }
    bd_gltf_json_open(json, "nodes", '[');
    for (uint32_t i = 0; i < writer->slots.nodes; i++)
        if (!writer->scene->nodes[i].is_removed) write_node(writer, i, &children);
    for (uint32_t i = 0; i < writer->slots.nodes; i++)
        if (needs_root(writer, &writer->scene->nodes[i]))
            write_root_of_mesh(writer, &writer->scene->nodes[i]);
    bd_gltf_json_close(json, '[');
    free_children(&children);
}
