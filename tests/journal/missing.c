// A journal that is not all that it was: its file, its log or both gone, or an older copy of either
// in its place. Refused with what to do, and nothing is touched; with the way out, taken as it is.

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/log.h"
#include "scene/journal/journal_internal.h"
#include "tests/journal/files.h"
#include "tests/journal/kit.h"
#include "tests/unit/cmocka_all.h"

#define FILE_NAME BD_JOURNAL_FILE
#define LOG_NAME  BD_JOURNAL_FILE "-wal"
#define REVISIONS 12

static char directory[64];
static struct kit_edit edits[REVISIONS + 2];

// Everything that a directory holds, as it was when the process was killed.
struct dump {
    struct file_bytes file, log, identity;
};

static struct dump dump(void)
{
    return (struct dump){file_read(directory, FILE_NAME), file_read(directory, LOG_NAME),
                         file_read(directory, BD_IDENTITY_FILE)};
}

static void drop(struct dump *dump)
{
    free(dump->file.data);
    free(dump->log.data);
    free(dump->identity.data);
    *dump = (struct dump){.file = {NULL, 0}};
}

static void put(const struct dump *what)
{
    files_remove(directory);
    if (what->file.data) file_write(directory, FILE_NAME, what->file.data, what->file.size);
    if (what->log.data) file_write(directory, LOG_NAME, what->log.data, what->log.size);
    if (what->identity.data)
        file_write(directory, BD_IDENTITY_FILE, what->identity.data, what->identity.size);
}

static struct bd_journal *open_journal(void)
{
    struct bd_journal *journal;
    struct bd_err_detail detail = {0};
    if (bd_journal_open(directory, &journal, &detail)) fail_msg("%s", detail.message);
    return journal;
}

static void commit_to(struct bd_journal *journal, uint64_t from, uint64_t to)
{
    struct bd_err_detail detail = {0};
    struct kit_snapshot snapshot;
    for (uint64_t r = from; r <= to; r++) {
        kit_make_snapshot(&snapshot, r, edits[r].state);
        if (r == 1 ? kit_add(journal, "a", &edits[r], &snapshot, &detail)
                   : kit_commit(journal, "a", &edits[r], &detail))
            fail_msg("%s", detail.message);
    }
}

// The log into the file, and a new one from the next commit on.
static void checkpoint(struct bd_journal *journal)
{
    assert_int_equal(
        sqlite3_wal_checkpoint_v2(journal->db, NULL, SQLITE_CHECKPOINT_PASSIVE, NULL, NULL),
        SQLITE_OK);
}

// Three moments of one life: the log goes into the file between the first two, and the third one's
// process was killed.
static struct dump early, middle, killed, ended;

static int set_up(void **state)
{
    (void)state;
    bd_log_setup(BD_LOG_ERROR, false);
    kit_make_directory(directory);
    for (uint64_t r = 1; r <= REVISIONS + 1; r++)
        kit_make_edit(&edits[r], r, edits[r - 1].state, 5);
    struct bd_journal *journal = open_journal();
    commit_to(journal, 1, 4);
    early = dump();
    checkpoint(journal);
    commit_to(journal, 5, 8);
    middle = dump();
    commit_to(journal, 9, REVISIONS);
    killed = dump();
    bd_journal_close(&journal);
    ended = dump();
    assert_null(ended.log.data);
    return 0;
}

static int tear_down(void **state)
{
    (void)state;
    kit_remove_directory(directory);
    drop(&early);
    drop(&middle);
    drop(&killed);
    drop(&ended);
    return 0;
}

static uint64_t newest(struct bd_journal *journal)
{
    struct bd_err_detail detail = {0};
    struct kit_loaded loaded;
    if (kit_load(journal, "a", 0, &loaded, &detail)) return 0;
    return loaded.state == edits[loaded.revision].state ? loaded.revision : UINT64_MAX;
}

static void expect_whole(const struct dump *what)
{
    put(what);
    struct bd_journal *journal = open_journal();
    assert_int_equal(newest(journal), REVISIONS);
    commit_to(journal, REVISIONS + 1, REVISIONS + 1);
    bd_journal_close(&journal);
    // And again, since what it wrote is held against it then.
    journal = open_journal();
    assert_int_equal(newest(journal), REVISIONS + 1);
    bd_journal_close(&journal);
}

