// What stands in for a missing camera and missing lights. The user manual of both is here; a scene
// that gets them says `default_camera`, `default_lights`.
//
// Camera: from the front, a little right and above (glTF's front is +z), 45 degrees, at the
// distance where the bounds just fit a square picture. From below or behind if that side shows
// four times as much: a single-sided plane that looks down is invisible from above.
//
// Lights, which yield to whatever else shines where the technique is lit by that
// (bd_scene_lights_yield): a directional key light of 2.4 lx over the first camera's left shoulder,
// and a point light at that camera. The key models the shapes; the point light is what still
// reaches the inside of a closed room. It gives 0.74 lx at the distance of what the camera looks
// at, so that a white surface facing both shows 1 cd/m^2, which is white at exposure 0.

#include <stdlib.h>
#include <string.h>

#include "scene/model/derive.h"

static const double pi = 3.14159265358979323846;

static void *appended(void *array, uint32_t count, size_t item_bytes)
{
    return realloc(array, (count + (size_t)1) * item_bytes);
}

static struct bd_placement look_from(bd_dvec3 position, bd_dvec3 backwards)
{
    bd_dvec3 z = bd_dvec3_normalize(backwards, (bd_dvec3){0, 0, 1});
    bd_dvec3 x = bd_dvec3_normalize(bd_dvec3_cross((bd_dvec3){0, 1, 0}, z), (bd_dvec3){1, 0, 0});
    return (struct bd_placement){BD_NONE, BD_NONE, position, x, bd_dvec3_cross(z, x), z};
}

static bd_dvec3 center_of(const struct bd_features *features)
{
    return bd_dvec3_scale(bd_dvec3_add(features->bounds_min, features->bounds_max), 0.5);
}

// How far from the middle must a camera stand that looks along -z of `axes`, so that every corner
// of the bounds is inside a square picture with a little room, and none is at the camera itself?
static double framing_distance_m(const struct bd_features *features,
                                 const struct bd_placement *axes, double half_angle)
{
    const double room = 0.94;
    double reach = room * tan(half_angle), distance = 0;
    bd_dvec3 half = bd_dvec3_scale(bd_dvec3_sub(features->bounds_max, features->bounds_min), 0.5);
    for (int corner = 0; corner < 8; corner++) {
        bd_dvec3 p = {corner & 1 ? half.x : -half.x, corner & 2 ? half.y : -half.y,
                      corner & 4 ? half.z : -half.z};
        double aside =
            fmax(fabs(bd_dvec3_dot(p, axes->axis_x)), fabs(bd_dvec3_dot(p, axes->axis_y)));
        double wanted = fmax(aside / reach, 0.05 * features->diagonal_m);
        distance = fmax(distance, bd_dvec3_dot(p, axes->axis_z) + wanted);
    }
    return distance > 0 ? distance : features->diagonal_m;
}

// Twice the area of a primitive that a camera far away in `direction` can see, were nothing in the
// way: a single-sided triangle shows its counter-clockwise side only.
static double facing_area(const struct bd_primitive *primitive, const bd_dmat4 *world_from_mesh,
                          bool double_sided, bd_dvec3 direction)
{
    double sign = bd_dmat4_determinant3(world_from_mesh) < 0 ? -1 : 1, area = 0;
    for (uint32_t t = 0; t < primitive->index_count; t += 3) {
        bd_dvec3 corner[3];
        for (int k = 0; k < 3; k++) {
            const float *p = primitive->position + 3 * (size_t)primitive->index[t + k];
            corner[k] = bd_dmat4_point(world_from_mesh, (bd_dvec3){p[0], p[1], p[2]});
        }
        bd_dvec3 normal = bd_dvec3_cross(bd_dvec3_sub(corner[1], corner[0]),
                                         bd_dvec3_sub(corner[2], corner[0]));
        double facing = sign * bd_dvec3_dot(normal, direction);
        area += double_sided ? fabs(facing) : fmax(facing, 0);
    }
    return area;
}

static double scene_facing_area(const struct bd_scene *scene, bd_dvec3 direction)
{
    double area = 0;
    for (uint32_t i = 0; i < scene->instance_count; i++) {
        const struct bd_instance *instance = &scene->instances[i];
        const struct bd_mesh *mesh = scene->meshes[instance->mesh];
        for (uint32_t p = 0; p < mesh->primitive_count; p++) {
            const struct bd_primitive *primitive = &mesh->primitives[p];
            area += facing_area(primitive, &instance->world_from_mesh,
                                scene->materials[primitive->material].double_sided, direction);
        }
    }
    return area;
}

// The first of the directions from which a quarter of what the best one shows can be seen.
static bd_dvec3 showing_direction(const struct bd_scene *scene)
{
    const bd_dvec3 directions[] = {
        {0.45, 0.35, 1}, {0.45, -0.35, 1}, {-0.45, 0.35, -1}, {-0.45, -0.35, -1}};
    double areas[4], best = 0;
    for (int d = 0; d < 4; d++) {
        areas[d] = scene_facing_area(scene, directions[d]);
        best = fmax(best, areas[d]);
    }
    for (int d = 0; d < 4; d++)
        if (areas[d] >= 0.25 * best) return directions[d];
    return directions[0];
}

// Where the default camera of a scene stands that looks the same; NULL where it has none.
static const struct bd_placement *default_camera_of(const struct bd_scene *scene)
{
    if (!scene || scene->placed_cameras[0].node != BD_NONE) return NULL;
    return &scene->placed_cameras[0];
}

