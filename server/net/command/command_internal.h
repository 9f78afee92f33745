// What the steps of a command share. Each step's function runs on the loop unless it says pool.

#ifndef BD_NET_COMMAND_COMMAND_INTERNAL_H
#define BD_NET_COMMAND_COMMAND_INTERNAL_H

#include <stdatomic.h>
#include <uv.h>

#include "net/command/command.h"
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

    const char *stage;                        // of bd_command_background; static
    void (*run)(struct bd_command *command);  // beside the loop
    void (*then)(struct bd_command *command); // and on it afterwards
    uv_work_t work;
    struct bd_background background; // an import, an export
    // Written beside the loop, read on it once the work came back.
    enum bd_err err;
    struct bd_fault fault;
    struct bd_scene *scene;
    uint64_t revision, transient;
    double load_ms, encode_ms;

    struct bd_frame_options options;
    bool may_remember, has_frame_key;
    uint8_t frame_key[BD_SHA256_BYTES]; // net/command/frame_cache.h
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
// What takes a core for seconds: waits for its turn among imports and exports
// (net/loop/background.h). Then the stage begins, `run` runs beside the loop, and `then` on it
// unless the command was cancelled or failed: it has ended then.
void bd_command_background(struct bd_command *command, const char *stage,
                           void (*run)(struct bd_command *command),
                           void (*then)(struct bd_command *command));
// For who takes such a turn alone, in `back`: the command's error, also where no thread was to be
// had.
BD_MUST_CHECK
enum bd_err bd_command_check_background(struct bd_command *command);
// For `back`: true, and the command is ended, if there is nothing to go on with.
bool bd_command_stop_here(struct bd_command *command);

void bd_command_progress(struct bd_command *command, const char *stage);

// The files of the request become command->scene, then `then` runs on the loop.
void bd_command_import(struct bd_command *command, void (*then)(struct bd_command *command));

// Answers by a frame that was sent before, and is true then: the command has ended. `entry`: of the
// scene that is asked for.
bool bd_command_render_remembered(struct bd_command *command, const struct bd_store_entry *entry);

// command->scene becomes a frame and the answer.
void bd_command_render(struct bd_command *command);

#endif
