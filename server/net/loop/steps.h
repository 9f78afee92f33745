// Work that goes from executor to executor: a command, a frame of a view, a commit, the journal's
// upkeep. Each is a list of steps that say where they run; the runner goes from one to the next on
// the loop, and there, in one place, looks whether the work has failed, was cancelled, is to stop
// with the daemon, or is over.
//
// Executors of loop/ are here; those of the journal, of a scene's turn and of the disk are in
// commit/, that of frames in live/.
//
// Thread: the event loop's, but for a step's own function and bd_steps_run, which the executor
// calls where it runs, and `cancelled`, which is for both.

#ifndef BD_NET_LOOP_STEPS_H
#define BD_NET_LOOP_STEPS_H

#include <stdatomic.h>
#include <stdbool.h>
#include <uv.h>

#include "base/err.h"
#include "net/loop/background.h"

struct bd_command;
struct bd_commit;
struct bd_commits;
struct bd_edit_place;
struct bd_job;
struct bd_live;
struct bd_loop;
struct bd_steps;
struct bd_upkeep;
struct bd_view;

// Where a step runs.
struct bd_step_executor {
    // True: the step ran here and is over. False: it comes back by bd_steps_back, or may be over,
    // and its memory gone, already.
    bool (*begin)(struct bd_steps *steps);
    // The step is not wanted any more. True: it had not begun, and will not come back.
    // NULL: what has begun cannot be stopped.
    bool (*stop)(struct bd_steps *steps);
};

extern const struct bd_step_executor bd_on_loop;
extern const struct bd_step_executor bd_on_pool; // libuv's, beside the loop
// The same, for what takes a core for seconds: waits for its turn (net/loop/background.h).
extern const struct bd_step_executor bd_on_background;

struct bd_step {
    const struct bd_step_executor *on; // NULL: the list's end
    // What it does, by the kind of work; says why it failed in `detail`. None where the executor
    // alone is waited for.
    union {
        enum bd_err (*command)(struct bd_command *command);
        enum bd_err (*view)(struct bd_view *view);
        enum bd_err (*commit)(struct bd_commit *commit);
        enum bd_err (*upkeep)(struct bd_upkeep *upkeep);
    } run;
    const char *stage;            // told as progress when it begins; NULL: none
    enum bd_background_lane lane; // of bd_on_background
};

// What a kind of work has of its own.
struct bd_steps_kind {
    enum bd_err (*run)(struct bd_steps *steps); // the step's function for this kind
    // Once, behind the last step or with steps->detail: may free the steps, or begin them anew.
    void (*end)(struct bd_steps *steps);
    void (*tell)(struct bd_steps *steps, const char *stage); // NULL: nobody wants to know
    bool (*is_past_cancel)(const struct bd_steps *steps);    // NULL: never
    bool stops_with_daemon; // its next step is not begun once the daemon takes no new work
};

// Part of whatever is carried out. Set before it begins: kind, loop, and what its executors take.
struct bd_steps {
    const struct bd_steps_kind *kind;
    struct bd_loop *loop;
    struct bd_commits *commits;  // for bd_on_journal, bd_on_scene, bd_on_disk
    struct bd_live *live;        // for bd_on_render
    struct bd_edit_place *place; // for bd_on_scene, bd_on_disk
    struct bd_job *job;          // of bd_on_render: what the step submits; the owner's to release

    struct bd_err_detail detail; // .err: why it ends before its last step
    atomic_bool cancelled;       // looked at beside the loop, too

    // The runner's and the executors'.
    const struct bd_step *step;   // under way, or the next
    const struct bd_step *branch; // set by a step: go on there instead of behind it
    bool waits;                   // set on behalf of a step: begin it again, later
    uv_work_t work;
    struct bd_background background;
    struct bd_steps *next; // in the queue of the executor that it waits for
};

#define BD_STEPS_OWNER(pointer, type, member) ((type *)((char *)(pointer)-offsetof(type, member)))

// Begins a list, which may end before this returns.
void bd_steps_begin(struct bd_steps *steps, const struct bd_step *first);

// The work is not wanted any more: it ends before the next step, or now where the executor can
// still take the step back (bd_step_executor.stop).
void bd_steps_cancel(struct bd_steps *steps);

// For a step's own function, wherever it runs: the work goes on with another list, or ends behind
// this step.
void bd_steps_branch(struct bd_steps *steps, const struct bd_step *list);
void bd_steps_finish(struct bd_steps *steps);

// --- for executors ---

// Runs the step's function and keeps what it returns.
void bd_steps_run(struct bd_steps *steps);
// What the step came to, where it was not run by bd_steps_run.
void bd_steps_record(struct bd_steps *steps, enum bd_err err);
// The step is over: goes on behind it.
void bd_steps_back(struct bd_steps *steps);
// The two halves of bd_steps_back, for turns that are waited for in between.
void bd_steps_pass(struct bd_steps *steps);
void bd_steps_go_on(struct bd_steps *steps);

#endif