bool bd_derive_default_camera(struct bd_scene *scene, const struct bd_scene *alike)
{
    if (scene->placed_camera_count > 0) return true;
    const double yfov = pi / 4;
    const struct bd_placement *known = default_camera_of(alike);
    struct bd_placement placed =
        known ? *known : look_from((bd_dvec3){0, 0, 0}, showing_direction(scene));
    double distance = framing_distance_m(&scene->features, &placed, 0.5 * yfov);
    struct bd_camera *cameras =
        appended(scene->cameras, scene->camera_count, sizeof *scene->cameras);
    if (!cameras) return false;
    scene->cameras = cameras;
    cameras[scene->camera_count] = (struct bd_camera){.name = "default",
                                                      .yfov = (float)yfov,
                                                      .near_m = (float)(0.01 * distance),
                                                      .far_m = INFINITY};
    placed.position =
        bd_dvec3_add(center_of(&scene->features), bd_dvec3_scale(placed.axis_z, distance));
    placed.object = (int32_t)scene->camera_count++;
    scene->placed_cameras[scene->placed_camera_count++] = placed;
    bd_scene_flag(scene, "default_camera");
    return true;
}

// How far away is what the camera sees? Its distance to the middle of the scene, but never less
// than an eighth of the scene: a camera may stand in the middle.
static double subject_distance_m(const struct bd_scene *scene, bd_dvec3 eye)
{
    double to_center = bd_dvec3_length(bd_dvec3_sub(center_of(&scene->features), eye));
    return fmax(to_center, 0.125 * scene->features.diagonal_m);
}

static void place_light(struct bd_scene *scene, const struct bd_light *light,
                        struct bd_placement placed)
{
    placed.node = BD_NONE;
    placed.object = (int32_t)scene->light_count;
    scene->lights[scene->light_count++] = *light;
    scene->placed_lights[scene->placed_light_count++] = placed;
}

bool bd_derive_default_lights(struct bd_scene *scene)
{
    if (scene->placed_light_count > 0) return true;
    struct bd_light *lights =
        appended(scene->lights, scene->light_count + 1, sizeof *scene->lights);
    if (!lights) return false;
    scene->lights = lights;
    struct bd_placement *placed = realloc(scene->placed_lights, 2 * sizeof *placed);
    if (!placed) return false;
    scene->placed_lights = placed;

    const struct bd_placement *camera = &scene->placed_cameras[0];
    double distance = subject_distance_m(scene, camera->position);
    struct bd_light key = {.name = "default key",
                           .kind = BD_LIGHT_DIRECTIONAL,
                           .color = {1, 1, 1},
                           .intensity = 2.4f,
                           .range_m = INFINITY};
    struct bd_light fill = {.name = "default fill",
                            .kind = BD_LIGHT_POINT,
                            .color = {1, 1, 1},
                            .intensity = (float)(0.74 * distance * distance),
                            .range_m = INFINITY};
    bd_dvec3 towards_key =
        bd_dvec3_add(camera->axis_z, bd_dvec3_add(bd_dvec3_scale(camera->axis_x, -0.6),
                                                  bd_dvec3_scale(camera->axis_y, 0.9)));
    place_light(scene, &key, look_from(camera->position, towards_key));
    place_light(scene, &fill, *camera);
    bd_scene_flag(scene, "default_lights");
    return true;
}

// --- yielding -----------------------------------------------------------------------------------

// Many files have a factor of 1 and a map that is black: such a surface is no light.
static bool is_black(const struct bd_scene *scene, const struct bd_texture_ref *map)
{
    const int32_t at = map->texture == BD_NONE ? BD_NONE : scene->textures[map->texture].picture;
    const struct bd_picture *picture = at == BD_NONE ? NULL : scene->pictures[at];
    if (!picture) return false;
    const size_t texels = (size_t)picture->width_px * picture->height_px;
    for (size_t i = 0; i < texels; i++)
        if (picture->rgba[4 * i] | picture->rgba[4 * i + 1] | picture->rgba[4 * i + 2])
            return false;
    return texels > 0;
}

static bool shines(const struct bd_scene *scene, const struct bd_material *material)
{
    const float *e = material->emissive;
    return !material->unlit && (e[0] > 0 || e[1] > 0 || e[2] > 0) &&
           !is_black(scene, &material->emissive_map);
}

static bool some_surface_shines(const struct bd_scene *scene)
{
    bool *asked = calloc(scene->material_count + 1, sizeof *asked);
    bool found = false;
    for (uint32_t i = 0; asked && !found && i < scene->instance_count; i++) {
        const struct bd_mesh *mesh = scene->meshes[scene->instances[i].mesh];
        for (uint32_t p = 0; !found && p < mesh->primitive_count; p++) {
            const int32_t material = mesh->primitives[p].material;
            if (asked[material] || mesh->primitives[p].index_count == 0) continue;
            asked[material] = true;
            found = shines(scene, &scene->materials[material]);
        }
    }
    free(asked);
    return found;
}

bool bd_scene_lights_yield(const struct bd_scene *scene, bool to_emitters, bool to_environment)
{
    const bool is_rig = scene->placed_light_count > 0 && scene->placed_lights[0].node == BD_NONE;
    if (!is_rig) return false;
    return (to_environment && scene->features.has_environment) ||
           (to_emitters && scene->features.has_emissive && some_surface_shines(scene));
}
