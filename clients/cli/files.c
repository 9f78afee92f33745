#include "clients/cli/files.h"

#include <errno.h>
#include <jansson.h>
#include <libgen.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "clients/cli/interrupt.h"

#define CHUNK_BYTES    (1u << 20)
#define JSON_BYTES_MAX (1u << 30) // of a .gltf; beyond it the server's limits have long spoken
#define GLB_HEAD_BYTES 20         // header, then length and type of the first chunk

static enum bd_err hash_file(int fd, struct bd_cli_file *file, struct bd_err_detail *detail)
{
    struct bd_sha256 *sha = bd_sha256_create();
    char *chunk = malloc(CHUNK_BYTES);
    enum bd_err err = BD_ERR_OK;
    uint64_t offset = 0;
    ssize_t got = 0;
    while (!err && (got = pread(fd, chunk, CHUNK_BYTES, (off_t)offset)) > 0) {
        bd_sha256_update(sha, chunk, (size_t)got);
        offset += (uint64_t)got;
        if (bd_interrupted()) err = bd_err_set(detail, BD_ERR_CANCELLED, "", "interrupted");
    }
    free(chunk);
    if (!err && (got < 0 || offset != file->size_bytes))
        err = bd_err_set(detail, BD_ERR_IO, file->path, "%.200s: %s", file->path,
                         got < 0 ? strerror(errno) : "changed while it was read");
    uint8_t digest[BD_SHA256_BYTES];
    bd_sha256_finish(&sha, digest);
    memcpy(file->blob, "sha256:", 7);
    bd_sha256_hex(digest, file->blob + 7);
    return err;
}

// Takes `path` and `uri` (malloc'ed, NULL for the scene itself), also when it fails.
static enum bd_err add_file(struct bd_cli_files *files, char *path, char *uri,
                            struct bd_err_detail *detail)
{
    struct bd_cli_file file = {.uri = uri, .path = path};
    enum bd_err err = BD_ERR_OK;
    struct bd_cli_file *grown = realloc(files->items, (files->count + 1) * sizeof *grown);
    if (!grown) {
        err = bd_err_set(detail, BD_ERR_NO_MEMORY, "scene", "no memory for the table of files");
        goto release_file;
    }
    files->items = grown;
    int fd = bd_cli_open_regular(path, &file.size_bytes, detail);
    if (fd < 0) {
        err = detail ? detail->err : BD_ERR_IO;
        goto release_file;
    }
    err = hash_file(fd, &file, detail);
    close(fd);
    if (err) goto release_file;
    files->items[files->count++] = file;
    return BD_ERR_OK;

release_file:
    free(path);
    free(uri);
    return err;
}

static bool known_uri(const struct bd_cli_files *files, const char *uri)
{
    for (size_t i = 1; i < files->count; i++)
        if (strcmp(files->items[i].uri, uri) == 0) return true;
    return false;
}

static void note_missing(struct bd_cli_files *files, const char *uri)
{
    char *all = NULL;
    if (asprintf(&all, "%s%s\n", files->missing ? files->missing : "", uri) < 0) return;
    free(files->missing);
    files->missing = all;
}

static enum bd_err add_uri(struct bd_cli_files *files, const char *folder, const char *uri,
                           struct bd_err_detail *detail)
{
    char *path = NULL;
    bool is_data = false;
    if (known_uri(files, uri)) return BD_ERR_OK;
    enum bd_err err = bd_cli_resolve_uri(folder, uri, &path, &is_data, detail);
    if (err) return err;
    if (!path) {
        if (!is_data) note_missing(files, uri);
        return BD_ERR_OK;
    }
    char *copy = strdup(uri);
    if (copy) return add_file(files, path, copy, detail);
    free(path);
    return bd_err_set(detail, BD_ERR_NO_MEMORY, "scene", "no memory for the table of files");
}

