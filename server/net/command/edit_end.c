#include "net/command/edit_end.h"

#include "net/commit/commit.h"

void bd_edit_end(struct bd_edit_work *work, struct bd_answer answer)
{
    bd_edit_work_leave(work);
    bd_command_end(work->command, &answer);
}

bool bd_edit_stop_here(struct bd_edit_work *work)
{
    if (!work->command->err && !atomic_load(&work->command->cancelled)) return false;
    bd_edit_work_leave(work);
    return bd_command_stop_here(work->command);
}

static void on_committed(struct bd_commit_waiter *waiter, const struct bd_batch *batch,
                         enum bd_err err, const struct bd_fault *fault)
{
    struct bd_edit_work *work = (struct bd_edit_work *)waiter;
    struct bd_command *command = work->command;
    (void)batch;
    if (err) {
        command->err = err;
        command->fault = *fault;
        bd_command_end_fault(command);
        return;
    }
    struct bd_answer answer = work->answer;
    work->answer = (struct bd_answer){0};
    bd_command_end(command, &answer);
}

void bd_edit_wait_for_disk(struct bd_edit_work *work, struct bd_batch *batch,
                           struct bd_answer answer)
{
    work->answer = answer;
    work->waiter.done = on_committed;
    batch->user = &work->waiter;
    bd_commit_soon(work->command->commands->commits);
    bd_edit_work_leave(work);
}
