#include "net/command/scene_change.h"

#include <stdlib.h>

#include "base/assert.h"
#include "net/command/command_rights.h"
#include "net/command/edit_end.h"
#include "net/commit/commit.h"

static void on_scene_added(struct bd_commit_waiter *waiter, const struct bd_batch *batch,
                           enum bd_err err, const struct bd_fault *fault)
{
    struct bd_edit_work *work = (struct bd_edit_work *)waiter;
    struct bd_command *command = work->command;
    const struct bd_store_entry *entry;
    if (err) command->fault = *fault;
    if (!err)
        err = bd_store_get(command->loop->serving->store, batch->scene_id, &entry, &command->fault);
    command->err = err;
    // A cancel comes too late: the scene is there.
    if (err) {
        bd_command_end_fault(command);
        return;
    }
    struct bd_answer answer = bd_answer_scene(entry);
    bd_command_end(command, &answer);
}

static struct bd_edit_work *work_of_scene(struct bd_command *command)
{
    struct bd_edit_work *work = calloc(1, sizeof *work);
    BD_ASSERT(work);
    work->command = command;
    command->edit = work;
    return work;
}

void bd_command_scene_add(struct bd_command *command, const char *name)
{
    struct bd_batch *batch;
    command->err = bd_command_check_new_scene(command, name, &command->fault);
    if (bd_command_stop_here(command)) return;
    command->err = bd_store_stage_add_at(
        command->loop->serving->store, command->scene, name, command->grant->name,
        command->revision ? command->revision : 1, &batch, &command->fault);
    if (bd_command_stop_here(command)) return;
    if (command->time_ms) batch->time_ms = command->time_ms;
    struct bd_edit_work *work = work_of_scene(command);
    work->waiter.done = on_scene_added;
    batch->user = &work->waiter;
    bd_commit_soon(command->commands->commits);
}

void bd_command_scene_remove(struct bd_command *command)
{
    const char *id = command->envelope->scene_remove->id;
    struct bd_batch *batch;
    command->err =
        bd_store_stage_remove(command->loop->serving->store, id ? id : "", &batch, &command->fault);
    if (bd_command_stop_here(command)) return;
    bd_edit_wait_for_disk(work_of_scene(command), batch, bd_answer_done());
}
