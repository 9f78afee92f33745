// What a view does next: a pure function of what it knows. view.c obeys.
//
// The rules: no frame is begun without a credit to send it by. The newest state wins; nothing waits
// in a queue. A refinement of what is no longer so is stopped at once; a first frame of it only
// while less than half of its usual time has passed, and never two in a row, so that a scene or a
// camera that never rests still shows at least every second frame that was begun. What is still is
// improved step by step up to a last, final frame. A client that takes frames at a pace of its own,
// slower than they are made, gets them made for the moment when it will take them: one begun as
// soon as there is a credit would lie with it until then, and show what was, not what is.
//
// Thread: any.

#ifndef BD_NET_LIVE_VIEW_PLAN_H
#define BD_NET_LIVE_VIEW_PLAN_H

#include <stdbool.h>
#include <stdint.h>

#define BD_VIEW_STEP_NONE UINT32_MAX

struct bd_view_state {
    bool refine;          // improve a still picture
    uint64_t interval_ns; // least time between the beginnings of two frames
    uint32_t credits;     // frames that may still be sent
    uint32_t credit_max;  // all of them are here: the client has shown whatever it got
    uint64_t credit_ns;   // when one came back last; 0 = never
    uint64_t pace_ns;     // usually after so long the next does; 0 = not known
    bool has_room;        // the connection takes more bytes

    uint64_t wanted; // the state to show; counts changes
    uint64_t shown;  // the state of the last frame that was sent; 0 = none was
    uint32_t shown_step;
    bool is_final;      // that frame was the last of its state
    uint32_t last_step; // no better one is tried; BD_VIEW_STEP_NONE = as far as the ladder goes

    bool is_running; // a frame is being rendered or encoded
    bool is_stopping;
    uint64_t running; // its state
    uint32_t running_step;
    bool has_rendered; // it is being encoded: it will be sent
    uint64_t begun_ns; // of the last frame
    uint64_t usual_ns; // what a first frame takes; 0 = not known
    bool stopped_one;  // the frame before it
    uint64_t retry_ns; // not before: the queue was full
};

enum bd_view_next {
    BD_VIEW_REST,  // until something happens
    BD_VIEW_WAIT,  // until a time
    BD_VIEW_BEGIN, // a frame, of a step
    BD_VIEW_STOP,  // the frame that is being rendered
};

struct bd_view_decision {
    enum bd_view_next next;
    uint32_t step;     // of BEGIN
    uint64_t until_ns; // of WAIT
};

struct bd_view_decision bd_view_decide(const struct bd_view_state *state, uint64_t now_ns);

// So many credits came back: never more than there are. Learns the client's pace.
void bd_view_take_credits(struct bd_view_state *state, uint32_t count, uint64_t now_ns);

// Why the frame that was just rendered is the last of its state.
enum bd_view_why {
    BD_VIEW_NOT_FINAL, // a better one follows, or one of a newer state
    BD_VIEW_TOP,       // there is no better step
    BD_VIEW_SETTLED,   // better ones look the same
    BD_VIEW_UNREFINED, // none was asked for
    BD_VIEW_DEADLINE,  // the next step took longer than deadline_ms
    BD_VIEW_TIME,      // it would take too long
};

// `has_better`: there is a next step, which shows something where the frame is not settled; it
// would take `next_ns` on the device, of at most `most_ns`.
enum bd_view_why bd_view_why_final(const struct bd_view_state *state, bool has_better,
                                   bool is_settled, uint64_t next_ns, uint64_t most_ns);

#endif
