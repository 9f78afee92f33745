// What the steps of a command share. Each step's function runs on the loop unless it says pool.

#ifndef BD_NET_COMMAND_INTERNAL_H
#define BD_NET_COMMAND_INTERNAL_H

#include <stdatomic.h>
#include <uv.h>

#include "net/command.h"
#include "net/frame_job.h"
#include "net/frame_options.h"
#include "net/net_internal.h"

struct bd_edit_work;
struct bd_multipart_part;

struct bd_command {
    struct bd_net *net;
    struct bd_client *client;
    const struct bd_grant *grant;
    Bounced__Envelope *envelope;
    struct bd_command_body body;
    const struct bd_command_events *events;
    void *user;
    struct bd_command *previous, *next; // net->commands
    struct bd_command *next_waiting;    // net->pool_turns_waiting
    atomic_bool cancelled;              // by whoever, on the loop; looked at on the pool, too
    bool abandoned;                     // no answer
    bool counts_as_job, waits_for_turn;
    uint64_t start_ns;

    const char *turn_stage;                      // pool_turn.h; static
    void (*on_pool)(struct bd_command *command); // what its turn is for
    void (*then)(struct bd_command *command);    // and what comes after it, or after the import
    uv_work_t work;
    // Written on the pool, read on the loop once the work came back.
    enum bd_err err;
    struct bd_fault fault;
    struct bd_scene *scene;
    uint64_t revision, transient;
    double load_ms, encode_ms;

    struct bd_frame_options options;
    struct bd_job *job;
    struct bd_frame_job frame_job;
    struct bd_encoded encoded;       // of an export the bytes alone
    struct bd_scene_flags *notes;    // of an export
    char *text;                      // of bd_net_options.list_devices
    struct bd_multipart_part *parts; // of a multipart body
    Bounced__BlobReply *blob_reply;
    struct bd_edit_work *edit; // of requests that change a scene
    uint8_t *payload;          // of an edit batch, or a revision out of a journal
    size_t payload_bytes;
    uint64_t time_ms; // since 1970, when what it brings was done; 0: now
};

// Ends the command with this answer (taken over) and frees it.
void bd_command_end(struct bd_command *command, struct bd_answer *answer);
void bd_command_end_fault(struct bd_command *command);

// Runs `on_pool` on libuv's pool, then `back` on the loop; straight to an end if the command was
// cancelled meanwhile.
void bd_command_pool(struct bd_command *command, uv_work_cb on_pool, uv_after_work_cb back);
// For `back`: true, and the command is ended, if there is nothing to go on with.
bool bd_command_stop_here(struct bd_command *command);

void bd_command_progress(struct bd_command *command, const char *stage);

// The files of the request become command->scene, then `then` runs on the loop.
void bd_command_import(struct bd_command *command, void (*then)(struct bd_command *command));

// command->scene becomes a frame and the answer.
void bd_command_render(struct bd_command *command);

#endif
