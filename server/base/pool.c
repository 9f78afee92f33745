#include "base/pool.h"

#include <pthread.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdlib.h>
#include <unistd.h>

#include "base/assert.h"

struct bd_pool {
    pthread_mutex_t mutex;
    pthread_cond_t begun, ended;
    uint64_t loop;    // counts loops: a thread waits for the next
    uint32_t working; // threads that have not ended this loop
    bool closing;
    // Of the loop; set before it begins.
    uint32_t count;
    void (*work)(void *user, uint32_t i);
    void *user;
    _Atomic uint32_t next;
    uint32_t helper_count;
    pthread_t *helpers;
};

// The next item; false after the last.
static bool take(struct bd_pool *pool, uint32_t *i)
{
    uint32_t next = atomic_load_explicit(&pool->next, memory_order_relaxed);
    do {
        if (next >= pool->count) return false;
    } while (!atomic_compare_exchange_weak_explicit(&pool->next, &next, next + 1,
                                                    memory_order_relaxed, memory_order_relaxed));
    *i = next;
    return true;
}

static void *help(void *argument)
{
    struct bd_pool *pool = argument;
    uint64_t seen = 0;
    pthread_mutex_lock(&pool->mutex);
    for (;;) {
        while (pool->loop == seen && !pool->closing) pthread_cond_wait(&pool->begun, &pool->mutex);
        if (pool->closing) break;
        seen = pool->loop;
        pthread_mutex_unlock(&pool->mutex);
        for (uint32_t i; take(pool, &i);) pool->work(pool->user, i);
        pthread_mutex_lock(&pool->mutex);
        if (--pool->working == 0) pthread_cond_signal(&pool->ended);
    }
    pthread_mutex_unlock(&pool->mutex);
    return NULL;
}

static uint32_t threads_of_machine(void)
{
    long count = sysconf(_SC_NPROCESSORS_ONLN);
    return count > 0 ? (uint32_t)count : 1;
}

// A machine that refuses a thread gets a smaller pool.
struct bd_pool *bd_pool_create(uint32_t thread_count)
{
    struct bd_pool *pool = calloc(1, sizeof *pool);
    BD_ASSERT(pool);
    if (thread_count == 0) thread_count = threads_of_machine();
    pool->helpers = calloc(thread_count, sizeof *pool->helpers);
    BD_ASSERT(pool->helpers);
    pthread_mutex_init(&pool->mutex, NULL);
    pthread_cond_init(&pool->begun, NULL);
    pthread_cond_init(&pool->ended, NULL);
    while (pool->helper_count < thread_count - 1 &&
           pthread_create(&pool->helpers[pool->helper_count], NULL, help, pool) == 0)
        pool->helper_count++;
    return pool;
}

void bd_pool_destroy(struct bd_pool **pool)
{
    struct bd_pool *p = *pool;
    if (!p) return;
    pthread_mutex_lock(&p->mutex);
    p->closing = true;
    pthread_cond_broadcast(&p->begun);
    pthread_mutex_unlock(&p->mutex);
    for (uint32_t i = 0; i < p->helper_count; i++) pthread_join(p->helpers[i], NULL);
    pthread_cond_destroy(&p->ended);
    pthread_cond_destroy(&p->begun);
    pthread_mutex_destroy(&p->mutex);
    free(p->helpers);
    free(p);
    *pool = NULL;
}

uint32_t bd_pool_thread_count(const struct bd_pool *pool)
{
    return pool->helper_count + 1;
}

static void begin(struct bd_pool *pool)
{
    pthread_mutex_lock(&pool->mutex);
    pool->loop++;
    pool->working = pool->helper_count;
    pthread_cond_broadcast(&pool->begun);
    pthread_mutex_unlock(&pool->mutex);
}

static void wait_for_helpers(struct bd_pool *pool)
{
    pthread_mutex_lock(&pool->mutex);
    while (pool->working > 0) pthread_cond_wait(&pool->ended, &pool->mutex);
    pthread_mutex_unlock(&pool->mutex);
}

enum bd_err bd_pool_run(struct bd_pool *pool, uint32_t count, void (*work)(void *user, uint32_t i),
                        enum bd_err (*should_stop)(void *user), void *user)
{
    enum bd_err err = BD_ERR_OK;
    pool->count = count;
    pool->work = work;
    pool->user = user;
    atomic_store_explicit(&pool->next, 0, memory_order_relaxed);
    begin(pool);
    for (uint32_t i;;) {
        if (should_stop && (err = should_stop(user)) != BD_ERR_OK) break;
        if (!take(pool, &i)) break;
        work(user, i);
    }
    // No further items for anyone.
    if (err) atomic_store_explicit(&pool->next, count, memory_order_relaxed);
    wait_for_helpers(pool);
    return err;
}
