// Records into the file: all of a call's, or none.

#include <string.h>

#include "base/log.h"
#include "scene/journal/journal_internal.h"

static const char not_kept[] = "nothing of the edit was kept";

static enum bd_err check_text(const char *field, const char *text, bool is_needed,
                              struct bd_err_detail *detail)
{
    size_t size = text ? strlen(text) : 0;
    if (is_needed && size == 0)
        return bd_err_set(detail, BD_ERR_USAGE, field, "%s is empty", field);
    if (size <= BD_JOURNAL_TEXT_BYTES_MAX) return BD_ERR_OK;
    return bd_err_set(detail, BD_ERR_LIMIT, field, "%s has %zu bytes, and %d are the most", field,
                      size, BD_JOURNAL_TEXT_BYTES_MAX);
}

static enum bd_err check_size(const char *field, size_t size, struct bd_err_detail *detail)
{
    if (size <= BD_JOURNAL_RECORD_BYTES_MAX) return BD_ERR_OK;
    return bd_err_set(detail, BD_ERR_LIMIT, field,
                      "the %s has %zu bytes, and %u are the most that the journal takes", field,
                      size, BD_JOURNAL_RECORD_BYTES_MAX);
}

static enum bd_err check_digests(struct bd_journal *journal, const struct bd_journal_digests *list,
                                 struct bd_err_detail *detail)
{
    enum bd_err err = check_size("content list", (size_t)list->count * BD_SHA256_BYTES, detail);
    for (uint32_t i = 0; i < list->count && !err; i++) {
        const uint8_t *sha256 = list->sha256 + (size_t)i * BD_SHA256_BYTES;
        uint64_t row;
        int result = bd_journal_find_content(journal, sha256, &row);
        if (result) return bd_journal_err(journal, result, not_kept, detail);
        char hex[BD_SHA256_HEX];
        bd_sha256_hex(sha256, hex);
        if (!row)
            err = bd_err_set(detail, BD_ERR_NOT_FOUND, "content",
                             "%s: content sha256:%s is not in the journal", not_kept, hex);
    }
    return err;
}

static enum bd_err check_edit(struct bd_journal *journal, const struct bd_journal_edit *edit,
                              struct bd_err_detail *detail)
{
    enum bd_err err = check_text("kind", edit->kind, true, detail);
    if (!err) err = check_text("client_edit_id", edit->client_edit_id, false, detail);
    if (!err) err = check_text("message", edit->message, false, detail);
    if (!err) err = check_text("author", edit->author, false, detail);
    if (!err) err = check_size("summary", edit->summary.size, detail);
    if (!err) err = check_size("answer", edit->answer.size, detail);
    if (!err) err = check_size("edit", edit->forward.size, detail);
    if (!err) err = check_size("inverse edit", edit->inverse.size, detail);
    if (!err) err = check_digests(journal, &edit->forward_content, detail);
    if (!err) err = check_digests(journal, &edit->inverse_content, detail);
    return err;
}

static enum bd_err check_snapshot(struct bd_journal *journal,
                                  const struct bd_journal_snapshot *snapshot,
                                  struct bd_err_detail *detail)
{
    enum bd_err err = check_size("index", snapshot->index.size, detail);
    return err ? err : check_digests(journal, &snapshot->content, detail);
}

// The scene's row anew, with another newest revision.
static int set_revision(struct bd_journal *journal, const char *id, uint64_t revision)
{
    sqlite3_stmt *find = bd_journal_sql(journal, BD_SQL_FIND_SCENE);
    bd_bind_text(find, 1, id);
    int step = sqlite3_step(find);
    if (step != SQLITE_ROW) return step == SQLITE_DONE ? SQLITE_CORRUPT : step;
    struct bd_journal_scene scene;
    bd_row_scene(find, &scene);
    scene.revision = revision;
    sqlite3_stmt *set = bd_journal_sql(journal, BD_SQL_SET_REVISION);
    bd_bind_u64(set, 1, (uint64_t)sqlite3_column_int64(find, 5));
    bd_bind_u64(set, 2, revision);
    bd_bind_u64(set, 3, bd_check_scene(&scene));
    bd_journal_done(find, step);
    return bd_journal_run(set);
}

