// A session's views: their numbers, requests and events.

#include <stdlib.h>

#include "base/assert.h"
#include "net/live/view.h"
#include "net/session/session_internal.h"

#define CREDITS_USUAL 2
// Frames wait here for a peer that took those before; credits bound them too.
#define UNSENT_BYTES_MAX (8u << 20)

struct bd_session_view {
    struct bd_session *session;
    uint32_t number;
    uint64_t request_id; // that opened it
    struct bd_view *view;
    struct bd_session_view *next;
};

static struct bd_session_view *find(const struct bd_session *session, uint32_t number)
{
    struct bd_session_view *view = session->views;
    while (view && view->number != number) view = view->next;
    return view;
}

static void forget(struct bd_session_view *view)
{
    struct bd_session_view **at = &view->session->views;
    while (*at != view) at = &(*at)->next;
    *at = view->next;
    view->session->view_count--;
    bd_view_close(&view->view);
    free(view);
}

// --- events ---------------------------------------------------------------------------------

static Bounced__ViewFrame *frame_message(const struct bd_session_view *view,
                                         const struct bd_view_frame *frame)
{
    Bounced__ViewFrame *message = malloc(sizeof *message);
    BD_ASSERT(message);
    bounced__view_frame__init(message);
    BD_SET(message, view, view->number);
    BD_SET(message, number, frame->number);
    BD_SET(message, replaced, frame->replaced);
    BD_SET(message, final, frame->is_final);
    if (frame->is_final) message->why_final = bd_answer_text(frame->why_final);
    BD_SET(message, step, frame->step);
    BD_SET(message, age_ms, frame->age_ms);
    BD_SET(message, credits, frame->credits);
    if (frame->sequence) BD_SET(message, sequence, frame->sequence);
    message->encoding = bd_answer_text(bd_encode_format_name(frame->format));
    if (frame->transient) BD_SET(message, transient, frame->transient);
    message->report = bd_report_message(frame->report, frame->revision, 0, frame->encode_ms,
                                        &frame->exposure_stops);
    return message;
}

static void on_frame(void *user, struct bd_view_frame *frame)
{
    const struct bd_session_view *view = user;
    struct bd_answer answer =
        bd_answer_of(BOUNCED__ENVELOPE__BODY_VIEW_FRAME, frame_message(view, frame));
    answer.payload = frame->bytes.data;
    answer.payload_bytes = frame->bytes.size_bytes;
    frame->bytes = (struct bd_bytes){0};
    bd_session_send_event(view->session, view->request_id, &answer);
}

static void on_end(void *user, const struct bd_err_detail *detail)
{
    struct bd_session_view *view = user;
    struct bd_answer error = bd_answer_error(detail);
    Bounced__ViewEnd *message = malloc(sizeof *message);
    BD_ASSERT(message);
    bounced__view_end__init(message);
    BD_SET(message, view, view->number);
    message->error = error.envelope->error;
    error.envelope->body_case = BOUNCED__ENVELOPE__BODY__NOT_SET;
    bd_answer_finish(&error);
    struct bd_answer answer = bd_answer_of(BOUNCED__ENVELOPE__BODY_VIEW_END, message);
    // Kept like an answer: a client that comes back must not wait for this view's frames.
    bd_session_send(view->session, view->request_id, &answer);
    forget(view);
}

static bool has_room(void *user)
{
    const struct bd_session *session = ((const struct bd_session_view *)user)->session;
    return session->conn && session->conn->state == BD_CONN_OPEN &&
           bd_conn_unsent_bytes(session->conn) < UNSENT_BYTES_MAX;
}

static const struct bd_view_events events = {on_frame, on_end, has_room};

// --- requests -------------------------------------------------------------------------------

static enum bd_err read_credits(const struct bd_session *session, const Bounced__ViewOpen *open,
                                uint32_t *out, struct bd_err_detail *detail)
{
    uint64_t most = session->loop->serving->limits.view_credits;
    *out = open->has_credits ? open->credits : CREDITS_USUAL;
    if (*out > most && !open->has_credits) *out = (uint32_t)most;
    if (*out >= 1 && *out <= most) return BD_ERR_OK;
    return bd_err_set(detail, BD_ERR_USAGE, "credits",
                      "credits: %u: must be from 1 to %llu (limit view_credits)", *out,
                      (unsigned long long)most);
}

static enum bd_err check_open(const struct bd_session *session, const Bounced__ViewOpen *open,
                              struct bd_err_detail *detail)
{
    const struct bd_store_entry *entry;
    uint64_t most = session->loop->serving->limits.views_per_connection;
    const char *scene = open->scene ? open->scene : "";
    if (session->loop->draining)
        return bd_err_set(detail, BD_ERR_BUSY, "", "the server is shutting down");
    if (session->view_count >= most)
        return bd_err_set(detail, BD_ERR_BUSY, "views_per_connection",
                          "%u views are open on this connection (limit views_per_connection)",
                          session->view_count);
    enum bd_err err = bd_store_get(session->loop->serving->store, scene, &entry, detail);
    if (!err && !bd_grant_covers(session->grant, entry->name))
        err = bd_err_set(detail, BD_ERR_NOT_FOUND, "scene", "there is no scene \"%.64s\"", scene);
    return err;
}

