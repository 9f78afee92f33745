// What a start looks at: the newest snapshot of every scene and the edits after it, not the
// gigabytes. Content is proven when it is read, the rest of the log when somebody asks for it.

#include <stdio.h>
#include <string.h>

#include "base/log.h"
#include "scene/journal/journal_internal.h"

#define WAL_HEADER_BYTES       32
#define WAL_FRAME_HEADER_BYTES 24
#define WAL_SALT_AT_HEADER     16
#define WAL_SALT_AT_FRAME      8
#define WAL_SALT_BYTES         8

// Frames of the same generation as the log's header beyond its last commit.
static uint32_t count_cut_frames(sqlite3_file *file, int frame_count)
{
    const sqlite3_int64 frame_bytes = WAL_FRAME_HEADER_BYTES + BD_JOURNAL_PAGE_BYTES;
    uint8_t header[WAL_HEADER_BYTES], frame[WAL_FRAME_HEADER_BYTES];
    sqlite3_int64 size = 0, at = WAL_HEADER_BYTES + frame_count * frame_bytes;
    if (file->pMethods->xFileSize(file, &size) || size < WAL_HEADER_BYTES ||
        file->pMethods->xRead(file, header, sizeof header, 0))
        return 0;
    uint32_t count = 0;
    for (; at + WAL_FRAME_HEADER_BYTES <= size; at += frame_bytes, count++)
        if (file->pMethods->xRead(file, frame, sizeof frame, at) ||
            memcmp(frame + WAL_SALT_AT_FRAME, header + WAL_SALT_AT_HEADER, WAL_SALT_BYTES) != 0)
            break;
    return count;
}

void bd_journal_warn_of_tail(struct bd_journal *journal)
{
    sqlite3_file *file = NULL;
    int frame_count = 0, copied;
    // Copies the log into the file, too: a start is a good time for it.
    if (sqlite3_wal_checkpoint_v2(journal->db, NULL, SQLITE_CHECKPOINT_PASSIVE, &frame_count,
                                  &copied))
        return;
    sqlite3_file_control(journal->db, "main", SQLITE_FCNTL_JOURNAL_POINTER, &file);
    if (!file || !file->pMethods || frame_count < 0) return;
    uint32_t count = count_cut_frames(file, frame_count);
    if (count)
        bd_log(BD_LOG_WARN, "journal",
               "%s: the last %u pages of its write-ahead log were not finished and are cut off",
               journal->name, count);
}

static int check_snapshot(struct bd_journal *journal, int64_t row, uint64_t *revision)
{
    sqlite3_stmt *get = bd_journal_sql(journal, BD_SQL_SNAPSHOT_BEFORE);
    bd_bind_u64(get, 1, (uint64_t)row);
    bd_bind_u64(get, 2, INT64_MAX);
    int step = sqlite3_step(get);
    struct bd_journal_snapshot snapshot = {0};
    bool is_whole = step == SQLITE_ROW && bd_row_snapshot(get, row, &snapshot);
    *revision = snapshot.revision;
    int result = bd_journal_done(get, step);
    return result || is_whole ? result : SQLITE_CORRUPT;
}

static int check_edits(struct bd_journal *journal, int64_t row, uint64_t *revision)
{
    sqlite3_stmt *after = bd_journal_sql(journal, BD_SQL_EDITS_AFTER);
    bd_bind_u64(after, 1, (uint64_t)row);
    bd_bind_u64(after, 2, *revision);
    bd_bind_u64(after, 3, INT64_MAX);
    int step;
    bool is_whole = true;
    while (is_whole && (step = sqlite3_step(after)) == SQLITE_ROW) {
        struct bd_journal_edit edit;
        is_whole = bd_row_edit(after, row, &edit) && edit.revision == *revision + 1;
        (*revision)++;
    }
    int result = bd_journal_done(after, step);
    return result || is_whole ? result : SQLITE_CORRUPT;
}

static int check_scene(struct bd_journal *journal, int64_t row, uint64_t newest, char *where,
                       size_t where_bytes)
{
    uint64_t revision = 0;
    int result = check_snapshot(journal, row, &revision);
    if (!result) result = check_edits(journal, row, &revision);
    if (!result && revision != newest) result = SQLITE_CORRUPT;
    if (result)
        snprintf(where + strlen(where), where_bytes - strlen(where), ", revision %llu",
                 (unsigned long long)revision);
    return result;
}

// What the check says in words: damage, or a page that could not be read just now.
static int result_of(const char *words)
{
    int code = 0;
    const char *error = strstr(words, "error code");
    if (strcmp(words, "ok") == 0) return SQLITE_OK;
    if (error) sscanf(error + strlen("error code"), "%*[ =]%d", &code);
    return code ? code : SQLITE_CORRUPT;
}

static int check_table(struct bd_journal *journal, const char *table)
{
    char sql[64];
    sqlite3_stmt *check = NULL;
    snprintf(sql, sizeof sql, "PRAGMA integrity_check(%s)", table);
    int result = sqlite3_prepare_v2(journal->db, sql, -1, &check, NULL);
    int step = result ? result : sqlite3_step(check);
    result = step == SQLITE_ROW ? result_of(bd_column_text(check, 0)) : step;
    sqlite3_finalize(check);
    return result;
}

// Pages, order and indexes of everything but the parts of content, which are the gigabytes.
static int check_tables(struct bd_journal *journal, char *where, size_t where_bytes)
{
    static const char *const tables[] = {"scenes", "edits", "snapshots", "names", "contents"};
    int result = SQLITE_OK;
    for (size_t i = 0; i < sizeof tables / sizeof *tables && !result; i++) {
        snprintf(where, where_bytes, "table %s", tables[i]);
        result = check_table(journal, tables[i]);
        // Not every failing read has a number there. Damage is still there the next time.
        if (bd_journal_is_damage(result)) result = check_table(journal, tables[i]);
    }
    return result;
}

int bd_journal_find_damage(struct bd_journal *journal, char *where, size_t where_bytes)
{
    int broken = check_tables(journal, where, where_bytes);
    if (broken) return broken;
    for (int64_t at = 0;;) {
        sqlite3_stmt *next = bd_journal_sql(journal, BD_SQL_NEXT_SCENE);
        bd_bind_u64(next, 1, (uint64_t)at);
        int step = sqlite3_step(next);
        struct bd_journal_scene scene = {.scene = "", .revision = 0};
        bool is_whole = step != SQLITE_ROW || bd_row_scene(next, &scene);
        if (step == SQLITE_ROW) at = sqlite3_column_int64(next, 5);
        snprintf(where, where_bytes, "scene %.64s", scene.scene);
        uint64_t newest = scene.revision;
        bd_journal_done(next, step);
        if (step == SQLITE_DONE) return SQLITE_OK;
        if (step != SQLITE_ROW) return step;
        int result =
            is_whole ? check_scene(journal, at, newest, where, where_bytes) : SQLITE_CORRUPT;
        if (result) return result;
    }
}
