#include "clients/cli/upload.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define PIECE_BYTES (1u << 20)

static enum bd_err ask_which_of(struct bd_cli_conn *conn, char **names, size_t count,
                                struct bd_cli_answer *answer, struct bd_err_detail *detail)
{
    Bounced__BlobHave have = BOUNCED__BLOB_HAVE__INIT;
    have.n_blobs = count;
    have.blobs = names;
    Bounced__Envelope envelope = BOUNCED__ENVELOPE__INIT;
    envelope.body_case = BOUNCED__ENVELOPE__BODY_BLOB_HAVE;
    envelope.blob_have = &have;
    return bd_cli_conn_call(conn, &envelope, NULL, 0, BOUNCED__ENVELOPE__BODY_BLOB_REPLY, NULL,
                            answer, detail);
}

static enum bd_err ask_which_are_held(struct bd_cli_conn *conn, const struct bd_cli_files *files,
                                      struct bd_cli_answer *answer, struct bd_err_detail *detail)
{
    char **names = calloc(files->count, sizeof *names);
    if (!names) return bd_err_set(detail, BD_ERR_NO_MEMORY, "", "no memory for a list of blobs");
    for (size_t i = 0; i < files->count; i++) names[i] = files->items[i].blob;
    enum bd_err err = ask_which_of(conn, names, files->count, answer, detail);
    free(names);
    return err;
}

static bool is_held(const Bounced__BlobReply *reply, const char *blob)
{
    for (size_t i = 0; i < reply->n_have; i++)
        if (strcmp(reply->have[i], blob) == 0) return true;
    return false;
}

// The same content under two uris travels once.
static bool came_before(const struct bd_cli_files *files, size_t index)
{
    for (size_t i = 0; i < index; i++)
        if (strcmp(files->items[i].blob, files->items[index].blob) == 0) return true;
    return false;
}

static enum bd_err put_piece(struct bd_cli_conn *conn, const char *blob, uint64_t size_bytes,
                             uint64_t offset, const void *bytes, size_t size, bool *complete,
                             struct bd_err_detail *detail)
{
    Bounced__BlobPut put = BOUNCED__BLOB_PUT__INIT;
    put.blob = (char *)blob;
    put.has_offset = put.has_size_bytes = 1;
    put.offset = offset;
    put.size_bytes = size_bytes;
    Bounced__Envelope envelope = BOUNCED__ENVELOPE__INIT;
    envelope.body_case = BOUNCED__ENVELOPE__BODY_BLOB_PUT;
    envelope.blob_put = &put;
    struct bd_cli_answer answer;
    enum bd_err err = bd_cli_conn_call(conn, &envelope, bytes, size,
                                       BOUNCED__ENVELOPE__BODY_BLOB_REPLY, NULL, &answer, detail);
    if (!err) *complete = answer.envelope->blob_reply->complete;
    bd_cli_answer_finish(&answer);
    return err;
}

struct upload {
    struct bd_cli_conn *conn;
    struct bd_cli_progress *progress;
    uint64_t sent_bytes, total_bytes;
    char *piece;
};

static enum bd_err put_open_file(struct upload *upload, const struct bd_cli_file *file, int fd,
                                 struct bd_err_detail *detail)
{
    bool complete = false;
    uint64_t offset = 0;
    do {
        // An empty file is one empty piece.
        ssize_t got = pread(fd, upload->piece, PIECE_BYTES, (off_t)offset);
        if (got < 0 || (got == 0 && file->size_bytes > 0))
            return bd_err_set(detail, BD_ERR_IO, file->path, "%.200s: %s", file->path,
                              got < 0 ? strerror(errno) : "changed while it was read");
        enum bd_err err = put_piece(upload->conn, file->blob, file->size_bytes, offset,
                                    upload->piece, (size_t)got, &complete, detail);
        if (err) return err;
        offset += (uint64_t)got;
        upload->sent_bytes += (uint64_t)got;
        bd_cli_progress_bar(upload->progress, upload->sent_bytes, upload->total_bytes);
    } while (!complete && offset < file->size_bytes);
    if (complete) return BD_ERR_OK;
    return bd_err_set(detail, BD_ERR_INTERNAL, file->path,
                      "%.200s: sent whole, and the daemon wants more", file->path);
}

