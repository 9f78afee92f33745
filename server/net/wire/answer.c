#include "net/wire/answer.h"

#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "base/hash.h"

void bd_answer_finish(struct bd_answer *answer)
{
    if (answer->envelope) bounced__envelope__free_unpacked(answer->envelope, NULL);
    free(answer->payload);
    *answer = (struct bd_answer){0};
}

char *bd_answer_text(const char *text)
{
    char *copy = strdup(text);
    BD_ASSERT(copy);
    return copy;
}

static void *new_message(size_t size)
{
    void *message = malloc(size);
    BD_ASSERT(message);
    return message;
}

#define NEW(name, prefix) Bounced__##name *prefix = new_message(sizeof *prefix);

struct bd_answer bd_answer_of(Bounced__Envelope__BodyCase body_case, void *body)
{
    NEW(Envelope, envelope)
    bounced__envelope__init(envelope);
    envelope->body_case = body_case;
    // All members of the oneof are pointers and lie in one place.
    envelope->error = body;
    return (struct bd_answer){.envelope = envelope};
}

struct bd_answer bd_answer_error(const struct bd_fault *fault)
{
    NEW(Error, error)
    bounced__error__init(error);
    error->code = bd_answer_text(bd_err_name(fault->err));
    error->message = bd_answer_text(fault->message);
    NEW(ErrorDetails, details)
    bounced__error_details__init(details);
    if (fault->field[0]) details->field = bd_answer_text(fault->field);
    error->details = details;
    return bd_answer_of(BOUNCED__ENVELOPE__BODY_ERROR, error);
}

struct bd_answer bd_answer_done(void)
{
    NEW(Done, done)
    bounced__done__init(done);
    return bd_answer_of(BOUNCED__ENVELOPE__BODY_DONE, done);
}

struct bd_answer bd_answer_blob(uint64_t offset, bool complete)
{
    NEW(BlobReply, reply)
    bounced__blob_reply__init(reply);
    BD_SET(reply, offset, offset);
    BD_SET(reply, complete, complete);
    return bd_answer_of(BOUNCED__ENVELOPE__BODY_BLOB_REPLY, reply);
}

static char **text_list(size_t count)
{
    if (count == 0) return NULL;
    char **list = calloc(count, sizeof *list);
    BD_ASSERT(list);
    return list;
}

static char *hash_text(const uint8_t sha256[BD_SHA256_BYTES])
{
    char text[8 + BD_SHA256_HEX] = "sha256:";
    bd_sha256_hex(sha256, text + 7);
    return bd_answer_text(text);
}

// A placed camera or light goes by its own name, or its node's: what `camera=` takes.
static const char *placed_name(const struct bd_scene *scene, const struct bd_placement *placement,
                               const char *own_name)
{
    if (own_name[0] || placement->node == BD_NONE) return own_name;
    return scene->nodes[placement->node].name;
}

static void fill_names(Bounced__Scene *message, const struct bd_scene *scene)
{
    message->cameras = text_list(scene->placed_camera_count);
    for (uint32_t i = 0; i < scene->placed_camera_count; i++) {
        const struct bd_placement *placed = &scene->placed_cameras[i];
        message->cameras[message->n_cameras++] =
            bd_answer_text(placed_name(scene, placed, scene->cameras[placed->object].name));
    }
    message->lights = text_list(scene->placed_light_count);
    for (uint32_t i = 0; i < scene->placed_light_count; i++) {
        const struct bd_placement *placed = &scene->placed_lights[i];
        message->lights[message->n_lights++] =
            bd_answer_text(placed_name(scene, placed, scene->lights[placed->object].name));
    }
    message->flags = text_list(scene->flags.count);
    for (uint32_t i = 0; i < scene->flags.count; i++)
        message->flags[message->n_flags++] = bd_answer_text(scene->flags.text[i]);
}

static void fill_counts(Bounced__Scene *message, const struct bd_scene *scene)
{
    NEW(SceneCounts, counts)
    bounced__scene_counts__init(counts);
    BD_SET(counts, triangles, scene->features.triangle_count);
    const struct bd_scene_counts there = bd_scene_count(scene);
    BD_SET(counts, nodes, there.nodes);
    BD_SET(counts, meshes, there.meshes);
    BD_SET(counts, materials, there.materials);
    BD_SET(counts, textures, there.textures);
    BD_SET(counts, lights, scene->placed_light_count);
    BD_SET(counts, cameras, scene->placed_camera_count);
    message->counts = counts;
}

static double *point_list(bd_dvec3 point)
{
    double *list = malloc(3 * sizeof *list);
    BD_ASSERT(list);
    list[0] = point.x;
    list[1] = point.y;
    list[2] = point.z;
    return list;
}

Bounced__Scene *bd_scene_message(const struct bd_store_entry *entry)
{
    NEW(Scene, message)
    bounced__scene__init(message);
    message->id = bd_answer_text(entry->id);
    message->name = bd_answer_text(entry->name);
    BD_SET(message, revision, entry->revision);
    if (entry->transient) BD_SET(message, transient, entry->transient);
    message->hash = hash_text(entry->scene->content_sha256);
    fill_names(message, entry->scene);
    fill_counts(message, entry->scene);
    message->n_bounds_min = message->n_bounds_max = 3;
    message->bounds_min = point_list(entry->scene->features.bounds_min);
    message->bounds_max = point_list(entry->scene->features.bounds_max);
    return message;
}

struct bd_answer bd_answer_scene(const struct bd_store_entry *entry)
{
    return bd_answer_of(BOUNCED__ENVELOPE__BODY_SCENE, bd_scene_message(entry));
}

Bounced__Device *bd_device_message(const struct bd_sched_stats *stats)
{
    NEW(Device, device)
    bounced__device__init(device);
    device->name = bd_answer_text(stats->device_name);
    device->class_ = bd_answer_text(stats->device_class);
    BD_SET(device, software, stats->software);
    BD_SET(device, in_use, 1);
    BD_SET(device, memory_mib, stats->gpu_memory_limit_mib);
    return device;
}
