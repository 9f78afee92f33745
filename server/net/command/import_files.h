// The files of an import: blobs, mapped for as long as it takes.
//
// Thread: libuv's pool.

#ifndef BD_NET_COMMAND_IMPORT_FILES_H
#define BD_NET_COMMAND_IMPORT_FILES_H

#include "base/err.h"
#include "protocol/bounced.pb-c.h"
#include "protocol/limits.h"
#include "scene/blobs/blobs.h"
#include "scene/import/import.h"

struct bd_import_files {
    struct bd_import_file *files;
    struct bd_blob_map *maps;
    uint32_t file_count, map_count;
};

// Room for so many; nothing is mapped yet.
void bd_import_files_begin(struct bd_import_files *files, size_t count);
void bd_import_files_finish(struct bd_import_files *files);

// The main file and the table of the others. BD_ERR_USAGE names the uri whose blob has no proper
// name, BD_ERR_NOT_FOUND the blob that is not there. Finish it either way.
BD_MUST_CHECK
enum bd_err bd_import_files_map(struct bd_import_files *out, struct bd_blobs *blobs,
                                const char *name, const char *blob, Bounced__KeyValue **table,
                                size_t table_size, struct bd_err_detail *detail);

// What the server's limits say of an import.
struct bd_import_limits bd_import_limits_of(const struct bd_limits *limits);

// Maps one blob by its wire name, "sha256:HEX"; `field` is for the error.
BD_MUST_CHECK
enum bd_err bd_net_map_blob(struct bd_blobs *blobs, const char *field, const char *blob,
                            struct bd_blob_map *out, struct bd_err_detail *detail);

#endif
