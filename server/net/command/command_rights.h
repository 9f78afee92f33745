// What a request needs of whoever makes it: a role, a scene that the token may know of, and room in
// its quotas.
//
// Thread: the event loop's.

#ifndef BD_NET_COMMAND_COMMAND_RIGHTS_H
#define BD_NET_COMMAND_COMMAND_RIGHTS_H

#include "net/command/command_internal.h"

// BD_ERR_FORBIDDEN for a role, BD_ERR_NOT_FOUND for a scene that the token may not know of: it must
// not tell from one that is not there. BD_ERR_BUSY or BD_ERR_LIMIT, naming max_jobs, max_scenes
// or max_bytes.
BD_MUST_CHECK
enum bd_err bd_command_check_rights(const struct bd_command *command, struct bd_err_detail *detail);

// Whether it is of those that count against jobs_per_client and max_jobs.
bool bd_command_is_job(const struct bd_command *command);

// Before a scene is added: the name has to begin as the token's scenes do, and its quotas to hold
// it.
BD_MUST_CHECK
enum bd_err bd_command_check_new_scene(const struct bd_command *command, const char *name,
                                       struct bd_err_detail *detail);

// Before the content of an edit of `base`, a state of a scene, is read: the bytes that it can take
// and the scene still fit its owner's quota. UINT64_MAX where that is not the asker's.
uint64_t bd_command_content_quota(const struct bd_command *command, const char *scene_id,
                                  const struct bd_scene *base);

// Before `delta` changes `base`, a state of a scene: what grows has to fit the quota of the scene's
// owner, which is the asker's only where he is the owner.
BD_MUST_CHECK
enum bd_err bd_command_check_growth(const struct bd_command *command, const char *scene_id,
                                    const struct bd_scene *base, const struct bd_delta *delta,
                                    struct bd_err_detail *detail);

#endif
