// Receivers of a part in sets of neighbours, for which one cut of points is made (point_gather.h):
// those of one cell of space and of the ways that surfaces face, halved until few are in it.
//
// Where planes lie is no matter of receivers. Of a group, which is of those that follow each other
// in a picture's list, all would be others behind a place where one is added.
//
// Private to pass/. Thread: any.

#ifndef BD_PASS_RECEIVER_SETS_H
#define BD_PASS_RECEIVER_SETS_H

#include "base/err.h"
#include "pass/receivers.h"

#define BD_SET_MOST BD_LANES

struct bd_receiver_sets {
    uint32_t count;
    uint32_t *first;  // of each set, and of none behind the last: places in
    uint32_t *places; // receivers that are lit: lanes of groups
};

// Of a set, its receivers by group and lane.
struct bd_receiver_set {
    const uint32_t *places;
    uint32_t count; // 1 to BD_SET_MOST
};
static inline struct bd_receiver_set bd_receiver_set_at(const struct bd_receiver_sets *sets,
                                                        uint32_t set)
{
    const uint32_t first = sets->first[set];
    return (struct bd_receiver_set){sets->places + first, sets->first[set + 1] - first};
}

// `part`: with `starts`. BD_ERR_NO_MEMORY.
BD_MUST_CHECK
enum bd_err bd_receiver_sets_init(struct bd_receiver_sets *sets,
                                  const struct bd_receiver_part *part,
                                  struct bd_err_detail *detail);
void bd_receiver_sets_finish(struct bd_receiver_sets *sets);

#endif
