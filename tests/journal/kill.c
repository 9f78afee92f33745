// kill -9 at random moments of a process that commits as fast as it can: what it had acknowledged
// is there, and at most the batch that was on its way, whole.
//
// usage: kill COUNT

#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

#include "base/assert.h"
#include "base/log.h"
#include "tests/journal/kit.h"

#define WAIT_US_MAX 60000
#define KEEP_EDITS  50
#define WHY_BYTES   256

// Every batch is known from the revision before it: its length, its edits, its content.
static uint64_t batch_end(uint64_t revision)
{
    return revision + 1 + revision % 3;
}

static void make_content(struct kit_content *out, uint64_t revision)
{
    kit_make_content(out, 1 + revision % 7 * 30000, revision);
}

static enum bd_err commit_batch(struct bd_journal *journal, uint64_t *revision, uint64_t *state,
                                struct bd_err_detail *detail)
{
    struct kit_edit edits[3];
    struct bd_journal_record records[3];
    struct kit_content content;
    uint32_t count = 0;
    uint64_t end = batch_end(*revision);
    make_content(&content, end);
    enum bd_err err = kit_put(journal, &content.content, 1, detail);
    for (; *revision < end; count++) {
        kit_make_edit(&edits[count], ++*revision, *state, 7);
        edits[count].edit.forward_content =
            (struct bd_journal_digests){content.content.sha256, *revision == end};
        *state = edits[count].state;
        records[count] = (struct bd_journal_record){
            .kind = BD_JOURNAL_EDIT, .scene = "a", .edit = &edits[count].edit};
    }
    if (!err) err = bd_journal_commit(journal, records, count, NULL, detail);
    free(content.bytes);
    return err;
}

static enum bd_err tidy(struct bd_journal *journal, uint64_t revision, uint64_t state,
                        struct bd_err_detail *detail)
{
    struct kit_snapshot snapshot;
    bool is_done;
    kit_make_snapshot(&snapshot, revision, state);
    enum bd_err err = bd_journal_write_snapshot(journal, "a", &snapshot.snapshot, detail);
    if (!err) err = bd_journal_compact(journal, "a", KEEP_EDITS, &is_done, detail);
    for (int i = 0; i < 20 && !err; i++) err = bd_journal_collect(journal, &is_done, detail);
    return err;
}

// Until it is killed: says each revision once it is acknowledged.
__attribute__((noreturn)) static void commit_for_ever(const char *directory, uint64_t revision,
                                                      uint64_t state, int out)
{
    struct bd_journal *journal;
    struct bd_err_detail detail = {0};
    enum bd_err err = bd_journal_open(directory, &journal, &detail);
    for (int i = 1; !err; i++) {
        err = commit_batch(journal, &revision, &state, &detail);
        if (!err && write(out, &revision, sizeof revision) != sizeof revision) break;
        if (!err && i % 16 == 0) err = tidy(journal, revision, state, &detail);
    }
    fprintf(stderr, "the process that commits: %s\n", detail.message);
    _exit(1);
}

static uint64_t read_acknowledged(int in, uint64_t acknowledged)
{
    uint64_t revision;
    while (read(in, &revision, sizeof revision) == sizeof revision) acknowledged = revision;
    return acknowledged;
}

// Starts it, lets it run for a while, kills it: the last revision that it had said.
static uint64_t run_and_kill(const char *directory, uint64_t revision, uint64_t state,
                             uint32_t wait_us)
{
    int ends[2], status;
    BD_ASSERT(pipe(ends) == 0);
    pid_t child = fork();
    BD_ASSERT_CMP(child, >=, 0);
    if (child == 0) {
        close(ends[0]);
        commit_for_ever(directory, revision, state, ends[1]);
    }
    close(ends[1]);
    usleep(wait_us);
    kill(child, SIGKILL);
    waitpid(child, &status, 0);
    uint64_t acknowledged = read_acknowledged(ends[0], revision);
    close(ends[0]);
    return WIFSIGNALED(status) ? acknowledged : 0;
}

static bool check_content(struct bd_journal *journal, uint64_t revision,
                          struct bd_err_detail *detail)
{
    struct kit_content content;
    if (revision == 1) return true;
    make_content(&content, revision);
    enum bd_err err = kit_read(journal, &content, detail);
    free(content.bytes);
    return err == BD_ERR_OK;
}

// Follows the batches from what was known to what is there.
static bool check(const char *directory, uint64_t acknowledged, uint64_t *revision, uint64_t *state)
{
    struct bd_journal *journal;
    struct bd_err_detail detail = {0};
    struct kit_loaded loaded = {0};
    enum bd_err err = bd_journal_open(directory, &journal, &detail);
    if (!err) err = kit_load(journal, "a", 0, &loaded, &detail);
    bool is_good = !err && check_content(journal, loaded.revision, &detail);
    bd_journal_close(&journal);
    uint64_t limit = batch_end(acknowledged);
    while (*revision < loaded.revision) {
        struct kit_edit edit;
        uint64_t end = batch_end(*revision);
        for (uint64_t i = *revision + 1; i <= end; i++) {
            kit_make_edit(&edit, i, *state, 7);
            *state = edit.state;
        }
        *revision = end;
    }
    if (is_good && loaded.revision >= acknowledged && loaded.revision <= limit &&
        *revision == loaded.revision && *state == loaded.state)
        return true;
    fprintf(stderr, "revision %llu, acknowledged %llu, limit %llu: %s\n",
            (unsigned long long)loaded.revision, (unsigned long long)acknowledged,
            (unsigned long long)limit, detail.message);
    return false;
}

static bool begin(const char *directory, uint64_t *state)
{
    struct bd_journal *journal;
    struct bd_err_detail detail = {0};
    struct kit_edit first;
    struct kit_snapshot snapshot;
    kit_make_edit(&first, 1, 0, 7);
    kit_make_snapshot(&snapshot, 1, first.state);
    *state = first.state;
    enum bd_err err = bd_journal_open(directory, &journal, &detail);
    if (!err) err = kit_add(journal, "a", &first, &snapshot, &detail);
    bd_journal_close(&journal);
    return err == BD_ERR_OK;
}

int main(int argc, char **argv)
{
    int count = argc > 1 ? atoi(argv[1]) : 30, killed = 0;
    uint64_t revision = 1, state, random = 11;
    char directory[64];
    bd_log_setup(BD_LOG_ERROR, false);
    kit_make_directory(directory);
    bool is_good = begin(directory, &state);
    for (; killed < count && is_good; killed++) {
        uint32_t wait_us = kit_random(&random) % WAIT_US_MAX;
        uint64_t acknowledged = run_and_kill(directory, revision, state, wait_us);
        is_good = acknowledged && check(directory, acknowledged, &revision, &state);
    }
    printf("killed %d times, %llu revisions\n", killed, (unsigned long long)revision);
    kit_remove_directory(directory);
    // A process that never got to commit would prove nothing.
    return !is_good || revision < (uint64_t)count;
}
