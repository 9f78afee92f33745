#include "net/command/import_files.h"

#include <stdlib.h>
#include <string.h>

#include "base/assert.h"

void bd_import_files_begin(struct bd_import_files *files, size_t count)
{
    *files = (struct bd_import_files){0};
    files->files = calloc(count, sizeof *files->files);
    files->maps = calloc(count, sizeof *files->maps);
    BD_ASSERT(files->files && files->maps);
}

void bd_import_files_finish(struct bd_import_files *files)
{
    for (uint32_t i = 0; i < files->map_count; i++) bd_blob_unmap(&files->maps[i]);
    free(files->maps);
    free(files->files);
    *files = (struct bd_import_files){0};
}

enum bd_err bd_net_map_blob(struct bd_blobs *blobs, const char *field, const char *blob,
                            struct bd_blob_map *out, struct bd_err_detail *detail)
{
    if (!blob || strncmp(blob, "sha256:", 7) != 0 || !bd_blob_name_is_valid(blob + 7))
        return bd_err_set(detail, BD_ERR_USAGE, field,
                          "a blob's name is sha256: and 64 lower-case hexadecimal digits");
    return bd_blobs_map(blobs, blob + 7, out, detail);
}

static enum bd_err map_one(struct bd_import_files *files, struct bd_blobs *blobs, const char *uri,
                           const char *blob, struct bd_err_detail *detail)
{
    struct bd_blob_map *map = &files->maps[files->map_count];
    enum bd_err err = bd_net_map_blob(blobs, uri, blob, map, detail);
    if (err) return err;
    files->map_count++;
    files->files[files->file_count++] =
        (struct bd_import_file){.uri = uri, .bytes = map->bytes, .size_bytes = map->size_bytes};
    return BD_ERR_OK;
}

enum bd_err bd_import_files_map(struct bd_import_files *out, struct bd_blobs *blobs,
                                const char *name, const char *blob, Bounced__KeyValue **table,
                                size_t table_size, struct bd_err_detail *detail)
{
    bd_import_files_begin(out, table_size + 1);
    enum bd_err err = map_one(out, blobs, name && *name ? name : "scene", blob, detail);
    for (size_t i = 0; !err && i < table_size; i++)
        err = map_one(out, blobs, table[i]->key ? table[i]->key : "", table[i]->value, detail);
    return err;
}

struct bd_import_limits bd_import_limits_of(const struct bd_limits *limits)
{
    struct bd_import_limits out = bd_import_default_limits;
    out.memory_bytes = limits->import_bytes;
    out.cpu_seconds = (uint32_t)limits->import_cpu_seconds;
    out.wall_seconds = (uint32_t)limits->import_wall_seconds;
    out.scene_bytes = limits->scene_bytes;
    out.triangle_count = limits->scene_triangles;
    out.picture_side_px = (uint32_t)limits->picture_side_px;
    out.picture_texels_kept = out.picture_texels = limits->picture_texels;
    return out;
}
