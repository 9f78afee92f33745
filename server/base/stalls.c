#include "base/stalls.h"

const double bd_stalls_bucket_s[] = {.001, .002, .005, .01, .02, .05, .1, .2, .5, 1};

static uint64_t window_of(uint64_t now_ns)
{
    return now_ns / (BD_STALLS_WINDOW_S * 1000000000ull);
}

static void begin_window(struct bd_stalls *stalls, uint64_t window)
{
    if (window == stalls->window) return;
    stalls->longest_s[1] = window == stalls->window + 1 ? stalls->longest_s[0] : 0;
    stalls->longest_s[0] = 0;
    stalls->window = window;
}

void bd_stalls_add(struct bd_stalls *stalls, uint64_t now_ns, uint64_t stall_ns)
{
    double stall_s = (double)stall_ns * 1e-9;
    int bucket = 0;
    while (bucket < BD_STALLS_BUCKET_COUNT && stall_s > bd_stalls_bucket_s[bucket]) bucket++;
    stalls->counts[bucket]++;
    stalls->total_s += stall_s;
    begin_window(stalls, window_of(now_ns));
    if (stall_s > stalls->longest_s[0]) stalls->longest_s[0] = stall_s;
}

double bd_stalls_longest_s(const struct bd_stalls *stalls, uint64_t now_ns)
{
    struct bd_stalls now = *stalls;
    begin_window(&now, window_of(now_ns));
    return now.longest_s[0] > now.longest_s[1] ? now.longest_s[0] : now.longest_s[1];
}
