// One path from the eye: its vertices, and the light that reaches the eye along it.
//
// Private to reference/. Any thread; allocates nothing.

#ifndef BD_REFERENCE_PATH_H
#define BD_REFERENCE_PATH_H

#include <math.h>
#include <stdbool.h>
#include <stdint.h>

#include "reference/bsdf.h"
#include "reference/emitters.h"
#include "reference/geometry.h"
#include "reference/nested.h"
#include "reference/punctual.h"
#include "reference/reference.h"
#include "reference/sampler.h"
#include "reference/sky.h"

// What a solid does to light inside it (KHR_materials_volume), by material.
struct bd_medium {
    bool absorbs;
    float per_unit[3]; // extinction per reference unit
};

struct bd_reference {
    struct bd_scene *scene;
    double unit_cd_m2; // a power of two: luminances are traced in multiples of it
    struct bd_geometry geometry;
    struct bd_punctuals punctuals;
    struct bd_emitters emitters;
    struct bd_sky sky;
    struct bd_medium *media;
    bool *smooth;    // by material: whether it may send light on as a mirror or clear glass does
    bool has_smooth; // any of them
    bool has_panes;  // of those some let light pass straight on
};

// A point where light is scattered towards the eye.
struct bd_vertex {
    struct bd_bsdf bsdf;
    float wo[3];                    // towards the eye
    float position[3];              // reference space
    float clearance;                // rays start this far off the surface
    const struct bd_medium *behind; // what fills the solid that it bounds; NULL: nothing
    const struct bd_part *solid;    // that one's; NULL: it bounds none
};

// A light vertex: where a ray from a punctual light met the scene.
struct bd_light_vertex {
    bool traced, found;
    const struct bd_punctual *punctual;
    struct bd_intersection at;
    struct bd_illumination light;
    float pdf;       // of being found, per area
    uint32_t passed; // smooth surfaces on the way to it, through which nothing else finds it
    // Its surface as seen from before and from behind, made when first asked for: all vertices of a
    // path look at it, and what they see differs in its side alone.
    bool has_sender[2];
    struct bd_vertex sender[2];
};

struct bd_path {
    const struct bd_reference *reference;
    const struct bd_integrand *integrand;
    struct bd_sampler sampler;
    uint32_t events;    // scattering events between the eye and what is looked at now
    uint64_t seed;      // of sampler and sample
    uint32_t ray_index; // numbers the rays of this path
    float throughput[3];
    float scatter_pdf;     // of the last direction, with the chance of its survival; per steradian
    bool is_specular;      // no other way could have found the last direction
    bool only_mirrors;     // nor any before it
    bool misses_caustics;  // it saw a place by a mirror or glass whose caustics of points nothing
                           // finds
    float lamp_radius;     // reference units
    struct bd_nested solids; // that the eye's way is within
    struct bd_light_vertex light_vertex;
    float clamp_per_unit2;
    float sum[BD_PART_COUNT][3];
};

void bd_path_begin(const struct bd_reference *reference, const struct bd_integrand *integrand,
                   struct bd_sampler sampler, struct bd_path *path);

// Follows the ray of a camera. False if it met nothing but sky; else `first` is what it met, at
// `distance` along the ray.
bool bd_path_from_camera(struct bd_path *path, struct bd_ray *ray, struct bd_vertex *first,
                         float *distance);
// Follows what arrives at a vertex.
void bd_path_from_vertex(struct bd_path *path, const struct bd_vertex *vertex);

// --- for the files of the path only --------------------------------------------------------------

// Pairs of random numbers: the first is the camera's, each vertex has so many.
enum bd_path_pair {
    BD_PAIR_DIRECTION,
    BD_PAIR_LOBE_AND_SURVIVAL,
    BD_PAIR_PUNCTUAL_AND_EMITTER,
    BD_PAIR_EMITTER_POINT,
    BD_PAIR_SKY,
    BD_PAIR_COUNT,
};
// Of the light vertex, which a path has one of; then those of the vertices.
enum { BD_PAIR_CAMERA, BD_PAIR_LIGHT_RAY, BD_PAIR_LIGHT_CHOICE, BD_PAIR_FIRST_VERTEX };

static inline uint32_t bd_path_pair(const struct bd_path *path, enum bd_path_pair pair)
{
    return BD_PAIR_FIRST_VERTEX + path->events * BD_PAIR_COUNT + (uint32_t)pair;
}

