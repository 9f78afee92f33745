// Revisions by the names that were given to them.
//
// Thread: the pool, with the journal's turn.

#ifndef BD_NET_COMMAND_REVISION_NAME_H
#define BD_NET_COMMAND_REVISION_NAME_H

#include <stdint.h>

#include "base/err.h"
#include "scene/journal/journal.h"

// BD_ERR_NOT_FOUND: none of the scene's is called that.
BD_MUST_CHECK
enum bd_err bd_revision_find_name(struct bd_journal *journal, const char *scene_id,
                                  const char *name, uint64_t *revision,
                                  struct bd_err_detail *detail);

#endif
