// Groups of neighbours in an ordered list of VPLs, for choosing some of them (kernel/choice.h). A
// receiver far from a group weighs the group as one VPL, a near one weighs each of its VPLs; within
// the group that was chosen, VPLs are chosen by their exact strengths. So the choice among
// thousands of VPLs costs as much as one among hundreds, and stays unbiased.
//
// Walter, Fernandez, Arbree, Bala, Donikian, Greenberg 2005 (clusters of lights, and when they are
// too near to be one).
//
// Thread: any.

#ifndef BD_PASS_VPL_GROUPS_H
#define BD_PASS_VPL_GROUPS_H

#include <stdint.h>

#include "shared/types.h"

// How many VPLs a group has, in a list of `vpl_count`; at most BD_VPL_GROUP_MAX. 0: a list so short
// has no groups, and all of its VPLs are weighed.
#define BD_VPL_GROUP_MAX 64u
uint32_t bd_vpl_group_size(uint32_t vpl_count);

// `vpls` and `groups` as in shared/vpl.h; the last group may be smaller.
void bd_vpl_groups_make(const struct bd_vec4 *vpls, uint32_t vpl_count, uint32_t group_vpls,
                        struct bd_vec4 *groups);

#endif
