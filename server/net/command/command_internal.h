// What the steps of a command share. Each step's function runs on the loop unless it says pool.

#ifndef BD_NET_COMMAND_COMMAND_INTERNAL_H
#define BD_NET_COMMAND_COMMAND_INTERNAL_H

#include <stddef.h>

#include "net/command/command.h"
#include "net/commit/edit_queue.h"
#include "net/commit/journal_turn.h"
#include "net/live/frame_job.h"
#include "net/loop/steps.h"
#include "net/wire/frame_options.h"

struct bd_edit_work;
struct bd_multipart_part;

struct bd_command {
    struct bd_steps steps;      // first
    struct bd_edit_place place; // in the queue of the scene's edits, and on the way to the disk
    struct bd_commands *commands;
    struct bd_client *client;
    const struct bd_grant *grant;
    Bounced__Envelope *envelope;
    const struct bd_command_row *row; // NULL: the envelope holds no command
    struct bd_command_body body;
    const struct bd_command_events *events;
    void *user;
    struct bd_command *previous, *next; // bd_commands.list
    bool abandoned;                     // no answer
    bool counts_as_job;
    uint64_t start_ns;

    // What steps hand on. Written beside the loop, read on it once the step has come back.
    struct bd_answer answer; // what the command ends with, once its steps are over
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

// --- steps ---
//
// Behind the last one the command ends with its answer, or before with its error.

#define BD_STEP(where, function)                                                                   \
    {                                                                                              \
        .on = &bd_on_##where, .run.command = function                                              \
    }
#define BD_STEP_TOLD(where, function, name)                                                        \
    {                                                                                              \
        .on = &bd_on_##where, .run.command = function, .stage = name                               \
    }
#define BD_STEP_BACKGROUND(function, name, which)                                                  \
    {                                                                                              \
        .on = &bd_on_background, .run.command = function, .stage = name,                           \
        .lane = BD_BACKGROUND_##which                                                              \
    }
#define BD_STEPS_END                                                                               \
    {                                                                                              \
        .on = NULL                                                                                 \
    }

// A text of the request, by its field's name; NULL: not set, or the message has no such field.
const char *bd_command_text(const struct bd_command *command, const char *field);

// Rows stand with their steps, a family a file, and are ended by one without steps. command.c has
// the families, in the order in which lists of commands have them.
#define BD_BODY(name) .body = BOUNCED__ENVELOPE__BODY_##name
#define BD_OF_SCENE   .scene = "scene"
#define BD_ROWS_END                                                                                \
    {                                                                                              \
        .steps = NULL                                                                              \
    }
extern const struct bd_command_row bd_rows_of_scenes[], bd_rows_of_exports[], bd_rows_of_batches[],
    bd_rows_of_history[], bd_rows_of_replay[], bd_rows_of_frames[];

// Steps of one family that others go on with: a scene's turn is waited for, and then the row's
// turn_steps (edit_step.c); command->scene becomes one of the store (scene_step.c); what was read
// out of a journal becomes a revision (edit_history.c).
extern const struct bd_step bd_steps_edit[], bd_steps_stage_scene[], bd_steps_replay_edit[];

// import_step.c. On the loop: whether the table of files is short enough. In the background: the
// files of the request become command->scene.
BD_MUST_CHECK
enum bd_err bd_command_check_files(struct bd_command *command);
BD_MUST_CHECK
enum bd_err bd_command_import(struct bd_command *command);

// render_step.c: what a frame that was stopped has to say of itself goes into the error's details.
void bd_command_tell_how_far(struct bd_command *command, struct bd_answer *error);

#endif
