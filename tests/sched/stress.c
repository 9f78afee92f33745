// The scheduler under load, with a fake device (fake_frame.h): several threads submit, cancel, wait
// for, look at and let go of frames, checks, refinements and references, of several priorities and
// owners, with and without deadlines; the device is lost now and then; and every second time the
// scheduler ends in the middle of it.
//
// BD_STRESS_SECONDS (2) and BD_STRESS_SEED (1) in the environment say how long and how.
//
// What has to hold: `done` is called exactly once for each job that was let in; a job ends well
// with the layers that were asked for and the pixels of its own seed, or in an error that somebody
// asked for or the device caused, with none; the figures add up; nothing holds a snapshot
// afterwards.

#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "base/assert.h"
#include "base/clock.h"
#include "base/hash.h"
#include "base/log.h"
#include "fake_frame.h"
#include "sched/sched.h"
#include "world.h"

#define CLIENTS     5
#define SCENES      6 // more than the reference's runner keeps
#define HELD_MAX    12
#define SIDE        16
#define ROUND_MS    150
#define PATIENCE_MS 60000

struct ticket {
    struct bd_job_request request;
    struct bd_job *job; // NULL once it was let go
    bool was_cancelled;
    atomic_uint done_count;
    enum bd_err err; // at `done`
    struct ticket *next;
};

struct client {
    pthread_t thread;
    struct bd_sched *sched;
    uint64_t random, until_ns;
    struct ticket *tickets; // newest first
    struct ticket *held[HELD_MAX];
    uint32_t held_count, refused_count;
};

static struct bd_scene *scenes[SCENES];
static struct {
    uint32_t rounds, jobs, refused, errs[BD_ERR_COUNT], checked, traced;
} seen;

static uint32_t pick(uint64_t *random, uint32_t count)
{
    *random = bd_hash64(random, sizeof *random, 1);
    return (uint32_t)(*random % count);
}

static void sleep_ms(long ms)
{
    const struct timespec time = {ms / 1000, ms % 1000 * 1000000};
    nanosleep(&time, NULL);
}

// --- what is asked for ----------------------------------------------------------------------

static void set(struct bd_frame_request *frame, const char *technique, const char *setting)
{
    struct bd_err_detail detail = {0};
    snprintf(frame->technique, sizeof frame->technique, "%s", technique);
    enum bd_err err = setting ? bd_param_list_add(&frame->params, setting, &detail) : BD_ERR_OK;
    BD_ASSERT_CMP(err, ==, BD_ERR_OK);
}

static struct bd_frame_request choose_frame(uint64_t *random)
{
    struct bd_frame_request frame = bd_frame_request_default;
    frame.width_px = frame.height_px = SIDE;
    frame.seed = pick(random, UINT32_MAX);
    if (pick(random, 4) == 0) frame.deadline_ms = 1 + pick(random, 12);
    if (pick(random, 3) == 0) frame.layers |= 1u << BD_LAYER_NORMAL;
    switch (pick(random, 16)) {
    case 0:
        set(&frame, "reference", "spp=2");
        break;
    case 1:
    case 2:
        set(&frame, "direct", NULL);
        frame.check_pixels = 16 + pick(random, 32);
        break;
    case 3:
        set(&frame, "rsm", NULL);
        frame.check_pixels = 16;
        frame.target_error = pick(random, 2) ? 0.01 : 10; // not to be reached, and at once
        break;
    default:
        set(&frame, "rsm", NULL);
        break;
    }
    return frame;
}

// --- a client -------------------------------------------------------------------------------

static void on_done(void *user, struct bd_job *job)
{
    struct ticket *ticket = user;
    ticket->err = bd_job_result(job)->err;
    atomic_fetch_add(&ticket->done_count, 1);
}

static bool is_own_picture(const struct bd_image *image, uint64_t seed, uint32_t layer)
{
    const float value = fake_frame_value(seed, (enum bd_layer)layer);
    const uint32_t count = SIDE * SIDE * image->channel_count;
    if (image->width_px != SIDE || image->height_px != SIDE) return false;
    for (uint32_t i = 0; i < count; i++)
        if (memcmp(&image->pixels[i], &value, sizeof value) != 0) return false;
    return true;
}

