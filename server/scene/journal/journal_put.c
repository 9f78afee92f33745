// Content on its way in, and out again. Where the power goes while content comes in, what is there
// of it counts as missing until it is put again or collected.

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "base/log.h"
#include "scene/journal/journal_internal.h"

int bd_journal_find_content(struct bd_journal *journal, const uint8_t sha256[BD_SHA256_BYTES],
                            uint64_t *row)
{
    *row = 0;
    if (bd_digests_have(&journal->damaged, sha256)) return SQLITE_OK;
    sqlite3_stmt *find = bd_journal_sql(journal, BD_SQL_FIND_CONTENT);
    bd_bind_bytes(find, 1, sha256, BD_SHA256_BYTES);
    int step = sqlite3_step(find);
    if (step == SQLITE_ROW && sqlite3_column_int(find, 2) == 1)
        *row = (uint64_t)sqlite3_column_int64(find, 0);
    return bd_journal_done(find, step);
}

enum bd_err bd_journal_has_content(struct bd_journal *journal,
                                   const uint8_t sha256[BD_SHA256_BYTES], bool *out,
                                   struct bd_err_detail *detail)
{
    uint64_t row;
    int result = bd_journal_find_content(journal, sha256, &row);
    *out = !result && row;
    return result ? bd_journal_err(journal, result, "content cannot be looked for", detail)
                  : BD_ERR_OK;
}

int bd_journal_has_contents(struct bd_journal *journal, const struct bd_journal_digests *list,
                            bool *out)
{
    uint64_t row = 1;
    int result = SQLITE_OK;
    for (uint32_t i = 0; i < list->count && row && !result; i++)
        result = bd_journal_find_content(journal, list->sha256 + (size_t)i * BD_SHA256_BYTES, &row);
    *out = !result && row;
    return result;
}

// The row of content whose parts are written now, or were begun before.
static int open_content(struct bd_journal *journal, const struct bd_journal_content *content,
                        bool is_new, uint64_t *row)
{
    int result = SQLITE_OK;
    if (is_new) {
        sqlite3_stmt *begin = bd_journal_sql(journal, BD_SQL_BEGIN_CONTENT);
        bd_bind_bytes(begin, 1, content->sha256, BD_SHA256_BYTES);
        bd_bind_u64(begin, 2, content->bytes.size);
        result = bd_journal_run(begin);
    }
    if (result) return result;
    sqlite3_stmt *find = bd_journal_sql(journal, BD_SQL_FIND_CONTENT);
    bd_bind_bytes(find, 1, content->sha256, BD_SHA256_BYTES);
    return bd_journal_number(find, row);
}

static int put_part(struct bd_journal *journal, uint64_t row, uint64_t at, const void *data,
                    size_t size)
{
    sqlite3_stmt *put = bd_journal_sql(journal, BD_SQL_PUT_PART);
    bd_bind_u64(put, 1, row);
    bd_bind_u64(put, 2, at / BD_JOURNAL_PART_BYTES);
    bd_bind_bytes(put, 3, data, size);
    return bd_journal_run(put);
}

static int finish_content(struct bd_journal *journal, const struct bd_journal_content *content)
{
    sqlite3_stmt *finish = bd_journal_sql(journal, BD_SQL_FINISH_CONTENT);
    bd_bind_bytes(finish, 1, content->sha256, BD_SHA256_BYTES);
    return bd_journal_run(finish);
}

// Parts of one content, as many as `*room_bytes` allows; `put` moves to the next one after the
// last.
static int put_parts(struct bd_journal *journal, struct bd_journal_put *put, uint64_t *room_bytes)
{
    const struct bd_journal_content *content = &put->content[put->next];
    uint64_t row;
    int result = open_content(journal, content, put->next_bytes == 0, &row);
    while (!result && *room_bytes > 0 && put->next_bytes < content->bytes.size) {
        uint64_t left = content->bytes.size - put->next_bytes;
        size_t size = left < BD_JOURNAL_PART_BYTES ? (size_t)left : BD_JOURNAL_PART_BYTES;
        const char *data = content->bytes.data;
        result = put_part(journal, row, put->next_bytes, data + put->next_bytes, size);
        put->next_bytes += size;
        *room_bytes -= *room_bytes < size ? *room_bytes : size;
    }
    if (result || put->next_bytes < content->bytes.size) return result;
    put->next++;
    put->next_bytes = 0;
    return finish_content(journal, content);
}

// What begins must be named as on its way first: a round of collection may come between two calls.
static void pin_next(struct bd_journal *journal, struct bd_journal_put *put)
{
    if (put->pinned > put->next) return;
    bd_digests_add(&journal->pinned, put->content[put->next].sha256);
    put->pinned++;
}

static int put_slice(struct bd_journal *journal, struct bd_journal_put *put)
{
    uint64_t room_bytes = BD_JOURNAL_SLICE_BYTES;
    int result = SQLITE_OK;
    for (uint32_t i = 0;
         i < BD_JOURNAL_SLICE_RECORDS && put->next < put->count && !result && room_bytes > 0; i++) {
        uint64_t row = 0;
        pin_next(journal, put);
        result = bd_journal_find_content(journal, put->content[put->next].sha256, &row);
        if (!result && row) {
            put->next++;
            put->next_bytes = 0;
        } else if (!result) {
            result = put_parts(journal, put, &room_bytes);
        }
    }
    return result;
}

static enum bd_err check_sizes(const struct bd_journal_put *put, struct bd_err_detail *detail)
{
    if (put->content[put->next].bytes.size <= BD_JOURNAL_CONTENT_BYTES_MAX) return BD_ERR_OK;
    return bd_err_set(detail, BD_ERR_LIMIT, "content",
                      "%zu bytes of one mesh or picture are "
                      "above the journal's limit of %llu",
                      put->content[put->next].bytes.size,
                      (unsigned long long)BD_JOURNAL_CONTENT_BYTES_MAX);
}

