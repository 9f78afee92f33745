#include "net/live/view_plan.h"

// Slower than this nobody shows a film: the client rested.
#define PACE_MAX_NS 200000000u
// A frame is begun so long before it will be wanted, and twice what frames take besides: encoders,
// sockets and clocks of clients are not on time by less than this.
#define PACE_SLACK_NS 5000000u

// A frame of an older state: is it worth its end?
static bool may_stop(const struct bd_view_state *state, uint64_t now_ns)
{
    if (state->is_stopping || state->has_rendered || state->running == state->wanted) return false;
    if (state->running_step > 0) return true;
    return !state->stopped_one && 2 * (now_ns - state->begun_ns) < state->usual_ns;
}

static uint64_t due_ns(const struct bd_view_state *state)
{
    uint64_t due = state->begun_ns ? state->begun_ns + state->interval_ns : 0;
    return due > state->retry_ns ? due : state->retry_ns;
}

// When a first frame would come just in time for a client that is showing another. One that has
// given all of its credits back waits for a frame now.
static uint64_t wanted_ns(const struct bd_view_state *state)
{
    uint64_t lead_ns = 2 * state->usual_ns + PACE_SLACK_NS;
    bool is_showing = state->shown != 0 && state->credits < state->credit_max;
    if (!is_showing || state->shown == state->wanted || state->pace_ns <= lead_ns) return 0;
    return state->credit_ns + state->pace_ns - lead_ns;
}

static bool has_work(const struct bd_view_state *state)
{
    return state->shown != state->wanted || !state->is_final;
}

// A step that took too long is not tried again: the one before it, then, once more as the last.
static uint32_t next_step(const struct bd_view_state *state)
{
    if (state->shown != state->wanted) return 0;
    uint32_t step = state->refine ? state->shown_step + 1 : state->shown_step;
    return step < state->last_step ? step : state->last_step;
}

struct bd_view_decision bd_view_decide(const struct bd_view_state *state, uint64_t now_ns)
{
    struct bd_view_decision decision = {.next = BD_VIEW_REST};
    if (state->is_running) {
        if (may_stop(state, now_ns)) decision.next = BD_VIEW_STOP;
        return decision;
    }
    if (!has_work(state) || state->credits == 0 || !state->has_room) return decision;
    decision.until_ns = due_ns(state);
    if (decision.until_ns < wanted_ns(state)) decision.until_ns = wanted_ns(state);
    decision.next = now_ns < decision.until_ns ? BD_VIEW_WAIT : BD_VIEW_BEGIN;
    decision.step = next_step(state);
    return decision;
}

void bd_view_take_credits(struct bd_view_state *state, uint32_t count, uint64_t now_ns)
{
    uint32_t room = state->credit_max - state->credits;
    if (room == 0) return;
    state->credits += count < room ? count : room;
    uint64_t since_ns = now_ns - state->credit_ns;
    if (state->credit_ns == 0 || since_ns > PACE_MAX_NS)
        state->pace_ns = 0;
    else
        state->pace_ns = state->pace_ns ? (3 * state->pace_ns + since_ns) / 4 : since_ns;
    state->credit_ns = now_ns;
}

enum bd_view_why bd_view_why_final(const struct bd_view_state *state, bool has_better,
                                   bool is_settled, uint64_t next_ns, uint64_t most_ns)
{
    // Of an older state: another follows.
    if (state->running != state->wanted) return BD_VIEW_NOT_FINAL;
    if (!state->refine) return BD_VIEW_UNREFINED;
    if (!has_better) return BD_VIEW_TOP;
    if (is_settled) return BD_VIEW_SETTLED;
    if (state->running_step >= state->last_step) return BD_VIEW_DEADLINE;
    return next_ns > most_ns ? BD_VIEW_TIME : BD_VIEW_NOT_FINAL;
}