static void expect_same(const struct file_bytes *was, const char *name)
{
    struct file_bytes is = file_read(directory, name);
    assert_int_equal(is.size, was->size);
    if (was->data) assert_memory_equal(is.data, was->data, is.size);
    free(is.data);
}

// Twice, and not a byte is another one after it; then with the way out, at `revision`.
static void expect_refused(const struct dump *what, const char *words, uint64_t revision)
{
    struct bd_journal *journal;
    struct bd_err_detail detail = {0};
    put(what);
    for (int i = 0; i < 2; i++) {
        enum bd_err err = bd_journal_open(directory, &journal, &detail);
        if (!err) fail_msg("taken at revision %d: %s", (int)newest(journal), words);
        assert_int_equal(err, BD_ERR_IO);
        assert_null(journal);
        assert_string_equal(detail.field, "data");
        if (!strstr(detail.message, words) || !strstr(detail.message, "--accept-journal"))
            fail_msg("%s", detail.message);
        expect_same(&what->file, FILE_NAME);
        expect_same(&what->log, LOG_NAME);
        expect_same(&what->identity, BD_IDENTITY_FILE);
    }
    if (bd_journal_open_as_it_is(directory, &journal, &detail)) fail_msg("%s", detail.message);
    assert_int_equal(newest(journal), revision);
    commit_to(journal, revision + 1, revision + 1);
    bd_journal_close(&journal);
    journal = open_journal(); // once is enough
    assert_int_equal(newest(journal), revision + 1);
    bd_journal_close(&journal);
}

static void what_is_whole_is_taken(void **state)
{
    (void)state;
    expect_whole(&killed);
    expect_whole(&ended);
}

static void a_file_that_is_gone(void **state)
{
    (void)state;
    struct dump what = killed;
    what.file = (struct file_bytes){NULL, 0};
    expect_refused(&what, "is missing, and its log", 0);
    assert_true(file_exists(directory, LOG_NAME ".lone"));
    what.log = (struct file_bytes){NULL, 0};
    expect_refused(&what, "is missing or empty", 0);
    what = ended;
    what.file = (struct file_bytes){(uint8_t *)"", 0}; // cut to nothing
    expect_refused(&what, "is missing or empty", 0);
}

static void a_file_without_log_and_identity_is_gone(void **state)
{
    (void)state;
    struct dump what = {.log = killed.log};
    expect_refused(&what, "is missing, and its log", 0);
}

static void a_log_that_is_gone(void **state)
{
    (void)state;
    struct dump what = killed;
    what.log = (struct file_bytes){NULL, 0};
    expect_refused(&what, "-wal, is missing", 4);
    what = killed;
    what.log.size = 0;
    expect_refused(&what, "-wal, is missing", 4);
}

static void a_log_that_is_cut_short_or_damaged(void **state)
{
    (void)state;
    struct dump what = killed;
    what.log.size = middle.log.size / 2;
    put(&what);
    struct bd_journal *journal;
    struct bd_err_detail detail = {0};
    assert_int_equal(bd_journal_open(directory, &journal, &detail), BD_ERR_IO);
    what = killed;
    what.log.data[middle.log.size + 100] ^= 1;
    expect_refused(&what, "the log is damaged", 8);
    what.log.data[middle.log.size + 100] ^= 1;
}

static void an_older_file(void **state)
{
    (void)state;
    struct dump what = ended;
    what.file = early.file;
    what.log = (struct file_bytes){NULL, 0};
    expect_refused(&what, "older copy", 0); // all of it was in the log then
    what = ended;
    what.file = middle.file;
    expect_refused(&what, "older copy", 4);
    // SQLite would lay the new log over it.
    what = killed;
    what.file = early.file;
    put(&what);
    struct bd_journal *journal;
    struct bd_err_detail detail = {0};
    assert_int_equal(bd_journal_open(directory, &journal, &detail), BD_ERR_IO);
    if (!strstr(detail.message, "is an older copy")) fail_msg("%s", detail.message);
}