static inline uint64_t bd_path_ray_seed(struct bd_path *path)
{
    return path->seed + path->ray_index++ * (uint64_t)0x9e3779b97f4a7c15u;
}

// A ray from the vertex on the side of `direction`, as far as `far` of its lengths.
// Written in place: a copy would have to wait for its parts.
void bd_path_ray(struct bd_path *path, const struct bd_vertex *vertex, const float direction[3],
                 float far, struct bd_ray *out);
// The same to a point, which is at its far end.
void bd_path_ray_to(struct bd_path *path, const struct bd_vertex *vertex, const float target[3],
                    struct bd_ray *out);
// True if nothing lies between the vertex and a point that is `clearance` off its surface.
bool bd_path_sees(struct bd_path *path, const struct bd_vertex *vertex, const float target[3]);

// Punctual lights are sought through panes, and no other way of that is.
static inline bool bd_path_looks_straight(const struct bd_path *path)
{
    const struct bd_integrand *integrand = path->integrand;
    return path->reference->has_panes && integrand->transmission && !integrand->lambert &&
           !integrand->lambert_senders && integrand->indirect_visibility && path->lamp_radius == 0;
}

// What panes let pass straight on: of each colour, and the chance with which a path from the light
// would have passed as well; 0 where such a path would have ended.
struct bd_straight_way {
    float passed[3], chance;
};
extern const struct bd_straight_way bd_straight_free;

// Adds a pane to the way, seen from `wo`. False: nothing passes it.
bool bd_path_add_pane(const struct bd_path *path, const struct bd_intersection *at,
                      const float wo[3], struct bd_straight_way *way);
// Whether light comes along the ray, up to its far end. `ray` is changed.
bool bd_path_passes(const struct bd_path *path, struct bd_ray *ray, struct bd_straight_way *way);

// The first surface along a ray that is not the camera's. False: none.
bool bd_path_intersect(const struct bd_path *path, const struct bd_ray *ray,
                       struct bd_intersection *at);

// The vertex at an intersection, for light that leaves towards `wo`, along a way that is within
// those solids; NULL: within none.
void bd_path_vertex(const struct bd_path *path, const struct bd_intersection *at, const float wo[3],
                    const struct bd_nested *within, struct bd_vertex *out);
// What the way meets next, past edges that are none; `value` is less by what solids take before.
// False: nothing. `ray` is changed, and begins behind such an edge then.
bool bd_path_meet(const struct bd_path *path, const struct bd_vertex *from, struct bd_ray *ray,
                  struct bd_nested *solids, float value[3], struct bd_intersection *at);

// Multiplies by what the solid around the segment from `from` along `wi` lets pass. `to` may be
// NULL.
void bd_path_absorb(const struct bd_vertex *from, const float wi[3], const struct bd_vertex *to,
                    float distance, float value[3]);

// The factor that holds cos cos / r^2 of two surfaces to the integrand's bound.
static inline float bd_path_clamp(const struct bd_path *path, float cosine_at_receiver,
                                  float cosine_at_sender, float distance)
{
    float kernel = fabsf(cosine_at_receiver * cosine_at_sender);
    float bounded = path->clamp_per_unit2 * distance * distance;
    return kernel > bounded ? bounded / kernel : 1;
}

// The chance that a path goes on after scattering here.
float bd_path_survival(const struct bd_path *path, const struct bd_vertex *vertex);

// Where the integrand has Lambertian senders: makes one of a surface that is not the first.
void bd_path_make_sender(const struct bd_path *path, struct bd_surface *surface);

// Kinds of light that count once it was scattered `events` times.
static inline uint32_t bd_path_lights(const struct bd_path *path, uint32_t events)
{
    const struct bd_integrand *integrand = path->integrand;
    return integrand->lights & (events > 1 ? integrand->indirect_lights : BD_REFERENCE_ALL_LIGHTS);
}

// Power heuristic with exponent 2 (Veach 1997).
static inline float bd_path_power_weight(float pdf, float other)
{
    float a = pdf * pdf, b = other * other;
    return a > 0 ? a / (a + b) : 0;
}

// Adds throughput x value as light that was scattered `events` times.
static inline void bd_path_add(struct bd_path *path, uint32_t events, const float value[3])
{
    enum bd_reference_part part = events == 0   ? BD_PART_EMISSION
                                  : events == 1 ? BD_PART_DIRECT
                                                : BD_PART_INDIRECT;
    for (int k = 0; k < 3; k++) path->sum[part][k] += path->throughput[k] * value[k];
}

