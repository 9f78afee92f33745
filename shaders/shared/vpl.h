// A virtual point light: a patch of surface that sends on the light that it got.
//
// In the array BD_UNIT_VPLS, three vec4s:
//   0: xyz position, w = area in the kernel's denominator (0 for the bare kernel)
//   1: xyz unit normal, w = square of the distance below which the patch is integrated exactly; or
//      below 0: less what the kernel, irradiance for a unit of flux, is at most
//   2: xyz outgoing flux P = rho Phi, w = its place from the representative texel, in u
// In the array BD_UNIT_VPL_QUADS, two vec4s: the patch is the parallelogram position +- u +- v.
//   0: xyz u, w = 1 / area of the parallelogram
//   1: xyz v, w = the same in v
// Or, where the former w is below 0, the VPL is a point with a coat (kernel/coat.h), and two w mean
// something else:
//   vpls 2:  w = what of the coat's light is in P, for a unit of it
//   quads 0: xyz whence light comes, unit, w = -roughness
//   quads 1: xyz flux that comes to the coat, w = what that reflects of light along its normal
#ifndef BD_SHARED_VPL_H
#define BD_SHARED_VPL_H

#define BD_VPL_VEC4S      3
#define BD_VPL_QUAD_VEC4S 2

// Neighbours in an ordered list are groups (pass/vpl_groups.h), of which a receiver far away knows
// enough to choose one. In the array BD_UNIT_VPL_GROUPS, three vec4s:
//   0: xyz middle, w = mean area in the kernel's denominator
//   1: xyz mean normal, by flux and not unit, w = how far from it a VPL's normal is at most
//   2: x = radius about the middle, y = square of the distance below which VPLs are looked at one by
//      one, z = flux of all of them, all channels together
#define BD_VPL_GROUP_VEC4S 3

// A partial sum over so many of a list is added to the whole, whoever sums: this sets the order of
// the sums, and how many a receiver asks about at once.
#define BD_VPLS_PER_SUM 1024u

#endif
