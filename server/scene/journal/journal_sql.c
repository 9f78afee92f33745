#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "base/assert.h"
#include "scene/journal/journal_internal.h"

const char *const bd_journal_sql_texts[BD_SQL_COUNT] = {
#define X(name, text) text,
    BD_SQL_MAP(X)
#undef X
};

sqlite3_stmt *bd_journal_sql(struct bd_journal *journal, enum bd_journal_sql name)
{
    sqlite3_stmt *statement = journal->statements[name];
    sqlite3_reset(statement);
    return statement;
}

// Binding fails only for want of memory or for bytes beyond limits that were checked before; the
// value is then NULL, which every table refuses.
void bd_bind_u64(sqlite3_stmt *statement, int index, uint64_t value)
{
    sqlite3_bind_int64(statement, index, (int64_t)value);
}

void bd_bind_text(sqlite3_stmt *statement, int index, const char *text)
{
    sqlite3_bind_text(statement, index, text ? text : "", -1, SQLITE_STATIC);
}

void bd_bind_bytes(sqlite3_stmt *statement, int index, const void *data, size_t size)
{
    sqlite3_bind_blob64(statement, index, size ? data : "", size, SQLITE_STATIC);
}

void bd_bind_digests(sqlite3_stmt *statement, int index, const struct bd_journal_digests *list)
{
    bd_bind_bytes(statement, index, list->sha256, (size_t)list->count * BD_SHA256_BYTES);
}

const char *bd_column_text(sqlite3_stmt *statement, int index)
{
    const char *text = (const char *)sqlite3_column_text(statement, index);
    return text ? text : "";
}

struct bd_journal_bytes bd_column_bytes(sqlite3_stmt *statement, int index)
{
    const void *data = sqlite3_column_blob(statement, index);
    size_t size = data ? (size_t)sqlite3_column_bytes(statement, index) : 0;
    return (struct bd_journal_bytes){data ? data : "", size};
}

struct bd_journal_digests bd_column_digests(sqlite3_stmt *statement, int index)
{
    struct bd_journal_bytes bytes = bd_column_bytes(statement, index);
    return (struct bd_journal_digests){bytes.data, (uint32_t)(bytes.size / BD_SHA256_BYTES)};
}

bool bd_column_sha256(sqlite3_stmt *statement, int index, uint8_t sha256[BD_SHA256_BYTES])
{
    struct bd_journal_bytes bytes = bd_column_bytes(statement, index);
    memset(sha256, 0, BD_SHA256_BYTES);
    if (bytes.size != BD_SHA256_BYTES) return false;
    memcpy(sha256, bytes.data, BD_SHA256_BYTES);
    return true;
}

int bd_journal_done(sqlite3_stmt *statement, int step)
{
    sqlite3_reset(statement);
    sqlite3_clear_bindings(statement);
    return step == SQLITE_ROW || step == SQLITE_DONE ? SQLITE_OK : step;
}

int bd_journal_run(sqlite3_stmt *statement)
{
    int step;
    do step = sqlite3_step(statement);
    while (step == SQLITE_ROW);
    return bd_journal_done(statement, step);
}

int bd_journal_number(sqlite3_stmt *statement, uint64_t *out)
{
    int step = sqlite3_step(statement);
    *out = step == SQLITE_ROW ? (uint64_t)sqlite3_column_int64(statement, 0) : 0;
    return bd_journal_done(statement, step);
}

bool bd_journal_is_damage(int result)
{
    return (result & 0xff) == SQLITE_CORRUPT || (result & 0xff) == SQLITE_NOTADB;
}

void bd_journal_suspect_path(const struct bd_journal *journal, char *out, size_t out_bytes)
{
    snprintf(out, out_bytes, "%s.suspect", journal->path);
}

