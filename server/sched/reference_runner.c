#include "sched/reference_runner.h"

#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "base/assert.h"
#include "base/clock.h"
#include "base/hash.h"
#include "base/pool.h"

// Prepared snapshots that are kept: edits make new ones, and a bench walks through several scenes.
#define KEPT_MAX       4
#define KEPT_BYTES_MAX (UINT64_C(2) << 30)

#define TURN_MS 50
#define ASK_MS  20  // how long a wait lasts before should_stop is asked again
#define LATE_MS 200 // a turn begins, while something is more urgent

struct kept {
    struct bd_scene *scene; // NULL: free
    struct bd_reference *reference;
    bool building;
    uint32_t user_count;
    struct bd_reference_memory memory;
    uint64_t used_at;
    struct kept *next;
};

struct bd_reference_runner {
    uint32_t thread_count;

    pthread_mutex_t lock; // of everything below
    pthread_cond_t changed;
    struct lane {
        uint64_t next_ticket, serving; // whose turn the pool is
        struct bd_pool *pool;          // used by whoever's turn it is
    } lanes[BD_RUNNER_LANE_COUNT];
    struct kept *kept;
    uint64_t clock, built_count;

    struct bd_reference_sums *sums; // has a lock of its own
};

struct bd_reference_runner *bd_reference_runner_create(uint32_t thread_count)
{
    struct bd_reference_runner *runner = calloc(1, sizeof *runner);
    BD_ASSERT(runner);
    runner->thread_count = thread_count;
    runner->sums = bd_reference_sums_create();
    pthread_condattr_t monotonic;
    pthread_condattr_init(&monotonic);
    pthread_condattr_setclock(&monotonic, CLOCK_MONOTONIC);
    BD_ASSERT(pthread_mutex_init(&runner->lock, NULL) == 0);
    BD_ASSERT(pthread_cond_init(&runner->changed, &monotonic) == 0);
    pthread_condattr_destroy(&monotonic);
    return runner;
}

static void free_kept(struct kept *kept)
{
    bd_reference_destroy(&kept->reference);
    bd_scene_release(&kept->scene);
    free(kept);
}

void bd_reference_runner_destroy(struct bd_reference_runner **runner)
{
    struct bd_reference_runner *r = *runner;
    *runner = NULL;
    if (!r) return;
    while (r->kept) {
        struct kept *kept = r->kept;
        BD_ASSERT_CMP(kept->user_count, ==, 0);
        r->kept = kept->next;
        free_kept(kept);
    }
    bd_reference_sums_destroy(&r->sums);
    for (int i = 0; i < BD_RUNNER_LANE_COUNT; i++) bd_pool_destroy(&r->lanes[i].pool);
    pthread_mutex_destroy(&r->lock);
    pthread_cond_destroy(&r->changed);
    free(r);
}

struct bd_reference_sums *bd_reference_runner_sums(struct bd_reference_runner *runner)
{
    return runner->sums;
}

// --- waiting, with the lock held ------------------------------------------------------------

static void wait_a_little(struct bd_reference_runner *runner)
{
    struct timespec until;
    clock_gettime(CLOCK_MONOTONIC, &until);
    until.tv_nsec += ASK_MS * 1000000L;
    if (until.tv_nsec >= 1000000000L) {
        until.tv_sec++;
        until.tv_nsec -= 1000000000L;
    }
    pthread_cond_timedwait(&runner->changed, &runner->lock, &until);
}

// Asked without the lock: it may take locks of its own.
static enum bd_err ask(struct bd_reference_runner *runner, bd_reference_should_stop should_stop,
                       void *user)
{
    if (!should_stop) return BD_ERR_OK;
    pthread_mutex_unlock(&runner->lock);
    enum bd_err err = should_stop(user);
    pthread_mutex_lock(&runner->lock);
    return err;
}

// --- prepared snapshots ---------------------------------------------------------------------

// Snapshots built by hand have no hash; they are themselves alone.
static bool is_same(const struct bd_scene *a, const struct bd_scene *b)
{
    static const uint8_t none[BD_SHA256_BYTES] = {0};
    if (a == b) return true;
    return memcmp(a->content_sha256, b->content_sha256, BD_SHA256_BYTES) == 0 &&
           memcmp(a->content_sha256, none, BD_SHA256_BYTES) != 0;
}

static struct kept *find(struct bd_reference_runner *runner, const struct bd_scene *scene)
{
    for (struct kept *kept = runner->kept; kept; kept = kept->next)
        if (is_same(kept->scene, scene)) return kept;
    return NULL;
}

// Whether an earlier one has the same shape, and so counts it.
static bool is_counted(const struct bd_reference_runner *runner, const struct kept *kept)
{
    for (const struct kept *other = runner->kept; other != kept; other = other->next)
        if (other->memory.shape == kept->memory.shape) return true;
    return false;
}

