// A damaged file, built anew from what is whole in it.
//
// Rows are copied one by one, past pages that cannot be read, into a new file with indexes of its
// own; then every record that is not what was written goes, what removed scenes left, and of each
// scene what lies beyond the first gap. The old file stays beside for a person.

#include <errno.h>
#include <fcntl.h>
#include <libgen.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/assert.h"
#include "base/log.h"
#include "scene/journal/journal_internal.h"

// How far behind the last row that could be read another is looked for.
#define SKIP_ROWS_MAX 65536

static const char *const tables[] = {"scenes", "edits", "snapshots", "names", "contents", "parts"};

struct copy {
    sqlite3_stmt *from, *to;
    uint64_t copied, skipped;
};

static int copy_row(struct copy *copy)
{
    int count = sqlite3_column_count(copy->from);
    for (int i = 0; i < count; i++)
        sqlite3_bind_value(copy->to, i + 1, sqlite3_column_value(copy->from, i));
    int result = bd_journal_run(copy->to);
    copy->copied += !result;
    // A row whose fields cannot be what they were is not worth a line of its own.
    if ((result & 0xff) == SQLITE_CONSTRAINT || (result & 0xff) == SQLITE_MISMATCH ||
        bd_journal_is_damage(result)) {
        copy->skipped++;
        return SQLITE_OK;
    }
    return result;
}

static int copy_rows(struct copy *copy)
{
    sqlite3_int64 at = 0;
    for (int skips = 0; skips < SKIP_ROWS_MAX;) {
        sqlite3_reset(copy->from);
        sqlite3_bind_int64(copy->from, 1, at);
        int step = sqlite3_step(copy->from);
        if (step == SQLITE_DONE) return SQLITE_OK;
        if (step == SQLITE_ROW) {
            sqlite3_int64 id = sqlite3_column_int64(copy->from, 0);
            // Rows stand in order; one that claims to stand before is damage like any other.
            int result = id > at ? copy_row(copy) : SQLITE_OK;
            if (result) return result;
            at = id > at ? id : at + 1;
            skips = id > at ? 0 : skips + 1;
        } else if (bd_journal_is_damage(step)) {
            at++;
            skips++;
            copy->skipped++;
        } else {
            return step;
        }
    }
    return SQLITE_OK;
}

// By the names of its columns: a file of an older format has fewer, and those that it lacks are
// what that format's step makes them.
static int prepare_insert(struct copy *copy, sqlite3 *to, const char *table)
{
    sqlite3_str *sql = sqlite3_str_new(to);
    const int count = sqlite3_column_count(copy->from);
    sqlite3_str_appendf(sql, "INSERT OR IGNORE INTO %s(", table);
    for (int i = 0; i < count; i++)
        sqlite3_str_appendf(sql, "%s\"%w\"", i ? "," : "", sqlite3_column_name(copy->from, i));
    sqlite3_str_appendall(sql, ") VALUES(?");
    for (int i = 1; i < count; i++) sqlite3_str_appendall(sql, ",?");
    sqlite3_str_appendall(sql, ")");
    char *text = sqlite3_str_finish(sql);
    int result = text ? sqlite3_prepare_v2(to, text, -1, &copy->to, NULL) : SQLITE_NOMEM;
    sqlite3_free(text);
    return result;
}

static int copy_table(sqlite3 *from, sqlite3 *to, const char *table)
{
    char sql[256];
    struct copy copy = {0};
    snprintf(sql, sizeof sql, "SELECT * FROM %s WHERE id>?1 ORDER BY id LIMIT 1", table);
    int result = sqlite3_prepare_v2(from, sql, -1, &copy.from, NULL);
    if (result) bd_log(BD_LOG_WARN, "journal", "the table %s cannot be read", table);
    // Without the scenes nothing can be told apart; what any other table held is lost.
    if (result) return strcmp(table, "scenes") == 0 ? SQLITE_CORRUPT : SQLITE_OK;
    result = prepare_insert(&copy, to, table);
    if (!result) result = copy_rows(&copy);
    if (copy.skipped)
        bd_log(BD_LOG_WARN, "journal", "%llu rows of %s could not be read, %llu were",
               (unsigned long long)copy.skipped, table, (unsigned long long)copy.copied);
    sqlite3_finalize(copy.from);
    sqlite3_finalize(copy.to);
    return result;
}

