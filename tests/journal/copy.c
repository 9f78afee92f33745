// A copy for reading: it has all that the journal has, its log included, from the oldest state on;
// the journal itself is left as it is, and what is wrong with it is said and not mended.

#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <unistd.h>

#include "base/log.h"
#include "scene/journal/journal_internal.h"
#include "tests/journal/files.h"
#include "tests/journal/kit.h"
#include "tests/unit/cmocka_all.h"

#define REVISIONS 6

static char directory[64];
static struct kit_edit edits[REVISIONS + 1];

// A scene of six revisions, with a snapshot of the first and of the fourth.
static struct bd_journal *make_journal(void)
{
    struct bd_journal *journal;
    struct kit_snapshot snapshot;
    struct bd_err_detail detail = {0};
    if (bd_journal_open(directory, &journal, &detail)) fail_msg("%s", detail.message);
    for (uint64_t r = 1; r <= REVISIONS; r++) {
        kit_make_edit(&edits[r], r, edits[r - 1].state, 5);
        kit_make_snapshot(&snapshot, r, edits[r].state);
        assert_int_equal(r == 1 ? kit_add(journal, "a", &edits[r], &snapshot, &detail)
                                : kit_commit(journal, "a", &edits[r], &detail),
                         BD_ERR_OK);
        if (r == 4)
            assert_int_equal(bd_journal_write_snapshot(journal, "a", &snapshot.snapshot, &detail),
                             BD_ERR_OK);
    }
    return journal;
}

static int set_up(void **state)
{
    (void)state;
    bd_log_setup(BD_LOG_ERROR, false);
    kit_make_directory(directory);
    return 0;
}

static int tear_down(void **state)
{
    (void)state;
    kit_remove_directory(directory);
    return 0;
}

static void make_closed(void)
{
    struct bd_journal *journal = make_journal();
    bd_journal_close(&journal);
}

static void change(const char *sql)
{
    char path[256];
    sqlite3 *db;
    snprintf(path, sizeof path, "%s/" BD_JOURNAL_FILE, directory);
    assert_int_equal(sqlite3_open(path, &db), SQLITE_OK);
    assert_int_equal(sqlite3_exec(db, sql, NULL, NULL, NULL), SQLITE_OK);
    sqlite3_close(db);
}

// --- walks ----------------------------------------------------------------------------------

struct seen {
    uint64_t first, last;
};

static enum bd_err see_snapshot(void *user, const struct bd_journal_snapshot *snapshot,
                                struct bd_err_detail *detail)
{
    struct seen *seen = user;
    (void)detail;
    seen->first = seen->last = snapshot->revision;
    assert_memory_equal(snapshot->sha256, edits[snapshot->revision].edit.snapshot_sha256, 32);
    return BD_ERR_OK;
}

static enum bd_err see_edit(void *user, const struct bd_journal_edit *edit,
                            struct bd_err_detail *detail)
{
    struct seen *seen = user;
    (void)detail;
    assert_int_equal(edit->revision, ++seen->last);
    assert_true(kit_is_edit(edit, &edits[edit->revision], false));
    return BD_ERR_OK;
}

static enum bd_err walk(uint64_t revision, struct seen *seen, struct bd_err_detail *detail)
{
    struct bd_journal *journal;
    const struct bd_journal_visitor visitor = {see_snapshot, see_edit, seen};
    *seen = (struct seen){0};
    if (bd_journal_open_copy(directory, &journal, detail)) fail_msg("%s", detail->message);
    enum bd_err err = bd_journal_walk(journal, "a", revision, &visitor, detail);
    bd_journal_close(&journal);
    return err;
}

static void a_walk_begins_at_the_oldest_state(void **state)
{
    (void)state;
    struct seen seen;
    struct bd_err_detail detail;
    make_closed();
    assert_int_equal(walk(0, &seen, &detail), BD_ERR_OK);
    assert_true(seen.first == 1 && seen.last == REVISIONS);
    assert_int_equal(walk(3, &seen, &detail), BD_ERR_OK);
    assert_true(seen.first == 1 && seen.last == 3);
    assert_int_equal(walk(REVISIONS + 1, &seen, &detail), BD_ERR_NOT_FOUND);
    assert_non_null(strstr(detail.message, "newest is 6"));
}

static void a_walk_begins_where_compaction_left_off(void **state)
{
    (void)state;
    struct seen seen;
    struct bd_err_detail detail;
    struct bd_journal *journal = make_journal();
    bool is_done = false;
    while (!is_done)
        assert_int_equal(bd_journal_compact(journal, "a", 1, &is_done, &detail), BD_ERR_OK);
    bd_journal_close(&journal);
    assert_int_equal(walk(0, &seen, &detail), BD_ERR_OK);
    assert_true(seen.first == 4 && seen.last == REVISIONS);
    assert_int_equal(walk(2, &seen, &detail), BD_ERR_NOT_FOUND);
    assert_non_null(strstr(detail.message, "begins at revision 4"));
}

