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

static enum bd_err stage_scene(struct bd_command *command)
{
    const char *name = name_of(command);
    enum bd_err err = bd_command_check_new_scene(command, name, &command->steps.fault);
    if (!err)
        err = bd_store_stage_add_at(command->steps.loop->serving->store, command->scene, name,
                                    command->grant->name, command->revision ? command->revision : 1,
                                    &command->place.batch, &command->steps.fault);
    if (!err && command->time_ms) command->place.batch->time_ms = command->time_ms;
    return err;
}

static enum bd_err tell_scene(struct bd_command *command)
{
    const struct bd_store_entry *entry;
    enum bd_err err = bd_store_get(command->steps.loop->serving->store, command->place.scene_id,
                                   &entry, &command->steps.fault);
    if (!err) command->answer = bd_answer_scene(entry);
    return err;
}

static enum bd_err stage_removal(struct bd_command *command)
{
    const char *id = command->envelope->scene_remove->id;
    enum bd_err err = bd_store_stage_remove(command->steps.loop->serving->store, id ? id : "",
                                            &command->place.batch, &command->steps.fault);
    if (!err) command->answer = bd_answer_done();
    return err;
}

#define STAGE_STEPS                                                                                \
    BD_STEP(loop, stage_scene), BD_STEP(disk, NULL), BD_STEP(loop, tell_scene), BD_STEPS_END

const struct bd_step bd_steps_stage_scene[] = {STAGE_STEPS};
const struct bd_step bd_steps_scene_add[] = {
    BD_STEP(loop, bd_command_check_files),
    BD_STEP_BACKGROUND(bd_command_import, "import", FILES),
    STAGE_STEPS,
};
const struct bd_step bd_steps_scene_remove[] = {BD_STEP(loop, stage_removal), BD_STEP(disk, NULL),
                                                BD_STEPS_END};
