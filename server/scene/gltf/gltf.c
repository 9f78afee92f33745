#include "scene/gltf/gltf.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "scene/gltf/gltf_reader.h"
#include "scene/gltf/gltf_scan.h"
#include "scene/gltf/gltf_schema.h"

struct bd_gltf_path bd_gltf_path(const char *format, ...)
{
    struct bd_gltf_path path;
    va_list args;
    va_start(args, format);
    vsnprintf(path.text, sizeof path.text, format, args);
    va_end(args);
    return path;
}

enum bd_err bd_gltf_no_memory(struct bd_gltf_reader *reader, const char *path)
{
    return bd_err_set(reader->detail, BD_ERR_NO_MEMORY, path,
                      "the import needs more memory than its limit");
}

// Cut where it is too long, but never inside a character.
void bd_gltf_copy_name(char name[64], const char *text)
{
    size_t length = strnlen(text, 64);
    if (length == 64) {
        length = 63;
        while (length > 0 && ((unsigned char)text[length] & 0xc0) == 0x80) length--;
    }
    memset(name, 0, 64);
    memcpy(name, text, length);
}

static void flag_repairs(struct bd_gltf_reader *reader)
{
    const struct bd_gltf_repairs *repairs = &reader->repairs;
    const struct {
        const char *name;
        uint32_t count;
    } flags[] = {
        {"nonfinite_vertices", repairs->mesh.nonfinite_vertices},
        {"degenerate_triangles", repairs->mesh.degenerate_triangles},
        {"incomplete_triangles", repairs->incomplete_triangles},
        {"repaired_normals", repairs->mesh.repaired_normals},
        {"normals_against_winding", repairs->normals_against_winding},
        {"repaired_tangents", repairs->mesh.repaired_tangents},
        {"nonfinite_texcoords", repairs->nonfinite_texcoords},
        {"clamped_factors", repairs->clamped_factors},
        {"repaired_rotations", repairs->repaired_rotations},
        {"non_affine_matrices", repairs->non_affine_matrices},
        {"repaired_cameras", repairs->repaired_cameras},
        {"repaired_lights", repairs->repaired_lights},
        {"odd_skin_weights", repairs->odd_skin_weights},
        {"skipped_points_or_lines", repairs->skipped_primitives},
        {"missing_positions", repairs->missing_positions},
        {"missing_texcoords", repairs->missing_texcoords},
        {"uv_sets_ignored", repairs->uv_sets_ignored},
    };
    for (size_t i = 0; i < sizeof flags / sizeof flags[0]; i++)
        if (flags[i].count) bd_scene_flag(reader->scene, "%s: %u", flags[i].name, flags[i].count);
    for (uint32_t i = 0; i < reader->doc->extension_used_count; i++)
        if (!bd_gltf_extension_is_supported(reader->doc->extensions_used[i]))
            bd_scene_flag(reader->scene, "extension_ignored: %.60s",
                          reader->doc->extensions_used[i]);
}

static enum bd_err read_document(struct bd_gltf_reader *reader)
{
    enum bd_err err = bd_gltf_check(reader);
    if (err == BD_ERR_OK) err = bd_gltf_read_materials(reader);
    if (err == BD_ERR_OK) err = bd_gltf_read_pictures(reader);
    if (err == BD_ERR_OK) err = bd_gltf_read_nodes(reader);
    if (err == BD_ERR_OK) err = bd_gltf_read_meshes(reader);
    if (err == BD_ERR_OK) err = bd_gltf_read_environment(reader);
    if (err == BD_ERR_OK) flag_repairs(reader);
    return err;
}

static enum bd_err no_scene(struct bd_err_detail *detail)
{
    return bd_err_set(detail, BD_ERR_BAD_INPUT, "scenes", "the file holds no scene and no nodes");
}

static uint64_t size_of_all(const struct bd_import_file *files, uint32_t file_count)
{
    uint64_t sum = 0;
    for (uint32_t i = 0; i < file_count; i++) sum += files[i].size_bytes;
    return sum;
}

static enum bd_err read_parsed(const struct bd_gltf_document *doc,
                               const struct bd_import_file *files, uint32_t file_count,
                               const struct bd_import_limits *limits,
                               struct bd_picture_queue *pictures, struct bd_scene **out,
                               struct bd_err_detail *detail)
{
    struct bd_gltf_reader reader = {.doc = doc,
                                    .files = files,
                                    .file_count = file_count,
                                    .limits = limits,
                                    .pictures = pictures,
                                    .scene = bd_scene_create(),
                                    .detail = detail,
                                    .input_bytes = size_of_all(files, file_count),
                                    .vertex_bytes_left = limits->scene_bytes};
    enum bd_err err = read_document(&reader);
    if (err == BD_ERR_OK && doc->scene_count == 0 && doc->node_count == 0) err = no_scene(detail);
    free(reader.uv_slots);
    if (err == BD_ERR_OK)
        *out = reader.scene;
    else
        bd_scene_release(&reader.scene);
    return err;
}

enum bd_err bd_gltf_read_waiting(const struct bd_import_file *files, uint32_t file_count,
                                 const struct bd_import_limits *limits,
                                 struct bd_picture_queue *pictures,
                                 struct bd_gltf_document **document, struct bd_scene **out,
                                 struct bd_err_detail *detail)
{
    *out = NULL;
    *document = NULL;
    struct bd_gltf_text text;
    enum bd_err err = bd_gltf_scan(files[0].bytes, files[0].size_bytes, &text, detail);
    if (err == BD_ERR_OK)
        err =
            bd_gltf_parse(text.bytes, text.size, text.is_glb, files, file_count, document, detail);
    // What tinygltf cannot do with a legal fragment is not the fragment's first trouble. What our
    // own checks find in one is.
    if (err == BD_ERR_BAD_INPUT && text.is_scanned && !text.has_scene) err = no_scene(detail);
    bd_gltf_text_free(&text);
    if (err == BD_ERR_OK)
        err = read_parsed(*document, files, file_count, limits, pictures, out, detail);
    if (err == BD_ERR_OK && text.min_version[0])
        bd_scene_flag(*out, "min_version: %s", text.min_version);
    if (err == BD_ERR_OK && text.dataless_buffer_count)
        bd_scene_flag(*out, "buffers_without_data: %u", text.dataless_buffer_count);
    return err;
}

static enum bd_err fill_pictures(struct bd_scene *scene, struct bd_picture_queue *pictures,
                                 struct bd_err_detail *detail)
{
    enum bd_err err = BD_ERR_OK;
    for (uint32_t i = 0; !err && i < scene->picture_count; i++)
        err = bd_picture_queue_take(pictures, &scene->pictures[i]->rgba, detail);
    return err;
}

enum bd_err bd_gltf_read(const struct bd_import_file *files, uint32_t file_count,
                         const struct bd_import_limits *limits, struct bd_scene **out,
                         struct bd_err_detail *detail)
{
    *out = NULL;
    struct bd_gltf_document *document = NULL;
    struct bd_picture_queue *pictures = bd_picture_queue_create(0);
    if (!pictures) return bd_err_set(detail, BD_ERR_NO_MEMORY, "", "no memory for the pictures");
    enum bd_err err =
        bd_gltf_read_waiting(files, file_count, limits, pictures, &document, out, detail);
    if (err == BD_ERR_OK) err = fill_pictures(*out, pictures, detail);
    bd_picture_queue_destroy(&pictures);
    bd_gltf_document_destroy(&document);
    if (err == BD_ERR_OK)
        bd_scene_seal(*out);
    else
        bd_scene_release(out);
    return err;
}