static void an_older_log(void **state)
{
    (void)state;
    struct dump what = killed;
    what.log = middle.log;
    expect_refused(&what, "older copy", 8);
    // SQLite would lay it over the newer file.
    what = ended;
    what.log = middle.log;
    put(&what);
    struct bd_journal *journal;
    struct bd_err_detail detail = {0};
    assert_int_equal(bd_journal_open(directory, &journal, &detail), BD_ERR_IO);
    expect_same(&what.file, FILE_NAME);
    what = killed;
    what.log = early.log;
    put(&what);
    assert_int_equal(bd_journal_open(directory, &journal, &detail), BD_ERR_IO);
    expect_same(&what.file, FILE_NAME);
}

static void an_older_directory(void **state)
{
    (void)state;
    struct dump what = middle;
    what.identity = ended.identity;
    expect_refused(&what, "an older copy", 8);
    // All of it together is a directory as any other: there is nothing to hold it against.
    put(&middle);
    struct bd_journal *journal = open_journal();
    assert_int_equal(newest(journal), 8);
    bd_journal_close(&journal);
}

static void another_directorys(void **state)
{
    (void)state;
    files_remove(directory);
    struct bd_journal *journal = open_journal();
    commit_to(journal, 1, 1);
    bd_journal_close(&journal);
    struct dump other = dump(), what = {.file = ended.file, .identity = other.identity};
    expect_refused(&what, "another data directory", REVISIONS);
    drop(&other);
}

// Of a version before there was one, or lost: the journal is served, and gets one.
static void an_identity_that_is_gone(void **state)
{
    (void)state;
    struct dump what = killed;
    what.identity = (struct file_bytes){NULL, 0};
    expect_whole(&what);
    what = ended;
    what.identity = (struct file_bytes){NULL, 0};
    expect_whole(&what);
    // Damaged, and so known for nothing.
    what.identity = (struct file_bytes){malloc(700), 700};
    memset(what.identity.data, 'x', 700);
    expect_whole(&what);
    what.file = middle.file;
    put(&what);
    free(what.identity.data);
    struct bd_journal *journal = open_journal();
    bd_journal_close(&journal);
    // From here on it is held against what it wrote.
    what = dump();
    free(what.file.data);
    what.file = (struct file_bytes){NULL, 0};
    expect_refused(&what, "is missing or empty", 0);
    drop(&what);
}

// Nobody can say what there was: not nothing, for the file was written whole once.
static void a_damaged_identity_without_a_file(void **state)
{
    (void)state;
    struct dump what = {.identity = {malloc(ended.identity.size), ended.identity.size}};
    memset(what.identity.data, 'x', what.identity.size);
    expect_refused(&what, "is missing or empty", 0);
    free(what.identity.data);
}

// One of the two slots was being written when the power went.
static void half_an_identity(void **state)
{
    (void)state;
    for (size_t slot = 0; slot < 2; slot++) {
        struct dump what = killed;
        memset(what.identity.data + slot * 512 + 30, 'x', 20);
        put(&what);
        drop(&what);
        struct bd_journal *journal = open_journal();
        assert_int_equal(newest(journal), REVISIONS);
        bd_journal_close(&journal);
        what = dump();
        what.file.size = 0;
        expect_refused(&what, "is missing or empty", 0);
        killed = (struct dump){what.file, what.log, what.identity};
        tear_down(NULL);
        set_up(NULL);
    }
}

// It was made, and then the machine stopped: there is no database yet, or an empty one.
static void a_directory_that_was_being_made(void **state)
{
    (void)state;
    files_remove(directory);
    static struct bd_identity identity;
    struct bd_journal_state fresh = {.identity = {1}};
    char path[128];
    snprintf(path, sizeof path, "%s/" BD_IDENTITY_FILE, directory);
    assert_int_equal(bd_identity_open(&identity, path), SQLITE_OK);
    assert_true(identity.is_blank);
    assert_int_equal(bd_identity_set(&identity, &fresh), SQLITE_OK);
    bd_identity_close(&identity);
    struct dump what = dump();
    for (size_t i = 0; i < 5; i++) {
        files_remove(directory);
        file_write(directory, BD_IDENTITY_FILE, what.identity.data, i / 2 * 512);
        if (i % 2 > 0) file_write(directory, FILE_NAME, "", 0);
        struct bd_journal *journal = open_journal();
        commit_to(journal, 1, 2);
        bd_journal_close(&journal);
        journal = open_journal();
        assert_int_equal(newest(journal), 2);
        bd_journal_close(&journal);
    }
    drop(&what);
}

