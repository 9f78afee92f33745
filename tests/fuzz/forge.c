#include "tests/fuzz/forge.h"

#include <sqlite3.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "scene/journal/journal_internal.h"

#define CHANGE_BYTES 6
#define CHANGES_MAX  32

struct column {
    const char *table, *name;
    char kind; // b: bytes, t: text, n: number
};

static const struct column columns[] = {
    {"edits", "forward", 'b'},
    {"edits", "inverse", 'b'},
    {"edits", "forward_content", 'b'},
    {"edits", "inverse_content", 'b'},
    {"edits", "answer", 'b'},
    {"edits", "summary", 'b'},
    {"edits", "snapshot_sha256", 'b'},
    {"edits", "kind", 't'},
    {"edits", "client_edit_id", 't'},
    {"edits", "message", 't'},
    {"edits", "of", 'n'},
    {"edits", "revision", 'n'},
    {"edits", "time_ms", 'n'},
    {"edits", "scene", 'n'},
    {"snapshots", "bytes", 'b'},
    {"snapshots", "content", 'b'},
    {"snapshots", "sha256", 'b'},
    {"snapshots", "revision", 'n'},
    {"snapshots", "scene", 'n'},
    {"scenes", "scene", 't'},
    {"scenes", "name", 't'},
    {"scenes", "owner", 't'},
    {"scenes", "revision", 'n'},
    {"names", "name", 't'},
    {"names", "revision", 'n'},
    {"contents", "is_whole", 'n'},
    {"parts", "bytes", 'b'},
    {"parts", "part", 'n'},
};
#define COLUMN_COUNT (sizeof columns / sizeof columns[0])

// --- statements -------------------------------------------------------------------------------

static sqlite3_stmt *prepare(sqlite3 *db, const char *sql)
{
    sqlite3_stmt *statement = NULL;
    int result = sqlite3_prepare_v2(db, sql, -1, &statement, NULL);
    if (result) fprintf(stderr, "%s: %s\n", sql, sqlite3_errmsg(db));
    BD_ASSERT_CMP(result, ==, SQLITE_OK);
    return statement;
}

// A change that the format itself forbids (a revision that is there twice) is none.
static void finish(sqlite3_stmt *statement)
{
    int step = sqlite3_step(statement);
    BD_ASSERT(step == SQLITE_DONE || (step & 0xff) == SQLITE_CONSTRAINT);
    sqlite3_finalize(statement);
}

static void set_number(sqlite3 *db, const char *sql, int64_t id, uint64_t first, uint64_t second)
{
    sqlite3_stmt *statement = prepare(db, sql);
    sqlite3_bind_int64(statement, 1, id);
    sqlite3_bind_int64(statement, 2, (sqlite3_int64)first);
    if (sqlite3_bind_parameter_count(statement) > 2)
        sqlite3_bind_int64(statement, 3, (sqlite3_int64)second);
    finish(statement);
}

// --- changes ----------------------------------------------------------------------------------

struct value {
    uint8_t *bytes;
    size_t size;
};

static const uint32_t numbers[] = {0,          1,          2,          3,          0x7f,
                                   0x80,       0xff,       0x100,      0x7fff,     0xffff,
                                   0x10000,    0x3f800000, 0x7f800000, 0x7fc00000, 0x7fffffff,
                                   0x80000000, 0xfffffffe, 0xffffffff};

static void put_number(struct value *value, size_t at, uint32_t number)
{
    for (size_t i = 0; i < 4 && at + i < value->size; i++)
        value->bytes[at + i] = (uint8_t)(number >> 8 * i);
}

static void insert(struct value *value, size_t at, size_t count)
{
    value->bytes = realloc(value->bytes, value->size + count + 1);
    BD_ASSERT(value->bytes);
    memmove(value->bytes + at + count, value->bytes + at, value->size - at);
    memset(value->bytes + at, 0, count);
    value->size += count;
}

static void take_out(struct value *value, size_t at, size_t count)
{
    if (count > value->size - at) count = value->size - at;
    memmove(value->bytes + at, value->bytes + at + count, value->size - at - count);
    value->size -= count;
}

