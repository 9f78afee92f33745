// How the acceleration structure is built: on a thread of its own, and Embree's, while the render
// thread gives others their turn; of what the memo has of the same scene, where it has any.

#include <pthread.h>
#include <stdatomic.h>
#include <time.h>

#include "base/assert.h"
#include "frame/stages.h"

#define TURN_MS 2

struct building {
    struct bd_scene *scene;
    const struct bd_rays *earlier; // NULL: none is followed
    struct bd_rays *rays;
    struct bd_fault fault;
    enum bd_err err;
    _Atomic bool stops;
    pthread_mutex_t mutex;
    pthread_cond_t ended;
    bool has_ended;
};

// From Embree's threads.
static bool should_stop(void *user)
{
    return atomic_load(&((struct building *)user)->stops);
}

static void *build(void *user)
{
    struct building *building = user;
    const struct bd_rays_build how = {
        .repeated_max = BD_RAYS_REPEATED_MAX, .should_stop = should_stop, .user = building};
    building->err = building->earlier
                        ? bd_rays_follow(building->earlier, building->scene, &how, &building->rays,
                                         &building->fault)
                        : bd_rays_create(building->scene, &how, &building->rays, &building->fault);
    pthread_mutex_lock(&building->mutex);
    building->has_ended = true;
    pthread_cond_signal(&building->ended);
    pthread_mutex_unlock(&building->mutex);
    return NULL;
}

// Waits as long as a turn is; true when it has ended.
static bool wait_a_turn(struct building *building)
{
    struct timespec until;
    clock_gettime(CLOCK_REALTIME, &until);
    until.tv_nsec += TURN_MS * 1000000;
    until.tv_sec += until.tv_nsec / 1000000000;
    until.tv_nsec %= 1000000000;
    pthread_mutex_lock(&building->mutex);
    if (!building->has_ended)
        pthread_cond_timedwait(&building->ended, &building->mutex, &until);
    const bool has_ended = building->has_ended;
    pthread_mutex_unlock(&building->mutex);
    return has_ended;
}

// What stops the frame stops the building.
static enum bd_err wait_for(struct building *building, struct bd_slicer *slicer)
{
    enum bd_err err = BD_ERR_OK;
    while (!wait_a_turn(building)) {
        if (!err) err = bd_slicer_pause(slicer);
        if (err) atomic_store(&building->stops, true);
    }
    return err;
}

static bool could_be_followed(const void *output, void *scene)
{
    return bd_rays_could_follow(output, scene);
}

enum bd_err bd_run_rays(struct bd_frame *frame, struct bd_frame_light *light)
{
    (void)light;
    struct building building = {.scene = frame->snapshot,
                                .mutex = PTHREAD_MUTEX_INITIALIZER,
                                .ended = PTHREAD_COND_INITIALIZER};
    uint64_t earlier_key = 0;
    pthread_t thread;
    if (!frame->anew)
        building.earlier = bd_memo_find_fitting(frame->renderer->memo, bd_destroy_rays,
                                                could_be_followed, frame->snapshot, &earlier_key);
    if (!frame->renderer->pool) frame->renderer->pool = bd_pool_create(0);
    bd_slicer_work(frame->context.slicer, "bvh");
    if (pthread_create(&thread, NULL, build, &building))
        return bd_fault_set(frame->fault, BD_ERR_NO_MEMORY, "rays", "no thread to build on");
    enum bd_err err = wait_for(&building, frame->context.slicer);
    pthread_join(thread, NULL);
    if (!err && building.err) {
        *frame->fault = building.fault;
        err = building.err;
    }
    if (err) bd_rays_destroy(&building.rays);
    if (!err && building.earlier && bd_rays_share(building.rays, building.earlier))
        frame->rests_on = earlier_key;
    frame->rays = building.rays;
    return err;
}
