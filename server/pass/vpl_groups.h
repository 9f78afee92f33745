// Neighbours in an ordered list of VPLs as groups: what a receiver that is far from them needs to
// know to choose one by, instead of looking at each (kernel/choice.h). Whoever is near looks at
// each. So light of thousands of VPLs is chosen from for the price of hundreds, and as rightly: a
// group is chosen by about what it gives, one of its VPLs by exactly that.
//
// Walter, Fernandez, Arbree, Bala, Donikian, Greenberg 2005 (clusters of lights, and when they are
// too near to be one).
//
// Thread: any.

#ifndef BD_PASS_VPL_GROUPS_H
#define BD_PASS_VPL_GROUPS_H

#include <stdint.h>

#include "shared/types.h"

// VPLs of a group of a list of so many; at most BD_VPL_GROUP_MAX. 0: the list is so short that all
// of it is looked at.
#define BD_VPL_GROUP_MAX 64u
uint32_t bd_vpl_group_size(uint32_t vpl_count);

// `vpls` and `groups` as in shared/vpl.h; the last group may be smaller.
void bd_vpl_groups_make(const struct bd_vec4 *vpls, uint32_t vpl_count, uint32_t group_vpls,
                        struct bd_vec4 *groups);

#endif