static void change_bytes(struct value *value, size_t at, uint8_t how, uint8_t by)
{
    at = value->size ? at % value->size : 0;
    if (how % 6 == 3) insert(value, at, by);
    if (value->size == 0) return;
    if (how % 6 == 0) value->bytes[at] ^= by;
    if (how % 6 == 1) value->bytes[at] = by;
    if (how % 6 == 2) put_number(value, at, numbers[by % (sizeof numbers / sizeof numbers[0])]);
    if (how % 6 == 4) take_out(value, at, by);
    if (how % 6 == 5) value->size = at;
}

static int64_t change_number(int64_t number, uint8_t how, uint8_t by)
{
    if (how % 3 == 0) return by;
    if (how % 3 == 1) return (int64_t)((uint64_t)number + (uint64_t)(int8_t)by); // around
    return by & 1 ? INT64_MAX : INT64_MIN;
}

// The id of the `row`th of a table's rows, around; 0 if it has none.
static int64_t find_row(sqlite3 *db, const char *table, uint8_t row)
{
    char sql[128];
    snprintf(sql, sizeof sql,
             "SELECT id FROM %s ORDER BY id LIMIT 1 OFFSET %u %% max((SELECT count(*) FROM %s),1)",
             table, row, table);
    sqlite3_stmt *find = prepare(db, sql);
    int64_t id = sqlite3_step(find) == SQLITE_ROW ? sqlite3_column_int64(find, 0) : 0;
    sqlite3_finalize(find);
    return id;
}

static struct value read_value(sqlite3_stmt *row)
{
    struct value value = {NULL, (size_t)sqlite3_column_bytes(row, 0)};
    value.bytes = malloc(value.size + 1);
    BD_ASSERT(value.bytes);
    if (value.size > 0) memcpy(value.bytes, sqlite3_column_blob(row, 0), value.size);
    return value;
}

static void write_changed(sqlite3_stmt *write, const struct column *column, sqlite3_stmt *old,
                          const uint8_t change[CHANGE_BYTES])
{
    if (column->kind == 'n') {
        sqlite3_bind_int64(write, 1,
                           change_number(sqlite3_column_int64(old, 0), change[4], change[5]));
        return;
    }
    struct value value = read_value(old);
    change_bytes(&value, (size_t)(change[2] | change[3] << 8), change[4], change[5]);
    if (column->kind == 'b')
        sqlite3_bind_blob(write, 1, value.bytes, (int)value.size, SQLITE_TRANSIENT);
    else
        sqlite3_bind_text(write, 1, (const char *)value.bytes, (int)value.size, SQLITE_TRANSIENT);
    free(value.bytes);
}

static void change(sqlite3 *db, const uint8_t change[CHANGE_BYTES])
{
    char sql[128];
    const struct column *column = &columns[change[0] % COLUMN_COUNT];
    const int64_t id = find_row(db, column->table, change[1]);
    if (!id) return;
    snprintf(sql, sizeof sql, "SELECT %s FROM %s WHERE id=%lld", column->name, column->table,
             (long long)id);
    sqlite3_stmt *old = prepare(db, sql);
    int step = sqlite3_step(old);
    BD_ASSERT_CMP(step, ==, SQLITE_ROW);
    snprintf(sql, sizeof sql, "UPDATE %s SET %s=? WHERE id=%lld", column->table, column->name,
             (long long)id);
    sqlite3_stmt *write = prepare(db, sql);
    write_changed(write, column, old, change);
    sqlite3_finalize(old);
    finish(write);
}

// --- names of content -------------------------------------------------------------------------

