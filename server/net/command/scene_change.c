// Requests by which scenes come and go. Each is answered once it is on the disk.

#include "net/command/command_internal.h"
#include "net/command/command_rights.h"

static const char *name_of(const struct bd_command *command)
{
    const Bounced__Envelope *envelope = command->envelope;
    const char *name = command->row->body == BOUNCED__ENVELOPE__BODY_SCENE_ADD
                           ? envelope->scene_add->name
                           : envelope->scene_replay->name;
    return name ? name : "";
}

static void stage_scene(struct bd_command *command)
{
    const char *name = name_of(command);
    command->err = bd_command_check_new_scene(command, name, &command->fault);
    if (!command->err)
        command->err = bd_store_stage_add_at(
            command->loop->serving->store, command->scene, name, command->grant->name,
            command->revision ? command->revision : 1, &command->batch, &command->fault);
    if (!command->err && command->time_ms) command->batch->time_ms = command->time_ms;
}

static void tell_scene(struct bd_command *command)
{
    const struct bd_store_entry *entry;
    command->err =
        bd_store_get(command->loop->serving->store, command->scene_id, &entry, &command->fault);
    if (!command->err) command->answer = bd_answer_scene(entry);
}

static void stage_removal(struct bd_command *command)
{
    const char *id = command->envelope->scene_remove->id;
    command->err = bd_store_stage_remove(command->loop->serving->store, id ? id : "",
                                         &command->batch, &command->fault);
    if (!command->err) command->answer = bd_answer_done();
}

#define STAGE_STEPS                                                                                \
    BD_STEP(LOOP, stage_scene), BD_STEP(DISK, NULL), BD_STEP(LOOP, tell_scene), BD_STEPS_END

const struct bd_step bd_steps_stage_scene[] = {STAGE_STEPS};
const struct bd_step bd_steps_scene_add[] = {
    BD_STEP(LOOP, bd_command_check_files),
    BD_STEP_BACKGROUND(bd_command_import, "import", FILES),
    STAGE_STEPS,
};
const struct bd_step bd_steps_scene_remove[] = {BD_STEP(LOOP, stage_removal), BD_STEP(DISK, NULL),
                                                BD_STEPS_END};
