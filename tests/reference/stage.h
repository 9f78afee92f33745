// Scenes known on paper, built in code, and the reference to look at them with. No GPU.
//
// Estimates come with their standard error, from replicates that share no random number; checks
// allow four of them and what the caller knows of the scene's own error (a sphere of triangles).

#ifndef BD_TESTS_REFERENCE_STAGE_H
#define BD_TESTS_REFERENCE_STAGE_H

#include "reference/reference.h"
#include "scene/model/scene.h"

struct stage {
    struct bd_scene *scene;
    struct bd_reference *reference; // once something was asked of it
    uint64_t asked;                 // seeds so far: no two estimates share any
};

struct stage *stage_create(void);
void stage_destroy(struct stage **stage);
// Builds the reference, with that many threads; asked without, the first estimate does it with one.
void stage_finish(struct stage *stage, uint32_t thread_count);

// Double-sided and Lambertian (roughness 1 has a specular lobe: ask with `lambert`).
int32_t stage_material(struct stage *stage, float albedo);
struct bd_material *stage_material_at(struct stage *stage, int32_t material);
void stage_emission(struct stage *stage, int32_t material, float cd_m2);

// All shapes return the index of their node. Corners counter-clockwise as seen from the front.
int32_t stage_triangles(struct stage *stage, int32_t material, const float *positions,
                        const float *uv, const uint32_t *indices, uint32_t index_count);
int32_t stage_quad(struct stage *stage, int32_t material, const double corners[4][3]);
// A quad of [-a, a]^2 at height y, its front up (1) or down (-1).
int32_t stage_floor(struct stage *stage, int32_t material, double half, double y, int front);
int32_t stage_disc(struct stage *stage, int32_t material, double radius, double y, int front,
                   uint32_t corner_count);
int32_t stage_sphere(struct stage *stage, int32_t material, const double centre[3], double radius,
                     uint32_t subdivisions, bool inward);
// The six faces of a box, fronts inside.
void stage_box(struct stage *stage, int32_t material, const double low[3], const double high[3]);

// Intensity in cd, or lx. A spot's cone is 30 degrees, flat within 10.
struct bd_light *stage_light(struct stage *stage, enum bd_light_kind kind, double x, double y,
                             double z, const double direction[3], float intensity);
// Perspective, looking at `target`. Returns the camera's index.
uint32_t stage_camera(struct stage *stage, const double position[3], const double target[3],
                      double yfov);

// --- asking -------------------------------------------------------------------------------------

struct estimate {
    double mean, error; // one standard deviation of the mean
};

// Irradiance of one part, first channel.
struct estimate stage_irradiance(struct stage *stage, const struct bd_integrand *integrand,
                                 enum bd_reference_part part, double x, double y, double z,
                                 double nx, double ny, double nz, uint32_t sample_count);
// Mean luminance of a whole picture of size x size pixels; `part` BD_PART_COUNT is beauty.
struct estimate stage_radiance(struct stage *stage, const struct bd_integrand *integrand,
                               uint32_t camera, enum bd_reference_part part, uint32_t size,
                               uint32_t sample_count);

// `relative`: what the scene itself may be off by.
#define CHECK(estimate, expected, relative)                                                        \
    check_estimate(__FILE__, __LINE__, #estimate, (estimate), (expected), (relative))
void check_estimate(const char *file, int line, const char *what, struct estimate estimate,
                    double expected, double relative);
// Two estimates of the same mean, each with an error of at most `relative`, or the check is void.
#define CHECK_SAME(a, b, relative) check_same(__FILE__, __LINE__, #a, (a), (b), (relative))
void check_same(const char *file, int line, const char *what, struct estimate a, struct estimate b,
                double relative);

#endif