static void rename_in(sqlite3 *db, const struct column *column, const uint8_t *from,
                      const uint8_t *to)
{
    char sql[128];
    snprintf(sql, sizeof sql, "SELECT %s, id FROM %s", column->name, column->table);
    sqlite3_stmt *rows = prepare(db, sql);
    snprintf(sql, sizeof sql, "UPDATE %s SET %s=?1 WHERE id=?2", column->table, column->name);
    while (sqlite3_step(rows) == SQLITE_ROW) {
        struct value value = read_value(rows);
        bool is_changed = false;
        uint8_t *at = value.bytes;
        while ((at = memmem(at, value.size - (size_t)(at - value.bytes), from, BD_SHA256_BYTES))) {
            memcpy(at, to, BD_SHA256_BYTES);
            is_changed = true;
        }
        sqlite3_stmt *write = prepare(db, sql);
        sqlite3_bind_blob(write, 1, value.bytes, (int)value.size, SQLITE_TRANSIENT);
        sqlite3_bind_int64(write, 2, sqlite3_column_int64(rows, 1));
        if (is_changed)
            finish(write);
        else
            sqlite3_finalize(write);
        free(value.bytes);
    }
    sqlite3_finalize(rows);
}

static void rename_everywhere(sqlite3 *db, const uint8_t *from, const uint8_t *to)
{
    static const struct column namers[] = {
        {"edits", "forward", 'b'},         {"edits", "inverse", 'b'},
        {"edits", "forward_content", 'b'}, {"edits", "inverse_content", 'b'},
        {"snapshots", "bytes", 'b'},       {"snapshots", "content", 'b'}};
    for (size_t i = 0; i < sizeof namers / sizeof namers[0]; i++)
        rename_in(db, &namers[i], from, to);
}

static uint64_t hash_parts(sqlite3 *db, int64_t content, uint8_t sha256[BD_SHA256_BYTES])
{
    uint64_t size = 0;
    struct bd_sha256 *sha = bd_sha256_create();
    sqlite3_stmt *parts = prepare(db, "SELECT bytes FROM parts WHERE content=?1 ORDER BY part");
    sqlite3_bind_int64(parts, 1, content);
    while (sqlite3_step(parts) == SQLITE_ROW) {
        size_t bytes = (size_t)sqlite3_column_bytes(parts, 0);
        if (bytes > 0) bd_sha256_update(sha, sqlite3_column_blob(parts, 0), bytes);
        size += bytes;
    }
    sqlite3_finalize(parts);
    bd_sha256_finish(&sha, sha256);
    return size;
}

static void name_content(sqlite3 *db)
{
    sqlite3_stmt *rows = prepare(db, "SELECT sha256, id FROM contents");
    while (sqlite3_step(rows) == SQLITE_ROW) {
        struct value old = read_value(rows);
        uint8_t sha256[BD_SHA256_BYTES];
        uint64_t size = hash_parts(db, sqlite3_column_int64(rows, 1), sha256);
        if (old.size == BD_SHA256_BYTES && memcmp(old.bytes, sha256, BD_SHA256_BYTES) != 0) {
            sqlite3_stmt *write = prepare(db, "UPDATE contents SET sha256=?1, size=?2 WHERE id=?3");
            sqlite3_bind_blob(write, 1, sha256, BD_SHA256_BYTES, SQLITE_TRANSIENT);
            sqlite3_bind_int64(write, 2, (sqlite3_int64)size);
            sqlite3_bind_int64(write, 3, sqlite3_column_int64(rows, 1));
            finish(write);
            rename_everywhere(db, old.bytes, sha256);
        }
        free(old.bytes);
    }
    sqlite3_finalize(rows);
}

// --- sums -------------------------------------------------------------------------------------

static void sum_scenes(sqlite3 *db)
{
    sqlite3_stmt *rows =
        prepare(db, "SELECT id, scene, name, added_ms, revision, owner FROM scenes");
    while (sqlite3_step(rows) == SQLITE_ROW) {
        const struct bd_journal_scene scene = {.scene = bd_column_text(rows, 1),
                                               .name = bd_column_text(rows, 2),
                                               .added_ms = (uint64_t)sqlite3_column_int64(rows, 3),
                                               .revision = (uint64_t)sqlite3_column_int64(rows, 4),
                                               .owner = bd_column_text(rows, 5)};
        set_number(db, "UPDATE scenes SET chk=?2 WHERE id=?1", sqlite3_column_int64(rows, 0),
                   bd_check_scene(&scene), 0);
    }
    sqlite3_finalize(rows);
}

