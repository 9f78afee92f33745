// Files to the daemon: which of them it lacks, then those, in pieces. Thread: main.

#ifndef BD_CLI_UPLOAD_H
#define BD_CLI_UPLOAD_H

#include "base/err.h"
#include "clients/cli/conn.h"
#include "clients/cli/files.h"
#include "clients/cli/progress.h"

// Afterwards the daemon holds every blob of `files`.
BD_MUST_CHECK
enum bd_err bd_cli_upload(struct bd_cli_conn *conn, const struct bd_cli_files *files,
                          struct bd_cli_progress *progress, struct bd_err_detail *detail);

// One blob out of memory, whether the daemon holds it or not.
BD_MUST_CHECK
enum bd_err bd_cli_upload_bytes(struct bd_cli_conn *conn, const char *blob, const void *bytes,
                                size_t size, struct bd_err_detail *detail);
BD_MUST_CHECK
enum bd_err bd_cli_upload_is_held(struct bd_cli_conn *conn, const char *blob, bool *out,
                                  struct bd_err_detail *detail);

// The table of a request: one entry for each file but the scene itself. `*out` borrows from
// `files`; free it with bd_cli_upload_table_free.
BD_MUST_CHECK
enum bd_err bd_cli_upload_table(const struct bd_cli_files *files, Bounced__KeyValue ***out,
                                size_t *count);
void bd_cli_upload_table_free(Bounced__KeyValue **table);

#endif
