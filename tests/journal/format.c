// The file's format: journals of every version are read, newer and foreign ones are refused and
// left as they are.

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "scene/journal/journal_internal.h"
#include "tests/journal/files.h"
#include "tests/journal/story.h"
#include "tests/unit/cmocka_all.h"

static char golden[512], directory[64];
static struct story story;

static int set_up(void **state)
{
    (void)state;
    kit_make_directory(directory);
    story_make(&story);
    return 0;
}

static int tear_down(void **state)
{
    (void)state;
    kit_remove_directory(directory);
    story_free(&story);
    return 0;
}

static void copy_golden(const char *name)
{
    struct file_bytes bytes = file_read(golden, name);
    if (!bytes.data) fail_msg("%s/%s is missing", golden, name);
    files_remove(directory); // each is a directory of its own
    file_write(directory, BD_JOURNAL_FILE, bytes.data, bytes.size);
    free(bytes.data);
}

static struct bd_journal *open_journal(void)
{
    struct bd_journal *journal;
    struct bd_err_detail detail = {0};
    if (bd_journal_open(directory, &journal, &detail)) fail_msg("%s", detail.message);
    return journal;
}

// Format 1 knew no authors.
static void write_authors(int version)
{
    for (uint64_t i = 1; i <= STORY_REVISIONS + 1; i++) {
        story.a[i].edit.author = version < 2 ? "" : story.a[i].author;
        story.b[i].edit.author = version < 2 ? "" : story.b[i].author;
    }
}

static void golden_journals_are_read(void **state)
{
    (void)state;
    for (int version = 1; version <= BD_JOURNAL_FORMAT; version++) {
        char name[64], why[256];
        struct bd_err_detail detail = {0};
        snprintf(name, sizeof name, "journal-%d.sqlite", version);
        copy_golden(name);
        write_authors(version);
        for (int i = 0; i < 2; i++) {
            struct bd_journal *journal = open_journal();
            if (!story_is_whole(&story, journal, why, sizeof why)) fail_msg("%s: %s", name, why);
            bd_journal_close(&journal);
        }
        // And written on.
        struct bd_journal *journal = open_journal();
        struct kit_loaded loaded;
        const struct kit_edit *next = &story.a[STORY_REVISIONS + 1];
        assert_int_equal(kit_commit(journal, "a", next, &detail), BD_ERR_OK);
        assert_int_equal(kit_load(journal, "a", 0, &loaded, &detail), BD_ERR_OK);
        assert_true(loaded.state == next->state);
        bd_journal_close(&journal);
    }
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

static void expect_refused(enum bd_err expected, const char *words)
{
    struct bd_journal *journal;
    struct bd_err_detail detail = {0};
    struct file_bytes before = file_read(directory, BD_JOURNAL_FILE);
    assert_int_equal(bd_journal_open(directory, &journal, &detail), expected);
    assert_null(journal);
    assert_string_equal(detail.field, "data");
    if (!strstr(detail.message, words)) fail_msg("%s", detail.message);
    struct file_bytes after = file_read(directory, BD_JOURNAL_FILE);
    assert_int_equal(before.size, after.size);
    assert_memory_equal(before.data, after.data, after.size);
    free(before.data);
    free(after.data);
}

static void a_newer_one_is_refused(void **state)
{
    (void)state;
    copy_golden("journal-3.sqlite");
    change("PRAGMA user_version=4");
    expect_refused(BD_ERR_UNSUPPORTED, "format 4, of a newer bounced");
    change("PRAGMA user_version=3");
    struct bd_journal *journal = open_journal();
    bd_journal_close(&journal);
}

static void a_foreign_one_is_refused(void **state)
{
    static char text[8192];
    memset(text, 'a', sizeof text);
    (void)state;
    change("CREATE TABLE cats(name TEXT); INSERT INTO cats VALUES('Minka');");
    expect_refused(BD_ERR_IO, "is no journal of bounced");
    file_write(directory, BD_JOURNAL_FILE, text, sizeof text);
    expect_refused(BD_ERR_IO, "could not be built anew");
}

static int64_t number(sqlite3 *db, const char *sql)
{
    sqlite3_stmt *get;
    assert_int_equal(sqlite3_prepare_v2(db, sql, -1, &get, NULL), SQLITE_OK);
    assert_int_equal(sqlite3_step(get), SQLITE_ROW);
    int64_t value = sqlite3_column_int64(get, 0);
    sqlite3_finalize(get);
    return value;
}

// An older file passes through each step once; one that fails leaves it as it was.
static void older_ones_are_brought_up(void **state)
{
    static const struct bd_journal_step steps[] = {
        {"CREATE TABLE t(a)"},
        {"ALTER TABLE t ADD COLUMN b; INSERT INTO t VALUES(1,2)"},
        {"UPDATE t SET a=a+10"},
        {"UPDATE t SET a=a+100; SELECT nothing FROM nowhere"},
    };
    (void)state;
    sqlite3 *db;
    assert_int_equal(sqlite3_open(":memory:", &db), SQLITE_OK);
    assert_int_equal(bd_journal_migrate(db, 0, steps, 1), SQLITE_OK);
    assert_int_equal(number(db, "PRAGMA user_version"), 1);
    assert_int_equal(bd_journal_migrate(db, 1, steps, 3), SQLITE_OK);
    assert_int_equal(number(db, "PRAGMA user_version"), 3);
    assert_int_equal(number(db, "SELECT a FROM t"), 11);
    assert_int_equal(bd_journal_migrate(db, 3, steps, 4), SQLITE_ERROR);
    assert_int_equal(number(db, "PRAGMA user_version"), 3);
    assert_int_equal(number(db, "SELECT a FROM t"), 11);
    assert_int_equal(sqlite3_get_autocommit(db), 1);
    sqlite3_close(db);
}

// What no start can read of a file of format 1 is left behind, and the rest is built anew.
static void an_older_one_is_mended(void **state)
{
    struct bd_err_detail detail = {0};
    struct bd_journal_edit edit;
    (void)state;
    copy_golden("journal-1.sqlite");
    change("UPDATE edits SET message='forged' WHERE revision=3");
    file_write(directory, BD_JOURNAL_FILE ".suspect", "", 0);
    struct bd_journal *journal = open_journal();
    assert_int_equal(bd_journal_get_edit(journal, "a", 2, &edit, &detail), BD_ERR_OK);
    assert_string_equal(edit.message, story.a[2].message);
    assert_string_equal(edit.author, "");
    bd_journal_close(&journal);
}

int main(int argc, char **argv)
{
    if (argc != 2) return 2;
    snprintf(golden, sizeof golden, "%s", argv[1]);
#define TEST(function) cmocka_unit_test_setup_teardown(function, set_up, tear_down)
    const struct CMUnitTest tests[] = {
        TEST(golden_journals_are_read),  TEST(a_newer_one_is_refused),
        TEST(a_foreign_one_is_refused),  TEST(an_older_one_is_mended),
        TEST(older_ones_are_brought_up),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