// A vertex as the tree of lights asks about it.
static inline struct bd_receiver bd_path_receiver(const struct bd_vertex *vertex)
{
    const struct bd_surface *s = &vertex->bsdf.surface;
    struct bd_receiver receiver = {.all_round = s->transmission > 0};
    bd_vec3f_copy(receiver.position, vertex->position);
    bd_vec3f_copy(receiver.normal, s->normal);
    bd_vec3f_copy(receiver.normal_geometric, s->normal_geometric);
    return receiver;
}

// True with probability `share`, by a number that is uniform before and after.
static inline bool bd_path_decide(float *u, float share)
{
    bool yes = *u < share;
    *u = yes ? *u / share : (*u - share) / (1 - share);
    return yes;
}

// A number in [0, 1) of 52 bits, of which these come first: what is left of them at the leaves of a
// large tree still tells lights apart.
static inline double bd_path_fine(struct bd_path *path, uint32_t bits)
{
    uint32_t low = bd_sampler_hash(&path->sampler, path->ray_index++) >> 12;
    return (bits + low * 0x1p-20) * 0x1p-32;
}

// Light of punctual lights, scattered here (next_event.c). `sender_pdf`: pdf per area with which
// the path found this vertex by scattering, 0 if only so could it be found.
void bd_path_add_punctuals(struct bd_path *path, const struct bd_vertex *vertex, float found_pdf);
// Light of emissive triangles and the sky, scattered here.
void bd_path_add_areas(struct bd_path *path, const struct bd_vertex *vertex);
// Of emissive triangles, of which there must be some (next_emitter.c).
void bd_path_add_emitters(struct bd_path *path, const struct bd_vertex *vertex);
// The weights of the same light where scattering finds it; `from` is the vertex that scattered,
// NULL: the camera.
float bd_path_emitter_weight(const struct bd_path *path, const struct bd_vertex *from,
                             const struct bd_intersection *at, const float direction[3]);
float bd_path_sky_weight(const struct bd_path *path, const float direction[3]);

// Of punctual lights with a radius (lamp.c). Draws a direction towards one, as which it then
// stands; its pdf, or 0: it is a point to the place.
float bd_path_spread_lamp(struct bd_path *path, struct bd_illumination *light);
// Those that the ray which was scattered at `from` goes into before `distance`.
void bd_path_add_lamps(struct bd_path *path, const struct bd_vertex *from, const float direction[3],
                       float distance);

// The same with the scene's own lights alone: a default rig stands in for what would shine.
struct bd_integrand bd_reference_without_rig(const struct bd_reference *reference,
                                             const struct bd_integrand *integrand);

// Sets what is smooth. BD_ERR_NO_MEMORY.
BD_MUST_CHECK
enum bd_err bd_reference_find_smooth(struct bd_reference *reference, struct bd_err_detail *detail);

// Light on its way from a punctual light, at a surface that it has met (light_path.c).
struct bd_carried {
    struct bd_intersection at;
    float towards_light[3]; // unit: where it came from
    float flux[3];          // of all punctual lights, were this the only path
    struct bd_nested solids; // that it is within
    uint32_t passed;        // smooth surfaces, but for panes that it went straight through at first
    const struct bd_punctual *punctual;
    bool straight;              // panes alone, or nothing, where those are looked through
    struct bd_straight_way way; // while that holds
};
// Its first surface, by uniform numbers. False: none, or out of the light's reach.
bool bd_path_leave_light(struct bd_path *path, float choice, const float u[2],
                         struct bd_carried *out, struct bd_illumination *light);
// On to the next surface by what is smooth of this one. False: it ends here.
bool bd_path_pass_on(struct bd_path *path, struct bd_carried *carried);
// Whether nothing of the surface is rough: no light can be sought there.
bool bd_path_is_smooth(const struct bd_path *path, const struct bd_carried *carried);

// Light that went punctual light -> light vertex -> here (light_vertex.c).
void bd_path_add_light_vertex(struct bd_path *path, const struct bd_vertex *vertex);
// Whether light vertices are used for paths that are scattered `events` times.
bool bd_path_has_light_vertices(const struct bd_path *path, uint32_t events);

#endif
