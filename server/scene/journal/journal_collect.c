// A round of collection: what removed scenes left goes; then everything that a record still names
// is marked, in memory, and content that is not goes; then free pages go back to the file system.
// Each call is one bounded transaction, and commits come between: what they need is marked as they
// come.

#include "scene/journal/journal_internal.h"

#define PARTS_A_SLICE (BD_JOURNAL_SLICE_BYTES / BD_JOURNAL_PART_BYTES)
// A file keeps this share of free pages for what comes next.
#define FREE_SHARE 8

void bd_journal_mark(struct bd_journal *journal, const struct bd_journal_digests *list)
{
    if (journal->round == BD_ROUND_IDLE) return;
    for (uint32_t i = 0; i < list->count; i++)
        bd_digests_add(&journal->needed, list->sha256 + (size_t)i * BD_SHA256_BYTES);
}

static void enter(struct bd_journal *journal, enum bd_journal_round round)
{
    journal->round = round;
    journal->round_at = 0;
}

// The first row of scenes beyond `at` that a table still names and that is no more; 0 if none.
static int find_orphan(struct bd_journal *journal, enum bd_journal_sql next_of, uint64_t *at)
{
    uint64_t exists = 1;
    int result = SQLITE_OK;
    for (*at = 0; exists && !result;) {
        sqlite3_stmt *next = bd_journal_sql(journal, next_of);
        bd_bind_u64(next, 1, *at);
        result = bd_journal_number(next, at);
        if (*at == 0 || result) return result;
        sqlite3_stmt *find = bd_journal_sql(journal, BD_SQL_SCENE_EXISTS);
        bd_bind_u64(find, 1, *at);
        result = bd_journal_number(find, &exists);
    }
    return result;
}

static int forget_names(struct bd_journal *journal, uint64_t scene, uint32_t *room)
{
    sqlite3_stmt *forget = bd_journal_sql(journal, BD_SQL_FORGET_NAMES);
    bd_bind_u64(forget, 1, scene);
    bd_bind_u64(forget, 2, *room);
    int result = bd_journal_run(forget);
    if (!result) *room -= (uint32_t)sqlite3_changes(journal->db);
    return result;
}

static int forget_orphans(struct bd_journal *journal)
{
    uint32_t room = BD_JOURNAL_SLICE_RECORDS;
    uint64_t scene = 0;
    int result = find_orphan(journal, BD_SQL_NEXT_OF_EDITS, &scene);
    if (!result && scene)
        return bd_journal_forget(journal, BD_SQL_FORGET_EDITS, (int64_t)scene, 0, INT64_MAX, &room);
    if (!result) result = find_orphan(journal, BD_SQL_NEXT_OF_SNAPSHOTS, &scene);
    if (!result && scene)
        return bd_journal_forget(journal, BD_SQL_FORGET_SNAPSHOTS, (int64_t)scene, 0, INT64_MAX,
                                 &room);
    if (!result) result = find_orphan(journal, BD_SQL_NEXT_OF_NAMES, &scene);
    if (!result && scene) return forget_names(journal, scene, &room);
    if (!result) enter(journal, BD_ROUND_MARK_SNAPSHOTS);
    return result;
}

static int mark_slice(struct bd_journal *journal, enum bd_journal_sql lists,
                      enum bd_journal_round then)
{
    sqlite3_stmt *next = bd_journal_sql(journal, lists);
    bd_bind_u64(next, 1, (uint64_t)journal->round_at);
    bd_bind_u64(next, 2, BD_JOURNAL_SLICE_RECORDS);
    int step, count = 0;
    for (; (step = sqlite3_step(next)) == SQLITE_ROW; count++) {
        journal->round_at = sqlite3_column_int64(next, 0);
        for (int i = 1; i < sqlite3_column_count(next); i++) {
            struct bd_journal_digests list = bd_column_digests(next, i);
            bd_journal_mark(journal, &list);
        }
    }
    int result = bd_journal_done(next, step);
    if (!result && count < BD_JOURNAL_SLICE_RECORDS) enter(journal, then);
    return result;
}

