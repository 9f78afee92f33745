#include "net/loop/heartbeat.h"

#include "base/clock.h"

#define BEAT_NS (BD_HEARTBEAT_MS * 1000000ull)

static uint64_t processor_ns(void)
{
    struct timespec time;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
    return (uint64_t)time.tv_sec * 1000000000u + (uint64_t)time.tv_nsec;
}

static void on_beat(uv_timer_t *timer)
{
    struct bd_heartbeat *heart = timer->data;
    uint64_t now_ns = bd_clock_ns(), worked_ns = processor_ns();
    bd_stalls_add(&heart->work, now_ns, worked_ns - heart->worked_ns);
    heart->worked_ns = worked_ns;
    bd_stalls_add(&heart->stalls, now_ns, now_ns > heart->due_ns ? now_ns - heart->due_ns : 0);
    heart->due_ns = now_ns + BEAT_NS;
    // Not by repeat: after a long stall that would be due at once, by the time before it.
    uv_update_time(timer->loop);
    uv_timer_start(timer, on_beat, BD_HEARTBEAT_MS, 0);
}

void bd_heartbeat_init(struct bd_heartbeat *heart, uv_loop_t *loop)
{
    uv_timer_init(loop, &heart->timer);
    heart->timer.data = heart;
}

void bd_heartbeat_set(struct bd_heartbeat *heart, bool beats)
{
    if (beats == (bool)uv_is_active((const uv_handle_t *)&heart->timer)) return;
    if (!beats) {
        uv_timer_stop(&heart->timer);
        return;
    }
    uv_update_time(heart->timer.loop);
    heart->due_ns = bd_clock_ns() + BEAT_NS;
    heart->worked_ns = processor_ns();
    uv_timer_start(&heart->timer, on_beat, BD_HEARTBEAT_MS, 0);
}

void bd_heartbeat_close(struct bd_heartbeat *heart)
{
    uv_close((uv_handle_t *)&heart->timer, NULL);
}
