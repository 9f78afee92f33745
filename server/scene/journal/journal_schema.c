// The file's settings and its format, from version to version.

#include <stdio.h>
#include <string.h>

#include "scene/journal/journal_internal.h"

#define APPLICATION_ID 0x62644a6c // "bdJl", in the file's header: `file` and we know it by that

// `chk` is the sum over the fields before it (journal_check.c). What is long stands last: the
// columns before it are read without walking through it. Each table has an integer key of its own,
// so that rows can be found past a broken page, and indexes can be made again.
static const char format_1[] =
    "CREATE TABLE scenes(id INTEGER PRIMARY KEY AUTOINCREMENT, scene TEXT NOT NULL UNIQUE,"
    " name TEXT NOT NULL, added_ms INTEGER NOT NULL, revision INTEGER NOT NULL,"
    " chk INTEGER NOT NULL, owner TEXT NOT NULL) STRICT;"
    "CREATE TABLE edits(id INTEGER PRIMARY KEY, scene INTEGER NOT NULL, revision INTEGER NOT NULL,"
    " kind TEXT NOT NULL, of INTEGER NOT NULL, client_edit_id TEXT NOT NULL,"
    " message TEXT NOT NULL, time_ms INTEGER NOT NULL, snapshot_sha256 BLOB NOT NULL,"
    " summary BLOB NOT NULL, payload_chk INTEGER NOT NULL, chk INTEGER NOT NULL,"
    " answer BLOB NOT NULL, forward_content BLOB NOT NULL, inverse_content BLOB NOT NULL,"
    " forward BLOB NOT NULL, inverse BLOB NOT NULL, UNIQUE(scene, revision)) STRICT;"
    "CREATE UNIQUE INDEX edits_by_client ON edits(scene, client_edit_id)"
    " WHERE client_edit_id<>'';"
    "CREATE TABLE snapshots(id INTEGER PRIMARY KEY, scene INTEGER NOT NULL,"
    " revision INTEGER NOT NULL, sha256 BLOB NOT NULL, content BLOB NOT NULL,"
    " chk INTEGER NOT NULL, bytes BLOB NOT NULL, UNIQUE(scene, revision)) STRICT;"
    "CREATE TABLE names(id INTEGER PRIMARY KEY, scene INTEGER NOT NULL, name TEXT NOT NULL,"
    " revision INTEGER NOT NULL, chk INTEGER NOT NULL, UNIQUE(scene, name)) STRICT;"
    "CREATE TABLE contents(id INTEGER PRIMARY KEY AUTOINCREMENT, sha256 BLOB NOT NULL UNIQUE,"
    " size INTEGER NOT NULL, is_whole INTEGER NOT NULL) STRICT;"
    "CREATE TABLE parts(id INTEGER PRIMARY KEY, content INTEGER NOT NULL, part INTEGER NOT NULL,"
    " bytes BLOB NOT NULL, UNIQUE(content, part)) STRICT;";

// Who made each edit. The table is made anew: a column that is added stands behind what is long.
static const char format_2[] =
    "CREATE TABLE edits_2(id INTEGER PRIMARY KEY, scene INTEGER NOT NULL,"
    " revision INTEGER NOT NULL, kind TEXT NOT NULL, of INTEGER NOT NULL,"
    " client_edit_id TEXT NOT NULL, message TEXT NOT NULL, time_ms INTEGER NOT NULL,"
    " snapshot_sha256 BLOB NOT NULL, summary BLOB NOT NULL, payload_chk INTEGER NOT NULL,"
    " chk INTEGER NOT NULL, author TEXT NOT NULL DEFAULT '', answer BLOB NOT NULL,"
    " forward_content BLOB NOT NULL, inverse_content BLOB NOT NULL, forward BLOB NOT NULL,"
    " inverse BLOB NOT NULL, UNIQUE(scene, revision)) STRICT;"
    "INSERT INTO edits_2(id,scene,revision,kind,of,client_edit_id,message,time_ms,snapshot_sha256,"
    "summary,payload_chk,chk,answer,forward_content,inverse_content,forward,inverse)"
    " SELECT id,scene,revision,kind,of,client_edit_id,message,time_ms,snapshot_sha256,"
    "summary,payload_chk,chk,answer,forward_content,inverse_content,forward,inverse FROM edits;"
    "DROP TABLE edits;"
    "ALTER TABLE edits_2 RENAME TO edits;"
    "CREATE UNIQUE INDEX edits_by_client ON edits(scene, client_edit_id)"
    " WHERE client_edit_id<>'';";