static enum bd_err put_file(struct upload *upload, const struct bd_cli_file *file,
                            struct bd_err_detail *detail)
{
    uint64_t size_bytes = 0;
    int fd = bd_cli_open_regular(file->path, &size_bytes, detail);
    if (fd < 0) return detail ? detail->err : BD_ERR_IO;
    enum bd_err err = put_open_file(upload, file, fd, detail);
    close(fd);
    return err;
}

enum bd_err bd_cli_upload(struct bd_cli_conn *conn, const struct bd_cli_files *files,
                          struct bd_cli_progress *progress, struct bd_err_detail *detail)
{
    struct bd_cli_answer answer;
    enum bd_err err = ask_which_are_held(conn, files, &answer, detail);
    if (err) {
        bd_cli_answer_finish(&answer);
        return err;
    }
    const Bounced__BlobReply *held = answer.envelope->blob_reply;
    struct upload upload = {.conn = conn, .progress = progress, .piece = malloc(PIECE_BYTES)};
    if (!upload.piece)
        err = bd_err_set(detail, BD_ERR_NO_MEMORY, "", "no memory for a piece of a file");
    for (size_t i = 0; i < files->count; i++)
        if (!is_held(held, files->items[i].blob) && !came_before(files, i))
            upload.total_bytes += files->items[i].size_bytes;
    if (upload.total_bytes > PIECE_BYTES) bd_cli_progress_stage(progress, "upload");
    for (size_t i = 0; !err && i < files->count; i++)
        if (!is_held(held, files->items[i].blob) && !came_before(files, i))
            err = put_file(&upload, &files->items[i], detail);
    free(upload.piece);
    bd_cli_answer_finish(&answer);
    return err;
}

enum bd_err bd_cli_upload_bytes(struct bd_cli_conn *conn, const char *blob, const void *bytes,
                                size_t size, struct bd_err_detail *detail)
{
    bool complete = false;
    size_t at = 0;
    enum bd_err err;
    do {
        size_t piece = size - at < PIECE_BYTES ? size - at : PIECE_BYTES;
        err = put_piece(conn, blob, size, at, (const char *)bytes + at, piece, &complete, detail);
        at += piece;
    } while (!err && !complete && at < size);
    if (err || complete) return err;
    return bd_err_set(detail, BD_ERR_INTERNAL, "server",
                      "%.80s: sent whole, and the daemon wants more", blob);
}

enum bd_err bd_cli_upload_is_held(struct bd_cli_conn *conn, const char *blob, bool *out,
                                  struct bd_err_detail *detail)
{
    struct bd_cli_answer answer;
    char *names[] = {(char *)blob};
    enum bd_err err = ask_which_of(conn, names, 1, &answer, detail);
    *out = !err && is_held(answer.envelope->blob_reply, blob);
    bd_cli_answer_finish(&answer);
    return err;
}

enum bd_err bd_cli_upload_table(const struct bd_cli_files *files, Bounced__KeyValue ***out,
                                size_t *count)
{
    *count = files->count - 1;
    // Pointers first, then what they point at, in one allocation; never of size 0.
    Bounced__KeyValue **table = malloc(files->count * (sizeof *table + sizeof **table));
    if (!table) return BD_ERR_NO_MEMORY;
    Bounced__KeyValue *entries = (Bounced__KeyValue *)(void *)(table + files->count);
    for (size_t i = 0; i < *count; i++) {
        bounced__key_value__init(&entries[i]);
        entries[i].key = files->items[i + 1].uri;
        entries[i].value = files->items[i + 1].blob;
        table[i] = &entries[i];
    }
    *out = table;
    return BD_ERR_OK;
}

void bd_cli_upload_table_free(Bounced__KeyValue **table)
{
    free(table);
}
