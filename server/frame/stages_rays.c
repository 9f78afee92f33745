// How the acceleration structure is built: on a thread of its own, and Embree's, while the render
// thread gives others their turn; of what the memo has of the same scene, where it has any. A
// device's is uploaded then; what is not for a device is the processor's.

#include <pthread.h>
#include <stdatomic.h>
#include <time.h>

#include "base/assert.h"
#include "frame/stages.h"

#define TURN_MS 2

struct building {
    struct bd_scene *scene;
    const struct bd_rays *earlier; // NULL: none is followed
    uint64_t device_bytes_max;     // of a buffer; 0: the processor is to be asked
    struct bd_ray_nodes *nodes;    // either
    struct bd_rays *rays;
    struct bd_err_detail detail;
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

static enum bd_err build_either(struct building *building)
{
    const struct bd_rays_build how = {
        .repeated_max = BD_RAYS_REPEATED_MAX, .should_stop = should_stop, .user = building};
    if (building->device_bytes_max > 0) {
        const enum bd_err err = bd_ray_nodes_create(
            building->scene, &how, building->device_bytes_max, &building->nodes, &building->detail);
        if (err != BD_ERR_UNSUPPORTED) return err;
        building->detail = (struct bd_err_detail){0};
    }
    return building->earlier
               ? bd_rays_follow(building->earlier, building->scene, &how, &building->rays,
                                &building->detail)
               : bd_rays_create(building->scene, &how, &building->rays, &building->detail);
}

static void *build(void *user)
{
    struct building *building = user;
    building->err = build_either(building);
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
    if (!building->has_ended) pthread_cond_timedwait(&building->ended, &building->mutex, &until);
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

// Another snapshot's, which the processor is asked.
static bool could_be_followed(const void *output, void *scene)
{
    const struct bd_occluders *occluders = output;
    return occluders->rays && bd_rays_could_follow(occluders->rays, scene);
}

static enum bd_err build_apart(struct bd_frame *frame, struct building *building)
{
    pthread_t thread;
    bd_slicer_work(frame->context.slicer, "bvh");
    if (pthread_create(&thread, NULL, build, building))
        return bd_err_set(frame->detail, BD_ERR_NO_MEMORY, "rays", "no thread to build on");
    enum bd_err err = wait_for(building, frame->context.slicer);
    pthread_join(thread, NULL);
    if (err || !building->err) return err;
    *frame->detail = building->detail;
    return building->err;
}

const struct bd_tracer *bd_stage_tracer(struct bd_frame *frame, uint64_t samples)
{
    if (!bd_plan_traces(frame->plan, samples)) return NULL;
    frame->tracer = (struct bd_tracer){frame->occluders->rays, bd_renderer_pool(frame->renderer)};
    return &frame->tracer;
}

enum bd_err bd_run_rays(struct bd_frame *frame, struct bd_frame_light *light)
{
    (void)light;
    const struct bd_gpu *gpu = frame->renderer->gpu;
    struct building building = {.scene = frame->snapshot,
                                .mutex = PTHREAD_MUTEX_INITIALIZER,
                                .ended = PTHREAD_COND_INITIALIZER};
    const struct bd_occluders *earlier = NULL;
    uint64_t earlier_key = 0;
    if (!bd_plan_asks_processor(frame->plan) &&
        bd_occluders_on_device(gpu, frame->renderer->rays_on))
        building.device_bytes_max = bd_gpu_caps(gpu)->storage_block_max_bytes;
    if (!frame->anew)
        earlier = bd_memo_find_fitting(frame->renderer->memo, bd_stage_rows[BD_STAGE_RAYS].destroy,
                                       could_be_followed, frame->snapshot, &earlier_key);
    if (earlier) building.earlier = earlier->rays;
    bd_renderer_pool(frame->renderer);
    enum bd_err err = build_apart(frame, &building);
    if (!err && building.rays && earlier && bd_rays_share(building.rays, earlier->rays))
        frame->rests_on = earlier_key;
    if (!err && building.nodes)
        err =
            bd_occluders_upload(&frame->context, building.nodes, &frame->occluders, frame->detail);
    else if (!err)
        frame->occluders = bd_occluders_of_rays(&building.rays);
    bd_ray_nodes_destroy(&building.nodes);
    bd_rays_destroy(&building.rays);
    return err;
}
