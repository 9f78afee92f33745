// Vec4s of one instance in the array BD_UNIT_INSTANCES, which is made anew for each view, of the
// instances that it sees, so that positions are relative to it: rows of view_from_mesh, then rows
// of the matrix for normals, render space from mesh (cofactors of the upper 3x3: right under
// mirroring and uneven scale).
#ifndef BD_SHARED_INSTANCE_H
#define BD_SHARED_INSTANCE_H

#define BD_INSTANCE_VEC4S 6

// The per-instance attribute, unsigned: x = place in that array, y = which of its draw's instances
// it is, seen or not.
#define BD_INSTANCE_ATTRIBUTES 2

#endif
