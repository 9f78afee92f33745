// What a journal tells: scenes, edits, names.

#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "base/log.h"
#include "scene/journal/journal_internal.h"

enum bd_err bd_journal_each_scene(struct bd_journal *journal, bd_journal_scene_fn *visit,
                                  void *user, struct bd_err_detail *detail)
{
    int64_t at = 0;
    int step;
    do {
        sqlite3_stmt *next = bd_journal_sql(journal, BD_SQL_NEXT_SCENE);
        bd_bind_u64(next, 1, (uint64_t)at);
        step = sqlite3_step(next);
        struct bd_journal_scene scene;
        if (step == SQLITE_ROW) {
            at = sqlite3_column_int64(next, 5);
            bd_row_scene(next, &scene);
            visit(user, &scene);
        }
        bd_journal_done(next, step);
    } while (step == SQLITE_ROW);
    if (step == SQLITE_DONE) return BD_ERR_OK;
    return bd_journal_err(journal, step, "the scenes cannot be read", detail);
}

// Room for all texts and bytes of an edit, one after another.
static char *lend(char **at, const void *data, size_t size)
{
    char *copy = *at;
    memcpy(copy, data, size);
    copy[size] = 0;
    *at += size + 1;
    return copy;
}

static size_t lent_size(const struct bd_journal_edit *edit)
{
    size_t digests = (size_t)edit->forward_content.count + edit->inverse_content.count;
    return strlen(edit->kind) + strlen(edit->client_edit_id) + strlen(edit->message) +
           strlen(edit->author) + edit->summary.size + edit->answer.size + edit->forward.size +
           edit->inverse.size + digests * BD_SHA256_BYTES + 16;
}

static void lend_edit(struct bd_journal *journal, struct bd_journal_edit *edit)
{
    size_t size = lent_size(edit);
    if (size > journal->lent.size) {
        free(journal->lent.bytes);
        journal->lent.bytes = malloc(size);
        BD_ASSERT(journal->lent.bytes);
        journal->lent.size = size;
    }
    char *at = journal->lent.bytes;
    edit->kind = lend(&at, edit->kind, strlen(edit->kind));
    edit->client_edit_id = lend(&at, edit->client_edit_id, strlen(edit->client_edit_id));
    edit->message = lend(&at, edit->message, strlen(edit->message));
    edit->author = lend(&at, edit->author, strlen(edit->author));
    struct bd_journal_bytes *bytes[] = {&edit->summary, &edit->answer, &edit->forward,
                                        &edit->inverse};
    for (int i = 0; i < 4; i++) bytes[i]->data = lend(&at, bytes[i]->data, bytes[i]->size);
    struct bd_journal_digests *lists[] = {&edit->forward_content, &edit->inverse_content};
    for (int i = 0; i < 2; i++)
        lists[i]->sha256 =
            (uint8_t *)lend(&at, lists[i]->sha256, (size_t)lists[i]->count * BD_SHA256_BYTES);
}

// Runs a bound query for one edit.
static enum bd_err get_edit(struct bd_journal *journal, sqlite3_stmt *get, int64_t row,
                            struct bd_journal_edit *out, struct bd_err_detail *detail)
{
    int step = sqlite3_step(get);
    bool is_whole = true;
    if (step == SQLITE_ROW) {
        is_whole = bd_row_edit(get, row, out);
        lend_edit(journal, out);
    }
    int result = bd_journal_done(get, step);
    if (!result && !is_whole) result = SQLITE_CORRUPT;
    if (result) return bd_journal_err(journal, result, "an edit cannot be read", detail);
    return step == SQLITE_ROW ? BD_ERR_OK : BD_ERR_NOT_FOUND;
}

enum bd_err bd_journal_get_edit(struct bd_journal *journal, const char *scene, uint64_t revision,
                                struct bd_journal_edit *out, struct bd_err_detail *detail)
{
    int64_t row;
    uint64_t newest;
    enum bd_err err = bd_journal_find_scene(journal, scene, &row, &newest, detail);
    if (err) return err;
    sqlite3_stmt *get = bd_journal_sql(journal, BD_SQL_GET_EDIT);
    bd_bind_u64(get, 1, (uint64_t)row);
    bd_bind_u64(get, 2, revision);
    err = get_edit(journal, get, row, out, detail);
    if (err != BD_ERR_NOT_FOUND) return err;
    return bd_err_set(detail, err, "revision", "the journal has no edit %llu of scene \"%.64s\"",
                      (unsigned long long)revision, scene);
}

