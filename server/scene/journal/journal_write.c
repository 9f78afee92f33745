// Rows of a journal's tables, written.

#include "scene/journal/journal_internal.h"

int bd_write_snapshot(struct bd_journal *journal, int64_t scene,
                      const struct bd_journal_snapshot *snapshot)
{
    sqlite3_stmt *add = bd_journal_sql(journal, BD_SQL_ADD_SNAPSHOT);
    bd_bind_u64(add, 1, (uint64_t)scene);
    bd_bind_u64(add, 2, snapshot->revision);
    bd_bind_bytes(add, 3, snapshot->sha256, BD_SHA256_BYTES);
    bd_bind_digests(add, 4, &snapshot->content);
    bd_bind_u64(add, 5, bd_check_snapshot(scene, snapshot));
    bd_bind_bytes(add, 6, snapshot->index.data, snapshot->index.size);
    bd_journal_mark(journal, &snapshot->content);
    return bd_journal_run(add);
}

int bd_write_edit(struct bd_journal *journal, int64_t scene, const struct bd_journal_edit *edit)
{
    sqlite3_stmt *add = bd_journal_sql(journal, BD_SQL_ADD_EDIT);
    uint64_t payload_check = bd_check_edit_payload(edit);
    bd_bind_u64(add, 1, (uint64_t)scene);
    bd_bind_u64(add, 2, edit->revision);
    bd_bind_text(add, 3, edit->kind);
    bd_bind_u64(add, 4, edit->of);
    bd_bind_text(add, 5, edit->client_edit_id);
    bd_bind_text(add, 6, edit->message);
    bd_bind_u64(add, 7, edit->time_ms);
    bd_bind_bytes(add, 8, edit->snapshot_sha256, BD_SHA256_BYTES);
    bd_bind_bytes(add, 9, edit->summary.data, edit->summary.size);
    bd_bind_u64(add, 10, payload_check);
    bd_bind_u64(add, 11, bd_check_edit(scene, edit, payload_check));
    bd_bind_text(add, 12, edit->author);
    bd_bind_bytes(add, 13, edit->answer.data, edit->answer.size);
    bd_bind_digests(add, 14, &edit->forward_content);
    bd_bind_digests(add, 15, &edit->inverse_content);
    bd_bind_bytes(add, 16, edit->forward.data, edit->forward.size);
    bd_bind_bytes(add, 17, edit->inverse.data, edit->inverse.size);
    bd_journal_mark(journal, &edit->forward_content);
    bd_journal_mark(journal, &edit->inverse_content);
    return bd_journal_run(add);
}