// Uris of one list ("buffers", "images"). Shapes that glTF does not allow are passed over: the
// importer refuses them better than this could.
static enum bd_err add_uris(struct bd_cli_files *files, const char *folder, const json_t *root,
                            const char *list, struct bd_err_detail *detail)
{
    const json_t *items = json_object_get(root, list);
    for (size_t i = 0; i < json_array_size(items); i++) {
        const char *uri = json_string_value(json_object_get(json_array_get(items, i), "uri"));
        if (!uri) continue;
        struct bd_err_detail inner = {0};
        enum bd_err err = add_uri(files, folder, uri, &inner);
        if (!err) continue;
        char field[64];
        snprintf(field, sizeof field, "%s[%zu].uri", list, i);
        return bd_err_set(detail, err, field, "%s: %s", field, inner.message);
    }
    return BD_ERR_OK;
}

static uint32_t u32_le(const uint8_t *bytes)
{
    return (uint32_t)bytes[0] | (uint32_t)bytes[1] << 8 | (uint32_t)bytes[2] << 16 |
           (uint32_t)bytes[3] << 24;
}

// Where the JSON lies: all of a .gltf, the first chunk of a .glb. False if neither fits.
static bool find_json(int fd, uint64_t size_bytes, uint64_t *offset, uint64_t *json_bytes)
{
    uint8_t head[GLB_HEAD_BYTES];
    *offset = 0;
    *json_bytes = size_bytes;
    if (pread(fd, head, sizeof head, 0) == (ssize_t)sizeof head && memcmp(head, "glTF", 4) == 0) {
        *offset = sizeof head;
        *json_bytes = u32_le(head + 12);
    }
    return *json_bytes <= JSON_BYTES_MAX && *offset + *json_bytes <= size_bytes;
}

static json_t *parse_json(const char *path)
{
    uint64_t size_bytes = 0, offset = 0, json_bytes = 0;
    int fd = bd_cli_open_regular(path, &size_bytes, NULL);
    if (fd < 0) return NULL;
    json_t *root = NULL;
    char *text = find_json(fd, size_bytes, &offset, &json_bytes) ? malloc(json_bytes + 1) : NULL;
    if (text && pread(fd, text, json_bytes, (off_t)offset) == (ssize_t)json_bytes)
        root = json_loadb(text, json_bytes, JSON_DISABLE_EOF_CHECK | JSON_ALLOW_NUL, NULL);
    free(text);
    close(fd);
    return root;
}

// What cannot be parsed here is sent alone, and refused by the importer with the reason.
static enum bd_err add_referenced(struct bd_cli_files *files, struct bd_err_detail *detail)
{
    json_t *root = parse_json(files->items[0].path);
    if (!root) return BD_ERR_OK;
    // The folder of the name that was given, also where that is a link to a file elsewhere.
    char *copy = strdup(files->items[0].path);
    char *folder = copy ? realpath(dirname(copy), NULL) : NULL;
    enum bd_err err = BD_ERR_OK;
    if (!folder) err = bd_err_set(detail, BD_ERR_IO, "scene", "the scene's folder is gone");
    if (!err) err = add_uris(files, folder, root, "buffers", detail);
    if (!err) err = add_uris(files, folder, root, "images", detail);
    free(folder);
    free(copy);
    json_decref(root);
    return err;
}

enum bd_err bd_cli_files_one(const char *path, struct bd_cli_files *out,
                             struct bd_err_detail *detail)
{
    *out = (struct bd_cli_files){0};
    char *copy = strdup(path);
    if (!copy) return bd_err_set(detail, BD_ERR_NO_MEMORY, path, "no memory for a path");
    return add_file(out, copy, NULL, detail);
}

enum bd_err bd_cli_files_collect(const char *scene_path, struct bd_cli_files *out,
                                 struct bd_err_detail *detail)
{
    enum bd_err err = bd_cli_files_one(scene_path, out, detail);
    if (!err) err = add_referenced(out, detail);
    if (err) bd_cli_files_finish(out);
    return err;
}

void bd_cli_files_finish(struct bd_cli_files *files)
{
    for (size_t i = 0; i < files->count; i++) {
        free(files->items[i].uri);
        free(files->items[i].path);
    }
    free(files->items);
    free(files->missing);
    *files = (struct bd_cli_files){0};
}