static enum bd_err not_unique(const char *field, const char *what, struct bd_err_detail *detail)
{
    return bd_err_set(detail, BD_ERR_CONFLICT, field, "%s \"%.64s\" is taken", field, what);
}

static enum bd_err add_edit(struct bd_journal *journal, int64_t row,
                            const struct bd_journal_edit *edit, struct bd_err_detail *detail)
{
    enum bd_err err = check_edit(journal, edit, detail);
    if (err) return err;
    int result = bd_write_edit(journal, row, edit);
    if ((result & 0xff) == SQLITE_CONSTRAINT)
        return not_unique("client_edit_id", edit->client_edit_id, detail);
    return result ? bd_journal_err(journal, result, not_kept, detail) : BD_ERR_OK;
}

static int insert_scene(struct bd_journal *journal, const struct bd_journal_scene *scene)
{
    sqlite3_stmt *add = bd_journal_sql(journal, BD_SQL_ADD_SCENE);
    bd_bind_text(add, 1, scene->scene);
    bd_bind_text(add, 2, scene->name);
    bd_bind_u64(add, 3, scene->added_ms);
    bd_bind_u64(add, 4, scene->revision);
    bd_bind_u64(add, 5, bd_check_scene(scene));
    bd_bind_text(add, 6, scene->owner);
    return bd_journal_run(add);
}

static enum bd_err add_scene(struct bd_journal *journal, const struct bd_journal_record *record,
                             struct bd_err_detail *detail)
{
    enum bd_err err = check_text("scene", record->scene, true, detail);
    if (!err) err = check_text("name", record->name, false, detail);
    if (!err) err = check_text("owner", record->owner, false, detail);
    if (!err) err = check_snapshot(journal, record->snapshot, detail);
    if (!err &&
        (record->edit->revision == 0 || record->edit->revision != record->snapshot->revision))
        err = bd_err_set(detail, BD_ERR_CONFLICT, "revision",
                         "a scene begins at revision %llu and its snapshot is of %llu",
                         (unsigned long long)record->edit->revision,
                         (unsigned long long)record->snapshot->revision);
    if (err) return err;
    struct bd_journal_scene scene = {.scene = record->scene,
                                     .name = record->name ? record->name : "",
                                     .owner = record->owner ? record->owner : "",
                                     .revision = record->edit->revision,
                                     .added_ms = record->edit->time_ms};
    int result = insert_scene(journal, &scene);
    if ((result & 0xff) == SQLITE_CONSTRAINT) return not_unique("scene", record->scene, detail);
    int64_t row = sqlite3_last_insert_rowid(journal->db);
    if (!result) result = bd_write_snapshot(journal, row, record->snapshot);
    if (result) return bd_journal_err(journal, result, not_kept, detail);
    return add_edit(journal, row, record->edit, detail);
}

static enum bd_err remove_scene(struct bd_journal *journal, int64_t row,
                                struct bd_err_detail *detail)
{
    sqlite3_stmt *remove = bd_journal_sql(journal, BD_SQL_REMOVE_SCENE);
    bd_bind_u64(remove, 1, (uint64_t)row);
    int result = bd_journal_run(remove);
    return result ? bd_journal_err(journal, result, "the scene was not removed", detail)
                  : BD_ERR_OK;
}

static enum bd_err append_edit(struct bd_journal *journal, const struct bd_journal_record *record,
                               int64_t row, uint64_t revision, struct bd_err_detail *detail)
{
    if (record->edit->revision != revision + 1)
        return bd_err_set(detail, BD_ERR_CONFLICT, "revision",
                          "revision %llu does not follow %llu, the journal's newest",
                          (unsigned long long)record->edit->revision, (unsigned long long)revision);
    enum bd_err err = add_edit(journal, row, record->edit, detail);
    if (err) return err;
    int result = set_revision(journal, record->scene, revision + 1);
    return result ? bd_journal_err(journal, result, not_kept, detail) : BD_ERR_OK;
}