// Whatever met it, the whole file is looked through when it is opened again.
static void suspect(struct bd_journal *journal)
{
    char path[BD_JOURNAL_FILE_BYTES + 32];
    journal->is_damaged = true;
    bd_journal_suspect_path(journal, path, sizeof path);
    int file = open(path, O_WRONLY | O_CREAT | O_CLOEXEC, 0600);
    if (file >= 0) close(file);
}

// SQLite does not keep the number on every way out; its file layer does, until the next call.
static int system_error(struct bd_journal *journal)
{
    int number = journal->db ? sqlite3_system_errno(journal->db) : 0;
    sqlite3_vfs *vfs = sqlite3_vfs_find(NULL);
    return number || !vfs ? number : vfs->xGetLastError(vfs, 0, NULL);
}

static bool is_full(struct bd_journal *journal, int result)
{
    int system = system_error(journal);
    int kind = result & 0xff;
    if (kind == SQLITE_FULL) return true;
    return (kind == SQLITE_IOERR || kind == SQLITE_CANTOPEN) &&
           (system == ENOSPC || system == EDQUOT);
}

enum bd_err bd_journal_err(struct bd_journal *journal, int result, const char *what,
                           struct bd_err_detail *detail)
{
    const char *path = journal->name;
    BD_ASSERT_CMP(result, !=, SQLITE_OK);
    if (is_full(journal, result))
        return bd_err_set(detail, BD_ERR_NO_MEMORY, "data", "%s: the disk of %s is full", what,
                          path);
    if (bd_journal_is_damage(result)) suspect(journal);
    if (bd_journal_is_damage(result))
        return bd_err_set(detail, BD_ERR_IO, "data", "%s: %s is damaged%s", what, path,
                          journal->is_copy ? "" : "; the next start mends it");
    if (result == SQLITE_READONLY_DBMOVED)
        return bd_err_set(detail, BD_ERR_IO, "data",
                          "%s: %s or its log is not where it was when the daemon began: moved, "
                          "removed or replaced; put it back, or end the daemon",
                          what, path);
    switch (result & 0xff) {
    case SQLITE_NOMEM:
        return bd_err_set(detail, BD_ERR_NO_MEMORY, "", "%s: out of memory", what);
    case SQLITE_BUSY:
    case SQLITE_LOCKED:
        return bd_err_set(detail, BD_ERR_CONFLICT, "data", "%s: another program has %s open", what,
                          path);
    case SQLITE_READONLY:
    case SQLITE_PERM:
        return bd_err_set(detail, BD_ERR_IO, "data", "%s: %s is read-only", what, path);
    default:;
    }
    int system = system_error(journal);
    return bd_err_set(detail, BD_ERR_IO, "data", "%s: %s: %s (%d)%s%s", what, path,
                      sqlite3_errstr(result), result, system ? ", " : "",
                      system ? strerror(system) : "");
}

int bd_journal_begin(struct bd_journal *journal)
{
    // What is written to files that nobody finds any more is lost.
    if (!bd_journal_is_in_place(journal)) return SQLITE_READONLY_DBMOVED;
    journal->changes_more = false;
    journal->changes_begun = sqlite3_total_changes64(journal->db);
    return bd_journal_run(bd_journal_sql(journal, BD_SQL_BEGIN));
}

int bd_journal_end(struct bd_journal *journal, int result)
{
    bool has_changed =
        journal->changes_more || sqlite3_total_changes64(journal->db) != journal->changes_begun;
    if (result == SQLITE_OK && has_changed) result = bd_journal_write_state(journal);
    if (result == SQLITE_OK) result = bd_journal_run(bd_journal_sql(journal, BD_SQL_COMMIT));
    if (result == SQLITE_OK && has_changed)
        bd_identity_note(&journal->identity, journal->db, ++journal->state.sequence);
    // Some errors end the transaction by themselves.
    if (result != SQLITE_OK && !sqlite3_get_autocommit(journal->db))
        bd_journal_run(bd_journal_sql(journal, BD_SQL_ROLLBACK));
    return result;
}
