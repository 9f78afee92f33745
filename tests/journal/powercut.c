// Power cuts at random moments: whatever the disk made of what was not synced, every acknowledged
// commit is there, whole, and nothing else but, perhaps, the one that was on its way.
//
// And what the power left, less a file that is deleted: refused, or all of it is there.
//
// usage: powercut SEEDS [FIRST]
//        powercut SEEDS losing     the same without syncs: commits must be lost, or this test sees
//                                  nothing

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/log.h"
#include "scene/journal/journal_internal.h"
#include "tests/journal/powercut_vfs.h"
#include "tests/journal/session.h"

#define ROUNDS      3 // power cuts a seed, each on what the last one left
#define STEPS       60
#define CHANGES_MAX 700 // calls to the disk within which the power goes
#define WHY_BYTES   256

static struct {
    uint64_t cuts, cuts_at_open, came_through, steps;
    uint64_t files_lost, refused;
} seen;

// Some sessions copy their log into the file all the time, most at the usual length.
static void set_for_test(struct session *session, bool is_losing)
{
    static const char *const checkpoints[] = {"PRAGMA wal_autocheckpoint=8",
                                              "PRAGMA wal_autocheckpoint=60", "", ""};
    sqlite3 *db = session->journal->db;
    sqlite3_exec(db, checkpoints[kit_random(&session->random) % 4], NULL, NULL, NULL);
    if (is_losing) sqlite3_exec(db, "PRAGMA synchronous=OFF", NULL, NULL, NULL);
}

// Until the power goes; at rest, if it did not go before. BD_ERR_OK then.
static enum bd_err run_until_cut(struct session *session, bool is_losing,
                                 struct bd_err_detail *detail)
{
    uint64_t at = 1 + kit_random(&session->random) % CHANGES_MAX;
    disk_cut_power_at(at, kit_random(&session->random) % 2);
    session->in_flight = session->kept;
    enum bd_err err = bd_journal_open(DISK_DIRECTORY, &session->journal, detail);
    if (err) seen.cuts_at_open++;
    if (!err) set_for_test(session, is_losing);
    for (int i = 0; i < STEPS && !err; i++, seen.steps++) {
        err = session_step(session, detail);
        // Daemons restart between two edits, too.
        if (!err && kit_random(&session->random) % 40 == 0) {
            bd_journal_close(&session->journal);
            err = bd_journal_open(DISK_DIRECTORY, &session->journal, detail);
        }
    }
    bool is_cut = !disk_has_power();
    if (!is_cut) disk_cut_power();
    bd_journal_close(&session->journal);
    disk_restore_power();
    seen.cuts++;
    return is_cut ? BD_ERR_OK : err;
}

// What is left must be the one or the other.
static bool check(struct session *session, char *why)
{
    struct bd_err_detail detail = {0};
    if (bd_journal_open(DISK_DIRECTORY, &session->journal, &detail)) {
        snprintf(why, WHY_BYTES, "%.200s", detail.message);
        return false;
    }
    bool holds = session_holds(session->journal, &session->kept, why, WHY_BYTES);
    char other[WHY_BYTES];
    if (!holds && session_holds(session->journal, &session->in_flight, other, sizeof other)) {
        session->kept = session->in_flight;
        seen.came_through++;
        holds = true;
    }
    bd_journal_close(&session->journal);
    return holds;
}

// The power goes once more, and then one of the two files.
static bool lose_a_file(struct session *session, char *why)
{
    const char *name = kit_random(&session->random) % 4 ? "-wal" : BD_JOURNAL_FILE;
    struct bd_err_detail detail = {0};
    enum bd_err err = bd_journal_open(DISK_DIRECTORY, &session->journal, &detail);
    if (!err) set_for_test(session, false);
    for (uint32_t i = kit_random(&session->random) % STEPS; i > 0 && !err; i--)
        err = session_step(session, &detail);
    if (!err) disk_cut_power(); // at rest: what is acknowledged then was said to somebody
    bd_journal_close(&session->journal);
    disk_restore_power();
    if (err || !disk_lose_file(name)) return !err;
    seen.files_lost++;
    err = bd_journal_open(DISK_DIRECTORY, &session->journal, &detail);
    if (!err) {
        bd_journal_close(&session->journal);
        return check(session, why);
    }
    seen.refused++;
    if (err == BD_ERR_IO && strstr(detail.message, "--accept-journal")) return true;
    snprintf(why, WHY_BYTES, "%.200s", detail.message);
    return false;
}

static bool run_seed(uint64_t seed, bool is_losing)
{
    static struct session session; // large
    char why[WHY_BYTES];
    struct bd_err_detail detail = {0};
    disk_format(seed);
    session_begin(&session, seed);
    for (int round = 0; round < ROUNDS; round++) {
        bool holds = run_until_cut(&session, is_losing, &detail) == BD_ERR_OK;
        if (!holds) snprintf(why, sizeof why, "without a cut: %.200s", detail.message);
        if (holds && check(&session, why)) continue;
        if (!is_losing)
            fprintf(stderr, "seed %llu, round %d: %s\n", (unsigned long long)seed, round, why);
        return false;
    }
    bool holds = is_losing || lose_a_file(&session, why);
    if (!holds) fprintf(stderr, "seed %llu, a lost file: %s\n", (unsigned long long)seed, why);
    return holds;
}

int main(int argc, char **argv)
{
    uint64_t count = argc > 1 ? strtoull(argv[1], NULL, 10) : 100, lost = 0;
    bool is_losing = argc > 2 && strcmp(argv[2], "losing") == 0;
    uint64_t first = argc > 2 && !is_losing ? strtoull(argv[2], NULL, 10) : 1;
    bd_log_setup(is_losing ? BD_LOG_ERROR + 1 : BD_LOG_ERROR, false);
    disk_register();
    for (uint64_t i = 0; i < count; i++) lost += !run_seed(first + i, is_losing);
    printf("%llu seeds: %llu power cuts in %llu steps, %llu of them at a start; %llu commits came "
           "through unacknowledged; %llu of %llu lost files refused; %llu seeds with losses\n",
           (unsigned long long)count, (unsigned long long)seen.cuts, (unsigned long long)seen.steps,
           (unsigned long long)seen.cuts_at_open, (unsigned long long)seen.came_through,
           (unsigned long long)seen.refused, (unsigned long long)seen.files_lost,
           (unsigned long long)lost);
    disk_format(0);
    // Most of them had something that is nowhere else.
    bool saw_losses = is_losing || count < 50 || seen.refused > seen.files_lost / 2;
    return is_losing ? lost == 0 : lost > 0 || !saw_losses;
}
