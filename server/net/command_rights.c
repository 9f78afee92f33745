#include "net/command_rights.h"

#include <inttypes.h>
#include <string.h>

#include "net/edit_decode.h"

// The role that a request takes; looking is for everybody.
static enum bd_role role_for(const Bounced__Envelope *envelope)
{
    switch ((int)envelope->body_case) {
    case BOUNCED__ENVELOPE__BODY_SCENE_ADD:
    case BOUNCED__ENVELOPE__BODY_SCENE_REMOVE:
    case BOUNCED__ENVELOPE__BODY_EDIT_BATCH:
    case BOUNCED__ENVELOPE__BODY_EDIT_UNDO:
    case BOUNCED__ENVELOPE__BODY_EDIT_REVERT:
    case BOUNCED__ENVELOPE__BODY_EDIT_COMMIT:
    case BOUNCED__ENVELOPE__BODY_REVISION_NAME:
        return BD_ROLE_EDIT;
    case BOUNCED__ENVELOPE__BODY_RENDER:
        // A file of one's own is a scene for as long as it is looked at.
        return envelope->render->scene ? BD_ROLE_READ : BD_ROLE_EDIT;
    case BOUNCED__ENVELOPE__BODY_STATS:
    case BOUNCED__ENVELOPE__BODY_SCENE_REPLAY: // a past that did not happen here
        return BD_ROLE_ADMIN;
    default:
        return BD_ROLE_READ;
    }
}

// NULL: the request names none.
static const char *scene_of(const Bounced__Envelope *envelope)
{
    switch ((int)envelope->body_case) {
    case BOUNCED__ENVELOPE__BODY_SCENE_GET:
        return envelope->scene_get->id;
    case BOUNCED__ENVELOPE__BODY_SCENE_REMOVE:
        return envelope->scene_remove->id;
    case BOUNCED__ENVELOPE__BODY_RENDER:
        return envelope->render->scene;
    case BOUNCED__ENVELOPE__BODY_EDIT_BATCH:
        return envelope->edit_batch->scene;
    case BOUNCED__ENVELOPE__BODY_EDIT_UNDO:
        return envelope->edit_undo->scene;
    case BOUNCED__ENVELOPE__BODY_EDIT_REVERT:
        return envelope->edit_revert->scene;
    case BOUNCED__ENVELOPE__BODY_EDIT_COMMIT:
        return envelope->edit_commit->scene;
    case BOUNCED__ENVELOPE__BODY_REVISION_NAME:
        return envelope->revision_name->scene;
    case BOUNCED__ENVELOPE__BODY_SCENE_LOG:
        return envelope->scene_log->scene;
    case BOUNCED__ENVELOPE__BODY_SCENE_EXPORT:
        return envelope->scene_export->scene;
    case BOUNCED__ENVELOPE__BODY_SCENE_REPLAY:
        return envelope->scene_replay->scene;
    default:
        return NULL;
    }
}

static enum bd_err check_scene(const struct bd_command *command, const char *id,
                               struct bd_fault *fault)
{
    const struct bd_store_entry *entry;
    enum bd_err err = bd_store_get(command->net->options.store, id, &entry, fault);
    if (err || bd_grant_covers(command->grant, entry->name)) return err;
    return bd_fault_set(fault, BD_ERR_NOT_FOUND, "scene", "there is no scene \"%.32s\"", id);
}

static enum bd_err check_jobs(const struct bd_command *command, struct bd_fault *fault)
{
    const struct bd_grant *grant = command->grant;
    uint64_t jobs = 0;
    if (grant->jobs_max == UINT64_MAX) return BD_ERR_OK;
    for (const struct bd_command *at = command->net->commands; at; at = at->next)
        jobs += at->grant == grant && at->counts_as_job;
    if (jobs < grant->jobs_max) return BD_ERR_OK;
    return bd_fault_set(fault, BD_ERR_BUSY, "max_jobs",
                        "%" PRIu64 " jobs of \"%s\" are under way, which is its max_jobs", jobs,
                        grant->name);
}

static enum bd_err check_name(const struct bd_command *command, const char *name,
                              struct bd_fault *fault)
{
    uint64_t most = command->net->options.limits.scene_name_bytes;
    if (!name || strlen(name) <= most) return BD_ERR_OK;
    return bd_fault_set(
        fault, BD_ERR_LIMIT, "scene_name_bytes",
        "a scene's name of %zu bytes is above the limit scene_name_bytes of %" PRIu64, strlen(name),
        most);
}