static void check_layers(const struct ticket *ticket)
{
    const struct bd_frame_request *frame = &ticket->request.frame;
    const struct bd_job_result *result = bd_job_result(ticket->job);
    const bool stands = result->err == BD_ERR_OK;
    for (uint32_t l = 0; l < BD_LAYER_COUNT; l++) {
        const struct bd_image *image = result->layers[l];
        bool is_asked = l == BD_LAYER_BEAUTY || frame->layers >> l & 1;
        BD_ASSERT_CMP(image != NULL, ==, stands && is_asked);
        if (image && !bd_frame_request_is_traced(frame))
            BD_ASSERT(is_own_picture(image, frame->seed, l));
    }
}

static void check_stopped(const struct ticket *ticket)
{
    const struct bd_job_result *result = bd_job_result(ticket->job);
    const bool has_deadline = ticket->request.frame.deadline_ms > 0;
    const enum bd_stopped stopped = result->report.stopped;
    BD_ASSERT_CMP(stopped == BD_STOPPED_CANCELLED, ==, result->err == BD_ERR_CANCELLED);
    BD_ASSERT(stopped != BD_STOPPED_DEADLINE || has_deadline);
    if (result->err == BD_ERR_DEADLINE) BD_ASSERT_CMP(stopped, ==, BD_STOPPED_DEADLINE);
}

// Of a job that has ended; `is_stopping`: the scheduler may have ended it.
static void check_result(const struct ticket *ticket, bool is_stopping)
{
    const struct bd_job_result *result = bd_job_result(ticket->job);
    switch (result->err) {
    case BD_ERR_OK:
        BD_ASSERT_CMP(result->report.seed, ==, ticket->request.frame.seed);
        break;
    case BD_ERR_CANCELLED:
        BD_ASSERT(ticket->was_cancelled || is_stopping);
        break;
    case BD_ERR_DEADLINE:
        BD_ASSERT(ticket->request.frame.deadline_ms > 0);
        break;
    case BD_ERR_BUSY: // the checks' queue
        BD_ASSERT(bd_frame_request_is_checked(&ticket->request.frame));
        break;
    default: // twice, or so that it stuck
        BD_ASSERT(result->err == BD_ERR_DEVICE_LOST || result->err == BD_ERR_INTERNAL);
        break;
    }
    if (result->err) BD_ASSERT(result->detail.err == result->err && result->detail.message[0]);
    check_layers(ticket);
    check_stopped(ticket);
}

static struct ticket *take_held(struct client *client)
{
    uint32_t i = pick(&client->random, client->held_count);
    struct ticket *ticket = client->held[i];
    client->held[i] = client->held[--client->held_count];
    return ticket;
}

static void settle(struct client *client)
{
    if (client->held_count == 0) return;
    struct ticket *ticket = take_held(client);
    bd_job_wait(ticket->job);
    check_result(ticket, false);
    bd_job_release(&ticket->job);
}

static void let_go(struct client *client)
{
    if (client->held_count == 0) return;
    bd_job_release(&take_held(client)->job);
}

static void submit(struct client *client)
{
    static const int priorities[] = {0, 5, 10, 10, 20};
    if (client->held_count == HELD_MAX) settle(client);
    struct ticket *ticket = calloc(1, sizeof *ticket);
    BD_ASSERT(ticket);
    ticket->request = (struct bd_job_request){.scene = scenes[pick(&client->random, SCENES)],
                                              .frame = choose_frame(&client->random),
                                              .priority = priorities[pick(&client->random, 5)],
                                              .turn = pick(&client->random, 3),
                                              .done = on_done,
                                              .user = ticket};
    struct bd_err_detail detail = {0};
    enum bd_err err = bd_sched_submit(client->sched, &ticket->request, &ticket->job, &detail);
    if (err) {
        BD_ASSERT_CMP(err, ==, BD_ERR_BUSY);
        client->refused_count++;
        free(ticket);
        return;
    }
    ticket->next = client->tickets;
    client->tickets = ticket;
    client->held[client->held_count++] = ticket;
}