static enum bd_err open_view(struct bd_session_view *view, const Bounced__ViewOpen *open,
                             struct bd_err_detail *detail)
{
    struct bd_session *session = view->session;
    struct bd_view_start start = {.live = session->sessions->commands->live,
                                  .client = session->client,
                                  .scene = open->scene ? open->scene : "",
                                  .frame = open->frame,
                                  .frames_per_second = open->frames_per_second,
                                  .refine = !open->has_refine || open->refine,
                                  .events = &events,
                                  .user = view};
    enum bd_err err = check_open(session, open, detail);
    if (!err) err = read_credits(session, open, &start.credits, detail);
    if (!err) err = bd_view_open(&start, &view->view, detail);
    return err;
}

void bd_session_open_view(struct bd_session *session, const Bounced__Envelope *envelope)
{
    struct bd_err_detail detail;
    struct bd_session_view *view = calloc(1, sizeof *view);
    BD_ASSERT(view);
    *view = (struct bd_session_view){
        .session = session, .request_id = envelope->request_id, .next = session->views};
    if (open_view(view, envelope->view_open, &detail)) {
        free(view);
        bd_session_send_error(session, envelope->request_id, &detail);
        return;
    }
    view->number = ++session->view_number;
    session->views = view;
    session->view_count++;
    Bounced__ViewReply *reply = malloc(sizeof *reply);
    BD_ASSERT(reply);
    bounced__view_reply__init(reply);
    BD_SET(reply, view, view->number);
    struct bd_answer answer = bd_answer_of(BOUNCED__ENVELOPE__BODY_VIEW_REPLY, reply);
    bd_session_send(session, envelope->request_id, &answer);
}

static void answer_no_view(struct bd_session *session, uint64_t request_id, uint32_t number)
{
    struct bd_err_detail detail;
    bd_err_set(&detail, BD_ERR_NOT_FOUND, "view", "there is no view %u", number);
    bd_session_send_error(session, request_id, &detail);
}

void bd_session_update_view(struct bd_session *session, const Bounced__Envelope *envelope)
{
    const Bounced__ViewUpdate *update = envelope->view_update;
    struct bd_session_view *view = find(session, update->view);
    struct bd_err_detail detail;
    if (!view) {
        answer_no_view(session, envelope->request_id, update->view);
    } else if (bd_view_update(view->view, update, &detail)) {
        bd_session_send_error(session, envelope->request_id, &detail);
    } else {
        struct bd_answer answer = bd_answer_done();
        bd_session_send(session, envelope->request_id, &answer);
    }
}

void bd_session_close_view(struct bd_session *session, const Bounced__Envelope *envelope)
{
    struct bd_session_view *view = find(session, envelope->view_close->view);
    if (!view) {
        answer_no_view(session, envelope->request_id, envelope->view_close->view);
        return;
    }
    forget(view);
    struct bd_answer answer = bd_answer_done();
    bd_session_send(session, envelope->request_id, &answer);
}

// Of a view that has ended meanwhile, too: nobody is at fault.
void bd_session_credit_view(struct bd_session *session, const Bounced__ViewCredit *credit)
{
    struct bd_session_view *view = find(session, credit->view);
    if (view) bd_view_credit(view->view, credit->has_count ? credit->count : 1);
}

static struct bd_session_view *find_request(const struct bd_session *session, uint64_t request_id)
{
    struct bd_session_view *view = session->views;
    while (view && view->request_id != request_id) view = view->next;
    return view;
}

void bd_session_view_ids(const struct bd_session *session, uint64_t *out)
{
    for (const struct bd_session_view *view = session->views; view; view = view->next)
        *out++ = view->request_id;
}

bool bd_session_has_view(const struct bd_session *session, uint64_t request_id)
{
    return find_request(session, request_id) != NULL;
}

void bd_session_end_view(struct bd_session *session, uint64_t request_id)
{
    struct bd_session_view *view = find_request(session, request_id);
    if (view) forget(view);
}

// One step may end a view: from the start again after each would be endless, so by number, upwards.
static struct bd_session_view *find_above(const struct bd_session *session, uint32_t number)
{
    struct bd_session_view *next = NULL;
    for (struct bd_session_view *view = session->views; view; view = view->next)
        if (view->number > number && (!next || view->number < next->number)) next = view;
    return next;
}

void bd_session_wake_views(struct bd_session *session, bool restart)
{
    uint32_t number = 0;
    for (struct bd_session_view *view; (view = find_above(session, number));) {
        number = view->number;
        if (restart)
            bd_view_restart(view->view);
        else
            bd_view_wake(view->view);
    }
}

void bd_session_end_views(struct bd_session *session)
{
    while (session->views) forget(session->views);
}