static void sum_names(sqlite3 *db)
{
    sqlite3_stmt *rows = prepare(db, "SELECT id, scene, name, revision FROM names");
    while (sqlite3_step(rows) == SQLITE_ROW)
        set_number(db, "UPDATE names SET chk=?2 WHERE id=?1", sqlite3_column_int64(rows, 0),
                   bd_check_name(sqlite3_column_int64(rows, 1), bd_column_text(rows, 2),
                                 (uint64_t)sqlite3_column_int64(rows, 3)),
                   0);
    sqlite3_finalize(rows);
}

static void sum_snapshots(sqlite3 *db)
{
    sqlite3_stmt *rows =
        prepare(db, "SELECT id, scene, revision, sha256, content, bytes FROM snapshots");
    while (sqlite3_step(rows) == SQLITE_ROW) {
        struct bd_journal_snapshot snapshot = {.revision = (uint64_t)sqlite3_column_int64(rows, 2),
                                               .content = bd_column_digests(rows, 4),
                                               .index = bd_column_bytes(rows, 5)};
        if (!bd_column_sha256(rows, 3, snapshot.sha256)) continue;
        set_number(db, "UPDATE snapshots SET chk=?2 WHERE id=?1", sqlite3_column_int64(rows, 0),
                   bd_check_snapshot(sqlite3_column_int64(rows, 1), &snapshot), 0);
    }
    sqlite3_finalize(rows);
}

static void sum_edits(sqlite3 *db)
{
    sqlite3_stmt *rows = prepare(
        db, "SELECT id, scene, revision, kind, of, client_edit_id, message, time_ms,"
            " snapshot_sha256, summary, answer, forward_content, inverse_content, forward, inverse"
            " FROM edits");
    while (sqlite3_step(rows) == SQLITE_ROW) {
        struct bd_journal_edit edit = {.revision = (uint64_t)sqlite3_column_int64(rows, 2),
                                       .kind = bd_column_text(rows, 3),
                                       .of = (uint64_t)sqlite3_column_int64(rows, 4),
                                       .client_edit_id = bd_column_text(rows, 5),
                                       .message = bd_column_text(rows, 6),
                                       .time_ms = (uint64_t)sqlite3_column_int64(rows, 7),
                                       .summary = bd_column_bytes(rows, 9),
                                       .answer = bd_column_bytes(rows, 10),
                                       .forward_content = bd_column_digests(rows, 11),
                                       .inverse_content = bd_column_digests(rows, 12),
                                       .forward = bd_column_bytes(rows, 13),
                                       .inverse = bd_column_bytes(rows, 14)};
        if (!bd_column_sha256(rows, 8, edit.snapshot_sha256)) continue;
        const uint64_t payload_check = bd_check_edit_payload(&edit);
        set_number(db, "UPDATE edits SET payload_chk=?2, chk=?3 WHERE id=?1",
                   sqlite3_column_int64(rows, 0), payload_check,
                   bd_check_edit(sqlite3_column_int64(rows, 1), &edit, payload_check));
    }
    sqlite3_finalize(rows);
}

static void run(sqlite3 *db, const char *sql)
{
    int result = sqlite3_exec(db, sql, NULL, NULL, NULL);
    BD_ASSERT_CMP(result, ==, SQLITE_OK);
}

void forge(const char *directory, const uint8_t *changes, size_t size)
{
    char path[256];
    sqlite3 *db;
    snprintf(path, sizeof path, "%s/" BD_JOURNAL_FILE, directory);
    int result = sqlite3_open(path, &db);
    BD_ASSERT_CMP(result, ==, SQLITE_OK);
    run(db, "PRAGMA synchronous=OFF; PRAGMA locking_mode=EXCLUSIVE; BEGIN IMMEDIATE");
    size_t count = size / CHANGE_BYTES;
    if (count > CHANGES_MAX) count = CHANGES_MAX;
    for (size_t i = 0; i < count; i++) change(db, changes + i * CHANGE_BYTES);
    name_content(db);
    sum_scenes(db);
    sum_names(db);
    sum_snapshots(db);
    sum_edits(db);
    run(db, "COMMIT");
    sqlite3_close(db);
}
