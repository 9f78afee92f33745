// A session's watches: scene_watch until cancel or the session's end.

#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "net/live/watch.h"
#include "net/session/session_internal.h"

// A peer that is so far behind is told that it missed something, once it has caught up.
#define UNSENT_BYTES_MAX (1u << 20)

struct bd_session_watch {
    struct bd_watch watch;
    struct bd_session *session;
    uint64_t request_id;
    bool has_missed;
    struct bd_session_watch *next;
};

// Whatever fields it has.
static Bounced__SceneEvent *copy(const Bounced__SceneEvent *event)
{
    const size_t size = bounced__scene_event__get_packed_size(event);
    uint8_t *bytes = malloc(size + 1);
    BD_ASSERT(bytes);
    bounced__scene_event__pack(event, bytes);
    Bounced__SceneEvent *message = bounced__scene_event__unpack(NULL, size, bytes);
    BD_ASSERT(message);
    free(bytes);
    return message;
}

static void send_event(struct bd_session_watch *watch, const Bounced__SceneEvent *event)
{
    struct bd_answer answer = bd_answer_of(BOUNCED__ENVELOPE__BODY_SCENE_EVENT, copy(event));
    bd_session_send_event(watch->session, watch->request_id, &answer);
}

static void on_event(void *user, const Bounced__SceneEvent *event)
{
    struct bd_session_watch *watch = user;
    if (watch->has_missed || bd_session_unsent_bytes(watch->session) > UNSENT_BYTES_MAX)
        watch->has_missed = true;
    else
        send_event(watch, event);
}

void bd_session_flush_watches(struct bd_session *session)
{
    static char missed[] = "missed";
    for (struct bd_session_watch *watch = session->watches; watch; watch = watch->next) {
        if (!watch->has_missed || bd_session_unsent_bytes(session) > UNSENT_BYTES_MAX) continue;
        Bounced__SceneEvent event = BOUNCED__SCENE_EVENT__INIT;
        event.scene = watch->watch.scene_id[0] ? watch->watch.scene_id : NULL;
        event.kind = missed;
        watch->has_missed = false;
        send_event(watch, &event);
    }
}

static enum bd_err begin(struct bd_session_watch *watch, const char *scene,
                         struct bd_err_detail *detail)
{
    if (watch->session->watch_count >= watch->session->loop->serving->limits.watches_per_connection)
        return bd_err_set(detail, BD_ERR_BUSY, "watches_per_connection",
                          "%u watches are open on this connection (limit "
                          "watches_per_connection)",
                          watch->session->watch_count);
    return bd_watch_begin(&watch->watch, watch->session->sessions->commands->live, scene, detail);
}

void bd_session_watch(struct bd_session *session, const Bounced__Envelope *envelope)
{
    struct bd_err_detail detail;
    struct bd_session_watch *watch = calloc(1, sizeof *watch);
    BD_ASSERT(watch);
    *watch = (struct bd_session_watch){
        .watch = {.grant = session->grant, .event = on_event, .user = watch},
        .session = session,
        .request_id = envelope->request_id,
        .next = session->watches};
    if (begin(watch, envelope->scene_watch->scene, &detail)) {
        free(watch);
        bd_session_send_error(session, envelope->request_id, &detail);
        return;
    }
    session->watches = watch;
    session->watch_count++;
    struct bd_answer answer = bd_answer_done();
    bd_session_send(session, envelope->request_id, &answer);
}

void bd_session_watch_ids(const struct bd_session *session, uint64_t *out)
{
    for (const struct bd_session_watch *watch = session->watches; watch; watch = watch->next)
        *out++ = watch->request_id;
}

bool bd_session_has_watch(const struct bd_session *session, uint64_t request_id)
{
    const struct bd_session_watch *watch = session->watches;
    while (watch && watch->request_id != request_id) watch = watch->next;
    return watch != NULL;
}

void bd_session_end_watch(struct bd_session *session, uint64_t request_id)
{
    for (struct bd_session_watch **at = &session->watches; *at; at = &(*at)->next) {
        struct bd_session_watch *watch = *at;
        if (watch->request_id != request_id) continue;
        *at = watch->next;
        session->watch_count--;
        bd_watch_end(&watch->watch);
        free(watch);
        return;
    }
}

void bd_session_end_watches(struct bd_session *session)
{
    while (session->watches) bd_session_end_watch(session, session->watches->request_id);
}