enum bd_err bd_journal_find_edit(struct bd_journal *journal, const char *scene,
                                 const char *client_edit_id, struct bd_journal_edit *out,
                                 struct bd_err_detail *detail)
{
    int64_t row;
    uint64_t newest;
    enum bd_err err = bd_journal_find_scene(journal, scene, &row, &newest, detail);
    if (err) return err;
    sqlite3_stmt *find = bd_journal_sql(journal, BD_SQL_FIND_EDIT);
    bd_bind_u64(find, 1, (uint64_t)row);
    bd_bind_text(find, 2, client_edit_id);
    err = get_edit(journal, find, row, out, detail);
    if (err != BD_ERR_NOT_FOUND) return err;
    return bd_err_set(detail, err, "client_edit_id", "no edit of scene \"%.64s\" has id \"%.64s\"",
                      scene, client_edit_id);
}

static enum bd_err log_start(struct bd_journal *journal, int64_t row, uint64_t after,
                             uint32_t limit, uint64_t *out, struct bd_err_detail *detail)
{
    sqlite3_stmt *start = bd_journal_sql(journal, BD_SQL_LOG_START);
    bd_bind_u64(start, 1, (uint64_t)row);
    bd_bind_u64(start, 2, after);
    bd_bind_u64(start, 3, limit);
    int result = bd_journal_number(start, out);
    return result ? bd_journal_err(journal, result, "the log cannot be read", detail) : BD_ERR_OK;
}

enum bd_err bd_journal_each_edit(struct bd_journal *journal, const char *scene, uint64_t after,
                                 uint32_t limit, bd_journal_edit_fn *visit, void *user,
                                 struct bd_err_detail *detail)
{
    int64_t row;
    uint64_t newest, first;
    enum bd_err err = bd_journal_find_scene(journal, scene, &row, &newest, detail);
    if (!err) err = log_start(journal, row, after, limit, &first, detail);
    if (err || first == 0) return err;
    sqlite3_stmt *heads = bd_journal_sql(journal, BD_SQL_EDIT_HEADS);
    bd_bind_u64(heads, 1, (uint64_t)row);
    bd_bind_u64(heads, 2, first);
    int step;
    while ((step = sqlite3_step(heads)) == SQLITE_ROW) {
        struct bd_journal_edit edit;
        if (bd_row_edit_head(heads, row, &edit))
            visit(user, &edit);
        else
            bd_log(BD_LOG_WARN, "journal", "scene %.64s: the log's entry %llu is damaged", scene,
                   (unsigned long long)edit.revision);
    }
    int result = bd_journal_done(heads, step);
    return result ? bd_journal_err(journal, result, "the log cannot be read", detail) : BD_ERR_OK;
}

enum bd_err bd_journal_each_name(struct bd_journal *journal, const char *scene,
                                 bd_journal_name_fn *visit, void *user,
                                 struct bd_err_detail *detail)
{
    int64_t row;
    uint64_t newest;
    enum bd_err err = bd_journal_find_scene(journal, scene, &row, &newest, detail);
    if (err) return err;
    sqlite3_stmt *names = bd_journal_sql(journal, BD_SQL_NAMES);
    bd_bind_u64(names, 1, (uint64_t)row);
    int step;
    while ((step = sqlite3_step(names)) == SQLITE_ROW) {
        const char *name = bd_column_text(names, 0);
        uint64_t revision = (uint64_t)sqlite3_column_int64(names, 1);
        if (bd_check_name(row, name, revision) == (uint64_t)sqlite3_column_int64(names, 2))
            visit(user, name, revision);
        else
            bd_log(BD_LOG_WARN, "journal", "scene %.64s: a name of revision %llu is damaged", scene,
                   (unsigned long long)revision);
    }
    int result = bd_journal_done(names, step);
    return result ? bd_journal_err(journal, result, "names cannot be read", detail) : BD_ERR_OK;
}

