// Forgetting what nobody can ask for any more.

#include <stdlib.h>

#include "base/assert.h"
#include "scene/journal/journal_internal.h"

int bd_journal_forget(struct bd_journal *journal, enum bd_journal_sql which, int64_t row,
                      uint64_t after, uint64_t to, uint32_t *room)
{
    if (to <= after || *room == 0) return SQLITE_OK;
    sqlite3_stmt *forget = bd_journal_sql(journal, which);
    bd_bind_u64(forget, 1, (uint64_t)row);
    bd_bind_u64(forget, 2, after);
    bd_bind_u64(forget, 3, to);
    bd_bind_u64(forget, 4, *room);
    int result = bd_journal_run(forget);
    if (!result) *room -= (uint32_t)sqlite3_changes(journal->db);
    return result;
}

// The next revision beyond `after` that has a name; 0 if none lies before `base`.
static int next_named(struct bd_journal *journal, int64_t row, uint64_t after, uint64_t base,
                      uint64_t *out)
{
    sqlite3_stmt *next = bd_journal_sql(journal, BD_SQL_NEXT_NAMED);
    bd_bind_u64(next, 1, (uint64_t)row);
    bd_bind_u64(next, 2, after);
    int result = bd_journal_number(next, out);
    if (*out >= base) *out = 0;
    return result;
}

// Where the walk over named revisions is: up to where edits and snapshots were looked at.
struct kept {
    uint64_t named, snapshot;
};

// What lies between the last named revision's way and the next one's, whose way is from its
// snapshot `from` to `to`.
static int forget_between(struct bd_journal *journal, int64_t row, struct kept *kept, uint64_t from,
                          uint64_t to, uint32_t *room)
{
    int result = bd_journal_forget(journal, BD_SQL_FORGET_EDITS, row, kept->named, from, room);
    if (!result && from > 0)
        result = bd_journal_forget(journal, BD_SQL_FORGET_SNAPSHOTS, row, kept->snapshot, from - 1,
                                   room);
    *kept = (struct kept){to, from};
    return result;
}

// Edits and snapshots before the snapshot `base`, but the ways to named revisions.
static int forget_before(struct bd_journal *journal, int64_t row, uint64_t base, uint32_t *room)
{
    struct kept kept = {0, 0};
    uint64_t named = 0;
    int result = next_named(journal, row, 0, base, &named);
    while (!result && named && *room) {
        uint64_t from;
        result = bd_journal_snapshot_before(journal, row, named, &from);
        if (!result) result = forget_between(journal, row, &kept, from, named, room);
        if (!result) result = next_named(journal, row, named, base, &named);
    }
    return result ? result : forget_between(journal, row, &kept, base, base, room);
}

enum bd_err bd_journal_compact(struct bd_journal *journal, const char *scene, uint64_t keep_edits,
                               bool *is_done, struct bd_err_detail *detail)
{
    int64_t row;
    uint64_t newest, base = 0;
    uint32_t room = BD_JOURNAL_SLICE_RECORDS;
    *is_done = false;
    enum bd_err err = bd_journal_find_scene(journal, scene, &row, &newest, detail);
    if (err) return err;
    int result = bd_journal_begin(journal);
    if (!result) {
        if (newest > keep_edits)
            result = bd_journal_snapshot_before(journal, row, newest - keep_edits, &base);
        if (!result && base) result = forget_before(journal, row, base, &room);
        result = bd_journal_end(journal, result);
    }
    *is_done = !result && room > 0;
    return result ? bd_journal_err(journal, result, "the journal was not compacted", detail)
                  : BD_ERR_OK;
}
