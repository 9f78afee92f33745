// The scene of a request: a file, sent as blobs, or one that the daemon holds; and the sky over it.
//
// Thread: main.

#ifndef BD_CLI_SOURCE_H
#define BD_CLI_SOURCE_H

#include <stdbool.h>

#include "base/err.h"
#include "clients/cli/conn.h"
#include "clients/cli/files.h"
#include "clients/cli/progress.h"

struct bd_cli_source {
    const char *scene; // a path, or "scene:ID"; borrowed
    struct bd_cli_files files, sky;
    Bounced__KeyValue **table; // of `files`
    size_t table_count;
    bool has_environment;
    Bounced__Environment environment;
    double radiance[3];
};

// What can be seen to fail before a daemon is started for it. `environment` is "R,G,B" in cd/m^2,
// an .exr or .hdr, or NULL for none; it goes with a file.
BD_MUST_CHECK
enum bd_err bd_cli_source_check(const char *scene, const char *environment,
                                struct bd_err_detail *detail);

// Reads and hashes the files, notes those that are missing, and sends what the daemon lacks. Finish
// `out` either way; do not move it.
BD_MUST_CHECK
enum bd_err bd_cli_source_send(struct bd_cli_source *out, const char *scene,
                               const char *environment, struct bd_cli_conn *conn,
                               struct bd_cli_progress *progress, struct bd_err_detail *detail);
void bd_cli_source_finish(struct bd_cli_source *source);

// Names the scene in a request, which borrows from `source`.
void bd_cli_source_fill_render(const struct bd_cli_source *source, Bounced__Render *render);
void bd_cli_source_fill_add(const struct bd_cli_source *source, Bounced__SceneAdd *add);

#endif