static void cancel(struct client *client)
{
    if (client->held_count == 0) return;
    struct ticket *ticket = client->held[pick(&client->random, client->held_count)];
    ticket->was_cancelled = true;
    bd_job_cancel(ticket->job);
}

static void look(struct client *client)
{
    struct bd_sched_stats stats;
    bd_sched_stats(client->sched, &stats);
    BD_ASSERT(strcmp(stats.device_name, "fake") == 0);
    for (uint32_t i = 0; i < client->held_count; i++) {
        double share = bd_job_progress(client->held[i]->job);
        const char *stage = bd_job_stage(client->held[i]->job);
        BD_ASSERT(share >= 0 && share <= 1);
        BD_ASSERT(strcmp(stage, "render") == 0 || strcmp(stage, "check") == 0);
    }
}

static void act(struct client *client)
{
    switch (pick(&client->random, 12)) {
    case 0:
    case 1:
        settle(client);
        break;
    case 2:
        cancel(client);
        break;
    case 3:
        let_go(client);
        break;
    case 4:
        look(client);
        break;
    case 5:
        sleep_ms(1);
        break;
    default:
        submit(client);
        break;
    }
}

static void *run_client(void *user)
{
    struct client *client = user;
    while (bd_clock_ns() < client->until_ns) act(client);
    return NULL;
}

// --- a round --------------------------------------------------------------------------------

static uint32_t count_jobs(const struct client *clients, uint32_t done_count)
{
    uint32_t count = 0;
    for (uint32_t c = 0; c < CLIENTS; c++)
        for (const struct ticket *t = clients[c].tickets; t; t = t->next)
            count += atomic_load(&t->done_count) >= done_count;
    return count;
}

static void wait_for_all(const struct client *clients)
{
    const uint64_t start_ns = bd_clock_ns();
    const uint32_t count = count_jobs(clients, 0);
    while (count_jobs(clients, 1) < count) {
        BD_ASSERT(bd_ms_since(start_ns) < PATIENCE_MS);
        sleep_ms(1);
    }
}

static void check_stats(struct bd_sched *sched, const struct client *clients)
{
    struct bd_sched_stats stats;
    bd_sched_stats(sched, &stats);
    const uint64_t ended = stats.jobs_done + stats.jobs_cancelled + stats.jobs_failed;
    BD_ASSERT_CMP(ended, ==, count_jobs(clients, 0));
    BD_ASSERT_CMP(stats.jobs_waiting, ==, 0);
    BD_ASSERT_CMP(stats.jobs_running, ==, 0);
    BD_ASSERT(stats.device_ok);
}

static void count_ticket(const struct ticket *ticket)
{
    BD_ASSERT_CMP(atomic_load(&ticket->done_count), ==, 1);
    seen.jobs++;
    seen.errs[ticket->err]++;
    if (ticket->err) return;
    seen.checked += bd_frame_request_is_checked(&ticket->request.frame);
    seen.traced += bd_frame_request_is_traced(&ticket->request.frame);
}

static void finish_client(struct client *client, bool is_stopping)
{
    while (client->tickets) {
        struct ticket *ticket = client->tickets;
        client->tickets = ticket->next;
        count_ticket(ticket);
        if (ticket->job) check_result(ticket, is_stopping);
        bd_job_release(&ticket->job);
        free(ticket);
    }
    seen.refused += client->refused_count;
}