static void totals(const struct bd_reference_runner *runner, uint32_t *count, uint64_t *bytes)
{
    *count = 0;
    *bytes = 0;
    for (const struct kept *kept = runner->kept; kept; kept = kept->next) {
        *count += 1;
        *bytes += kept->memory.own_bytes;
        if (!is_counted(runner, kept)) *bytes += kept->memory.shape_bytes;
    }
}

static struct kept **least_recently_used(struct bd_reference_runner *runner)
{
    struct kept **least = NULL;
    for (struct kept **at = &runner->kept; *at; at = &(*at)->next)
        if (!(*at)->user_count && (!least || (*at)->used_at < (*least)->used_at)) least = at;
    return least;
}

// The one used last stays, whatever its size.
static void evict(struct bd_reference_runner *runner)
{
    uint32_t count;
    uint64_t bytes;
    for (totals(runner, &count, &bytes);
         count > 1 && (count > KEPT_MAX || bytes > KEPT_BYTES_MAX);
         totals(runner, &count, &bytes)) {
        struct kept **at = least_recently_used(runner);
        if (!at) return;
        struct kept *dropped = *at;
        *at = dropped->next;
        free_kept(dropped);
    }
}

static void forget(struct bd_reference_runner *runner, struct kept *gone)
{
    struct kept **at = &runner->kept;
    while (*at != gone) at = &(*at)->next;
    *at = gone->next;
    free_kept(gone);
}

static struct kept *begin(struct bd_reference_runner *runner, struct bd_scene *scene)
{
    struct kept *kept = calloc(1, sizeof *kept);
    BD_ASSERT(kept);
    kept->scene = bd_scene_retain(scene);
    kept->building = true;
    kept->user_count = 1;
    kept->next = runner->kept;
    runner->kept = kept;
    return kept;
}

// From the first one that has its triangles in common; BD_ERR_NOT_FOUND if there is none.
static enum bd_err create_like_kept(struct kept *const like[KEPT_MAX + 1], uint32_t like_count,
                                    struct bd_scene *scene, struct bd_reference **out,
                                    struct bd_err_detail *detail)
{
    enum bd_err err = BD_ERR_NOT_FOUND;
    for (uint32_t i = 0; err == BD_ERR_NOT_FOUND && i < like_count; i++)
        err = bd_reference_create_like(scene, like[i]->reference, out, detail);
    return err;
}

// Those that may be taken from, held until they are let go.
static uint32_t hold_kept(struct bd_reference_runner *runner, struct kept *held[KEPT_MAX + 1])
{
    uint32_t count = 0;
    for (struct kept *kept = runner->kept; kept && count <= KEPT_MAX; kept = kept->next) {
        if (kept->building) continue;
        kept->user_count++;
        held[count++] = kept;
    }
    return count;
}

// With the lock held, which is open while the structures are built: what others may look at
// meanwhile, whoever gives something back among them, changes under it only.
static enum bd_err build(struct bd_reference_runner *runner, struct bd_scene *scene,
                         bd_reference_should_stop should_stop, void *user, struct kept **out,
                         bool *reused, struct bd_err_detail *detail)
{
    struct kept *held[KEPT_MAX + 1];
    const uint32_t held_count = hold_kept(runner, held);
    struct kept *kept = begin(runner, scene);
    struct bd_reference *reference = NULL;
    pthread_mutex_unlock(&runner->lock);
    enum bd_err err = create_like_kept(held, held_count, scene, &reference, detail);
    *reused = err != BD_ERR_NOT_FOUND;
    if (err == BD_ERR_NOT_FOUND)
        err =
            bd_reference_create(scene, runner->thread_count, should_stop, user, &reference, detail);
    pthread_mutex_lock(&runner->lock);
    for (uint32_t i = 0; i < held_count; i++) held[i]->user_count--;
    kept->reference = reference;
    kept->building = false;
    pthread_cond_broadcast(&runner->changed);
    if (err) {
        forget(runner, kept);
        return err;
    }
    kept->memory = bd_reference_memory(kept->reference);
    if (!*reused) runner->built_count++;
    *out = kept;
    return BD_ERR_OK;
}

enum bd_err bd_reference_runner_take(struct bd_reference_runner *runner, struct bd_scene *scene,
                                     bd_reference_should_stop should_stop, void *user,
                                     const struct bd_reference **out, bool *reused,
                                     struct bd_err_detail *detail)
{
    *out = NULL;
    pthread_mutex_lock(&runner->lock);
    enum bd_err err = ask(runner, should_stop, user);
    struct kept *kept = find(runner, scene);
    while (!err && kept && kept->building) {
        wait_a_little(runner);
        err = ask(runner, should_stop, user);
        kept = find(runner, scene); // whoever built it may have failed, or stopped
    }
    *reused = kept != NULL;
    if (!err && kept)
        kept->user_count++;
    else if (!err)
        err = build(runner, scene, should_stop, user, &kept, reused, detail);
    if (!err) {
        kept->used_at = ++runner->clock;
        *out = kept->reference;
        evict(runner);
    }
    pthread_mutex_unlock(&runner->lock);
    return err;
}

