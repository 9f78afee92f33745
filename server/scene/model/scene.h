// The scene model: one immutable, reference-counted snapshot of everything that a frame can see.
//
// Small things (nodes, materials, lights, cameras) are arrays of the snapshot; heavy things
// (meshes, images) are shared between snapshots by reference, so that an edit copies only what
// it touches. An object's id is its index; one that was removed leaves an empty slot (`is_removed`:
// all zero, referring to nothing, referred to by nothing), so that while the daemon runs no id
// comes to mean anything else (scene/README.md says what a restart forgets). Angles are radians,
// lengths metres, light in glTF's photometric units. World positions are double: `upload/`
// subtracts the scene's own origin before anything becomes float.
//
// Thread: built on one thread, published once, then read by all. Retain and release: any thread.

#ifndef BD_SCENE_MODEL_SCENE_H
#define BD_SCENE_MODEL_SCENE_H

#include <stdbool.h>
#include <stdint.h>

#include "base/err.h"
#include "base/vec.h"

#ifdef __cplusplus
extern "C" {
#endif

#define BD_NONE (-1) // "no such index" for every int32_t index below

// How far coordinates reach: beyond, squared lengths overflow the floats that the GPU computes
// with.
#define BD_COORDINATE_MAX_M 1e15

enum bd_alpha_mode { BD_ALPHA_OPAQUE, BD_ALPHA_MASK, BD_ALPHA_BLEND };
enum bd_wrap { BD_WRAP_REPEAT, BD_WRAP_CLAMP, BD_WRAP_MIRROR };
enum bd_light_kind { BD_LIGHT_DIRECTIONAL, BD_LIGHT_POINT, BD_LIGHT_SPOT };

// Decoded picture, 8-bit RGBA, rows from the top (texture coordinate v = 0). Whether its RGB is
// sRGB-encoded depends on the map that uses it, not on the picture.
struct bd_picture {
    uint32_t reference_count; // atomic
    uint32_t width_px, height_px;
    uint64_t content_hash; // of size and texels: the name of the GPU copy
    uint8_t sha256[32];    // the same, as files and journals name it (content.h)
    bool is_removed;       // then without texels
    uint8_t *rgba;
};

struct bd_texture {
    int32_t picture; // index into the scene's pictures, or BD_NONE (missing picture: white)
    enum bd_wrap wrap_s, wrap_t;
    bool nearest; // magnification filter is NEAREST; otherwise linear
    bool is_removed;
};

struct bd_texture_ref {
    int32_t texture; // BD_NONE: no map
    uint32_t uv_set; // 0 or 1
    // KHR_texture_transform as a 2x3 affine matrix, row-major: u' = m[0] u + m[1] v + m[2].
    float uv_transform[6];
};
extern const struct bd_texture_ref bd_texture_ref_none; // the first set, as it is

struct bd_material {
    char name[64];
    float base_color[4]; // linear, each in [0,1]
    float metallic;      // [0,1]
    float roughness;     // [0,1]
    float emissive[3];   // cd/m^2, factor x KHR_materials_emissive_strength
    float normal_scale;
    float ior;                    // KHR_materials_ior, 1.5 unless said
    float transmission;           // KHR_materials_transmission, [0,1]
    float thickness_m;            // KHR_materials_volume, 0 = thin wall
    float attenuation_distance_m; // +inf = clear
    float attenuation_color[3];
    enum bd_alpha_mode alpha_mode;
    float alpha_cutoff; // MASK
    bool double_sided;  // single-sided back faces are invisible to camera rays only
    bool unlit;         // KHR_materials_unlit
    bool is_removed;
    struct bd_texture_ref base_color_map;         // sRGB, alpha in A
    struct bd_texture_ref metallic_roughness_map; // linear, G roughness, B metallic
    struct bd_texture_ref normal_map;             // linear, tangent space
    struct bd_texture_ref emissive_map;           // sRGB
    struct bd_texture_ref transmission_map;       // linear, R
    // Occlusion maps are read by no technique: they imitate what we compute.
};

// A list of triangles with one material. Streams are tightly packed floats, object space.
//
// Which side is the front, and what the normals say: for every light path, raster (surface.glsl)
// and reference (surface.c) alike, and for all of them here and nowhere else.
// - The winding alone says which side is the front: counter-clockwise in the world as it is seen,
//   with a mirrored instance's turned round. It decides what is culled, what is lit or black on its
//   rear, which side of a single-sided emitter shines, and where a solid is entered.
// - A vertex normal is a line, not an arrow: it says how the surface is curved, never which side it
//   is looked at from. The geometric normal is turned towards the eye (or where the path came
//   from), and the shading normal, interpolated and bent by its map as it is, towards the geometric
//   one. So normals that all point against the winding give the light of their negatives, on both
//   sides. The file meant something else by one of the two, so it is counted and said
//   (`normals_against_winding`); what a viewer that trusts the normals shows is the other side.
struct bd_primitive {
    uint32_t vertex_count;
    uint32_t index_count; // a multiple of 3
    int32_t material;     // always valid: primitives without one share an appended default
    float *position;      // 3 a vertex
    float *normal;        // 3, unit; never NULL
    float *tangent;       // 4, w = handedness; NULL unless the material has a normal map
    float *uv[2];         // 2; NULL only if no map of the material reads this set
    float *color;         // 4, linear; NULL if absent
    uint32_t *index;
    float bounds_min[3], bounds_max[3];
};

struct bd_mesh {
    uint32_t reference_count; // atomic
    char name[64];
    uint64_t content_hash; // of all streams: the name of the GPU copy
    uint8_t sha256[32];    // the same, as files and journals name it (content.h)
    bool is_removed;       // then without primitives
    uint32_t primitive_count;
    struct bd_primitive *primitives;
    struct bd_mesh *streams_of; // whose the streams are; NULL: its own (bd_mesh_alias)
};

struct bd_node {
    char name[64];
    int32_t parent; // BD_NONE for a root
    int32_t mesh, camera, light;
    bd_dmat4 parent_from_node;
    bool is_hidden;  // and with it all that is below it
    bool is_removed; // only with all that is below it
    // Computed by bd_scene_finish:
    bd_dmat4 world_from_node;
    bool in_scene; // neither it nor what is above it is hidden or removed
    // A skinned mesh was baked at the default pose in world space: its instance ignores the node's
    // transform, as glTF says for skins. A mesh that is morphed alone stays in its node's space.
    bool mesh_is_world_space;
};

// Metals up to that roughness are mirrors: light goes on from them along their lobe, where others
// send it on evenly, for whoever follows it (lights/interface.h). Only rays find what they show.
#define BD_MIRROR_ROUGHNESS 0.25f
// Up to this one they are brushed: light goes on from them, too, for who follows it by photons and
// rays alone (lights/surface_hits.h).
#define BD_BRUSHED_ROUGHNESS 0.6f
static inline bool bd_material_may_mirror(const struct bd_material *material, float roughest)
{
    const bool has_map = material->metallic_roughness_map.texture != BD_NONE;
    const bool is_smooth = has_map || material->roughness <= roughest;
    return material->metallic > 0 && is_smooth && material->transmission == 0 && !material->unlit;
}

// Smooth glass with nothing solid behind it: light goes straight on.
static inline bool bd_material_is_pane(const struct bd_material *material)
{
    return material->transmission > 0 && !(material->thickness_m > 0) && material->roughness == 0 &&
           !material->unlit;
}

// Glass that bounds a solid, within which light goes on as it turned there.
static inline bool bd_material_is_solid(const struct bd_material *material)
{
    return material->transmission > 0 && material->thickness_m > 0 && !material->unlit;
}

// Whether light goes on at it, as at glass or a mirror, which metals up to that roughness are.
static inline bool bd_material_goes_on(const struct bd_material *material, float roughest)
{
    return (material->transmission > 0 && !material->unlit) ||
           bd_material_may_mirror(material, roughest);
}

struct bd_light {
    char name[64];
    enum bd_light_kind kind;
    float color[3];               // linear
    float intensity;              // cd for point and spot, lux for directional
    float range_m;                // +inf = unlimited
    float cone_inner, cone_outer; // half-angles of a spot, 0 <= inner < outer <= pi/2
    bool is_removed;
};

struct bd_camera {
    char name[64];
    bool orthographic;
    float yfov;          // full vertical angle, whatever the picture's aspect
    float xmag, ymag;    // orthographic: half width and half height, metres
    float near_m, far_m; // far_m +inf = none
    bool is_removed;
};

// A picture of the whole sky, linear RGB in cd/m^2, rows from the zenith (+y) to the nadir. Column
// 0 begins at -z and columns turn towards +x: direction (sin t sin p, cos t, -sin t cos p) at v = t
// / pi, u = p / (2 pi).
#define BD_SKY_MAP_SIDE_MAX_PX 8192
struct bd_sky_map {
    uint32_t reference_count; // atomic
    uint32_t width_px, height_px;
    uint64_t content_hash;
    uint8_t sha256[32]; // content.h
    float *rgb;         // finite, >= 0
};

// Light from infinitely far away.
struct bd_environment {
    float radiance[3];      // cd/m^2, or a factor on the map; 0: none
    float rotation[4];      // of the map: unit quaternion x y z w, as a node's; all 0: none
    struct bd_sky_map *map; // NULL: the same from everywhere
};

// Sets the rotation, of any length but 0.
void bd_environment_turn(struct bd_environment *environment, const double rotation[4]);
bool bd_environment_is_turned(const struct bd_environment *environment);
// Where the map's axes x, y (its zenith) and z point in the world.
void bd_environment_axes(const struct bd_environment *environment, bd_dvec3 axes[3]);

// One camera or light as placed by a node. Cameras look along -z of the node's frame, y up;
// lights shine along -z. Axes are orthonormal and right-handed: axis_z is where the node's z axis
// points in the world, so that what is modelled around a lamp agrees with it even in a mirrored
// or sheared node; no scale reaches the axes.
struct bd_placement {
    int32_t node;   // BD_NONE: made by us, not by the file
    int32_t object; // index into cameras or lights
    bd_dvec3 position;
    bd_dvec3 axis_x, axis_y, axis_z;
};

// A drawn mesh: one node that shows it.
struct bd_instance {
    int32_t node;
    int32_t mesh;
    bd_dmat4 world_from_mesh;
};

// What the scene contains, so that a plan can leave out the rest. Counted over what is placed in
// the scene, not over what the file holds. Fluxes in lm (luminance-weighted).
struct bd_features {
    uint64_t triangle_count; // instanced
    uint32_t instance_count, primitive_count;
    uint32_t light_count[3]; // by enum bd_light_kind
    bool has_base_color_map, has_metallic_roughness_map, has_normal_map, has_emissive_map;
    bool has_vertex_color;
    bool has_uv1; // some map reads the second set of texture coordinates
    bool has_mask, has_blend;
    bool has_single_sided;
    bool has_metal;    // metallic factor > 0 (before its map)
    bool has_glossy;   // metal, or roughness factor < 0.6
    bool has_rough;    // roughness factor of at least that, and not all metal
    bool has_mirror;   // bd_material_may_mirror, brushed ones too
    bool has_pane;     // bd_material_is_pane
    bool has_lens;     // glass that is none: it bends or spreads what passes
    bool has_transmissive, has_emissive, has_unlit, has_environment;
    double
        punctual_flux_lm; // point and spot; directional counts its lux x the bounds' cross-section
    double emissive_flux_lm; // pi x luminance x area (both sides if double-sided), factors only
    bd_dvec3 bounds_min, bounds_max; // world
    double diagonal_m;               // of the bounds; > 0 always (1 for an empty scene)
};

// What a pass may read of a scene. Materials are those of what is drawn, in the groups that passes
// tell apart; a group has its maps, and what those show.
enum bd_aspect {
    BD_ASPECT_GEOMETRY, // which triangles there are
    BD_ASPECT_TRANSFORMS,
    BD_ASPECT_ALPHA,   // which parts of surfaces are there: of a material that is not opaque
    BD_ASPECT_SIDES,   // which side is drawn, and what is lit at all: double_sided, unlit
    BD_ASPECT_NORMALS, // normal maps
    BD_ASPECT_COLOUR,  // base colour without alpha
    BD_ASPECT_METALNESS,
    BD_ASPECT_ROUGHNESS, // and the index of refraction: the lobe of a dielectric
    BD_ASPECT_MEDIUM,    // transmission, and what lies behind the surface
    BD_ASPECT_EMISSION,
    BD_ASPECT_LIGHTS, // punctual
    BD_ASPECT_ENVIRONMENT,
    BD_ASPECT_CAMERAS,
    BD_ASPECT_COUNT,
};

// Sets of them.
#define BD_ASPECT_BIT(name) (1u << BD_ASPECT_##name)
#define BD_ASPECTS_MATERIALS                                                                       \
    (BD_ASPECT_BIT(ALPHA) | BD_ASPECT_BIT(SIDES) | BD_ASPECT_BIT(NORMALS) |                        \
     BD_ASPECT_BIT(COLOUR) | BD_ASPECT_BIT(METALNESS) | BD_ASPECT_BIT(ROUGHNESS) |                 \
     BD_ASPECT_BIT(MEDIUM) | BD_ASPECT_BIT(EMISSION))
#define BD_ASPECTS_SURFACES                                                                        \
    (BD_ASPECT_BIT(GEOMETRY) | BD_ASPECT_BIT(TRANSFORMS) | BD_ASPECTS_MATERIALS)

// One counter for each aspect: a pass that reads an aspect is valid while its counter stands.
// Counters are unique within the process: two scenes never share a value.
struct bd_aspects {
    uint64_t counter[BD_ASPECT_COUNT];
};

// What the importer repaired or could not honour: rendered anyway, said in the report.
#define BD_SCENE_FLAG_MAX 24
struct bd_scene_flags {
    uint32_t count;
    char text[BD_SCENE_FLAG_MAX][96]; // "nonfinite_vertices: 3", "default_lights", ...
};

struct bd_scene {
    uint32_t reference_count;   // atomic
    uint8_t content_sha256[32]; // of the snapshot's index (flat.h): the "scene" of a report
    uint32_t node_count, mesh_count, material_count, texture_count, picture_count;
    uint32_t light_count, camera_count;
    struct bd_node *nodes;
    struct bd_mesh **meshes;
    struct bd_material *materials;
    struct bd_texture *textures;
    struct bd_picture **pictures;
    struct bd_light *lights;
    struct bd_camera *cameras;
    struct bd_environment environment;
    // Derived by bd_scene_finish, which appends the default rig to cameras, lights and flags:
    // behind these counts lies what belongs to no file, no edit and no hash.
    uint32_t authored_light_count, authored_camera_count, authored_flag_count;
    uint32_t instance_count, placed_light_count, placed_camera_count;
    struct bd_instance *instances;
    struct bd_placement *placed_lights;
    struct bd_placement *placed_cameras; // never empty: without a camera, one that frames the scene
    struct bd_features features;
    struct bd_aspects aspects;
    struct bd_scene_flags flags;
};

// An empty scene with one reference, to be filled by an importer. Never NULL (aborts without
// memory for the struct itself).
struct bd_scene *bd_scene_create(void);

// Computes everything derived: world matrices, instances, placements, features, aspects, and
// where the file has none the default camera and the default light rig, flagged `default_camera`
// and `default_lights`. Call once, before publishing.
BD_MUST_CHECK
enum bd_err bd_scene_finish(struct bd_scene *scene, struct bd_err_detail *detail);
bool bd_scene_is_finished(const struct bd_scene *scene);
// Whether its punctual lights are the default rig, and something else shines: a surface, for who is
// lit by emitters, or an environment, for who is lit by that. They do without the rig.
bool bd_scene_lights_yield(const struct bd_scene *scene, bool to_emitters, bool to_environment);

// Of solids at one place the smallest is there, by the square of its box's diagonal; and whether
// the box of all its mesh, along the world's axes, holds a place.
double bd_solid_size_m2(const struct bd_instance *instance, const struct bd_primitive *primitive);
bool bd_solid_box_holds(const struct bd_scene *scene, const struct bd_instance *instance,
                        bd_dvec3 world);

struct bd_scene *bd_scene_retain(struct bd_scene *scene);
// Drops a reference and nulls; takes NULL.
void bd_scene_release(struct bd_scene **scene);

struct bd_mesh *bd_mesh_retain(struct bd_mesh *mesh);
void bd_mesh_release(struct bd_mesh **mesh);
struct bd_picture *bd_picture_retain(struct bd_picture *picture);
void bd_picture_release(struct bd_picture **picture);
struct bd_sky_map *bd_sky_map_retain(struct bd_sky_map *map);
void bd_sky_map_release(struct bd_sky_map **map);

// Where everything that works in 32 bits has its origin: nearly in the middle of the bounds, but by
// no round number. The middle itself has a bit more than the corners: relative to it, coordinates
// often lie halfway between two floats, and the last bit of a scene's place decides which.
bd_dvec3 bd_scene_origin_m(const struct bd_features *features);

// Computes bounds and both hashes from the streams, or the hashes from the texels: a
// millisecond a MiB, so not on the event loop. For whoever fills a mesh, a picture or a sky, once,
// before it is shared.
void bd_mesh_seal(struct bd_mesh *mesh);
void bd_picture_seal(struct bd_picture *picture);
void bd_sky_map_seal(struct bd_sky_map *map);
// All meshes and pictures, and the sky, of a scene that nobody else holds yet.
void bd_scene_seal(struct bd_scene *scene);

// Triangles of all primitives whose normals point against their winding at all three corners.
uint32_t bd_mesh_count_against_winding(const struct bd_mesh *mesh);

// A mesh of the same streams, so of the same hashes, whose name and materials may be changed before
// it is shared. Cheap. NULL without memory.
struct bd_mesh *bd_mesh_alias(struct bd_mesh *mesh);

// Whether all that is referred to exists and is not removed, and no node is its own ancestor: what
// a snapshot from a file or a journal has to prove. The error names the first that is not so.
// BD_ERR_BAD_INPUT, BD_ERR_NO_MEMORY.
BD_MUST_CHECK
enum bd_err bd_scene_check_references(const struct bd_scene *scene, struct bd_err_detail *detail);

// False if some node is its own ancestor (named in `looping_node`, which may be NULL). Takes
// memory for a mark a node; without it, false.
BD_MUST_CHECK
bool bd_scene_parents_are_a_forest(const struct bd_scene *scene, uint32_t *looping_node);

// Appends one flag, printf-style; drops it silently once the list is full.
void bd_scene_flag(struct bd_scene *scene, const char *format, ...) BD_PRINTF(2, 3);

// Objects that are there: authored, and not removed.
struct bd_scene_counts {
    uint32_t nodes, meshes, materials, textures, pictures, lights, cameras;
};
struct bd_scene_counts bd_scene_count(const struct bd_scene *scene);

// A placed camera by node name, camera name or decimal index; "" is the first. BD_NONE if there
// is none of that name.
int32_t bd_scene_find_camera(const struct bd_scene *scene, const char *name);
// How many placed cameras a name may mean: those whose nodes have it, or where there is none those
// that have it themselves. `first` is set if there is one.
uint32_t bd_scene_count_cameras(const struct bd_scene *scene, const char *name, int32_t *first);

// The alpha from which on a material, by its number, is there for who sees it or not. What blends
// is in one picture from 0.5 on, and of several, the sub-frames of one, in as many as it is opaque:
// they go through even steps, each material in turns of its own, so that what is behind what is as
// often hidden as both alphas say.
float bd_scene_least_alpha(const struct bd_scene *scene, int32_t material, uint32_t sub_frame);

#ifdef __cplusplus
}
#endif

#endif
