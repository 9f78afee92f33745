#include "pass/disk_cuts.h"

#include <math.h>
#include <stdlib.h>

#include "lights/directions.h"
#include "pass/f3_arrays.h"
#include "pass/nearest.h"
#include "pass/receivers.h"

// Over the disk's radius: what is lower cuts nothing off.
#define LIFT 0.02f
// A ray of the disk, of the slicer's units.
#define UNITS_PER_CUT 20.0

static enum bd_err make_room(struct bd_disk_cuts *c, uint32_t count, struct bd_err_detail *detail)
{
    const size_t rays = (size_t)count * BD_DISK_CUTS;
    if (count <= c->room) return BD_ERR_OK;
    bd_disk_cuts_finish(c);
    c->first = malloc(count * sizeof *c->first);
    c->rays = malloc(rays * sizeof *c->rays);
    c->met = malloc(rays * sizeof *c->met);
    c->cuts = malloc(rays * sizeof *c->cuts);
    if (!c->first || !c->rays || !c->met || !c->cuts)
        return bd_err_set(detail, BD_ERR_NO_MEMORY, "photons", "no memory for disks of photons");
    c->room = count;
    return BD_ERR_OK;
}

static void aim_round(struct bd_disk_cuts *c, const struct bd_photon_disk *disk, uint32_t triangle)
{
    const struct bd_basis basis = bd_basis_of(disk->normal);
    const f3 from = f3_add(disk->position, f3_scale(disk->normal, LIFT * disk->radius));
    for (uint32_t k = 0; k < BD_DISK_CUTS; k++) {
        const float turn = 2 * F_PI * (float)k / BD_DISK_CUTS;
        const f3 d = bd_from_basis(&basis, disk->normal, f3_of(cosf(turn), sinf(turn), 0));
        c->rays[c->ray_count++] = (struct bd_ray){
            .origin = {from.x, from.y, from.z},
            .from_triangle = triangle,
            .direction = {d.x, d.y, d.z},
            .far = disk->radius,
        };
    }
}

static void find_cuts(void *user, uint32_t group)
{
    const struct bd_disk_cuts *c = user;
    for (uint32_t i = group * BD_LANES; i < (group + 1) * BD_LANES && i < c->ray_count; i++) {
        const struct bd_ray *ray = &c->rays[i];
        const struct bd_ray_hit *hit = &c->met[i];
        const f3 d = f3_loaded(ray->direction);
        struct bd_hit_triangle triangle;
        c->cuts[i] = (struct bd_disk_cut){.normal = f3_of(0, 0, 0)};
        if (hit->triangle == BD_NO_TRIANGLE ||
            !bd_surface_hit_triangle(c->surfaces, hit->triangle, &triangle))
            continue;
        c->cuts[i].point = f3_add(f3_loaded(ray->origin), f3_scale(d, hit->distance));
        c->cuts[i].normal = f3_scale(triangle.normal, f3_dot(triangle.normal, d) > 0 ? -1 : 1);
    }
}

enum bd_err bd_disk_cuts_find(const struct bd_pass_context *context, struct bd_disk_cuts *c,
                              const struct bd_photon_disk *disks, const uint32_t *triangles,
                              uint32_t count, struct bd_err_detail *detail)
{
    enum bd_err err = make_room(c, count, detail);
    c->ray_count = 0;
    for (uint32_t i = 0; !err && i < count; i++) {
        const bool is_asked = c->visibility && disks[i].radius > 0;
        c->first[i] = is_asked ? c->ray_count : UINT32_MAX;
        if (is_asked) aim_round(c, &disks[i], triangles[i]);
    }
    if (err || c->ray_count == 0) return err;
    err = bd_nearest_ask(context, c->visibility, c->rays, c->ray_count, c->met, &c->traced, detail);
    bd_slicer_work(context->slicer, "photon disks");
    return err ? err
               : bd_receivers_each(context, (c->ray_count + BD_LANES - 1) / BD_LANES,
                                   UNITS_PER_CUT * BD_LANES, find_cuts, c);
}

const struct bd_disk_cut *bd_disk_cuts_of(const struct bd_disk_cuts *cuts, uint32_t disk)
{
    return cuts->first[disk] == UINT32_MAX ? NULL : cuts->cuts + cuts->first[disk];
}

void bd_disk_cuts_finish(struct bd_disk_cuts *c)
{
    free(c->first);
    free(c->rays);
    free(c->met);
    free(c->cuts);
    *c = (struct bd_disk_cuts){
        .visibility = c->visibility, .surfaces = c->surfaces, .traced = c->traced};
}