// Whole again by what was just written: the next reader looks anew.
static void heal(struct bd_journal *journal, const struct bd_journal_put *put, uint32_t from)
{
    for (uint32_t i = from; i < put->next; i++)
        while (bd_digests_have(&journal->damaged, put->content[i].sha256))
            bd_digests_take(&journal->damaged, put->content[i].sha256);
}

enum bd_err bd_journal_put_some(struct bd_journal *journal, struct bd_journal_put *put,
                                struct bd_err_detail *detail)
{
    if (put->next >= put->count) return BD_ERR_OK;
    enum bd_err err = check_sizes(put, detail);
    if (err) return err;
    uint32_t next = put->next;
    uint64_t next_bytes = put->next_bytes;
    int result = bd_journal_begin(journal);
    if (!result) result = bd_journal_end(journal, put_slice(journal, put));
    if (!result) {
        heal(journal, put, next);
        return BD_ERR_OK;
    }
    put->next = next;
    put->next_bytes = next_bytes;
    return bd_journal_err(journal, result, "meshes and pictures were not kept", detail);
}

void bd_journal_put_end(struct bd_journal *journal, struct bd_journal_put *put)
{
    for (uint32_t i = 0; i < put->pinned; i++)
        bd_digests_take(&journal->pinned, put->content[i].sha256);
    put->pinned = 0;
}

static enum bd_err missing(const uint8_t sha256[BD_SHA256_BYTES], const char *why,
                           struct bd_err_detail *detail)
{
    char hex[BD_SHA256_HEX];
    bd_sha256_hex(sha256, hex);
    return bd_err_set(detail, BD_ERR_NOT_FOUND, "content", "content sha256:%s %s", hex, why);
}

static int read_part(struct bd_journal *journal, uint64_t row, uint64_t part, char *out,
                     uint64_t room, uint64_t *size)
{
    sqlite3_stmt *get = bd_journal_sql(journal, BD_SQL_GET_PART);
    bd_bind_u64(get, 1, row);
    bd_bind_u64(get, 2, part);
    int step = sqlite3_step(get);
    struct bd_journal_bytes bytes = {"", 0};
    if (step == SQLITE_ROW) bytes = bd_column_bytes(get, 0);
    *size = bytes.size <= room ? bytes.size : 0;
    memcpy(out, bytes.data, *size);
    return bd_journal_done(get, step);
}

// Damage is an answer of its own: the bytes that came are then not what the name says.
static int read_parts(struct bd_journal *journal, uint64_t row, char *bytes, uint64_t size)
{
    uint64_t at = 0;
    for (uint64_t part = 0; at < size; part++) {
        uint64_t part_size;
        int result = read_part(journal, row, part, bytes + at, size - at, &part_size);
        if (result || part_size == 0) return result ? result : SQLITE_CORRUPT;
        at += part_size;
    }
    return SQLITE_OK;
}

static bool is_named(const void *bytes, size_t size, const uint8_t sha256[BD_SHA256_BYTES])
{
    uint8_t digest[BD_SHA256_BYTES];
    bd_sha256_of(bytes, size, digest);
    return memcmp(digest, sha256, sizeof digest) == 0;
}

static enum bd_err say_damaged(struct bd_journal *journal, const uint8_t sha256[BD_SHA256_BYTES],
                               struct bd_err_detail *detail)
{
    struct bd_err_detail local;
    // It was not known: what is known to be damaged is not read.
    bd_digests_add(&journal->damaged, sha256);
    journal->damage_count++;
    enum bd_err err = missing(sha256, "is damaged in the journal", &local);
    bd_log(BD_LOG_WARN, "journal", "%s: %s", journal->name, local.message);
    if (detail) *detail = local;
    return err;
}

static int find_size(struct bd_journal *journal, const uint8_t sha256[BD_SHA256_BYTES],
                     uint64_t *row, uint64_t *size)
{
    int result = bd_journal_find_content(journal, sha256, row);
    if (result || !*row) return result;
    sqlite3_stmt *find = bd_journal_sql(journal, BD_SQL_FIND_CONTENT);
    bd_bind_bytes(find, 1, sha256, BD_SHA256_BYTES);
    int step = sqlite3_step(find);
    if (step == SQLITE_ROW) *size = (uint64_t)sqlite3_column_int64(find, 1);
    return bd_journal_done(find, step);
}

enum bd_err bd_journal_read_content(struct bd_journal *journal,
                                    const uint8_t sha256[BD_SHA256_BYTES], void **bytes,
                                    size_t *size, struct bd_err_detail *detail)
{
    uint64_t row = 0, expected = 0;
    int result = find_size(journal, sha256, &row, &expected);
    if (!result && !row) return missing(sha256, "is not in the journal", detail);
    // A size that a flipped bit made: no memory is asked for by it.
    if (expected > BD_JOURNAL_CONTENT_BYTES_MAX) return say_damaged(journal, sha256, detail);
    char *data = result ? NULL : malloc(expected ? expected : 1);
    if (!result && !data) result = SQLITE_NOMEM;
    if (!result) result = read_parts(journal, row, data, expected);
    if (!result && !is_named(data, expected, sha256)) result = SQLITE_CORRUPT;
    if (!result) {
        *bytes = data;
        *size = expected;
        return BD_ERR_OK;
    }
    free(data);
    if (bd_journal_is_damage(result)) return say_damaged(journal, sha256, detail);
    return bd_journal_err(journal, result, "a mesh or picture cannot be read", detail);
}

uint64_t bd_journal_damage_count(const struct bd_journal *journal)
{
    return journal->damage_count;
}
