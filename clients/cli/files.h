// The files that a scene is made of: the one named on the command line, and those that its uris
// mean, the uris of a .glb too. Each gets its SHA-256, so that a server which holds it need not be
// sent it.
//
// The daemon opens no path that a request names, so uris are resolved here, and strictly: a scene
// from a stranger must not be able to send the reader's other files anywhere. Refused, with the
// JSON path: absolute paths, schemes (data: is left inline), and everything that leaves the
// scene's folder after percent-decoding and symbolic links. A file that is not there is left out
// and noted: whether the scene can do without it is the importer's decision.
//
// Thread: main.

#ifndef BD_CLI_FILES_H
#define BD_CLI_FILES_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/err.h"
#include "base/hash.h"

#define BD_CLI_BLOB_NAME (7 + BD_SHA256_HEX) // "sha256:" and the digits

struct bd_cli_file {
    char *uri;  // as the scene spells it; NULL for the scene itself
    char *path; // canonical, but for the scene's own: as given
    uint64_t size_bytes;
    char blob[BD_CLI_BLOB_NAME];
};

struct bd_cli_files {
    struct bd_cli_file *items; // items[0] is the scene
    size_t count;
    char *missing; // uris of files that are not there, one a line; NULL if there are none
};

// Reads and hashes everything. BD_ERR_IO if the scene itself cannot be read; BD_ERR_BAD_INPUT for
// a uri as above; BD_ERR_CANCELLED on Ctrl-C.
BD_MUST_CHECK
enum bd_err bd_cli_files_collect(const char *scene_path, struct bd_cli_files *out,
                                 struct bd_err_detail *detail);
// One file alone, whatever is in it.
BD_MUST_CHECK
enum bd_err bd_cli_files_one(const char *path, struct bd_cli_files *out,
                             struct bd_err_detail *detail);
void bd_cli_files_finish(struct bd_cli_files *files);

// One uri against the scene's folder (canonical, as realpath gives it). On success `*path` is the
// canonical path of a file inside it (malloc'ed), or NULL if the uri is a data: one or nothing is
// there, which `*is_data` tells apart. BD_ERR_BAD_INPUT otherwise, with the reason in `detail`.
BD_MUST_CHECK
enum bd_err bd_cli_resolve_uri(const char *folder, const char *uri, char **path, bool *is_data,
                               struct bd_err_detail *detail);

// Opens a regular file for reading: no FIFO or device, which could block or never end.
// -1 and a filled `detail` if that fails.
int bd_cli_open_regular(const char *path, uint64_t *size_bytes, struct bd_err_detail *detail);

#endif