static void what_is_no_file_is_not_waited_for(void **state)
{
    (void)state;
    static const char *const names[] = {FILE_NAME, BD_IDENTITY_FILE};
    for (size_t i = 0; i < 2; i++) {
        char path[128];
        struct bd_journal *journal;
        struct bd_err_detail detail = {0};
        put(&ended);
        snprintf(path, sizeof path, "%s/%s", directory, names[i]);
        unlink(path);
        assert_int_equal(mkfifo(path, 0600), 0);
        assert_int_equal(bd_journal_open(directory, &journal, &detail), BD_ERR_IO);
        assert_string_equal(detail.field, "data");
    }
}

// What a daemon has open and nobody finds any more is no place to keep an edit.
// Two slashes at its beginning name no machine.
static void a_path_with_two_slashes(void **state)
{
    (void)state;
    char twice[80];
    struct bd_err_detail detail = {0};
    put(&ended);
    snprintf(twice, sizeof twice, "/%s", directory);
    for (int i = 0; i < 2; i++) {
        struct bd_journal *journal;
        if (bd_journal_open(twice, &journal, &detail)) fail_msg("%s", detail.message);
        bd_journal_close(&journal);
    }
}

// That a file was being mended is no reason to mend one that was moved away.
static void a_suspect_that_is_gone(void **state)
{
    (void)state;
    const struct dump what = {.identity = ended.identity};
    char path[128];
    put(&what);
    file_write(directory, FILE_NAME ".suspect", "", 0);
    struct bd_journal *journal;
    struct bd_err_detail detail = {0};
    if (bd_journal_open_as_it_is(directory, &journal, &detail)) fail_msg("%s", detail.message);
    bd_journal_close(&journal);
    snprintf(path, sizeof path, "%s/" FILE_NAME ".suspect", directory);
    assert_int_equal(access(path, F_OK), -1);
    files_remove(directory);
}

static void files_that_go_under_way(void **state)
{
    (void)state;
    static const char *const names[] = {FILE_NAME, LOG_NAME};
    for (size_t i = 0; i < 2; i++) {
        char path[128], elsewhere[160];
        struct bd_err_detail detail = {0};
        put(&ended);
        struct bd_journal *journal = open_journal();
        assert_true(bd_journal_is_in_place(journal));
        snprintf(path, sizeof path, "%s/%s", directory, names[i]);
        snprintf(elsewhere, sizeof elsewhere, "%s.elsewhere", path);
        assert_int_equal(rename(path, elsewhere), 0);
        file_write(directory, names[i], "not it", 6);
        assert_false(bd_journal_is_in_place(journal));
        assert_int_equal(kit_commit(journal, "a", &edits[REVISIONS + 1], &detail), BD_ERR_IO);
        if (!strstr(detail.message, "not where it was")) fail_msg("%s", detail.message);
        assert_int_equal(newest(journal), REVISIONS);
        // Put back, it goes on.
        assert_int_equal(rename(elsewhere, path), 0);
        assert_int_equal(kit_commit(journal, "a", &edits[REVISIONS + 1], &detail), BD_ERR_OK);
        bd_journal_close(&journal);
    }
}

int main(void)
{
#define TEST(function) cmocka_unit_test_setup_teardown(function, set_up, tear_down)
    const struct CMUnitTest tests[] = {
        TEST(what_is_whole_is_taken),
        TEST(a_file_that_is_gone),
        TEST(a_file_without_log_and_identity_is_gone),
        TEST(a_log_that_is_gone),
        TEST(a_log_that_is_cut_short_or_damaged),
        TEST(an_older_file),
        TEST(an_older_log),
        TEST(an_older_directory),
        TEST(another_directorys),
        TEST(an_identity_that_is_gone),
        TEST(a_damaged_identity_without_a_file),
        TEST(half_an_identity),
        TEST(a_directory_that_was_being_made),
        TEST(what_is_no_file_is_not_waited_for),
        TEST(a_path_with_two_slashes),
        TEST(a_suspect_that_is_gone),
        TEST(files_that_go_under_way),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
