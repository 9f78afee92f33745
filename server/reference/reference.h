// The ground truth: a path tracer on Embree that shares no code with the techniques it judges.
//
// It solves the rendering equation of a snapshot with the glTF BRDF, or a named part of it (struct
// bd_integrand), pixel by pixel, sample by sample. A sample is a function of scene, integrand,
// view, seed, pixel, half and index alone: threads, order and batching change no bit. Each pixel
// has two halves of samples that share no random number, A and B, so that a metric can remove the
// reference's own noise from what it measures (algorithms.md E1).
//
// Paths are split by the number of scattering events between light and eye:
//   emission  0   surfaces and sky seen directly
//   direct    1
//   indirect  2 or more
// The three add up to beauty. Passing through a surface that coverage makes absent is no event.
//
// Thread: a scene is made on any one thread, then read by all. The functions of this header
// allocate nothing per sample and take no lock.

#ifndef BD_REFERENCE_REFERENCE_H
#define BD_REFERENCE_REFERENCE_H

#include <stdbool.h>
#include <stdint.h>

#include "base/err.h"
#include "scene/model/framing.h"
#include "scene/model/scene.h"

#define BD_BOUNCES_UNLIMITED UINT32_MAX

enum bd_reference_lights {
    BD_REFERENCE_PUNCTUAL = 1u << 0,
    BD_REFERENCE_EMISSIVE = 1u << 1,
    BD_REFERENCE_ENVIRONMENT = 1u << 2,
    BD_REFERENCE_ALL_LIGHTS = 7,
};

enum bd_pixel_filter {
    BD_FILTER_POINT, // every sample through the pixel's centre: what a frame without --aa sees
    BD_FILTER_BOX,   // uniformly over the pixel
};

enum bd_alpha_reading {
    BD_ALPHA_AS_MASK,     // BLEND is opaque from alpha 0.5 on, as the raster techniques draw it
    BD_ALPHA_AS_COVERAGE, // BLEND lets the share 1 - alpha of the light pass
};

// Which part of the rendering equation is solved: the rungs of algorithms.md E9.
struct bd_integrand {
    uint32_t bounces_max; // of indirect light: 0 = direct only, 1 = one bounce, ... or UNLIMITED
    bool indirect_visibility; // false: occlusion is ignored between the last two surfaces of a path
                              // and all before them, but not towards lights (rungs R3, R3b)
    uint32_t lights;          // enum bd_reference_lights: those that light surfaces; emission is
                              // seen directly whatever stands here. A default rig is none of them
                              // where something else shines that is
    uint32_t indirect_lights; // of those, whose light surfaces send on
    // A frame with sub-frames looks through fixed points of its pixels, the box over all of each:
    // with few sub-frames a part of the error is that difference, and no parameter of the technique
    // removes it.
    enum bd_pixel_filter filter;
    enum bd_alpha_reading alpha;
    double
        clamp_per_m2; // bound b on cos cos / r^2 between two surfaces (rung R3b); INFINITY = none
    bool lambert;     // brdf=lambert: every surface is Lambertian with its base colour
    bool lambert_senders; // surfaces other than the first seen reflect by their diffuse lobe alone,
                          // base colour x (1 - metallic) / pi: what a diffuse virtual light does
    bool transmission;    // false: transmissive surfaces are opaque with their base colour
    // Of punctual lights: 0, points, or so large that scattering finds them, which then finds paths
    // that no point is found by: light that went through or off something smooth and is seen in or
    // through it. A directional light looks as large as that radius at one metre.
    double lamp_radius_m;
    bool light_vertices;  // joins eye paths with points that punctual lights shine on, by multiple
                         // importance sampling: the same mean, less noise where a small spot lights
                         // a room. Off is a second estimator, to test the first
    bool lights_by_flux; // emissive triangles, and punctual lights where there are many, are drawn
                         // by what they emit, not by what they can give where light is sought: the
                         // same mean. A second estimator, to test the first
};

// The whole rendering equation at pixel centres.
extern const struct bd_integrand bd_integrand_full;

struct bd_reference;

// Asked while something is built whether to go on, from several threads at once.
typedef enum bd_err (*bd_reference_should_stop)(void *user);

