#include "sched/reference_subject.h"

#include <string.h>

static void add_number(struct bd_sha256 *sha, uint64_t number)
{
    bd_sha256_update(sha, &number, sizeof number);
}

// Fields one by one: structs have padding.
static void add_integrand(struct bd_sha256 *sha, const struct bd_integrand *integrand)
{
    const bool words[] = {integrand->indirect_visibility, integrand->lambert,
                          integrand->lambert_senders,     integrand->transmission,
                          integrand->light_vertices,      integrand->lights_by_flux};
    bd_sha256_update(sha, words, sizeof words);
    bd_sha256_update(sha, &integrand->clamp_per_m2, sizeof integrand->clamp_per_m2);
    bd_sha256_update(sha, &integrand->lamp_radius_m, sizeof integrand->lamp_radius_m);
    add_number(sha, integrand->bounces_max);
    add_number(sha, integrand->lights);
    add_number(sha, integrand->indirect_lights);
    add_number(sha, (uint64_t)integrand->filter << 32 | (uint64_t)integrand->alpha);
}

static void add_view(struct bd_sha256 *sha, const struct bd_reference_view *view)
{
    const struct bd_pose *pose = &view->pose;
    const double numbers[] = {pose->eye_m.x,    pose->eye_m.y,    pose->eye_m.z, pose->target_m.x,
                              pose->target_m.y, pose->target_m.z, pose->up.x,    pose->up.y,
                              pose->up.z,       pose->yfov};
    add_number(sha, (uint64_t)view->width_px << 32 | view->height_px);
    add_number(sha, (uint64_t)pose->is_set << 32 | view->camera);
    if (pose->is_set) bd_sha256_update(sha, numbers, sizeof numbers);
}

bool bd_reference_subject_name(const struct bd_reference_subject *subject,
                               uint8_t name[BD_SHA256_BYTES])
{
    static const uint8_t none[BD_SHA256_BYTES] = {0};
    if (memcmp(subject->scene->content_sha256, none, sizeof none) == 0) return false;
    struct bd_sha256 *sha = bd_sha256_create();
    bd_sha256_update(sha, subject->scene->content_sha256, BD_SHA256_BYTES);
    add_integrand(sha, subject->integrand);
    add_view(sha, subject->view);
    bd_sha256_update(sha, subject->region, sizeof subject->region);
    add_number(sha, subject->first_sample);
    add_number(sha, subject->seed);
    bd_sha256_finish(&sha, name);
    return true;
}
