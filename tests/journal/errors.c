// A disk that fails, or is full, at every single call of a session: a clear line, nothing lost,
// nothing half there, and the next commit works. And the power may go right after.
//
// usage: errors SEED...

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/log.h"
#include "base/sanitizer.h"
#include "tests/journal/powercut_vfs.h"
#include "tests/journal/session.h"

#define STEPS       8
#define STEPS_AFTER 2
#define WHY_BYTES   256
// Of the calls, those that fail: all, but where sanitizers make each ten times as slow.
#define EVERY (BD_UNDER_SANITIZER ? 3 : 1)

struct trouble {
    const char *name;
    enum disk_detail detail;
    uint64_t count; // calls that fail; 0: all, until somebody mends it
    bool then_power_cut;
    enum bd_err expected;
};

static const struct trouble troubles[] = {
    {"one call fails", DISK_FAULT_IO, 1, false, BD_ERR_IO},
    {"every call fails from then on", DISK_FAULT_IO, 0, false, BD_ERR_IO},
    {"one call fails, and the power goes", DISK_FAULT_IO, 1, true, BD_ERR_IO},
    {"the disk is full once", DISK_FAULT_FULL, 1, false, BD_ERR_NO_MEMORY},
    {"the disk is full until there is room", DISK_FAULT_FULL, 0, false, BD_ERR_NO_MEMORY},
    {"the disk is full, and the power goes", DISK_FAULT_FULL, 0, true, BD_ERR_NO_MEMORY},
};

struct run {
    struct session session;
    const struct trouble *trouble;
    char why[WHY_BYTES];
};

static bool wrong(struct run *run, const char *what, const char *detail)
{
    snprintf(run->why, sizeof run->why, "%s: %.180s", what, detail);
    return false;
}

// One line, of the right kind, that names the file.
static bool is_clear(struct run *run, enum bd_err err, const struct bd_err_detail *detail)
{
    if (err != run->trouble->expected || detail->err != err)
        return wrong(run, bd_err_name(err), detail->message);
    if (strcmp(detail->field, "data") != 0) return wrong(run, "field", detail->field);
    // Nothing was damaged: nothing may be taken for it, or a start would mend what is whole.
    if (strstr(detail->message, "damaged") || !strstr(detail->message, BD_JOURNAL_FILE))
        return wrong(run, "message", detail->message);
    return true;
}

static bool open_now(struct run *run)
{
    struct bd_err_detail detail = {0};
    if (run->session.journal) return true;
    if (bd_journal_open(DISK_DIRECTORY, &run->session.journal, &detail))
        return wrong(run, "it does not open", detail.message);
    return true;
}

static bool holds(struct run *run)
{
    char why[WHY_BYTES];
    if (session_holds(run->session.journal, &run->session.kept, why, sizeof why)) return true;
    return wrong(run, "not what was acknowledged", why);
}

// The journal of a machine that died, or is about to be found whole.
static bool cut_and_look(struct run *run)
{
    struct session *session = &run->session;
    char why[WHY_BYTES];
    disk_cut_power();
    bd_journal_close(&session->journal);
    disk_restore_power();
    if (!open_now(run)) return false;
    // What was refused may have come through whole: journal.h says so.
    if (session_holds(session->journal, &session->in_flight, why, sizeof why))
        session->kept = session->in_flight;
    return holds(run);
}

// Every other time an orderly end lies between the trouble and the last power cut.
static bool go_on(struct run *run, bool ends_in_order)
{
    struct session *session = &run->session;
    struct bd_err_detail detail = {0};
    for (int i = 0; i < STEPS_AFTER; i++)
        if (session_step(session, &detail))
            return wrong(run, "the next step fails", detail.message);
    if (!holds(run)) return false;
    if (ends_in_order) bd_journal_close(&session->journal);
    if (!open_now(run) || (ends_in_order && !holds(run))) return false;
    session->in_flight = session->kept; // nothing may come through late any more
    return cut_and_look(run);
}

static enum bd_err run_session(struct session *session, struct bd_err_detail *detail)
{
    enum bd_err err = bd_journal_open(DISK_DIRECTORY, &session->journal, detail);
    for (int i = 0; i < STEPS && !err; i++) {
        err = session_step(session, detail);
        if (i != STEPS / 2 || err) continue;
        bd_journal_close(&session->journal);
        err = bd_journal_open(DISK_DIRECTORY, &session->journal, detail);
    }
    return err;
}

// `at` 0: without any trouble.
static bool run_once(struct run *run, uint64_t seed, uint64_t at)
{
    struct bd_err_detail detail = {0};
    session_begin(&run->session, seed);
    disk_format(seed + 1000 * at);
    disk_fail_at(at ? run->trouble->detail : DISK_FAULT_NONE, at, run->trouble->count);
    enum bd_err err = run_session(&run->session, &detail);
    bool has_failed = disk_failed_count() > 0;
    if (err && !has_failed) return wrong(run, "without trouble", detail.message);
    if (err && !is_clear(run, err, &detail)) return false;
    if (has_failed && run->trouble->then_power_cut) {
        // The fault goes with the power.
        disk_fail_at(DISK_FAULT_NONE, 0, 0);
        return cut_and_look(run) && go_on(run, at % 2);
    }
    if (at) disk_fail_at(DISK_FAULT_NONE, 0, 0);
    return open_now(run) && holds(run) && (!at || go_on(run, at % 2));
}

static bool run_seed(uint64_t seed, const struct trouble *trouble, uint64_t *calls)
{
    static struct run run; // large
    run.trouble = trouble;
    bool is_good = run_once(&run, seed, 0);
    *calls = disk_call_count();
    if (!is_good) fprintf(stderr, "seed %llu: %s\n", (unsigned long long)seed, run.why);
    bd_journal_close(&run.session.journal);
    for (uint64_t at = 1; at <= *calls && is_good; at += EVERY) {
        is_good = run_once(&run, seed, at);
        disk_fail_at(DISK_FAULT_NONE, 0, 0);
        bd_journal_close(&run.session.journal);
        if (!is_good)
            fprintf(stderr, "seed %llu, %s, call %llu: %s\n", (unsigned long long)seed,
                    trouble->name, (unsigned long long)at, run.why);
    }
    return is_good;
}

int main(int argc, char **argv)
{
    int failed = 0;
    bd_log_setup(BD_LOG_ERROR, false);
    disk_register();
    for (int i = 1; i < argc; i++)
        for (size_t j = 0; j < sizeof troubles / sizeof *troubles; j++) {
            uint64_t calls;
            failed += !run_seed(strtoull(argv[i], NULL, 10), &troubles[j], &calls);
            printf("seed %s: %s: at each of %llu calls\n", argv[i], troubles[j].name,
                   (unsigned long long)calls);
        }
    disk_format(0);
    return failed > 0 || argc < 2;
}
