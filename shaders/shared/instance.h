// Vec4s of one instance in the array BD_UNIT_INSTANCES, which is made anew for each view so that
// positions are relative to it: rows of view_from_mesh, then rows of the matrix for normals,
// render space from mesh (cofactors of the upper 3x3: right under mirroring and uneven scale).
#ifndef BD_SHARED_INSTANCE_H
#define BD_SHARED_INSTANCE_H

#define BD_INSTANCE_VEC4S 6

#endif