// What the directory's identity (journal_identity.h) is held against. One row, once there is one.
static const char format_3[] =
    "CREATE TABLE state(id INTEGER PRIMARY KEY, identity BLOB NOT NULL, sequence INTEGER NOT NULL,"
    " chk INTEGER NOT NULL) STRICT;";

static const struct bd_journal_step steps[BD_JOURNAL_FORMAT] = {{format_1}, {format_2}, {format_3}};

static int run_steps(sqlite3 *db, uint32_t version, const struct bd_journal_step *table,
                     uint32_t count)
{
    char pragmas[96];
    snprintf(pragmas, sizeof pragmas, "PRAGMA application_id=%d; PRAGMA user_version=%u;",
             APPLICATION_ID, count);
    int result = SQLITE_OK;
    for (uint32_t i = version; i < count && result == SQLITE_OK; i++)
        result = sqlite3_exec(db, table[i].sql, NULL, NULL, NULL);
    return result ? result : sqlite3_exec(db, pragmas, NULL, NULL, NULL);
}

int bd_journal_migrate(sqlite3 *db, uint32_t version, const struct bd_journal_step *table,
                       uint32_t count)
{
    if (version >= count) return SQLITE_OK;
    int result = sqlite3_exec(db, "BEGIN IMMEDIATE", NULL, NULL, NULL);
    if (result) return result;
    result = run_steps(db, version, table, count);
    if (!result) result = sqlite3_exec(db, "COMMIT", NULL, NULL, NULL);
    if (result && !sqlite3_get_autocommit(db)) sqlite3_exec(db, "ROLLBACK", NULL, NULL, NULL);
    return result;
}

static int take_number(void *user, int count, char **values, char **names)
{
    (void)names;
    if (count == 1 && values[0]) sscanf(values[0], "%lld", (long long *)user);
    return 0;
}

static int read_number(sqlite3 *db, const char *sql, long long *out)
{
    *out = 0;
    return sqlite3_exec(db, sql, take_number, out, NULL);
}

static void harden(sqlite3 *db)
{
    static const struct {
        int option, value;
    } options[] = {
        {SQLITE_DBCONFIG_DEFENSIVE, 1},   {SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0},
        {SQLITE_DBCONFIG_ENABLE_VIEW, 0}, {SQLITE_DBCONFIG_ENABLE_TRIGGER, 0},
        {SQLITE_DBCONFIG_DQS_DDL, 0},     {SQLITE_DBCONFIG_DQS_DML, 0},
    };
    for (size_t i = 0; i < sizeof options / sizeof *options; i++)
        sqlite3_db_config(db, options[i].option, options[i].value, NULL);
}

#define TEXT_OF(number) #number
#define TEXT(number)    TEXT_OF(number)

// The lock is taken with the first read, so the mode comes before it: exclusive, and the
// write-ahead log needs no shared memory. No mapping: a failing disk would be a signal, not an
// error.
static int set_before_reading(sqlite3 *db)
{
    return sqlite3_exec(db,
                        "PRAGMA locking_mode=EXCLUSIVE; PRAGMA mmap_size=0;"
                        "PRAGMA temp_store=MEMORY; PRAGMA cell_size_check=ON;"
                        "PRAGMA trusted_schema=OFF;",
                        NULL, NULL, NULL);
}

// Of a file that is there auto_vacuum would only cost a write at each start.
static int set_for_new(sqlite3 *db)
{
    return sqlite3_exec(
        db,
        "PRAGMA page_size=" TEXT(BD_JOURNAL_PAGE_BYTES) ";"
                                                        "PRAGMA auto_vacuum=INCREMENTAL;",
        NULL, NULL, NULL);
}

