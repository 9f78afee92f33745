#include "net/command/revision_name.h"

#include <string.h>

struct naming {
    const char *name;
    uint64_t revision;
};

static void look_at_name(void *user, const char *name, uint64_t revision)
{
    struct naming *naming = user;
    if (strcmp(name, naming->name) == 0) naming->revision = revision;
}

enum bd_err bd_revision_find_name(struct bd_journal *journal, const char *scene_id,
                                  const char *name, uint64_t *revision,
                                  struct bd_err_detail *detail)
{
    struct naming naming = {.name = name};
    enum bd_err err = bd_journal_each_name(journal, scene_id, look_at_name, &naming, detail);
    *revision = naming.revision;
    if (err || naming.revision) return err;
    return bd_err_set(detail, BD_ERR_NOT_FOUND, "name", "no revision is called \"%.64s\"", name);
}