// The damaged file, as far as SQLite can be talked into reading it: with a schema that may be
// written it forgives a file that is too short. What its log holds is copied into it first.
static int open_damaged(const char *path, sqlite3 **out)
{
    int result = sqlite3_open_v2(path, out, SQLITE_OPEN_READWRITE | SQLITE_OPEN_EXRESCODE, NULL);
    if (!result)
        result = sqlite3_exec(*out,
                              "PRAGMA locking_mode=EXCLUSIVE; PRAGMA trusted_schema=OFF;"
                              "PRAGMA writable_schema=ON; PRAGMA user_version;",
                              NULL, NULL, NULL);
    int log_pages, copied;
    if (!result)
        result =
            sqlite3_wal_checkpoint_v2(*out, NULL, SQLITE_CHECKPOINT_TRUNCATE, &log_pages, &copied);
    return result;
}

static int copy_tables(const char *path, struct bd_journal *to)
{
    sqlite3 *from = NULL;
    int result = open_damaged(path, &from);
    // One transaction to read all: a search for the next row that can be read is many reads.
    if (!result) result = sqlite3_exec(from, "BEGIN", NULL, NULL, NULL);
    if (!result) result = bd_journal_begin(to);
    for (size_t i = 0; i < sizeof tables / sizeof *tables && !result; i++)
        result = copy_table(from, to->db, tables[i]);
    if (!sqlite3_get_autocommit(to->db)) result = bd_journal_end(to, result);
    sqlite3_close(from);
    return result;
}

// Deletes rows of a table for which `is_whole` is false. Their scene stands behind the other
// columns.
static int purge(struct bd_journal *journal, const char *table, const char *columns,
                 bool (*is_whole)(sqlite3_stmt *row, int64_t scene))
{
    char sql[512];
    sqlite3_stmt *rows = NULL, *remove = NULL;
    snprintf(sql, sizeof sql, "SELECT %s,scene,id FROM %s ORDER BY id", columns, table);
    int result = sqlite3_prepare_v2(journal->db, sql, -1, &rows, NULL);
    snprintf(sql, sizeof sql, "DELETE FROM %s WHERE id=?1", table);
    if (!result) result = sqlite3_prepare_v2(journal->db, sql, -1, &remove, NULL);
    int step = SQLITE_DONE, last = sqlite3_column_count(rows) - 1;
    while (!result && (step = sqlite3_step(rows)) == SQLITE_ROW) {
        if (is_whole(rows, sqlite3_column_int64(rows, last - 1))) continue;
        sqlite3_bind_int64(remove, 1, sqlite3_column_int64(rows, last));
        result = bd_journal_run(remove);
        bd_log(BD_LOG_WARN, "journal", "a row of %s was damaged and is left out", table);
    }
    sqlite3_finalize(rows);
    sqlite3_finalize(remove);
    return result || step == SQLITE_DONE ? result : step;
}

static bool edit_is_whole(sqlite3_stmt *row, int64_t scene)
{
    struct bd_journal_edit edit;
    return bd_row_edit(row, scene, &edit);
}

static bool snapshot_is_whole(sqlite3_stmt *row, int64_t scene)
{
    struct bd_journal_snapshot snapshot;
    return bd_row_snapshot(row, scene, &snapshot);
}

static bool name_is_whole(sqlite3_stmt *row, int64_t scene)
{
    return bd_check_name(scene, bd_column_text(row, 0), (uint64_t)sqlite3_column_int64(row, 1)) ==
           (uint64_t)sqlite3_column_int64(row, 2);
}