static int set_for_writing(sqlite3 *db)
{
    char cache[64];
    snprintf(cache, sizeof cache, "PRAGMA cache_size=-%u;", BD_JOURNAL_CACHE_BYTES >> 10);
    int result = sqlite3_exec(db, "PRAGMA journal_mode=WAL", NULL, NULL, NULL);
    if (!result) result = sqlite3_exec(db, cache, NULL, NULL, NULL);
    if (result) return result;
    return sqlite3_exec(db,
                        "PRAGMA synchronous=FULL;"
                        "PRAGMA wal_autocheckpoint=" TEXT(
                            BD_JOURNAL_LOG_PAGES) ";"
                                                  "PRAGMA journal_size_limit=8388608;",
                        NULL, NULL, NULL);
}

static enum bd_err open_err(struct bd_journal *journal, int result, struct bd_err_detail *detail)
{
    journal->is_damaged = bd_journal_is_damage(result);
    return bd_journal_err(journal, result, "the journal cannot be opened", detail);
}

static enum bd_err check_version(struct bd_journal *journal, uint32_t *version,
                                 struct bd_err_detail *detail)
{
    long long number, application, tables;
    int result = read_number(journal->db, "PRAGMA user_version", &number);
    if (!result) result = read_number(journal->db, "PRAGMA application_id", &application);
    if (!result) result = read_number(journal->db, "SELECT count(*) FROM sqlite_schema", &tables);
    if (result) return open_err(journal, result, detail);
    bool is_empty = number == 0 && application == 0 && tables == 0;
    if (!is_empty && application != APPLICATION_ID)
        return bd_err_set(detail, BD_ERR_IO, "data", "%s is no journal of bounced", journal->name);
    if (number < 0 || number > BD_JOURNAL_FORMAT)
        return bd_err_set(detail, BD_ERR_UNSUPPORTED, "data",
                          "%s has format %lld, of a newer bounced; this one knows formats up to "
                          "%d: use the newer one, or another data directory",
                          journal->name, number, BD_JOURNAL_FORMAT);
    *version = (uint32_t)number;
    return BD_ERR_OK;
}

static int prepare(struct bd_journal *journal)
{
    int result = SQLITE_OK;
    for (int i = 0; i < BD_SQL_COUNT && !result; i++)
        result = sqlite3_prepare_v3(journal->db, bd_journal_sql_texts[i], -1,
                                    SQLITE_PREPARE_PERSISTENT, &journal->statements[i], NULL);
    // The statements are right: if a table or column is not there, the file's schema is damaged.
    return result == SQLITE_ERROR ? SQLITE_CORRUPT : result;
}

enum bd_err bd_journal_connect(struct bd_journal *journal, struct bd_err_detail *detail)
{
    int flags = SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE | SQLITE_OPEN_NOMUTEX |
                SQLITE_OPEN_EXRESCODE | SQLITE_OPEN_PRIVATECACHE;
    int result = sqlite3_open_v2(journal->path, &journal->db, flags, NULL);
    if (!result) harden(journal->db);
    // Whoever says that the log may go says so to the directory's identity first.
    if (!result && journal->identity.file)
        sqlite3_db_config(journal->db, SQLITE_DBCONFIG_NO_CKPT_ON_CLOSE, 1, NULL);
    if (!result) result = set_before_reading(journal->db);
    if (result) return open_err(journal, result, detail);
    uint32_t version = 0;
    enum bd_err err = check_version(journal, &version, detail);
    if (err) return err;
    if (version == 0) result = set_for_new(journal->db);
    if (!result) result = set_for_writing(journal->db);
    if (!result) result = bd_journal_migrate(journal->db, version, steps, BD_JOURNAL_FORMAT);
    if (!result) result = prepare(journal);
    if (!result) result = bd_journal_read_state(journal);
    return result ? open_err(journal, result, detail) : BD_ERR_OK;
}

void bd_journal_disconnect(struct bd_journal *journal)
{
    for (int i = 0; i < BD_SQL_COUNT; i++) {
        sqlite3_finalize(journal->statements[i]);
        journal->statements[i] = NULL;
    }
    sqlite3_close(journal->db);
    journal->db = NULL;
}
