// Pictures made by hand as points in space: whether two of them are of one surface, straight from
// the definition (shaders/common/one_surface.glsl), in double precision.

#ifndef BD_TESTS_PASS_POINTS_H
#define BD_TESTS_PASS_POINTS_H

#include "picture.h"

struct vec {
    double x, y, z;
};

struct point {
    struct vec position, normal, normal_geometric;
};

// Nearer than this to a threshold either answer is right: the device rounds.
#define UNSURE 1e-5

double distance_between(struct vec a, struct vec b);
// Both normals of each pixel. The geometric one agrees with the shading one in some parts of the
// picture, in others it is that of a wall opposite.
void upload_both_normals(const struct picture *picture);
// Of BD_PIXEL_PACK, with the normals that upload_both_normals gave it.
struct point point_of(const struct picture *picture, uint32_t pixel);
// Above 0: they are of one surface, by so much.
double one_surface(const struct point *a, const struct point *b);

#endif