// The new file counts scenes and contents from the last ones that came over: what is left of others
// would be the next one's. And content that lost a part has to be put anew.
static int purge_remains(struct bd_journal *journal)
{
    return sqlite3_exec(
        journal->db,
        "DELETE FROM edits WHERE scene NOT IN (SELECT id FROM scenes);"
        "DELETE FROM snapshots WHERE scene NOT IN (SELECT id FROM scenes);"
        "DELETE FROM names WHERE scene NOT IN (SELECT id FROM scenes);"
        "DELETE FROM parts WHERE content NOT IN (SELECT id FROM contents);"
        "UPDATE contents SET is_whole=0 WHERE is_whole=1 AND size<>"
        "(SELECT coalesce(sum(length(bytes)),0) FROM parts WHERE content=contents.id);",
        NULL, NULL, NULL);
}

static int purge_tables(struct bd_journal *journal)
{
    int result = bd_journal_begin(journal);
    if (result) return result;
    result = purge(journal, "edits", EDIT_ALL, edit_is_whole);
    if (!result) result = purge(journal, "snapshots", SNAPSHOT_ALL, snapshot_is_whole);
    if (!result) result = purge(journal, "names", "name,revision,chk", name_is_whole);
    if (!result) result = purge_remains(journal);
    return bd_journal_end(journal, result);
}

// The end of the unbroken run of edits after the newest snapshot; 0 if there is no snapshot.
static int find_whole_end(struct bd_journal *journal, int64_t row, uint64_t *out)
{
    int result = bd_journal_snapshot_before(journal, row, INT64_MAX, out);
    if (result || *out == 0) return result;
    sqlite3_stmt *heads = bd_journal_sql(journal, BD_SQL_EDIT_HEADS);
    bd_bind_u64(heads, 1, (uint64_t)row);
    bd_bind_u64(heads, 2, *out + 1);
    int step;
    while ((step = sqlite3_step(heads)) == SQLITE_ROW &&
           (uint64_t)sqlite3_column_int64(heads, 0) == *out + 1)
        (*out)++;
    return bd_journal_done(heads, step);
}

static int mend_scene(struct bd_journal *journal, int64_t row, const char *scene, uint64_t newest)
{
    uint64_t end;
    int result = find_whole_end(journal, row, &end);
    if (result) return result;
    if (end == 0) {
        bd_log(BD_LOG_WARN, "journal", "scene %.64s is lost: no state of it is whole", scene);
        sqlite3_stmt *remove = bd_journal_sql(journal, BD_SQL_REMOVE_SCENE);
        bd_bind_u64(remove, 1, (uint64_t)row);
        return bd_journal_run(remove);
    }
    bd_log(BD_LOG_WARN, "journal", "scene %.64s is served at revision %llu; the newest was %llu",
           scene, (unsigned long long)end, (unsigned long long)newest);
    result = bd_journal_begin(journal);
    return result ? result : bd_journal_end(journal, bd_journal_cut_rows(journal, row, scene, end));
}

static int mend_scenes(struct bd_journal *journal)
{
    for (int64_t at = 0;;) {
        sqlite3_stmt *next = bd_journal_sql(journal, BD_SQL_NEXT_SCENE);
        bd_bind_u64(next, 1, (uint64_t)at);
        int step = sqlite3_step(next);
        char scene[BD_JOURNAL_TEXT_BYTES_MAX + 1] = "";
        uint64_t newest = 0;
        if (step == SQLITE_ROW) {
            snprintf(scene, sizeof scene, "%s", bd_column_text(next, 0));
            newest = (uint64_t)sqlite3_column_int64(next, 3);
            at = sqlite3_column_int64(next, 5);
        }
        int result = bd_journal_done(next, step);
        if (result || step == SQLITE_DONE) return result;
        result = mend_scene(journal, at, scene, newest);
        if (result) return result;
    }
}

