// What the steps of a command share. Each step's function runs on the loop unless it says pool.

#ifndef BD_NET_COMMAND_COMMAND_INTERNAL_H
#define BD_NET_COMMAND_COMMAND_INTERNAL_H

#include <stdatomic.h>
#include <stddef.h>
#include <uv.h>

#include "net/command/command.h"
#include "net/commit/commit.h"
#include "net/commit/edit_queue.h"
#include "net/commit/journal_turn.h"
#include "net/live/frame_job.h"
#include "net/loop/background.h"
#include "net/wire/frame_options.h"

struct bd_edit_work;
struct bd_multipart_part;

struct bd_command {
    struct bd_commands *commands;
    struct bd_loop *loop; // theirs
    struct bd_client *client;
    const struct bd_grant *grant;
    Bounced__Envelope *envelope;
    const struct bd_command_row *row; // NULL: the envelope holds no command
    struct bd_command_body body;
    const struct bd_command_events *events;
    void *user;
    struct bd_command *previous, *next; // bd_commands.list
    atomic_bool cancelled;              // by whoever, on the loop; looked at beside it, too
    bool abandoned;                     // no answer
    bool counts_as_job;
    uint64_t start_ns;

    // The runner's.
    const struct bd_step *step;   // under way, or the next
    const struct bd_step *branch; // set by a step: go on there instead of behind it
    uv_work_t work;
    struct bd_background background;
    struct bd_journal_turn turn;
    struct bd_commit_waiter waiter;
    struct bd_edit_place place; // in the queue of the scene's edits
    bool is_queued;             // there
    bool waits;     // set by a step in the queue: not now; run it again after the next commit
    bool is_staged; // a cancel comes too late
    struct bd_job *job;
    struct bd_frame_job frame_job;

    // What steps hand on. Written beside the loop, read on it once the step has come back.
    enum bd_err err;
    struct bd_fault fault;
    struct bd_answer answer;          // what the command ends with, once its steps are over
    struct bd_batch *batch;           // staged, for the step BD_ON_DISK; gone behind it
    char scene_id[BD_SCENE_ID_BYTES]; // of that batch
    struct bd_scene *scene;
    uint64_t revision, transient;
    double load_ms, encode_ms;

    struct bd_frame_options options;
    bool may_remember, has_frame_key;
    uint8_t frame_key[BD_SHA256_BYTES]; // net/command/frame_cache.h
    struct bd_encoded encoded;          // of an export the bytes alone
    struct bd_scene_flags *notes;       // of an export
    char *text;                         // of bd_net_options.list_devices
    struct bd_multipart_part *parts;    // of a multipart body
    struct bd_edit_work *edit;          // of requests that change a scene
    uint8_t *payload;                   // of an edit batch, or a revision out of a journal
    size_t payload_bytes;
    uint64_t time_ms; // since 1970, when what it brings was done; 0: now
};

#define CONTAINER(pointer, type, member) ((type *)((char *)(pointer)-offsetof(type, member)))

// --- steps ---

enum bd_step_on {
    BD_ON_LOOP,
    BD_ON_POOL,       // libuv's, beside the loop
    BD_ON_BACKGROUND, // the same, for what takes a core for seconds: waits for its turn
                      // (background.h)
    BD_ON_JOURNAL,    // beside the loop, with the journal's turn
    BD_ON_RENDER,     // `run` submits command->job on the loop; the step ends with the frame
    BD_ON_SCENE,      // nothing runs: waits for the turn among the scene's edits (place.scene_id)
    BD_ON_DISK,       // nothing runs: waits until command->batch is on the disk; gives the turn up
    BD_ON_DISK_HELD,  // the same, and keeps the turn: what was staged goes before what is to come
};

// The runner goes from one to the next, on the loop. Before each it looks whether the command
// failed or was cancelled: then it ends it. Behind the last it ends it with command->answer.
struct bd_step {
    enum bd_step_on on;
    void (*run)(struct bd_command *command); // sets command->err where it fails
    const char *stage;                       // told as progress when it begins; NULL: none
    enum bd_background_lane lane;            // of BD_ON_BACKGROUND
};
#define BD_STEP(where, function)                                                                   \
    {                                                                                              \
        .on = BD_ON_##where, .run = function                                                       \
    }
#define BD_STEP_TOLD(where, function, name)                                                        \
    {                                                                                              \
        .on = BD_ON_##where, .run = function, .stage = name                                        \
    }
#define BD_STEP_BACKGROUND(function, name, which)                                                  \
    {                                                                                              \
        .on = BD_ON_BACKGROUND, .run = function, .stage = name, .lane = BD_BACKGROUND_##which      \
    }
#define BD_STEPS_END BD_STEP(LOOP, NULL)

// For a step: the command goes on with these, or, its answer being made, ends.
void bd_command_branch(struct bd_command *command, const struct bd_step *steps);
void bd_command_finish(struct bd_command *command);

// The steps of each kind of request, by the file that has them.
extern const struct bd_step bd_steps_scene_list[], bd_steps_scene_get[],
    bd_steps_scene_log[];                                                  // scene_step.c
extern const struct bd_step bd_steps_scene_add[], bd_steps_scene_remove[]; // scene_change.c
extern const struct bd_step bd_steps_stage_scene[]; // command->scene becomes one of the store
extern const struct bd_step bd_steps_export[];      // export_step.c
extern const struct bd_step bd_steps_render[];      // render_step.c
extern const struct bd_step bd_steps_edit[], bd_steps_batch[]; // edit_step.c
extern const struct bd_step bd_steps_undo[], bd_steps_revert[], bd_steps_commit[], bd_steps_name[],
    bd_steps_replay_edit[];                         // edit_history.c
extern const struct bd_step bd_steps_replay[];      // edit_replay.c

// import_step.c. On the loop: whether the table of files is short enough. In the background: the
// files of the request become command->scene.
void bd_command_check_files(struct bd_command *command);
void bd_command_import(struct bd_command *command);

// render_step.c: what a frame that was stopped has to say of itself goes into the error's details.
void bd_command_tell_how_far(struct bd_command *command, struct bd_answer *error);

#endif
