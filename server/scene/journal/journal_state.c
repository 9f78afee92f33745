// Whether the database is what the directory's identity says that it should be.
//
// Looked at by connections of its own, which change nothing: SQLite would lay an old log over a
// newer file, or a new one over an older, and delete a log whose file is gone.

#include <stdio.h>
#include <string.h>
#include <sys/stat.h>

#include "base/log.h"
#include "scene/journal/journal_internal.h"

#define SEQUENCE_MAX ((uint64_t)1 << 62)

// What there is, as far as it can be read.
struct look {
    int has_file, has_log;
    bool knows_bare, knows; // what is known of the two below
    bool is_own_log;
    struct bd_journal_state bare; // the file without its log
    struct bd_journal_state state;
};

static int read_row(sqlite3_stmt *row, struct bd_journal_state *out)
{
    int step = sqlite3_step(row);
    *out = (struct bd_journal_state){.sequence = 0};
    if (step != SQLITE_ROW) return step == SQLITE_DONE ? SQLITE_OK : step;
    struct bd_journal_bytes identity = bd_column_bytes(row, 0);
    out->sequence = (uint64_t)sqlite3_column_int64(row, 1);
    uint64_t sum = (uint64_t)sqlite3_column_int64(row, 2);
    if (identity.size != BD_IDENTITY_BYTES || out->sequence > SEQUENCE_MAX) return SQLITE_CORRUPT;
    memcpy(out->identity, identity.data, BD_IDENTITY_BYTES);
    return sum == bd_check_state(out) ? SQLITE_OK : SQLITE_CORRUPT;
}

int bd_journal_read_state(struct bd_journal *journal)
{
    sqlite3_stmt *get = bd_journal_sql(journal, BD_SQL_GET_STATE);
    int result = read_row(get, &journal->state);
    bd_journal_done(get, SQLITE_DONE);
    return result;
}

int bd_journal_write_state(struct bd_journal *journal)
{
    struct bd_journal_state next = journal->state;
    next.sequence++;
    sqlite3_stmt *set = bd_journal_sql(journal, BD_SQL_SET_STATE);
    bd_bind_bytes(set, 1, next.identity, sizeof next.identity);
    bd_bind_u64(set, 2, next.sequence);
    bd_bind_u64(set, 3, bd_check_state(&next));
    return bd_journal_run(set);
}

// --- looking --------------------------------------------------------------------------------

// A path as SQLite reads it in a URI. Behind two slashes of its own an absolute one would name a
// machine.
static void write_uri(const char *path, char *out, size_t size)
{
    size_t at = (size_t)snprintf(out, size, *path == '/' ? "file://" : "file:");
    for (; *path && at + 32 < size; path++)
        at += (size_t)snprintf(out + at, size - at, strchr("%?#", *path) ? "%%%02x" : "%c", *path);
    snprintf(out + at, size - at, "?immutable=1");
}

// A format before there was a state has none, and what is no journal is said by who opens it.
static int read_state_of(sqlite3 *db, struct bd_journal_state *out)
{
    sqlite3_stmt *get = NULL;
    int result = sqlite3_prepare_v2(db, bd_journal_sql_texts[BD_SQL_GET_STATE], -1, &get, NULL);
    if (result == SQLITE_ERROR) *out = (struct bd_journal_state){.sequence = 0};
    if (result) return result == SQLITE_ERROR ? SQLITE_OK : result;
    result = read_row(get, out);
    sqlite3_finalize(get);
    return result;
}

static int look_by(const char *path, int flags, struct bd_journal_state *out)
{
    sqlite3 *db = NULL;
    int result = sqlite3_open_v2(
        path, &db, flags | SQLITE_OPEN_EXRESCODE | SQLITE_OPEN_NOMUTEX | SQLITE_OPEN_PRIVATECACHE,
        NULL);
    if (!result) sqlite3_db_config(db, SQLITE_DBCONFIG_NO_CKPT_ON_CLOSE, 1, NULL);
    if (!result)
        result = sqlite3_exec(db, "PRAGMA locking_mode=EXCLUSIVE; PRAGMA trusted_schema=OFF;", NULL,
                              NULL, NULL);
    if (!result) result = read_state_of(db, out);
    sqlite3_close(db);
    return result;
}

// What can be read but makes no sense is for those who look for damage.
static bool is_unknown(int result)
{
    return bd_journal_is_damage(result) || result == SQLITE_IOERR_SHORT_READ;
}

static int find_files(const struct bd_journal *journal, struct look *out)
{
    char log[BD_JOURNAL_FILE_BYTES + 32];
    sqlite3_vfs *vfs = sqlite3_vfs_find(NULL);
    snprintf(log, sizeof log, "%s-wal", journal->path);
    // Empty files count as none.
    int result = vfs->xAccess(vfs, journal->path, SQLITE_ACCESS_EXISTS, &out->has_file);
    return result ? result : vfs->xAccess(vfs, log, SQLITE_ACCESS_EXISTS, &out->has_log);
}

