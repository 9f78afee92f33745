#include "net/command/command_rights.h"

#include <inttypes.h>
#include <string.h>

#include "net/wire/edit_decode.h"

// NULL: the request names none.
static const char *scene_of(const struct bd_command *command)
{
    return command->row->scene ? bd_command_text(command, command->row->scene) : NULL;
}

// A file of one's own to be rendered is a scene for as long as it is looked at.
static enum bd_role role_for(const struct bd_command *command)
{
    const bool brings_scene =
        command->row->body == BOUNCED__ENVELOPE__BODY_RENDER && !scene_of(command);
    return brings_scene ? BD_ROLE_EDIT : command->row->role;
}

static enum bd_err check_scene(const struct bd_command *command, const char *id,
                               struct bd_err_detail *detail)
{
    const struct bd_store_entry *entry;
    enum bd_err err = bd_store_get(command->steps.loop->serving->store, id, &entry, detail);
    if (err || bd_grant_covers(command->grant, entry->name)) return err;
    return bd_err_set(detail, BD_ERR_NOT_FOUND, "scene", "there is no scene \"%.32s\"", id);
}

static enum bd_err check_jobs(const struct bd_command *command, struct bd_err_detail *detail)
{
    const struct bd_grant *grant = command->grant;
    uint64_t jobs = 0;
    if (grant->jobs_max == UINT64_MAX) return BD_ERR_OK;
    for (const struct bd_command *at = command->commands->list; at; at = at->next)
        jobs += at->grant == grant && at->counts_as_job;
    if (jobs < grant->jobs_max) return BD_ERR_OK;
    return bd_err_set(detail, BD_ERR_BUSY, "max_jobs",
                      "%" PRIu64 " jobs of \"%s\" are under way, which is its max_jobs", jobs,
                      grant->name);
}

static enum bd_err check_name(const struct bd_command *command, const char *name,
                              struct bd_err_detail *detail)
{
    uint64_t most = command->steps.loop->serving->limits.scene_name_bytes;
    if (!name || strlen(name) <= most) return BD_ERR_OK;
    return bd_err_set(detail, BD_ERR_LIMIT, "scene_name_bytes",
                      "a scene's name of %zu bytes is above the limit scene_name_bytes of %" PRIu64,
                      strlen(name), most);
}

bool bd_command_is_job(const struct bd_command *command)
{
    if (command->row->body == BOUNCED__ENVELOPE__BODY_EDIT_BATCH)
        return bd_edit_batch_weight(command->envelope->edit_batch) == BD_EDIT_FILES;
    return command->row->is_job;
}

enum bd_err bd_command_check_rights(const struct bd_command *command, struct bd_err_detail *detail)
{
    const char *scene = scene_of(command);
    enum bd_err err = bd_grant_check_role(command->grant, role_for(command), detail);
    if (!err && scene) err = check_scene(command, scene, detail);
    // What would not fit is refused before its files are looked at.
    if (!err && command->row->body == BOUNCED__ENVELOPE__BODY_SCENE_ADD)
        err = check_name(command, command->envelope->scene_add->name, detail);
    if (!err && bd_command_is_job(command)) err = check_jobs(command, detail);
    return err;
}

// --- quotas of scenes -----------------------------------------------------------------------

static enum bd_err check_bytes(const struct bd_grant *grant, uint64_t held, uint64_t more,
                               struct bd_err_detail *detail)
{
    if (held <= grant->bytes_max && more <= grant->bytes_max - held) return BD_ERR_OK;
    return bd_err_set(detail, BD_ERR_LIMIT, "max_bytes",
                      "the scenes of \"%s\" would take %" PRIu64
                      " bytes, above its max_bytes of %" PRIu64,
                      grant->name, held + more, grant->bytes_max);
}

enum bd_err bd_command_check_new_scene(const struct bd_command *command, const char *name,
                                       struct bd_err_detail *detail)
{
    const struct bd_grant *grant = command->grant;
    enum bd_err err = check_name(command, name, detail);
    if (err) return err;
    if (!bd_grant_covers(grant, name))
        return bd_err_set(detail, BD_ERR_FORBIDDEN, "name",
                          "scenes of \"%s\" have names that begin with \"%s\"", grant->name,
                          grant->scene_prefix);
    if (grant->scenes_max == UINT64_MAX && grant->bytes_max == UINT64_MAX) return BD_ERR_OK;
    struct bd_store_holdings held =
        bd_store_holdings(command->steps.loop->serving->store, grant->name, "");
    if (held.scenes >= grant->scenes_max)
        return bd_err_set(detail, BD_ERR_LIMIT, "max_scenes",
                          "\"%s\" holds %" PRIu64 " scenes, which is its max_scenes", grant->name,
                          held.scenes);
    return check_bytes(grant, held.bytes, bd_scene_bytes(command->scene), detail);
}

// Whether the scene counts for a quota of the asker.
static bool is_held_by(const struct bd_command *command, const char *scene_id)
{
    const struct bd_store_entry *entry;
    return command->grant->bytes_max != UINT64_MAX &&
           !bd_store_get(command->steps.loop->serving->store, scene_id, &entry, NULL) &&
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
                                    struct bd_err_detail *detail)
{
    const struct bd_grant *grant = command->grant;
    const struct bd_store *store = command->steps.loop->serving->store;
    struct bd_scene *after = NULL;
    if (!is_held_by(command, scene_id)) return BD_ERR_OK;
    enum bd_err err = bd_delta_apply(base, delta, &after, detail);
    if (err) return err;
    const uint64_t bytes = bd_scene_bytes(after);
    bd_scene_release(&after);
    if (bytes <= bd_scene_bytes(base)) return BD_ERR_OK;
    return check_bytes(grant, bd_store_holdings(store, grant->name, scene_id).bytes, bytes, detail);
}