int bd_journal_snapshot_before(struct bd_journal *journal, int64_t row, uint64_t revision,
                               uint64_t *out)
{
    sqlite3_stmt *find = bd_journal_sql(journal, BD_SQL_SNAPSHOT_REVISION);
    bd_bind_u64(find, 1, (uint64_t)row);
    bd_bind_u64(find, 2, revision);
    return bd_journal_number(find, out);
}

// Whether every edit after `from` is there, up to `to`.
static int are_all_there(struct bd_journal *journal, int64_t row, uint64_t from, uint64_t to,
                         bool *out)
{
    sqlite3_stmt *count = bd_journal_sql(journal, BD_SQL_COUNT_EDITS);
    bd_bind_u64(count, 1, (uint64_t)row);
    bd_bind_u64(count, 2, from);
    bd_bind_u64(count, 3, to);
    uint64_t number;
    int result = bd_journal_number(count, &number);
    *out = result == SQLITE_OK && number == to - from;
    return result;
}

enum bd_err bd_journal_can_reach(struct bd_journal *journal, int64_t row, uint64_t revision,
                                 bool *out, struct bd_err_detail *detail)
{
    uint64_t from;
    int result = bd_journal_snapshot_before(journal, row, revision, &from);
    *out = false;
    if (!result && from) result = are_all_there(journal, row, from, revision, out);
    return result ? bd_journal_err(journal, result, "the journal cannot be read", detail)
                  : BD_ERR_OK;
}

enum bd_err bd_journal_oldest(struct bd_journal *journal, const char *scene, uint64_t *out,
                              struct bd_err_detail *detail)
{
    int64_t row;
    uint64_t at, from;
    enum bd_err err = bd_journal_find_scene(journal, scene, &row, &at, detail);
    if (err) return err;
    bool is_chain = true;
    int result = bd_journal_snapshot_before(journal, row, at, &from);
    while (!result && from) {
        result = are_all_there(journal, row, from, at, &is_chain);
        if (result || !is_chain) break;
        at = from;
        result = bd_journal_snapshot_before(journal, row, at - 1, &from);
    }
    *out = at;
    return result ? bd_journal_err(journal, result, "the journal cannot be read", detail)
                  : BD_ERR_OK;
}

static uint64_t log_bytes(struct bd_journal *journal)
{
    sqlite3_file *file = NULL;
    sqlite3_int64 size = 0;
    sqlite3_file_control(journal->db, "main", SQLITE_FCNTL_JOURNAL_POINTER, &file);
    if (!file || !file->pMethods || file->pMethods->xFileSize(file, &size)) return 0;
    return (uint64_t)size;
}

enum bd_err bd_journal_get_stats(struct bd_journal *journal, struct bd_journal_stats *out,
                                 struct bd_err_detail *detail)
{
    uint64_t page_count, free_count;
    int result = bd_journal_number(bd_journal_sql(journal, BD_SQL_PAGES), &page_count);
    if (!result)
        result = bd_journal_number(bd_journal_sql(journal, BD_SQL_FREE_PAGES), &free_count);
    if (result) return bd_journal_err(journal, result, "the journal cannot be read", detail);
    sqlite3_stmt *counts = bd_journal_sql(journal, BD_SQL_COUNTS);
    int step = sqlite3_step(counts);
    *out = (struct bd_journal_stats){
        .scene_count = (uint64_t)sqlite3_column_int64(counts, 0),
        .edit_count = (uint64_t)sqlite3_column_int64(counts, 1),
        .snapshot_count = (uint64_t)sqlite3_column_int64(counts, 2),
        .content_count = (uint64_t)sqlite3_column_int64(counts, 3),
        .content_bytes = (uint64_t)sqlite3_column_int64(counts, 4),
        .file_bytes = page_count * BD_JOURNAL_PAGE_BYTES + log_bytes(journal),
        .free_bytes = free_count * BD_JOURNAL_PAGE_BYTES,
    };
    result = bd_journal_done(counts, step);
    return result ? bd_journal_err(journal, result, "the journal cannot be read", detail)
                  : BD_ERR_OK;
}