static void the_journal_is_left_as_it_is(void **state)
{
    (void)state;
    struct seen seen;
    struct bd_err_detail detail;
    struct bd_journal *journal = make_journal();
    // Nothing of it is in the file yet: all is in the log.
    struct file_bytes file = file_read(directory, BD_JOURNAL_FILE);
    struct file_bytes log = file_read(directory, BD_JOURNAL_FILE "-wal");
    assert_true(log.size > file.size);
    assert_int_equal(walk(0, &seen, &detail), BD_ERR_OK);
    assert_int_equal(seen.last, REVISIONS);
    struct file_bytes file_after = file_read(directory, BD_JOURNAL_FILE);
    struct file_bytes log_after = file_read(directory, BD_JOURNAL_FILE "-wal");
    assert_true(file_after.size == file.size && log_after.size == log.size);
    assert_memory_equal(file_after.data, file.data, file.size);
    assert_memory_equal(log_after.data, log.data, log.size);
    free(file.data);
    free(log.data);
    free(file_after.data);
    free(log_after.data);
    bd_journal_close(&journal);
}

// --- what is wrong --------------------------------------------------------------------------

static enum bd_err open_err(const char *path, struct bd_err_detail *detail)
{
    struct bd_journal *journal = NULL;
    *detail = (struct bd_err_detail){0};
    enum bd_err err = bd_journal_open_copy(path, &journal, detail);
    bd_journal_close(&journal);
    return err;
}

static void damage_is_said_and_not_mended(void **state)
{
    (void)state;
    struct seen seen;
    struct bd_err_detail detail;
    make_closed();
    // Before the newest snapshot: met on the way.
    change("UPDATE edits SET forward=zeroblob(length(forward)) WHERE revision=3");
    assert_int_equal(walk(0, &seen, &detail), BD_ERR_IO);
    assert_int_equal(seen.last, 2);
    assert_non_null(strstr(detail.message, "revision 3"));
    // After it: a start would mend it.
    change("UPDATE edits SET forward=zeroblob(length(forward)) WHERE revision=5");
    struct file_bytes before = file_read(directory, BD_JOURNAL_FILE);
    assert_int_equal(open_err(directory, &detail), BD_ERR_IO);
    assert_non_null(strstr(detail.message, directory));
    assert_non_null(strstr(detail.message, "is damaged"));
    assert_null(strstr(detail.message, "mends"));
    struct file_bytes after = file_read(directory, BD_JOURNAL_FILE);
    assert_true(before.size == after.size);
    assert_memory_equal(before.data, after.data, before.size);
    assert_false(file_exists(directory, BD_JOURNAL_FILE ".suspect"));
    assert_false(file_exists(directory, BD_JOURNAL_FILE ".damaged"));
    free(before.data);
    free(after.data);
}

static void foreign_and_newer_files_are_refused(void **state)
{
    (void)state;
    struct bd_err_detail detail;
    char path[128];
    static char text[8192];
    memset(text, 'x', sizeof text);
    assert_int_equal(open_err(directory, &detail), BD_ERR_NOT_FOUND);
    file_write(directory, "text", text, sizeof text);
    file_write(directory, "empty", text, 0);
    file_write(directory, "short", text, 20);
    static const char *const names[] = {"text", "empty", "short"};
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++) {
        snprintf(path, sizeof path, "%s/%s", directory, names[i]);
        assert_int_equal(open_err(path, &detail), BD_ERR_IO);
        assert_non_null(strstr(detail.message, names[i]));
    }
    make_closed();
    change("PRAGMA user_version=77");
    assert_int_equal(open_err(directory, &detail), BD_ERR_UNSUPPORTED);
    assert_non_null(strstr(detail.message, "format 77"));
}

static void a_daemon_that_holds_it_is_not_disturbed(void **state)
{
    (void)state;
    struct bd_err_detail detail;
    char path[128];
    make_closed();
    snprintf(path, sizeof path, "%s/lock", directory);
    int lock = open(path, O_RDWR | O_CREAT | O_CLOEXEC, 0600);
    assert_int_equal(flock(lock, LOCK_EX), 0);
    assert_int_equal(open_err(directory, &detail), BD_ERR_CONFLICT);
    close(lock);
    assert_int_equal(open_err(directory, &detail), BD_ERR_OK);
}

int main(void)
{
#define TEST(name) cmocka_unit_test_setup_teardown(name, set_up, tear_down)
    const struct CMUnitTest tests[] = {
        TEST(a_walk_begins_at_the_oldest_state),   TEST(a_walk_begins_where_compaction_left_off),
        TEST(the_journal_is_left_as_it_is),        TEST(damage_is_said_and_not_mended),
        TEST(foreign_and_newer_files_are_refused), TEST(a_daemon_that_holds_it_is_not_disturbed),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