// Builds everything that tracing needs; keeps a reference to the scene. `thread_count` builds the
// acceleration structure, 0 = all of the machine. `should_stop` (or NULL) is asked meanwhile; what
// it answers, unless BD_ERR_OK, is returned, with no error. BD_ERR_NO_MEMORY with what was too
// large.
BD_MUST_CHECK
enum bd_err bd_reference_create(struct bd_scene *scene, uint32_t thread_count,
                                bd_reference_should_stop should_stop, void *user,
                                struct bd_reference **out, struct bd_err_detail *detail);
// The same with what takes long, the triangles' acceleration structure, of another one, where the
// two snapshots have it in common: light, colours, roughness, emission and cameras may differ.
// Where they have not, BD_ERR_NOT_FOUND, with no error, and nothing was built.
BD_MUST_CHECK
enum bd_err bd_reference_create_like(struct bd_scene *scene, const struct bd_reference *like,
                                     struct bd_reference **out, struct bd_err_detail *detail);
// Destroys and nulls; takes NULL.
void bd_reference_destroy(struct bd_reference **reference);

// What it takes of the host's memory beside the scene: its own, and the triangles' structure, as
// Embree counts it, which others may have in common: those of the same `shape`.
struct bd_reference_memory {
    uint64_t own_bytes, shape_bytes;
    const void *shape;
};
struct bd_reference_memory bd_reference_memory(const struct bd_reference *reference);

// What a picture is of.
struct bd_reference_view {
    uint32_t width_px, height_px;
    uint32_t camera;     // index into the scene's placed_cameras
    struct bd_pose pose; // instead of a camera, where it is set
};

enum bd_reference_part { BD_PART_DIRECT, BD_PART_INDIRECT, BD_PART_EMISSION, BD_PART_COUNT };

// Sums over the samples of one pixel, in cd/m^2; zeroed by the caller, added to by tracing. Sums of
// disjoint ranges of samples add up to the sum of their union.
struct bd_reference_pixel {
    uint32_t sample_count[2];             // of half A and half B
    double sum[2][BD_PART_COUNT][3];      // by half
    double square_sum[BD_PART_COUNT][3];  // of single samples, both halves together
    double beauty_square_sum[3];          // of single samples' beauty
    // Indirect light that paths from lights brought (film.h), which the sums above have not; and of
    // its square, by path.
    double landed[2][3], landed_square_sum[3];
    uint64_t nonfinite_count;             // samples that were NaN or infinite, left out of the sums
    uint64_t refused_ray_count;           // rays beyond what can be traced: they met nothing
    uint64_t missing_count;               // samples whose path lacks caustics of points
    double coverage;                      // samples that met a surface
    double albedo[3], normal[3], depth_m; // sums over the first surfaces met
};

// Traces the samples first <= i < first + count of each of the two halves of pixel (x, y), rows
// from the top.
void bd_reference_trace(const struct bd_reference *reference, const struct bd_integrand *integrand,
                        const struct bd_reference_view *view, uint64_t seed, uint32_t x_px,
                        uint32_t y_px, uint32_t first, uint32_t count,
                        struct bd_reference_pixel *pixel);

// Light of punctual lights that smooth surfaces alone have sent on before it falls where the camera
// sees it, which no path from the eye finds: caustics of points. Whether there may be any.
bool bd_reference_has_light_paths(const struct bd_reference *reference,
                                  const struct bd_integrand *integrand);
// Luminance that a path from a light brings to a pixel, over its area, whatever the filter.
typedef void (*bd_reference_land)(void *user, uint32_t x_px, uint32_t y_px, const double cd_m2[3]);
// A path of a sample: those with a `number` below the picture's pixels are one estimate of all
// pixels, each standing for all light. Calls `land` for each pixel that it gives anything to. A
// function of these arguments, as samples are; none of it is in what bd_reference_trace gives.
void bd_reference_light_path(const struct bd_reference *reference,
                             const struct bd_integrand *integrand,
                             const struct bd_reference_view *view, uint64_t seed, uint32_t half,
                             uint32_t index, uint64_t number, bd_reference_land land, void *user);

// Irradiance at a point with a unit normal, by the same estimator: for oracles. The point is in
// world space and need not lie on a surface. Adds to `sums` what the samples of a pixel would, in
// lx: direct and indirect, no emission, and nothing about first surfaces.
void bd_reference_irradiance(const struct bd_reference *reference,
                             const struct bd_integrand *integrand, const double point[3],
                             const double normal[3], uint64_t seed, uint32_t first,
                             uint32_t count, struct bd_reference_pixel *sums);

// Rays traced so far by the calling thread: for reports and for speed against Embree alone.
uint64_t bd_reference_ray_count(void);

#endif
