// From the newest snapshot that is whole, forward.

#include "base/log.h"
#include "scene/journal/journal_internal.h"

struct walk {
    struct bd_journal *journal;
    const char *scene;
    int64_t row;
    uint64_t at; // the revision that was reached
    const struct bd_journal_visitor *visitor;
    struct bd_err_detail *detail;
};

static enum bd_err walk_err(const struct walk *walk, int result)
{
    return bd_journal_err(walk->journal, result, "a scene cannot be read", walk->detail);
}

// Whether a record and the content that it names are whole. A disk that does not answer just now
// says nothing about that, and nothing may be cut off for it: an error.
static enum bd_err check_whole(const struct walk *walk, bool is_row_whole,
                               const struct bd_journal_digests *content, bool *is_whole)
{
    int result = SQLITE_OK;
    *is_whole = is_row_whole;
    if (is_row_whole) result = bd_journal_has_contents(walk->journal, content, is_whole);
    return result && !bd_journal_is_damage(result) ? walk_err(walk, result) : BD_ERR_OK;
}

static enum bd_err visit_snapshot(struct walk *walk, sqlite3_stmt *row, bool *is_whole)
{
    struct bd_journal_snapshot snapshot;
    bool is_row_whole = bd_row_snapshot(row, walk->row, &snapshot);
    enum bd_err err = check_whole(walk, is_row_whole, &snapshot.content, is_whole);
    if (err) return err;
    walk->at = snapshot.revision;
    if (*is_whole) return walk->visitor->snapshot(walk->visitor->user, &snapshot, walk->detail);
    bd_log(BD_LOG_WARN, "journal", "scene %.64s: the snapshot of revision %llu is damaged",
           walk->scene, (unsigned long long)snapshot.revision);
    return BD_ERR_OK;
}

// The newest whole snapshot at or before `limit`. BD_ERR_NOT_FOUND if there is none.
static enum bd_err find_snapshot(struct walk *walk, uint64_t limit)
{
    bool is_whole = false;
    while (!is_whole) {
        uint64_t asked = limit;
        sqlite3_stmt *before = bd_journal_sql(walk->journal, BD_SQL_SNAPSHOT_BEFORE);
        bd_bind_u64(before, 1, (uint64_t)walk->row);
        bd_bind_u64(before, 2, limit);
        int step = asked ? sqlite3_step(before) : SQLITE_DONE;
        enum bd_err err = step == SQLITE_ROW ? visit_snapshot(walk, before, &is_whole) : BD_ERR_OK;
        bd_journal_done(before, step);
        if (err) return err;
        if (step == SQLITE_DONE)
            return bd_err_set(walk->detail, BD_ERR_NOT_FOUND, "revision",
                              "scene \"%.64s\" has no whole state at or before revision %llu",
                              walk->scene, (unsigned long long)limit);
        if (step != SQLITE_ROW) return walk_err(walk, step);
        // A revision that a flipped bit made does not turn the walk around.
        limit = (walk->at && walk->at <= asked ? walk->at : asked) - 1;
    }
    return BD_ERR_OK;
}

// Stops without an error before the first edit that is not whole.
static enum bd_err visit_edits(struct walk *walk, uint64_t target)
{
    sqlite3_stmt *after = bd_journal_sql(walk->journal, BD_SQL_EDITS_AFTER);
    bd_bind_u64(after, 1, (uint64_t)walk->row);
    bd_bind_u64(after, 2, walk->at);
    bd_bind_u64(after, 3, target);
    enum bd_err err = BD_ERR_OK;
    int step;
    while (!err && (step = sqlite3_step(after)) == SQLITE_ROW) {
        struct bd_journal_edit edit;
        bool is_whole = bd_row_edit(after, walk->row, &edit) && edit.revision == walk->at + 1;
        err = check_whole(walk, is_whole, &edit.forward_content, &is_whole);
        if (err || !is_whole) break;
        err = walk->visitor->edit(walk->visitor->user, &edit, walk->detail);
        walk->at = edit.revision;
    }
    int result = bd_journal_done(after, step);
    if (err || !result || bd_journal_is_damage(result)) return err;
    return walk_err(walk, result);
}

static enum bd_err load(struct walk *walk, uint64_t revision, uint64_t newest)
{
    uint64_t target = revision ? revision : newest;
    enum bd_err err = find_snapshot(walk, target);
    if (!err) err = visit_edits(walk, target);
    if (err || walk->at == target) return err;
    if (revision)
        return bd_err_set(walk->detail, BD_ERR_NOT_FOUND, "revision",
                          "there is no way to revision %llu of scene \"%.64s\" any more",
                          (unsigned long long)revision, walk->scene);
    bd_log(BD_LOG_WARN, "journal",
           "scene %.64s: revision %llu is damaged; %llu is the newest that is whole", walk->scene,
           (unsigned long long)walk->at + 1, (unsigned long long)walk->at);
    return BD_ERR_OK;
}

enum bd_err bd_journal_load(struct bd_journal *journal, const char *scene, uint64_t revision,
                            const struct bd_journal_visitor *visitor, uint64_t *reached,
                            struct bd_err_detail *detail)
{
    struct walk walk = {.journal = journal, .scene = scene, .visitor = visitor, .detail = detail};
    uint64_t newest;
    enum bd_err err = bd_journal_find_scene(journal, scene, &walk.row, &newest, detail);
    if (!err && revision > newest)
        err =
            bd_err_set(detail, BD_ERR_NOT_FOUND, "revision", "scene \"%.64s\" has no revision %llu",
                       scene, (unsigned long long)revision);
    if (!err) err = load(&walk, revision, newest);
    *reached = walk.at;
    return err;
}

static enum bd_err walk_all(struct walk *walk, uint64_t oldest, uint64_t target)
{
    if (target < oldest)
        return bd_err_set(walk->detail, BD_ERR_NOT_FOUND, "revision",
                          "scene \"%.64s\" begins at revision %llu: what was before it is "
                          "forgotten",
                          walk->scene, (unsigned long long)oldest);
    enum bd_err err = find_snapshot(walk, oldest);
    if (!err && walk->at == oldest) err = visit_edits(walk, target);
    if (err || walk->at == target) return err;
    return bd_err_set(walk->detail, BD_ERR_IO, "revision",
                      "revision %llu of scene \"%.64s\" is damaged, or content that it needs is "
                      "missing",
                      (unsigned long long)(walk->at < oldest ? oldest : walk->at + 1), walk->scene);
}

enum bd_err bd_journal_walk(struct bd_journal *journal, const char *scene, uint64_t revision,
                            const struct bd_journal_visitor *visitor, struct bd_err_detail *detail)
{
    struct walk walk = {.journal = journal, .scene = scene, .visitor = visitor, .detail = detail};
    uint64_t newest, oldest = 0;
    enum bd_err err = bd_journal_find_scene(journal, scene, &walk.row, &newest, detail);
    if (!err && revision > newest)
        err = bd_err_set(detail, BD_ERR_NOT_FOUND, "revision",
                         "scene \"%.64s\" has no revision %llu: its newest is %llu", scene,
                         (unsigned long long)revision, (unsigned long long)newest);
    if (!err) err = bd_journal_oldest(journal, scene, &oldest, detail);
    return err ? err : walk_all(&walk, oldest, revision ? revision : newest);
}
