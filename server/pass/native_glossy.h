// Receivers of a part that have a specular lobe worth its price, in groups of their own: elsewhere
// loops over lanes would take both sides of that question. Private to pass/.
//
// Thread: render thread; a group's light is one thread's.

#ifndef BD_PASS_NATIVE_GLOSSY_H
#define BD_PASS_NATIVE_GLOSSY_H

#include "pass/native/native.h"
#include "pass/receivers.h"

struct bd_glossy_group {
    struct bd_receivers receivers;
    struct bd_glossy_receivers surfaces;
    struct bd_lanes3 light;    // 0 at first
    uint32_t origin[BD_LANES]; // its place in the part, of who is lit
};

struct bd_glossy_groups {
    uint32_t count, room;
    struct bd_glossy_group *groups;
};

// Those of a part, in its order. The first part is the largest.
BD_MUST_CHECK
enum bd_err bd_glossy_groups_of(const struct bd_receiver_part *part, struct bd_glossy_groups *out,
                                struct bd_err_detail *detail);
// Their light, where the part keeps it.
void bd_glossy_groups_keep(const struct bd_glossy_groups *groups,
                           const struct bd_receiver_part *part);
void bd_glossy_groups_free(struct bd_glossy_groups *groups);

// What a group's lanes do not see, side by side: `words` words a lane, of those of the part.
void bd_glossy_hidden(const struct bd_glossy_group *group, const struct bd_native_hidden *of_part,
                      uint32_t *bits);

#endif