// Before it takes the old one's place: nothing may lie between the two but a rename.
static int set_state(struct bd_journal *journal, const struct bd_journal_state *state)
{
    journal->state = *state;
    int result = bd_journal_begin(journal);
    journal->changes_more = true;
    return result ? result : bd_journal_end(journal, SQLITE_OK);
}

static int build_anew(const char *path, struct bd_journal *journal, struct bd_identity *identity,
                      struct bd_err_detail *detail)
{
    if (bd_journal_connect(journal, detail)) return SQLITE_CANTOPEN;
    // What is in the log goes into the file.
    int result = bd_identity_settle(identity, identity->base);
    if (!result) result = copy_tables(path, journal);
    if (!result) result = purge_tables(journal);
    if (!result) result = mend_scenes(journal);
    if (!result) result = set_state(journal, &identity->state);
    // All of it may still be in the log, and closing would not say whether it comes out of there.
    int log_pages, copied;
    if (!result)
        result = sqlite3_wal_checkpoint_v2(journal->db, NULL, SQLITE_CHECKPOINT_TRUNCATE,
                                           &log_pages, &copied);
    return result;
}

static void sync_directory(const char *path)
{
    char copy[BD_JOURNAL_FILE_BYTES + 32];
    snprintf(copy, sizeof copy, "%s", path);
    int directory = open(dirname(copy), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (directory < 0) return;
    fsync(directory);
    close(directory);
}

static bool has_log(const char *path)
{
    char log[BD_JOURNAL_FILE_BYTES + 32];
    struct stat info;
    snprintf(log, sizeof log, "%s-wal", path);
    return stat(log, &info) == 0 ? info.st_size > 0 : errno != ENOENT;
}

// The old file gets a second name before the new one takes its first: whenever the power goes, one
// of the two stands there. A log that the old one leaves would be taken for the new file's, and one
// that the new one has would stay behind: there must be none.
static bool change_places(const char *path, const char *anew, char *kept, size_t kept_bytes)
{
    if (has_log(path) || has_log(anew)) {
        errno = EEXIST;
        return false;
    }
    for (int i = 0; i < 1000; i++) {
        snprintf(kept, kept_bytes, i ? "%s.damaged.%d" : "%s.damaged", path, i);
        if (link(path, kept) == 0) break;
        if (errno != EEXIST) return false;
    }
    if (rename(anew, path) != 0) return false;
    sync_directory(path);
    return true;
}

static void remove_file(const char *path)
{
    char log[BD_JOURNAL_FILE_BYTES + 32];
    snprintf(log, sizeof log, "%s-wal", path);
    unlink(log);
    unlink(path);
}

enum bd_err bd_journal_salvage(const char *path, const char *where, struct bd_identity *identity,
                               struct bd_err_detail *detail)
{
    struct bd_journal *journal = calloc(1, sizeof *journal);
    BD_ASSERT(journal);
    char kept[BD_JOURNAL_FILE_BYTES + 32];
    snprintf(journal->path, sizeof journal->path, "%.4000s.anew", path);
    bd_log(BD_LOG_WARN, "journal", "%s is damaged (%s): what is whole in it is copied", path,
           where);
    remove_file(journal->path);
    int result = build_anew(path, journal, identity, detail);
    bd_journal_disconnect(journal);
    bool is_done = !result && change_places(path, journal->path, kept, sizeof kept);
    if (is_done)
        bd_log(BD_LOG_WARN, "journal", "the damaged file is kept as %s", kept);
    else
        remove_file(journal->path);
    free(journal);
    if (is_done) return BD_ERR_OK;
    if (result == SQLITE_FULL)
        return bd_err_set(detail, BD_ERR_NO_MEMORY, "data",
                          "%s is damaged (%s), and the disk has no room for a copy of what is "
                          "whole in it: make room",
                          path, where);
    return bd_err_set(detail, BD_ERR_IO, "data",
                      "%s is damaged (%s) and could not be built anew (%s): mend it, or move it "
                      "away to begin without scenes",
                      path, where, result ? sqlite3_errstr(result) : strerror(errno));
}