void bd_reference_runner_give_back(struct bd_reference_runner *runner,
                                   const struct bd_reference **reference)
{
    if (!*reference) return;
    pthread_mutex_lock(&runner->lock);
    struct kept *kept = runner->kept;
    while (kept && kept->reference != *reference) kept = kept->next;
    BD_ASSERT(kept && kept->user_count > 0);
    kept->user_count--;
    evict(runner);
    pthread_mutex_unlock(&runner->lock);
    *reference = NULL;
}

// --- loops ----------------------------------------------------------------------------------

// A part of the caller's loop: what one turn runs.
struct turn {
    const struct bd_runner_caller *caller;
    struct lane *lane;
    void (*work)(void *user, uint32_t i);
    bd_reference_should_stop should_stop;
    void *user;
    uint32_t first;
};

static void turn_work(void *data, uint32_t i)
{
    const struct turn *turn = data;
    turn->work(turn->user, turn->first + i);
}

static enum bd_err turn_should_stop(void *data)
{
    const struct turn *turn = data;
    return turn->should_stop(turn->user);
}

// Nobody's turn yet: others of the lane get on meanwhile.
static enum bd_err let_urgent_go_first(struct bd_reference_runner *runner, const struct turn *turn)
{
    const struct bd_runner_caller *caller = turn->caller;
    const uint64_t start_ns = bd_clock_ns();
    enum bd_err err = BD_ERR_OK;
    while (!err && caller->is_urgent_elsewhere && bd_ms_since(start_ns) < LATE_MS &&
           caller->is_urgent_elsewhere(caller->of)) {
        pthread_mutex_lock(&runner->lock);
        wait_a_little(runner);
        pthread_mutex_unlock(&runner->lock);
        if (turn->should_stop) err = turn->should_stop(turn->user);
    }
    return err;
}

// Waits for this caller's turn, which it has to end whatever is returned.
static enum bd_err begin_turn(struct bd_reference_runner *runner, const struct turn *turn)
{
    struct lane *lane = turn->lane;
    pthread_mutex_lock(&runner->lock);
    uint64_t ticket = lane->next_ticket++;
    enum bd_err err = BD_ERR_OK;
    while (lane->serving != ticket) {
        // Also once it wants to stop: turns come in order, and are short.
        wait_a_little(runner);
        if (!err) err = ask(runner, turn->should_stop, turn->user);
    }
    if (!lane->pool) lane->pool = bd_pool_create(runner->thread_count);
    pthread_mutex_unlock(&runner->lock);
    return err;
}

static void end_turn(struct bd_reference_runner *runner, struct lane *lane)
{
    pthread_mutex_lock(&runner->lock);
    lane->serving++;
    pthread_cond_broadcast(&runner->changed);
    pthread_mutex_unlock(&runner->lock);
}

// As many items as fill a turn, going by the last one; at most four times as many, since the first
// items may be the quickest.
static uint32_t next_turn_items(uint32_t items, double ms)
{
    double fitting = ms > 0 ? items * (TURN_MS / ms) : 4.0 * items;
    if (fitting > 4.0 * items) fitting = 4.0 * items;
    return fitting < 1 ? 1 : fitting > 1e9 ? 1000000000 : (uint32_t)fitting;
}

enum bd_err bd_reference_runner_loop(struct bd_reference_runner *runner,
                                     const struct bd_runner_caller *caller, uint32_t count,
                                     void (*work)(void *user, uint32_t i),
                                     bd_reference_should_stop should_stop, void *user)
{
    struct turn turn = {caller, &runner->lanes[caller->lane], work, should_stop, user, 0};
    uint32_t items = 64;
    enum bd_err err = BD_ERR_OK;
    while (!err && turn.first < count) {
        uint32_t now = count - turn.first < items ? count - turn.first : items;
        err = let_urgent_go_first(runner, &turn);
        if (err) break;
        err = begin_turn(runner, &turn);
        uint64_t start_ns = bd_clock_ns();
        if (!err)
            err = bd_pool_run(turn.lane->pool, now, turn_work,
                              should_stop ? turn_should_stop : NULL, &turn);
        end_turn(runner, turn.lane);
        turn.first += now;
        items = next_turn_items(now, bd_ms_since(start_ns));
    }
    return err;
}

void bd_reference_runner_stats(struct bd_reference_runner *runner,
                               struct bd_reference_runner_stats *out)
{
    pthread_mutex_lock(&runner->lock);
    *out = (struct bd_reference_runner_stats){.built_count = runner->built_count};
    for (int i = 0; i < BD_RUNNER_LANE_COUNT; i++)
        if (runner->lanes[i].pool) out->thread_count = bd_pool_thread_count(runner->lanes[i].pool);
    totals(runner, &out->reference_count, &out->memory_bytes);
    out->memory_bytes += bd_reference_sums_bytes(runner->sums);
    pthread_mutex_unlock(&runner->lock);
}
