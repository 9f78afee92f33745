// Decoded requests, whichever transport they came by, and how they are carried out.
//
// A command takes one request and ends with one answer. What lies in between is a list of steps in
// its row (command_internal.h): each says where it runs, and between any two the runner looks for
// errors and cancels.
//
// Hello, blob uploads and cancel are no commands: they belong to a connection, and so to its
// transport.
//
// Thread: the event loop's.

#ifndef BD_NET_COMMAND_COMMAND_H
#define BD_NET_COMMAND_COMMAND_H

#include <stdbool.h>

#include "net/access/auth.h"
#include "net/commit/commits.h"
#include "net/loop/client.h"
#include "net/wire/answer.h"
#include "protocol/bounced.pb-c.h"
#include "scene/blobs/blobs.h"

struct bd_command;
struct bd_step;
struct bd_frame_cache;
struct bd_import_cache;
struct bd_import_pool;

// Commands under way, and what they keep between them: imports and frames that may be asked for
// again. Owned by net.c.
struct bd_commands {
    struct bd_loop *loop;
    struct bd_live *live;
    struct bd_commits *commits;
    struct bd_command *list; // under way, newest first
    uint32_t count;
    struct bd_import_cache *import_cache;
    struct bd_frame_cache *frame_cache;
    struct bd_import_pool *import_pool;
};

// `import_program`: for bd_import; NULL: this one.
void bd_commands_begin(struct bd_commands *commands, struct bd_commits *commits,
                       const char *import_program);
// Once none is under way and the loop has ended.
void bd_commands_finish(struct bd_commands *commands);

// What a request is: rights, routes of HTTP and dispatch go by its row, which stands with its
// steps.
struct bd_command_row {
    Bounced__Envelope__BodyCase body;
    const char *scene; // the message's field that names a scene; NULL: it has none
    enum bd_role role; // that it takes; looking is for everybody
    bool is_job;       // of jobs_per_client and max_jobs
    bool has_payload;  // others' mean nothing
    const char *http;  // "METHOD path", ID in it for the scene; NULL: ways of its own, or none
    const struct bd_step *steps;
    const struct bd_step *turn_steps; // of bd_steps_edit: what follows with the turn on the scene
};

// NULL: the body is no command.
const struct bd_command_row *bd_command_row_of(Bounced__Envelope__BodyCase body);
// By its number; NULL after the last.
const struct bd_command_row *bd_command_row_at(uint32_t number);
// The message of a row's request.
const ProtobufCMessageDescriptor *bd_command_message(const struct bd_command_row *row);

struct bd_command_events {
    // Once, last. What is in `answer` belongs to the callee. May come before bd_command_start
    // returns.
    void (*answer)(void *user, struct bd_answer *answer);
    // A stage began: "import", "queue", "encode"; or, with a `share` from 0 to 1 (else -1), how far
    // "render" is. NULL if nobody wants to know.
    void (*progress)(void *user, const char *stage, double share);
};

// Content that came with the request instead of by blob: the body of POST /v1/render.
struct bd_command_body {
    struct bd_blob_upload *upload; // owned by the command from now on
    char boundary[80];             // of multipart/form-data; "" = the body is the scene's file
    char name[128];                // for messages about the file
};

struct bd_command_start {
    struct bd_commands *commands;
    struct bd_client *client;     // the command takes its own reference
    Bounced__Envelope *envelope;  // malloc'ed pieces; owned by the command from now on
    struct bd_command_body *body; // NULL: none; copied
    const struct bd_command_events *events;
    void *user;
    const struct bd_grant *grant; // what whoever asks may do; outlives the command
    const uint8_t *payload;       // of the message; copied if it is needed
    size_t payload_bytes;
    bool may_remember; // a frame of a held scene may be one that was sent before
};

// Its transport has counted the request and taken it out of the bucket. NULL if it has been
// answered already.
struct bd_command *bd_command_start(const struct bd_command_start *start);

// Asks it to stop; it is still answered, by `cancelled` unless it was done by then.
void bd_command_cancel(struct bd_command *command);

// The same when nobody listens any more: there will be no answer.
void bd_command_abandon(struct bd_command *command);

// The one started before it, NULL at the end: to walk over bd_commands.list.
struct bd_command *bd_command_next(const struct bd_command *command);

// Called on the loop once a second: tells how far long frames are.
void bd_command_tick(const struct bd_commands *commands);

#endif