bool bd_command_is_job(const Bounced__Envelope *envelope)
{
    if (envelope->body_case == BOUNCED__ENVELOPE__BODY_EDIT_BATCH)
        return bd_edit_batch_weight(envelope->edit_batch) == BD_EDIT_FILES;
    return envelope->body_case == BOUNCED__ENVELOPE__BODY_SCENE_ADD ||
           envelope->body_case == BOUNCED__ENVELOPE__BODY_SCENE_EXPORT ||
           envelope->body_case == BOUNCED__ENVELOPE__BODY_RENDER;
}

enum bd_err bd_command_check_rights(const struct bd_command *command, struct bd_fault *fault)
{
    const char *scene = scene_of(command->envelope);
    enum bd_err err = bd_grant_check_role(command->grant, role_for(command->envelope), fault);
    if (!err && scene) err = check_scene(command, scene, fault);
    // What would not fit is refused before its files are looked at.
    if (!err && command->envelope->body_case == BOUNCED__ENVELOPE__BODY_SCENE_ADD)
        err = check_name(command, command->envelope->scene_add->name, fault);
    if (!err && bd_command_is_job(command->envelope)) err = check_jobs(command, fault);
    return err;
}

// --- quotas of scenes -----------------------------------------------------------------------

static enum bd_err check_bytes(const struct bd_grant *grant, uint64_t held, uint64_t more,
                               struct bd_fault *fault)
{
    if (held <= grant->bytes_max && more <= grant->bytes_max - held) return BD_ERR_OK;
    return bd_fault_set(fault, BD_ERR_LIMIT, "max_bytes",
                        "the scenes of \"%s\" would take %" PRIu64
                        " bytes, above its max_bytes of %" PRIu64,
                        grant->name, held + more, grant->bytes_max);
}

enum bd_err bd_command_check_new_scene(const struct bd_command *command, const char *name,
                                       struct bd_fault *fault)
{
    const struct bd_grant *grant = command->grant;
    enum bd_err err = check_name(command, name, fault);
    if (err) return err;
    if (!bd_grant_covers(grant, name))
        return bd_fault_set(fault, BD_ERR_FORBIDDEN, "name",
                            "scenes of \"%s\" have names that begin with \"%s\"", grant->name,
                            grant->scene_prefix);
    if (grant->scenes_max == UINT64_MAX && grant->bytes_max == UINT64_MAX) return BD_ERR_OK;
    struct bd_store_holdings held = bd_store_holdings(command->net->options.store, grant->name, "");
    if (held.scenes >= grant->scenes_max)
        return bd_fault_set(fault, BD_ERR_LIMIT, "max_scenes",
                            "\"%s\" holds %" PRIu64 " scenes, which is its max_scenes", grant->name,
                            held.scenes);
    return check_bytes(grant, held.bytes, bd_scene_bytes(command->scene), fault);
}

// Whether the scene counts for a quota of the asker.
static bool is_held_by(const struct bd_command *command, const char *scene_id)
{
    const struct bd_store_entry *entry;
    return command->grant->bytes_max != UINT64_MAX &&
           !bd_store_get(command->net->options.store, scene_id, &entry, NULL) &&
           strcmp(entry->owner, command->grant->name) == 0;
}

// What is above the quota already may be replaced, if it grows no further.
uint64_t bd_command_content_quota(const struct bd_command *command, const char *scene_id,
                                  const struct bd_scene *base)
{
    if (!is_held_by(command, scene_id)) return UINT64_MAX;
    const uint64_t held = bd_scene_bytes(base);
    return held > command->grant->bytes_max ? held : command->grant->bytes_max;
}

enum bd_err bd_command_check_growth(const struct bd_command *command, const char *scene_id,
                                    const struct bd_scene *base, const struct bd_delta *delta,
                                    struct bd_fault *fault)
{
    const struct bd_grant *grant = command->grant;
    const struct bd_store *store = command->net->options.store;
    struct bd_scene *after = NULL;
    if (!is_held_by(command, scene_id)) return BD_ERR_OK;
    enum bd_err err = bd_delta_apply(base, delta, &after, fault);
    if (err) return err;
    const uint64_t bytes = bd_scene_bytes(after);
    bd_scene_release(&after);
    if (bytes <= bd_scene_bytes(base)) return BD_ERR_OK;
    return check_bytes(grant, bd_store_holdings(store, grant->name, scene_id).bytes, bytes, fault);
}