static int look(const struct bd_journal *journal, struct look *out)
{
    char uri[4 * BD_JOURNAL_FILE_BYTES], log[BD_JOURNAL_FILE_BYTES + 32];
    int result = find_files(journal, out);
    if (result || !out->has_file) return result;
    write_uri(journal->path, uri, sizeof uri);
    result = look_by(uri, SQLITE_OPEN_READONLY | SQLITE_OPEN_URI, &out->bare);
    out->knows_bare = !result;
    if (result && !is_unknown(result)) return result;
    out->state = out->bare;
    out->knows = out->knows_bare;
    if (!out->has_log) return SQLITE_OK;
    snprintf(log, sizeof log, "%s-wal", journal->path);
    out->is_own_log = journal->identity.needs_log && bd_identity_is_log(&journal->identity, log);
    result = look_by(journal->path, SQLITE_OPEN_READWRITE, &out->state);
    out->knows = !result;
    return is_unknown(result) ? SQLITE_OK : result;
}

// --- what it means --------------------------------------------------------------------------

#define WAY_OUT                                                                                    \
    "; nothing was changed: put back what belongs there, or start once with --accept-journal to "

static enum bd_err refuse_missing(const struct bd_journal *journal, struct bd_err_detail *detail)
{
    return bd_err_set(detail, BD_ERR_IO, "data",
                      "%s is missing or empty, and %s says that it had %llu writes" WAY_OUT
                      "begin without scenes",
                      journal->name, journal->identity.path,
                      (unsigned long long)journal->identity.state.sequence);
}

static enum bd_err refuse_nameless(const struct bd_journal *journal, struct bd_err_detail *detail)
{
    return bd_err_set(detail, BD_ERR_IO, "data",
                      "%s is missing or empty, and %s, which is damaged, cannot say whether it "
                      "had scenes" WAY_OUT "begin without scenes",
                      journal->name, journal->identity.path);
}

static enum bd_err refuse_lone_log(const struct bd_journal *journal, struct bd_err_detail *detail)
{
    return bd_err_set(detail, BD_ERR_IO, "data",
                      "%s is missing, and its log %s-wal is there" WAY_OUT "begin without scenes",
                      journal->name, BD_JOURNAL_FILE);
}

static enum bd_err refuse_without_log(const struct bd_journal *journal,
                                      struct bd_err_detail *detail)
{
    return bd_err_set(detail, BD_ERR_IO, "data",
                      "the log of %s, %s-wal, is missing, and it was in use when the daemon "
                      "ended" WAY_OUT "go on with what is there",
                      journal->name, BD_JOURNAL_FILE);
}

static enum bd_err refuse_log(const struct bd_journal *journal, struct bd_err_detail *detail)
{
    return bd_err_set(detail, BD_ERR_IO, "data",
                      "the log of %s, %s-wal, is an older copy: the two do not fit" WAY_OUT
                      "go on with what is there",
                      journal->name, BD_JOURNAL_FILE);
}

static enum bd_err refuse_other(const struct bd_journal *journal, struct bd_err_detail *detail)
{
    return bd_err_set(detail, BD_ERR_IO, "data",
                      "%s belongs to another data directory than %s" WAY_OUT "take it over",
                      journal->name, journal->identity.path);
}

static enum bd_err refuse_short(const struct bd_journal *journal, const struct look *look,
                                struct bd_err_detail *detail)
{
    const char *why = look->has_log ? "it or its log is an older copy, or the log is damaged"
                                    : "it is an older copy";
    return bd_err_set(detail, BD_ERR_IO, "data",
                      "%s ends at write %llu of %llu that were kept: %s" WAY_OUT
                      "go on with what is there",
                      journal->name, (unsigned long long)look->state.sequence,
                      (unsigned long long)journal->identity.state.sequence, why);
}

static enum bd_err refuse_old(const struct bd_journal *journal, const struct look *look,
                              struct bd_err_detail *detail)
{
    return bd_err_set(detail, BD_ERR_IO, "data",
                      "%s is an older copy: without its log it has %llu writes, and that log "
                      "began after %llu" WAY_OUT "go on with what is there",
                      journal->name, (unsigned long long)look->bare.sequence,
                      (unsigned long long)journal->identity.base);
}

static enum bd_err judge(const struct bd_journal *journal, const struct look *look,
                         struct bd_err_detail *detail)
{
    const struct bd_identity *identity = &journal->identity;
    if (!look->has_file && look->has_log) return refuse_lone_log(journal, detail);
    if (!look->has_file && identity->is_damaged) return refuse_nameless(journal, detail);
    if (identity->is_blank || identity->state.sequence == 0) return BD_ERR_OK;
    if (!look->has_file) return refuse_missing(journal, detail);
    if (look->knows && bd_state_is_named(&look->state) &&
        memcmp(look->state.identity, identity->state.identity, BD_IDENTITY_BYTES) != 0)
        return refuse_other(journal, detail);
    if (identity->needs_log && !look->has_log) return refuse_without_log(journal, detail);
    if (look->knows_bare && look->bare.sequence < identity->base)
        return refuse_old(journal, look, detail);
    if (look->knows_bare && look->has_log && !look->knows && !look->is_own_log)
        return refuse_log(journal, detail);
    if (look->knows && look->state.sequence < identity->state.sequence)
        return refuse_short(journal, look, detail);
    return BD_ERR_OK;
}

