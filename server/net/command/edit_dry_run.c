// A batch that is only tried: what it would make of the scene, and what a frame would do again.

#include "net/command/edit_work.h"

#include <stdlib.h>

#include "base/assert.h"
#include "frame/invalidate.h"
#include "net/command/edit_reply.h"

static void list_passes(char ***list, size_t *count, const char *const *passes, uint32_t pass_count)
{
    *list = calloc(pass_count + 1, sizeof **list);
    BD_ASSERT(*list);
    for (uint32_t i = 0; i < pass_count; i++) (*list)[(*count)++] = bd_answer_text(passes[i]);
}

static enum bd_err try(struct bd_command *command, const struct bd_scene *base,
                       const struct bd_delta *delta, struct bd_scene **after,
                       struct bd_invalidation *passes)
{
    struct bd_frame_options options = {0};
    struct bd_fault *fault = &command->fault;
    enum bd_err err = bd_frame_options_read(command->envelope->edit_batch->frame, &options, fault);
    if (!err) err = bd_delta_apply(base, delta, after, fault);
    if (!err) err = bd_invalidate(base, *after, &options.frame, passes, fault);
    return err;
}

void bd_edit_dry_run(struct bd_edit_work *work, const struct bd_scene *base)
{
    struct bd_command *command = work->command;
    struct bd_invalidation passes;
    struct bd_scene *after = NULL;
    command->err = try(command, base, &work->delta, &after, &passes);
    if (!command->err) {
        command->answer = bd_edit_reply_of_trial(after, work);
        Bounced__EditReply *reply = command->answer.envelope->edit_reply;
        list_passes(&reply->invalidates, &reply->n_invalidates, passes.run, passes.run_count);
        list_passes(&reply->keeps, &reply->n_keeps, passes.kept, passes.kept_count);
    }
    bd_scene_release(&after);
}
