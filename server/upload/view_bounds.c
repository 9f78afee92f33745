#include "upload/view_bounds.h"

#include <math.h>

// The sample's place in its pixel shifts the picture by up to half of one, and a device's pixel
// grid moves corners by up to a sixteenth.
#define PADDING_PX 2.0
// Part of the near distance, and of an orthographic view's depth, that is drawn beyond the planes.
#define DEPTH_PADDING 1e-4
// A shader's position is the sum of four products in 32 bits, scaled and shifted: eight roundings
// of 2^-24, taken twice over.
#define ROUNDING 0x1p-20

static void add_plane(struct bd_view_bounds *to, double x, double y, double z, double offset)
{
    uint32_t p = to->plane_count++;
    to->planes[p].normal[0] = x;
    to->planes[p].normal[1] = y;
    to->planes[p].normal[2] = z;
    to->planes[p].offset = offset;
}

struct bd_view_bounds bd_view_bounds_of(const struct bd_viewpoint *viewpoint,
                                        const struct bd_render_space *space)
{
    struct bd_view_bounds to = {0};
    const double scale = space->render_per_m;
    double half_x = viewpoint->half_width * (1 + 2 * PADDING_PX / viewpoint->width_px);
    double half_y = viewpoint->half_height * (1 + 2 * PADDING_PX / viewpoint->height_px);
    double near = viewpoint->near_m * scale, far = viewpoint->far_m * scale;
    if (viewpoint->orthographic) {
        const double slack = DEPTH_PADDING * (far - near);
        for (int sign = -1; sign <= 1; sign += 2) {
            add_plane(&to, sign, 0, 0, -half_x * scale);
            add_plane(&to, 0, sign, 0, -half_y * scale);
        }
        add_plane(&to, 0, 0, 1, near - slack);
        add_plane(&to, 0, 0, -1, -far - slack);
        return to;
    }
    for (int sign = -1; sign <= 1; sign += 2) {
        add_plane(&to, sign, 0, half_x, 0);
        add_plane(&to, 0, sign, half_y, 0);
    }
    add_plane(&to, 0, 0, 1, near * (1 - DEPTH_PADDING)); // perspective has no far plane
    return to;
}

// How far the left side of a plane may be off, over the box.
static double rounding_of(const double normal[3], const float rows[12], const struct bd_box *box)
{
    double sum = 0;
    for (int r = 0; r < 3; r++) {
        double size = fabs(rows[4 * r + 3]);
        for (int c = 0; c < 3; c++)
            size += fabs(rows[4 * r + c]) * fmax(fabs(box->min[c]), fabs(box->max[c]));
        sum += fabs(normal[r]) * size;
    }
    return ROUNDING * sum;
}

struct bd_view_bounds bd_view_bounds_in_mesh(const struct bd_view_bounds *bounds,
                                             const float rows[12], const struct bd_box *box)
{
    struct bd_view_bounds to = {0};
    for (uint32_t p = 0; p < bounds->plane_count; p++) {
        const double *n = bounds->planes[p].normal;
        double of[4];
        for (int c = 0; c < 4; c++)
            of[c] = n[0] * rows[c] + n[1] * rows[4 + c] + n[2] * rows[8 + c];
        double offset = bounds->planes[p].offset;
        add_plane(&to, of[0], of[1], of[2],
                  offset + of[3] - rounding_of(n, rows, box) - ROUNDING * fabs(offset));
    }
    return to;
}

enum bd_view_share bd_view_bounds_share(const struct bd_view_bounds *bounds,
                                        const struct bd_box *box)
{
    enum bd_view_share share = BD_VIEW_ALL;
    double centre[3], half[3];
    for (int c = 0; c < 3; c++) {
        centre[c] = 0.5 * ((double)box->min[c] + box->max[c]);
        half[c] = 0.5 * ((double)box->max[c] - box->min[c]);
    }
    for (uint32_t p = 0; p < bounds->plane_count; p++) {
        const double *n = bounds->planes[p].normal;
        double at =
            bounds->planes[p].offset + n[0] * centre[0] + n[1] * centre[1] + n[2] * centre[2];
        double reach = fabs(n[0]) * half[0] + fabs(n[1]) * half[1] + fabs(n[2]) * half[2];
        if (at - reach > 0) return BD_VIEW_NONE;
        if (!(at + reach <= 0)) share = BD_VIEW_SOME; // as a box of which nothing is known
    }
    return share;
}