static void run_round(uint64_t seed)
{
    struct client clients[CLIENTS] = {0};
    const bool ends_in_the_middle = seen.rounds++ % 2 == 1;
    const struct bd_sched_options options = {
        .device = "fake",
        .queue_length_max = 1 + pick(&seed, 12),
        .reference_threads = 2,
        .frame_limits = {.side_px_max = SIDE, .pixel_count_max = SIDE * SIDE}};
    struct bd_sched *sched;
    struct bd_err_detail detail = {0};
    enum bd_err err = bd_sched_create(&options, &sched, &detail);
    BD_ASSERT_CMP(err, ==, BD_ERR_OK);
    for (uint32_t c = 0; c < CLIENTS; c++) {
        clients[c].sched = sched;
        clients[c].random = bd_hash64(&c, sizeof c, seed);
        clients[c].until_ns = bd_clock_ns() + ROUND_MS * UINT64_C(1000000);
        BD_ASSERT(pthread_create(&clients[c].thread, NULL, run_client, &clients[c]) == 0);
    }
    for (uint32_t c = 0; c < CLIENTS; c++) pthread_join(clients[c].thread, NULL);
    if (!ends_in_the_middle) {
        wait_for_all(clients);
        check_stats(sched, clients);
    }
    bd_sched_destroy(&sched);
    for (uint32_t c = 0; c < CLIENTS; c++) finish_client(&clients[c], ends_in_the_middle);
    for (uint32_t s = 0; s < SCENES; s++) BD_ASSERT_CMP(scenes[s]->reference_count, ==, 1);
}

// --- the whole ------------------------------------------------------------------------------

// A closed room with a lamp. Its hash is made up: it is what tells snapshots apart.
static struct bd_scene *create_scene(uint8_t id)
{
    struct world builder = {.scene = bd_scene_create()};
    const double origin[3] = {0, 0, 0}, down[3] = {0, -1, 0}, eye[3] = {.5, .5, .9};
    world_add_box_room(&builder, world_add_material(&builder, 0.5f), origin, 1 + 0.1 * id);
    world_add_light(&builder, BD_LIGHT_POINT, origin, down, 1);
    world_add_camera(&builder, eye, origin, 1.2);
    struct bd_err_detail detail = {0};
    enum bd_err err = bd_scene_finish(builder.scene, &detail);
    BD_ASSERT_CMP(err, ==, BD_ERR_OK);
    builder.scene->content_sha256[0] = id + 1;
    return builder.scene;
}

// Otherwise the run has shown less than it says.
static bool is_varied(void)
{
    return seen.rounds >= 2 && seen.refused > 0 && seen.errs[BD_ERR_OK] > 0 &&
           seen.errs[BD_ERR_CANCELLED] > 0 && seen.errs[BD_ERR_DEADLINE] > 0 &&
           seen.errs[BD_ERR_BUSY] > 0 && fake_frame_counts().devices_lost > 0 && seen.checked > 0 &&
           seen.traced > 0;
}

static double setting(const char *name, double usual)
{
    const char *text = getenv(name);
    return text ? atof(text) : usual;
}

int main(void)
{
    const double seconds = setting("BD_STRESS_SECONDS", 2);
    const uint64_t seed = (uint64_t)setting("BD_STRESS_SEED", 1);
    printf("BD_STRESS_SECONDS=%g BD_STRESS_SEED=%llu\n", seconds, (unsigned long long)seed);
    fflush(stdout);
    // Lost devices are what is meant to happen here.
    bd_log_setup(BD_LOG_ERROR, false);
    for (uint8_t s = 0; s < SCENES; s++) scenes[s] = create_scene(s);
    const uint64_t start_ns = bd_clock_ns();
    while (bd_ms_since(start_ns) < 1e3 * seconds || !is_varied())
        run_round(bd_hash64(&seen.rounds, sizeof seen.rounds, seed));
    for (uint8_t s = 0; s < SCENES; s++) bd_scene_release(&scenes[s]);
    const struct fake_frame_counts frames = fake_frame_counts();
    printf("%u rounds, %u jobs: %u done, of these %u checked and %u traced; %u cancelled, %u late, "
           "%u not checked\n",
           seen.rounds, seen.jobs, seen.errs[BD_ERR_OK], seen.checked, seen.traced,
           seen.errs[BD_ERR_CANCELLED], seen.errs[BD_ERR_DEADLINE], seen.errs[BD_ERR_BUSY]);
    printf("%u refused; %u frames begun, %u of them stopped, %u devices lost\n", seen.refused,
           frames.begun, frames.stopped, frames.devices_lost);
    return 0;
}
