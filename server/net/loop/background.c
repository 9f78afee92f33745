#include "net/loop/background.h"

#include <pthread.h>
#include <stdlib.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include "base/assert.h"
#include "base/priority.h"
#include "net/loop/loop.h"

// The loop must not wait for a thread of low priority, not even while it holds a lock or is about
// to end: on a busy machine that may be long. So what is done is pushed without a lock and told by
// an eventfd (uv_async_send has its receiver spin until the sender is through), and a thread is
// joined once it has ended.
struct bd_background_thread {
    pthread_t thread;
    struct bd_loop *loop;
    struct bd_background *work;
    struct bd_background_thread *next; // in `done`, then in `ending`
};

static void begin_waiting(struct bd_loop *loop, enum bd_background_lane lane);

static void *thread_main(void *user)
{
    struct bd_background_thread *thread = user;
    struct bd_background_state *state = &thread->loop->background;
    const uint64_t one = 1;
    bd_priority_lower();
    thread->work->run(thread->work);
    thread->next = __atomic_load_n(&state->done, __ATOMIC_RELAXED);
    while (!__atomic_compare_exchange_n(&state->done, &thread->next, thread, true, __ATOMIC_ACQ_REL,
                                        __ATOMIC_RELAXED)) {
    }
    ssize_t wrote = write(state->done_fd, &one, sizeof one);
    BD_ASSERT_CMP(wrote, ==, (ssize_t)sizeof one);
    return NULL;
}

// Those that have ended; `waits`: all of them, however long it takes.
static void join_ending(struct bd_background_state *state, bool waits)
{
    for (struct bd_background_thread **at = &state->ending; *at;) {
        struct bd_background_thread *thread = *at;
        int failed =
            waits ? pthread_join(thread->thread, NULL) : pthread_tryjoin_np(thread->thread, NULL);
        if (failed) {
            at = &thread->next;
            continue;
        }
        *at = thread->next;
        free(thread);
    }
}

static void come_back(struct bd_background *work)
{
    struct bd_loop *loop = work->loop;
    const enum bd_background_lane lane = work->lane;
    loop->background.lanes[lane].count--;
    work->back(work);
    begin_waiting(loop, lane);
}

static void on_done(uv_poll_t *poll, int status, int events)
{
    struct bd_background_state *state = &((struct bd_loop *)poll->data)->background;
    uint64_t count;
    (void)status;
    (void)events;
    ssize_t got = read(state->done_fd, &count, sizeof count);
    (void)got; // none: an earlier turn took it along
    struct bd_background_thread *done = __atomic_exchange_n(&state->done, NULL, __ATOMIC_ACQUIRE);
    while (done) {
        struct bd_background_thread *thread = done;
        done = thread->next;
        thread->next = state->ending;
        state->ending = thread;
        come_back(thread->work);
    }
    join_ending(state, false);
}

static void begin(struct bd_background *work)
{
    struct bd_background_thread *thread = malloc(sizeof *thread);
    BD_ASSERT(thread);
    *thread = (struct bd_background_thread){.loop = work->loop, .work = work};
    work->loop->background.lanes[work->lane].count++;
    if (work->begun) work->begun(work);
    work->has_failed = pthread_create(&thread->thread, NULL, thread_main, thread) != 0;
    if (!work->has_failed) return;
    free(thread);
    come_back(work);
}

static void begin_waiting(struct bd_loop *loop, enum bd_background_lane lane)
{
    struct bd_background **waiting = &loop->background.lanes[lane].waiting;
    const uint32_t *count = &loop->background.lanes[lane].count;
    while (*waiting && *count < loop->serving->limits.imports_at_once) {
        struct bd_background *work = *waiting;
        *waiting = work->next;
        work->is_waiting = false;
        begin(work);
    }
}

void bd_background_start(struct bd_loop *loop, struct bd_background *work)
{
    struct bd_background **last = &loop->background.lanes[work->lane].waiting;
    while (*last) last = &(*last)->next;
    *last = work;
    work->loop = loop;
    work->next = NULL;
    work->is_waiting = true;
    begin_waiting(loop, work->lane);
}

bool bd_background_drop(struct bd_background *work)
{
    if (!work->is_waiting) return false;
    struct bd_background **at = &work->loop->background.lanes[work->lane].waiting;
    while (*at != work) at = &(*at)->next;
    *at = work->next;
    work->is_waiting = false;
    return true;
}

// --- with the loop ---------------------------------------------------------------------------

void bd_background_begin(struct bd_loop *loop)
{
    struct bd_background_state *state = &loop->background;
    state->done_fd = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
    BD_ASSERT_CMP(state->done_fd, >=, 0);
    uv_poll_init(&loop->uv, &state->done_poll, state->done_fd);
    state->done_poll.data = loop;
    uv_poll_start(&state->done_poll, UV_READABLE, on_done);
}

void bd_background_close(struct bd_loop *loop)
{
    for (int lane = 0; lane < BD_BACKGROUND_LANES; lane++)
        BD_ASSERT_CMP(loop->background.lanes[lane].count, ==, 0);
    uv_close((uv_handle_t *)&loop->background.done_poll, NULL);
}

void bd_background_finish(struct bd_loop *loop)
{
    join_ending(&loop->background, true);
    close(loop->background.done_fd);
}
