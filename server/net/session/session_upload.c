// Blobs on their way in by a session: pieces in order, several blobs at once.

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "net/access/auth.h"
#include "net/loop/spool.h"
#include "net/session/session_internal.h"

// One blob on its way in.
struct bd_session_upload {
    struct bd_session *session;
    char blob[8 + BD_SHA256_HEX];
    uint64_t size_bytes;
    uint64_t last_request_id; // of the piece that completes it: answered when it is kept
    struct bd_spool *spool;   // NULL: the disk failed, which the next piece is told
    struct bd_err_detail detail;
    struct bd_session_upload *next;
};

static void forget_upload(struct bd_session_upload *upload)
{
    struct bd_session *session = upload->session;
    struct bd_session_upload **at = &session->uploads;
    while (*at != upload) at = &(*at)->next;
    *at = upload->next;
    session->upload_count--;
    bd_spool_abandon(&upload->spool);
    free(upload);
}

static void on_upload_drained(void *user)
{
    bd_session_update_reading(((struct bd_session_upload *)user)->session);
}

// Once the last piece is there it is what is answered. Before, all that came have been.
static void on_upload_ended(void *user, enum bd_err err, const struct bd_err_detail *detail)
{
    struct bd_session_upload *upload = user;
    struct bd_session *session = upload->session;
    if (err && !upload->last_request_id) {
        upload->detail = *detail;
        bd_spool_abandon(&upload->spool);
        bd_session_update_reading(session);
        return;
    }
    if (err) {
        bd_session_send_error(session, upload->last_request_id, detail);
    } else {
        struct bd_answer answer = bd_answer_blob(upload->size_bytes, true);
        bd_session_send(session, upload->last_request_id, &answer);
    }
    forget_upload(upload);
    bd_session_update_reading(session);
}

static const struct bd_spool_events upload_events = {on_upload_drained, on_upload_ended};

static struct bd_session_upload *find_upload(const struct bd_session *session, const char *blob)
{
    struct bd_session_upload *upload = session->uploads;
    while (upload && strcmp(upload->blob, blob) != 0) upload = upload->next;
    return upload;
}

static enum bd_err check_first_piece(const struct bd_session *session, const Bounced__BlobPut *put,
                                     struct bd_err_detail *detail)
{
    uint64_t most = session->loop->serving->limits.blob_bytes;
    enum bd_err err = bd_grant_check_role(session->grant, BD_ROLE_EDIT, detail);
    if (err) return err;
    if (!put->blob || strncmp(put->blob, "sha256:", 7) != 0 ||
        !bd_blob_name_is_valid(put->blob + 7))
        return bd_err_set(detail, BD_ERR_USAGE, "blob",
                          "a blob's name is sha256: and 64 lower-case hexadecimal digits");
    if (put->size_bytes > most)
        return bd_err_set(detail, BD_ERR_LIMIT, "blob_bytes",
                          "a blob of %llu bytes is above the limit blob_bytes of %llu",
                          (unsigned long long)put->size_bytes, (unsigned long long)most);
    if (session->upload_count >= session->loop->serving->limits.uploads_per_connection)
        return bd_err_set(detail, BD_ERR_BUSY, "uploads_per_connection",
                          "%u uploads are under way on this connection (limit "
                          "uploads_per_connection)",
                          session->upload_count);
    return BD_ERR_OK;
}

static struct bd_session_upload *begin_upload(struct bd_session *session,
                                              const Bounced__BlobPut *put)
{
    struct bd_session_upload *upload = calloc(1, sizeof *upload);
    BD_ASSERT(upload);
    upload->session = session;
    upload->size_bytes = put->size_bytes;
    snprintf(upload->blob, sizeof upload->blob, "%s", put->blob);
    upload->spool = bd_spool_create(session->loop,
                                    bd_grant_blobs(session->loop->serving->blobs, session->grant),
                                    session->grant->bytes_max, &upload_events, upload);
    upload->next = session->uploads;
    session->uploads = upload;
    session->upload_count++;
    return upload;
}

static enum bd_err check_piece(const struct bd_session_upload *upload, const Bounced__BlobPut *put,
                               size_t size, struct bd_err_detail *detail)
{
    if (upload->last_request_id)
        return bd_err_set(detail, BD_ERR_CONFLICT, "blob", "the upload is complete already");
    if (!upload->spool) {
        *detail = upload->detail;
        return detail->err;
    }
    uint64_t received = bd_spool_bytes(upload->spool);
    if (put->offset != received || put->size_bytes != upload->size_bytes)
        return bd_err_set(detail, BD_ERR_CONFLICT, "offset",
                          "%llu of %llu bytes have arrived: this piece is at %llu of %llu",
                          (unsigned long long)received, (unsigned long long)upload->size_bytes,
                          (unsigned long long)put->offset, (unsigned long long)put->size_bytes);
    if (size > upload->size_bytes - received)
        return bd_err_set(detail, BD_ERR_USAGE, "size_bytes",
                          "the pieces are longer than the blob's %llu bytes",
                          (unsigned long long)upload->size_bytes);
    return BD_ERR_OK;
}

void bd_session_put_piece(struct bd_session *session, const Bounced__Envelope *envelope,
                          const struct bd_message *message)
{
    const Bounced__BlobPut *put = envelope->blob_put;
    struct bd_err_detail detail;
    struct bd_session_upload *upload = put->blob ? find_upload(session, put->blob) : NULL;
    enum bd_err err = BD_ERR_OK;
    if (!upload) err = check_first_piece(session, put, &detail);
    if (!err && !upload) upload = begin_upload(session, put);
    if (!err) err = check_piece(upload, put, message->payload_bytes, &detail);
    if (err) {
        bd_session_send_error(session, envelope->request_id, &detail);
        if (upload && !upload->last_request_id) forget_upload(upload);
        return;
    }
    bd_spool_append(upload->spool, message->payload, message->payload_bytes);
    if (bd_spool_bytes(upload->spool) == upload->size_bytes) {
        upload->last_request_id = envelope->request_id;
        bd_spool_commit(upload->spool, upload->blob + 7);
    } else {
        struct bd_answer answer = bd_answer_blob(bd_spool_bytes(upload->spool), false);
        bd_session_send(session, envelope->request_id, &answer);
    }
    bd_session_update_reading(session);
}

bool bd_session_uploads_have_room(const struct bd_session *session)
{
    for (const struct bd_session_upload *upload = session->uploads; upload; upload = upload->next)
        if (upload->spool && bd_spool_is_full(upload->spool)) return false;
    return true;
}

void bd_session_forget_uploads(struct bd_session *session)
{
    while (session->uploads) forget_upload(session->uploads);
}
