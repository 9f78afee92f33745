#include "scene/gltf/gltf_write.h"

#include <inttypes.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "scene/gltf/gltf_schema.h"
#include "scene/gltf/gltf_write_parts.h"

// --- notes ----------------------------------------------------------------------------------

static void note(struct bd_scene_flags *notes, const char *name, uint64_t count)
{
    if (count == 0 || notes->count == BD_SCENE_FLAG_MAX) return;
    snprintf(notes->text[notes->count++], sizeof notes->text[0], "%s: %" PRIu64, name, count);
}

static void write_notes(const struct bd_gltf_writer *writer)
{
    struct bd_scene_flags *notes = writer->notes;
    note(notes, "left_out_empty_meshes", writer->left_out.empty_meshes);
    note(notes, "left_out_empty_primitives", writer->left_out.empty_primitives);
    note(notes, "left_out_degenerate_triangles", writer->left_out.degenerate_triangles);
    note(notes, "left_out_unused_vertices", writer->left_out.unused_vertices);
    note(notes, "left_out_unread_tangents", writer->left_out.unread_tangents);
    note(notes, "left_out_unshown_pictures", writer->left_out.unshown_pictures);
    note(notes, "materials_split", writer->left_out.split_materials);
    note(notes, "world_space_meshes_moved", writer->left_out.world_space_meshes);
}

// --- the document ---------------------------------------------------------------------------

// NULL: there are no more.
static const char *extension_name(uint32_t extension)
{
    static const char *const names[] = {
#define X(name, text) [BD_GLTF_EXTENSION_##name] = text,
        BD_GLTF_EXTENSION_MAP(X)
#undef X
    };
    return extension < BD_GLTF_EXTENSION_COUNT
               ? names[extension]
               : bd_gltf_material_extension(extension - BD_GLTF_EXTENSION_COUNT);
}

void bd_gltf_open_extension(struct bd_gltf_writer *writer, uint32_t extension)
{
    writer->extensions |= 1u << extension;
    bd_gltf_json_open(&writer->json, extension_name(extension), '{');
}

static void write_extensions_used(struct bd_gltf_writer *writer)
{
    if (!writer->extensions) return;
    bd_gltf_json_open(&writer->json, "extensionsUsed", '[');
    for (uint32_t i = 0; extension_name(i); i++)
        if (writer->extensions & 1u << i) bd_gltf_json_text(&writer->json, NULL, extension_name(i));
    bd_gltf_json_close(&writer->json, '[');
}

static void write_asset(struct bd_gltf_json *json)
{
    bd_gltf_json_open(json, "asset", '{');
    bd_gltf_json_text(json, "version", "2.0");
    bd_gltf_json_text(json, "generator", "bounced");
    bd_gltf_json_close(json, '{');
}

static void write_root_extensions(struct bd_gltf_writer *writer)
{
    if (bd_scene_count(writer->scene).lights == 0 && !bd_gltf_has_environment(writer->scene))
        return;
    bd_gltf_json_open(&writer->json, "extensions", '{');
    bd_gltf_write_environment(writer);
    bd_gltf_write_lights(writer);
    bd_gltf_json_close(&writer->json, '{');
}

static enum bd_err no_memory(const struct bd_gltf_writer *writer)
{
    return bd_err_set(writer->detail, BD_ERR_NO_MEMORY, "scene", "no memory for the export");
}

static enum bd_err write_document(struct bd_gltf_writer *writer)
{
    struct bd_gltf_json *json = &writer->json;
    if (!bd_gltf_plan(writer) || !bd_gltf_settle_meshes(writer)) return no_memory(writer);
    bd_gltf_plan_pictures(writer);
    bd_gltf_json_open(json, NULL, '{');
    write_asset(json);
    bd_gltf_write_nodes(writer);
    if (!bd_gltf_write_meshes(writer)) return no_memory(writer);
    bd_gltf_write_materials(writer);
    enum bd_err err = bd_gltf_write_textures(writer);
    if (err != BD_ERR_OK) return err;
    bd_gltf_write_cameras(writer);
    write_root_extensions(writer);
    bd_gltf_write_views(writer);
    write_extensions_used(writer);
    bd_gltf_json_close(json, '{');
    return json->no_memory ? no_memory(writer) : BD_ERR_OK;
}

// --- the file -------------------------------------------------------------------------------

static void put_u32(uint8_t *at, uint64_t value)
{
    BD_ASSERT_CMP(value, <=, UINT32_MAX);
    for (int i = 0; i < 4; i++) at[i] = (uint8_t)(value >> 8 * i);
}

static enum bd_err check_size(const struct bd_gltf_writer *writer, uint64_t size_bytes,
                              uint64_t bytes_max)
{
    if (size_bytes <= bytes_max) return BD_ERR_OK;
    return bd_err_set(writer->detail, BD_ERR_LIMIT, "scene",
                      "as a .glb the scene has %" PRIu64 " bytes, above the limit of %" PRIu64,
                      size_bytes, bytes_max);
}

// Header, JSON chunk padded by spaces, binary chunk padded by zeros; without the latter where it
// would be empty.
static enum bd_err assemble(const struct bd_gltf_writer *writer, uint64_t bytes_max,
                            struct bd_bytes *out)
{
    const struct bd_bytes *text = &writer->json.text;
    const uint64_t text_bytes = (text->size_bytes + 3) & ~3ull;
    const uint64_t binary_bytes = bd_gltf_views_bytes(writer);
    const uint64_t size_bytes = 20 + text_bytes + (binary_bytes ? 8 + binary_bytes : 0);
    enum bd_err err = check_size(writer, size_bytes, bytes_max);
    if (err != BD_ERR_OK) return err;
    uint8_t *at = malloc(size_bytes);
    if (!at) return no_memory(writer);
    *out = (struct bd_bytes){at, size_bytes, size_bytes};
    memcpy(at, "glTF", 4);
    put_u32(at + 4, 2);
    put_u32(at + 8, size_bytes);
    put_u32(at + 12, text_bytes);
    memcpy(at + 16, "JSON", 4);
    memcpy(at + 20, text->data, text->size_bytes);
    memset(at + 20 + text->size_bytes, ' ', text_bytes - text->size_bytes);
    if (!binary_bytes) return BD_ERR_OK;
    at += 20 + text_bytes;
    put_u32(at, binary_bytes);
    memcpy(at + 4, "BIN", 4); // with its final zero
    bd_gltf_copy_views(writer, at + 8);
    return BD_ERR_OK;
}

enum bd_err bd_gltf_write(const struct bd_scene *scene, uint64_t bytes_max, struct bd_bytes *out,
                          struct bd_scene_flags *notes, struct bd_err_detail *detail)
{
    BD_ASSERT(bd_scene_is_finished(scene));
    BD_ASSERT_CMP(bytes_max, <=, (uint64_t)BD_GLB_BYTES_MAX);
    struct bd_gltf_writer writer = {.scene = scene, .detail = detail, .notes = notes};
    enum bd_err err = write_document(&writer);
    if (err == BD_ERR_OK) err = assemble(&writer, bytes_max, out);
    if (err == BD_ERR_OK) write_notes(&writer);
    bd_gltf_free_views(&writer);
    bd_gltf_free_meshes(&writer);
    bd_gltf_plan_free(&writer);
    bd_bytes_finish(&writer.json.text);
    return err;
}
