// Rows of a journal's tables, and what a daemon would never have written in them.

#include "scene/journal/journal_internal.h"

// SQLite's numbers have a sign; a revision beyond it was never written by a daemon, and would be
// counted back past the first one.
static bool is_revision(uint64_t revision)
{
    return revision >= 1 && revision < INT64_MAX;
}

bool bd_row_scene(sqlite3_stmt *row, struct bd_journal_scene *out)
{
    out->scene = bd_column_text(row, 0);
    out->name = bd_column_text(row, 1);
    out->added_ms = (uint64_t)sqlite3_column_int64(row, 2);
    out->revision = (uint64_t)sqlite3_column_int64(row, 3);
    out->owner = bd_column_text(row, 6);
    return is_revision(out->revision) &&
           (uint64_t)sqlite3_column_int64(row, 4) == bd_check_scene(out);
}

bool bd_row_snapshot(sqlite3_stmt *row, int64_t scene, struct bd_journal_snapshot *out)
{
    out->revision = (uint64_t)sqlite3_column_int64(row, 0);
    bool is_whole = bd_column_sha256(row, 1, out->sha256) && is_revision(out->revision);
    out->content = bd_column_digests(row, 2);
    out->index = bd_column_bytes(row, 4);
    return is_whole && (uint64_t)sqlite3_column_int64(row, 3) == bd_check_snapshot(scene, out);
}

bool bd_row_edit_head(sqlite3_stmt *row, int64_t scene, struct bd_journal_edit *out)
{
    *out = (struct bd_journal_edit){
        .revision = (uint64_t)sqlite3_column_int64(row, 0),
        .kind = bd_column_text(row, 1),
        .of = (uint64_t)sqlite3_column_int64(row, 2),
        .client_edit_id = bd_column_text(row, 3),
        .message = bd_column_text(row, 4),
        .author = bd_column_text(row, 10),
        .time_ms = (uint64_t)sqlite3_column_int64(row, 5),
        .summary = bd_column_bytes(row, 7),
    };
    bool is_whole = bd_column_sha256(row, 6, out->snapshot_sha256) && is_revision(out->revision);
    uint64_t payload_check = (uint64_t)sqlite3_column_int64(row, 8);
    return is_whole &&
           (uint64_t)sqlite3_column_int64(row, 9) == bd_check_edit(scene, out, payload_check);
}

bool bd_row_edit(sqlite3_stmt *row, int64_t scene, struct bd_journal_edit *out)
{
    bool is_whole = bd_row_edit_head(row, scene, out);
    out->answer = bd_column_bytes(row, 11);
    out->forward_content = bd_column_digests(row, 12);
    out->inverse_content = bd_column_digests(row, 13);
    out->forward = bd_column_bytes(row, 14);
    out->inverse = bd_column_bytes(row, 15);
    return is_whole && (uint64_t)sqlite3_column_int64(row, 8) == bd_check_edit_payload(out);
}

enum bd_err bd_journal_find_scene(struct bd_journal *journal, const char *scene, int64_t *row,
                                  uint64_t *revision, struct bd_err_detail *detail)
{
    sqlite3_stmt *find = bd_journal_sql(journal, BD_SQL_FIND_SCENE);
    bd_bind_text(find, 1, scene);
    int step = sqlite3_step(find);
    if (step == SQLITE_ROW) {
        *revision = (uint64_t)sqlite3_column_int64(find, 3);
        *row = sqlite3_column_int64(find, 5);
    }
    int result = bd_journal_done(find, step);
    if (result) return bd_journal_err(journal, result, "a scene cannot be read", detail);
    if (step == SQLITE_ROW) return BD_ERR_OK;
    return bd_err_set(detail, BD_ERR_NOT_FOUND, "scene", "the journal has no scene \"%.64s\"",
                      scene);
}
