// A fixed amount of work, which nothing else in this project can make more or less: how fast the
// machine is today. Prints the milliseconds of the quickest of some runs.
//
// Two threads, as wide as any processor of its kind can: sums of what falls off with the square of
// the distance, which is what gathering does, and every now and then a walk through more memory
// than caches hold. deploy/machine_speed.py says what is made of it.

#include <pthread.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#define RUNS        3
#define THREADS     2
#define ROUNDS      48
#define RECEIVERS   6144 // of a round, four side by side
#define SENDERS     1024
#define WALKED      (4u << 20) // floats of a thread: 16 MiB
#define SENDER_STEP 0.001f

// Written out, so that every compiler makes the same of it, at any optimisation.
typedef float vec4 __attribute__((vector_size(16)));

struct work {
    float *walked;
    vec4 sum;
};

static vec4 all(float value)
{
    return (vec4){value, value, value, value};
}

static vec4 gather(vec4 x, vec4 y, vec4 z)
{
    vec4 sum = all(0);
    for (int i = 0; i < SENDERS; i++) {
        const float along = SENDER_STEP * (float)i;
        const vec4 dx = all(along) - x, dy = all(1 - along) - y, dz = all(2) - z;
        const vec4 square = dx * dx + dy * dy + dz * dz;
        sum += dz * (dz + dy) / (square * square);
    }
    return sum;
}

static vec4 walk(float *floats)
{
    vec4 sum = all(0);
    for (size_t i = 0; i < WALKED; i += 4) {
        vec4 *at = (vec4 *)(floats + i);
        *at = *at * all(0.5f) + all(1);
        sum += *at;
    }
    return sum;
}

static void *run(void *argument)
{
    struct work *work = argument;
    const vec4 apart = {0, 0.25f, 0.5f, 0.75f};
    for (int round = 0; round < ROUNDS; round++) {
        for (int i = 0; i < RECEIVERS; i++) {
            const float place = (float)i / RECEIVERS;
            work->sum += gather(apart + all(place), apart * all(place), all(place));
        }
        work->sum += walk(work->walked);
    }
    return NULL;
}

static double now_ms(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec * 1e3 + (double)now.tv_nsec * 1e-6;
}

static double run_ms(struct work work[THREADS])
{
    pthread_t threads[THREADS];
    const double start_ms = now_ms();
    for (int i = 0; i < THREADS; i++)
        if (pthread_create(&threads[i], NULL, run, &work[i])) abort();
    for (int i = 0; i < THREADS; i++) pthread_join(threads[i], NULL);
    return now_ms() - start_ms;
}

int main(void)
{
    static struct work work[THREADS];
    for (int i = 0; i < THREADS; i++) {
        work[i].walked = aligned_alloc(64, WALKED * sizeof(float));
        if (!work[i].walked) abort();
        for (size_t j = 0; j < WALKED; j++) work[i].walked[j] = 0;
    }
    double least_ms = run_ms(work);
    for (int i = 1; i < RUNS; i++) {
        const double ms = run_ms(work);
        if (ms < least_ms) least_ms = ms;
    }
    // So that none of it is for nothing.
    const vec4 sum = work[0].sum + work[1].sum;
    fprintf(stderr, "sum %g\n", (double)(sum[0] + sum[1] + sum[2] + sum[3]));
    printf("%.1f\n", least_ms);
    for (int i = 0; i < THREADS; i++) free(work[i].walked);
    return 0;
}
