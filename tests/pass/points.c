#include "points.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static double dot(struct vec a, struct vec b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

static struct vec minus(struct vec a, struct vec b)
{
    return (struct vec){a.x - b.x, a.y - b.y, a.z - b.z};
}

static double length(struct vec v)
{
    return sqrt(dot(v, v));
}

static struct vec normal_of(const float octahedral[2])
{
    double x = octahedral[0], y = octahedral[1], z = 1 - fabs(x) - fabs(y), fold = fmax(-z, 0);
    struct vec n = {x + (x >= 0 ? -fold : fold), y + (y >= 0 ? -fold : fold), z};
    double l = length(n);
    return (struct vec){n.x / l, n.y / l, n.z / l};
}

static void normals_of(const struct picture *p, size_t i, float out[4])
{
    size_t x = i % p->size.width, y = i / p->size.width;
    memcpy(out, p->pixels[i].normal, 2 * sizeof *out);
    bool agrees = (x / 16 + y / 16) % 2;
    out[2] = agrees ? out[0] : 1;
    out[3] = agrees ? out[1] : 0;
}

void upload_both_normals(const struct picture *p)
{
    size_t count = (size_t)p->size.width * p->size.height;
    float(*normals)[4] = calloc(count, sizeof *normals);
    assert_non_null(normals);
    for (size_t i = 0; i < count; i++) normals_of(p, i, normals[i]);
    bd_tex_upload(context.gpu, p->gbuffer.normals, 0, normals, count * sizeof *normals);
    free(normals);
}

struct point point_of(const struct picture *p, uint32_t pixel)
{
    uint32_t x = BD_PIXEL_X(pixel), y = BD_PIXEL_Y(pixel);
    size_t i = (size_t)y * p->size.width + x;
    // The picture looks along -x, with -z to the right (picture.c), half as wide as deep.
    double depth = p->pixels[i].depth;
    double u = (2 * (x + .5) / p->size.width - 1) * p->viewpoint.half_width;
    double v = (1 - 2 * (y + .5) / p->size.height) * p->viewpoint.half_height;
    float normals[4];
    normals_of(p, i, normals);
    return (struct point){
        {-depth, v * depth, -u * depth}, normal_of(normals), normal_of(normals + 2)};
}

double distance_between(struct vec a, struct vec b)
{
    return length(minus(a, b));
}

double one_surface(const struct point *a, const struct point *b)
{
    struct vec across = minus(b->position, a->position);
    double chord = fmin(distance_between(a->normal, b->normal),
                        distance_between(a->normal_geometric, b->normal_geometric));
    double height =
        fmin(fabs(dot(across, a->normal_geometric)), fabs(dot(across, b->normal_geometric)));
    double slope = length(across) > 0 ? height / length(across) : 0;
    return fmin(.4 - chord, .25 - slope);
}