// A log that stays beside a new file would be taken for its own.
static enum bd_err set_lone_log_aside(const struct bd_journal *journal,
                                      struct bd_err_detail *detail)
{
    char log[BD_JOURNAL_FILE_BYTES + 32], aside[BD_JOURNAL_FILE_BYTES + 64];
    snprintf(log, sizeof log, "%s-wal", journal->path);
    snprintf(aside, sizeof aside, "%s.lone", log);
    if (rename(log, aside) == 0) return BD_ERR_OK;
    return bd_err_set(detail, BD_ERR_IO, "data", "%s cannot be renamed to %s.lone", log,
                      BD_JOURNAL_FILE "-wal");
}

// The identity that goes with what is there, before anything else is written: a database never
// bears a name that is not on the disk outside of it.
static int name(struct bd_journal *journal, const struct look *look)
{
    struct bd_journal_state state = look->state;
    struct bd_identity *identity = &journal->identity;
    if (!identity->is_blank && !bd_state_is_named(&state))
        memcpy(state.identity, identity->state.identity, BD_IDENTITY_BYTES);
    if (!bd_state_is_named(&state)) bd_state_name_anew(&state);
    return bd_identity_set(identity, &state);
}

enum bd_err bd_journal_check_state(struct bd_journal *journal, bool takes_all,
                                   struct bd_err_detail *detail)
{
    static const char cannot[] = "the data directory cannot be looked at";
    struct look seen = {0};
    int result = look(journal, &seen);
    if (result) return bd_journal_err(journal, result, cannot, detail);
    struct bd_err_detail why = {0};
    bool was_blank = journal->identity.is_blank;
    enum bd_err err = judge(journal, &seen, &why);
    if (err && !takes_all) {
        if (detail) *detail = why;
        return err;
    }
    if (err) bd_log(BD_LOG_WARN, "journal", "--accept-journal: taken as it is: %s", why.message);
    if (err && !seen.has_file && seen.has_log && set_lone_log_aside(journal, detail))
        return BD_ERR_IO;
    if (was_blank && seen.has_file && bd_state_is_named(&seen.state))
        bd_log(BD_LOG_WARN, "journal",
               "%s is missing or damaged, and made anew: whether %s is all that there was cannot "
               "be told",
               journal->identity.path, journal->name);
    if (!err && !was_blank) return BD_ERR_OK;
    result = name(journal, &seen);
    return result ? bd_journal_err(journal, result, "the data directory cannot be marked", detail)
                  : BD_ERR_OK;
}

// --- while it is open -------------------------------------------------------------------------

void bd_journal_settle(struct bd_journal *journal)
{
    int in_log = 0, copied = 0;
    if (!journal->db || !journal->identity.file) return;
    if (sqlite3_wal_checkpoint_v2(journal->db, NULL, SQLITE_CHECKPOINT_PASSIVE, &in_log, &copied) ||
        in_log != copied || bd_identity_settle(&journal->identity, journal->state.sequence))
        return;
    sqlite3_db_config(journal->db, SQLITE_DBCONFIG_NO_CKPT_ON_CLOSE, 0, NULL);
}

static uint64_t number_of(const char *path, uint64_t *device)
{
    struct stat info;
    if (stat(path, &info)) return 0;
    *device = (uint64_t)info.st_dev;
    return (uint64_t)info.st_ino;
}

static void find_place(const struct bd_journal *journal, struct bd_journal_place *out)
{
    char log[BD_JOURNAL_FILE_BYTES + 32];
    *out = (struct bd_journal_place){0};
    snprintf(log, sizeof log, "%s-wal", journal->path);
    out->file = number_of(journal->path, &out->device);
    out->log = number_of(log, &out->device);
    out->is_known = out->file && out->log;
}

bool bd_journal_is_in_place(const struct bd_journal *journal)
{
    struct bd_journal_place now;
    if (!journal->place.is_known) return true;
    find_place(journal, &now);
    return now.is_known && now.device == journal->place.device && now.file == journal->place.file &&
           now.log == journal->place.log;
}

enum bd_err bd_journal_take_state(struct bd_journal *journal, struct bd_err_detail *detail)
{
    static const char cannot[] = "the journal cannot be marked";
    struct bd_identity *identity = &journal->identity;
    find_place(journal, &journal->place);
    bd_identity_meet_log(identity, journal->db);
    if (memcmp(journal->state.identity, identity->state.identity, BD_IDENTITY_BYTES) == 0)
        return BD_ERR_OK;
    memcpy(journal->state.identity, identity->state.identity, BD_IDENTITY_BYTES);
    int result = bd_journal_begin(journal);
    journal->changes_more = true;
    if (!result) result = bd_journal_end(journal, SQLITE_OK);
    return result ? bd_journal_err(journal, result, cannot, detail) : BD_ERR_OK;
}