static enum bd_err set_name(struct bd_journal *journal, const struct bd_journal_record *record,
                            int64_t row, struct bd_err_detail *detail)
{
    enum bd_err err = check_text("name", record->name, true, detail);
    bool can_reach;
    if (!err) err = bd_journal_can_reach(journal, row, record->revision, &can_reach, detail);
    if (!err && !can_reach)
        err = bd_err_set(detail, BD_ERR_NOT_FOUND, "revision",
                         "there is no way to revision %llu of scene \"%.64s\"",
                         (unsigned long long)record->revision, record->scene);
    if (err) return err;
    sqlite3_stmt *set = bd_journal_sql(journal, BD_SQL_SET_NAME);
    bd_bind_u64(set, 1, (uint64_t)row);
    bd_bind_text(set, 2, record->name);
    bd_bind_u64(set, 3, record->revision);
    bd_bind_u64(set, 4, bd_check_name(row, record->name, record->revision));
    int result = bd_journal_run(set);
    return result ? bd_journal_err(journal, result, "the name was not kept", detail) : BD_ERR_OK;
}

static enum bd_err remove_name(struct bd_journal *journal, const struct bd_journal_record *record,
                               int64_t row, struct bd_err_detail *detail)
{
    sqlite3_stmt *remove = bd_journal_sql(journal, BD_SQL_REMOVE_NAME);
    bd_bind_u64(remove, 1, (uint64_t)row);
    bd_bind_text(remove, 2, record->name);
    int result = bd_journal_run(remove);
    if (result) return bd_journal_err(journal, result, "the name was not removed", detail);
    if (sqlite3_changes(journal->db) > 0) return BD_ERR_OK;
    return bd_err_set(detail, BD_ERR_NOT_FOUND, "name", "no revision of the scene is named \"%s\"",
                      record->name ? record->name : "");
}

static enum bd_err apply(struct bd_journal *journal, const struct bd_journal_record *record,
                         struct bd_err_detail *detail)
{
    if (record->kind == BD_JOURNAL_ADD_SCENE) return add_scene(journal, record, detail);
    int64_t row;
    uint64_t revision;
    enum bd_err err = bd_journal_find_scene(journal, record->scene, &row, &revision, detail);
    if (err) return err;
    switch (record->kind) {
    case BD_JOURNAL_REMOVE_SCENE:
        return remove_scene(journal, row, detail);
    case BD_JOURNAL_EDIT:
        return append_edit(journal, record, row, revision, detail);
    case BD_JOURNAL_NAME:
        return set_name(journal, record, row, detail);
    default:
        return remove_name(journal, record, row, detail);
    }
}

enum bd_err bd_journal_commit(struct bd_journal *journal, const struct bd_journal_record *records,
                              uint32_t count, uint32_t *faulty, struct bd_err_detail *detail)
{
    uint32_t at = count;
    if (faulty) *faulty = count;
    if (count > BD_JOURNAL_COMMIT_RECORDS_MAX)
        return bd_err_set(detail, BD_ERR_LIMIT, "records", "%u records, and %d are the most", count,
                          BD_JOURNAL_COMMIT_RECORDS_MAX);
    int result = bd_journal_begin(journal);
    if (result) return bd_journal_err(journal, result, not_kept, detail);
    enum bd_err err = BD_ERR_OK;
    for (at = 0; at < count && !err; at++) err = apply(journal, &records[at], detail);
    result = bd_journal_end(journal, err ? SQLITE_ABORT : SQLITE_OK);
    // A disk that is full or fails is none of theirs.
    if (err && err != BD_ERR_NO_MEMORY && err != BD_ERR_IO && faulty) *faulty = at - 1;
    if (err) return err;
    return result ? bd_journal_err(journal, result, not_kept, detail) : BD_ERR_OK;
}

