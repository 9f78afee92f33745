// Alpha of what is not opaque as a device reads it (shared/rays.h): the same arithmetic as
// cutout.h, from tables. Private to rays/.
//
// Thread: that which makes the nodes.

#ifndef BD_RAYS_CUTOUT_TABLE_H
#define BD_RAYS_CUTOUT_TABLE_H

#include "rays/nodes.h"
#include "rays/structure.h"

// Fills `cutouts` and `texels`; nothing where all is opaque. BD_ERR_UNSUPPORTED for what takes more
// than `bytes_max` each.
BD_MUST_CHECK
enum bd_err bd_cutout_table_make(const struct bd_rays *rays, uint64_t bytes_max,
                                 struct bd_ray_nodes *out, struct bd_err_detail *detail);

#endif