// Not whole any more from the first part that goes: who wants it now must put it anew.
static int remove_content(struct bd_journal *journal, int64_t row, uint32_t *parts)
{
    sqlite3_stmt *unfinish = bd_journal_sql(journal, BD_SQL_UNFINISH_CONTENT);
    bd_bind_u64(unfinish, 1, (uint64_t)row);
    int result = bd_journal_run(unfinish);
    sqlite3_stmt *remove = bd_journal_sql(journal, BD_SQL_REMOVE_PARTS);
    bd_bind_u64(remove, 1, (uint64_t)row);
    bd_bind_u64(remove, 2, *parts);
    if (!result) result = bd_journal_run(remove);
    if (result) return result;
    *parts -= (uint32_t)sqlite3_changes(journal->db);
    if (*parts == 0) return SQLITE_OK; // there may be more: the row stays until the next slice
    sqlite3_stmt *last = bd_journal_sql(journal, BD_SQL_REMOVE_CONTENT);
    bd_bind_u64(last, 1, (uint64_t)row);
    return bd_journal_run(last);
}

static int next_content(struct bd_journal *journal, int64_t after, int64_t *row,
                        uint8_t sha256[BD_SHA256_BYTES])
{
    sqlite3_stmt *next = bd_journal_sql(journal, BD_SQL_NEXT_CONTENT);
    bd_bind_u64(next, 1, (uint64_t)after);
    int step = sqlite3_step(next);
    *row = step == SQLITE_ROW ? sqlite3_column_int64(next, 0) : 0;
    if (*row) bd_column_sha256(next, 1, sha256);
    return bd_journal_done(next, step);
}

static int sweep_slice(struct bd_journal *journal)
{
    uint32_t parts = PARTS_A_SLICE;
    for (int i = 0; i < BD_JOURNAL_SLICE_RECORDS; i++) {
        int64_t row;
        uint8_t sha256[BD_SHA256_BYTES];
        int result = next_content(journal, journal->round_at, &row, sha256);
        if (!result && !row) enter(journal, BD_ROUND_VACUUM);
        if (result || !row) return result;
        if (!bd_digests_have(&journal->needed, sha256) &&
            !bd_digests_have(&journal->pinned, sha256))
            result = remove_content(journal, row, &parts);
        if (result || parts == 0) return result;
        journal->round_at = row;
    }
    return SQLITE_OK;
}

static int vacuum_slice(struct bd_journal *journal)
{
    uint64_t page_count, free_count;
    int result = bd_journal_number(bd_journal_sql(journal, BD_SQL_PAGES), &page_count);
    if (!result)
        result = bd_journal_number(bd_journal_sql(journal, BD_SQL_FREE_PAGES), &free_count);
    if (result) return result;
    journal->changes_more = free_count > page_count / FREE_SHARE;
    if (journal->changes_more) return bd_journal_run(bd_journal_sql(journal, BD_SQL_VACUUM));
    bd_digests_clear(&journal->needed);
    enter(journal, BD_ROUND_IDLE);
    return SQLITE_OK;
}

static int slice(struct bd_journal *journal)
{
    switch (journal->round) {
    case BD_ROUND_ORPHANS:
        return forget_orphans(journal);
    case BD_ROUND_MARK_SNAPSHOTS:
        return mark_slice(journal, BD_SQL_NEXT_SNAPSHOT_LIST, BD_ROUND_MARK_EDITS);
    case BD_ROUND_MARK_EDITS:
        return mark_slice(journal, BD_SQL_NEXT_EDIT_LIST, BD_ROUND_SWEEP);
    case BD_ROUND_SWEEP:
        return sweep_slice(journal);
    default:
        return vacuum_slice(journal);
    }
}

// A slice whose transaction fails is done again by the next call.
static int slice_in_transaction(struct bd_journal *journal)
{
    enum bd_journal_round round = journal->round;
    int64_t at = journal->round_at;
    int result = bd_journal_begin(journal);
    if (!result) result = bd_journal_end(journal, slice(journal));
    if (!result) return SQLITE_OK;
    journal->round = round;
    journal->round_at = at;
    return result;
}

enum bd_err bd_journal_collect(struct bd_journal *journal, bool *is_done,
                               struct bd_err_detail *detail)
{
    if (journal->round == BD_ROUND_IDLE) {
        bd_digests_clear(&journal->needed);
        enter(journal, BD_ROUND_ORPHANS);
    }
    int result = slice_in_transaction(journal);
    *is_done = !result && journal->round == BD_ROUND_IDLE;
    return result ? bd_journal_err(journal, result, "the journal was not tidied", detail)
                  : BD_ERR_OK;
}