static enum bd_err check_own_hash(struct bd_journal *journal, int64_t row,
                                  const struct bd_journal_snapshot *snapshot,
                                  struct bd_err_detail *detail)
{
    sqlite3_stmt *get = bd_journal_sql(journal, BD_SQL_EDIT_SHA256);
    bd_bind_u64(get, 1, (uint64_t)row);
    bd_bind_u64(get, 2, snapshot->revision);
    int step = sqlite3_step(get);
    uint8_t sha256[BD_SHA256_BYTES];
    bool is_same = step != SQLITE_ROW || (bd_column_sha256(get, 0, sha256) &&
                                          memcmp(sha256, snapshot->sha256, sizeof sha256) == 0);
    int result = bd_journal_done(get, step);
    if (result) return bd_journal_err(journal, result, "a snapshot was not kept", detail);
    if (is_same) return BD_ERR_OK;
    return bd_err_set(detail, BD_ERR_CONFLICT, "snapshot",
                      "the snapshot of revision %llu is not what its edit made",
                      (unsigned long long)snapshot->revision);
}

static enum bd_err check_new_snapshot(struct bd_journal *journal, int64_t row,
                                      const struct bd_journal_snapshot *snapshot,
                                      struct bd_err_detail *detail)
{
    bool can_reach;
    enum bd_err err = check_snapshot(journal, snapshot, detail);
    if (!err) err = check_own_hash(journal, row, snapshot, detail);
    if (!err) err = bd_journal_can_reach(journal, row, snapshot->revision, &can_reach, detail);
    if (err || can_reach) return err;
    return bd_err_set(detail, BD_ERR_NOT_FOUND, "revision", "there is no way to revision %llu",
                      (unsigned long long)snapshot->revision);
}

enum bd_err bd_journal_write_snapshot(struct bd_journal *journal, const char *scene,
                                      const struct bd_journal_snapshot *snapshot,
                                      struct bd_err_detail *detail)
{
    int64_t row;
    uint64_t revision;
    enum bd_err err = bd_journal_find_scene(journal, scene, &row, &revision, detail);
    if (!err) err = check_new_snapshot(journal, row, snapshot, detail);
    if (err) return err;
    int result = bd_journal_begin(journal);
    if (!result) result = bd_journal_end(journal, bd_write_snapshot(journal, row, snapshot));
    return result ? bd_journal_err(journal, result, "a snapshot was not kept", detail) : BD_ERR_OK;
}

int bd_journal_cut_rows(struct bd_journal *journal, int64_t row, const char *scene,
                        uint64_t revision)
{
    static const enum bd_journal_sql cuts[] = {BD_SQL_CUT_EDITS, BD_SQL_CUT_SNAPSHOTS,
                                               BD_SQL_CUT_NAMES};
    int result = SQLITE_OK;
    for (size_t i = 0; i < sizeof cuts / sizeof *cuts && !result; i++) {
        sqlite3_stmt *cut = bd_journal_sql(journal, cuts[i]);
        bd_bind_u64(cut, 1, (uint64_t)row);
        bd_bind_u64(cut, 2, revision);
        result = bd_journal_run(cut);
    }
    return result ? result : set_revision(journal, scene, revision);
}

enum bd_err bd_journal_cut(struct bd_journal *journal, const char *scene, uint64_t revision,
                           struct bd_err_detail *detail)
{
    int64_t row;
    uint64_t newest;
    enum bd_err err = bd_journal_find_scene(journal, scene, &row, &newest, detail);
    if (err || revision == newest) return err;
    if (revision > newest || revision == 0)
        return bd_err_set(detail, BD_ERR_NOT_FOUND, "revision",
                          "scene \"%.64s\" has no revision %llu", scene,
                          (unsigned long long)revision);
    int result = bd_journal_begin(journal);
    if (!result)
        result = bd_journal_end(journal, bd_journal_cut_rows(journal, row, scene, revision));
    if (result) return bd_journal_err(journal, result, "damaged edits were not cut", detail);
    bd_log(BD_LOG_WARN, "journal", "scene %.64s: revisions %llu to %llu are lost to damage", scene,
           (unsigned long long)revision + 1, (unsigned long long)newest);
    return BD_ERR_OK;
}
