// The step from files to a scene: blobs or an uploaded body, mapped, parsed by the import child.

#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "base/clock.h"
#include "net/access/auth.h"
#include "net/command/command_internal.h"
#include "net/command/environment.h"
#include "net/command/import_cache.h"
#include "net/command/import_files.h"
#include "net/wire/multipart.h"
#include "scene/import/import.h"

static enum bd_err map_multipart(struct bd_command *command, struct bd_import_files *import)
{
    struct bd_multipart_part *parts;
    uint32_t part_count;
    enum bd_err err = bd_multipart_parse(
        import->maps[0].bytes, import->maps[0].size_bytes, command->body.boundary,
        (uint32_t)command->steps.loop->serving->limits.scene_files + 1, &parts, &part_count,
        &command->steps.detail);
    if (err) return err;
    free(import->files);
    import->files = calloc(part_count, sizeof *import->files);
    BD_ASSERT(import->files);
    // The main file goes first; it is the part called "scene".
    import->file_count = 1;
    for (uint32_t i = 0; i < part_count; i++) {
        bool is_main = strcmp(parts[i].name, "scene") == 0 && !import->files[0].bytes;
        if (!is_main && import->file_count == part_count) break; // no part is called "scene"
        uint32_t at = is_main ? 0 : import->file_count++;
        import->files[at] = (struct bd_import_file){
            .uri = parts[i].name, .bytes = parts[i].bytes, .size_bytes = parts[i].size_bytes};
    }
    if (!import->files[0].bytes)
        err = bd_err_set(&command->steps.detail, BD_ERR_USAGE, "scene",
                         "no part of the body is called \"scene\"");
    command->parts = parts; // the files' names lie in them
    return err;
}

static enum bd_err map_body(struct bd_command *command, struct bd_import_files *import)
{
    bd_import_files_begin(import, 1);
    enum bd_err err =
        bd_blob_upload_map(command->body.upload, &import->maps[0], &command->steps.detail);
    if (err) return err;
    import->map_count = 1;
    if (command->body.boundary[0]) return map_multipart(command, import);
    import->file_count = 1;
    import->files[0] = (struct bd_import_file){.uri = command->body.name,
                                               .bytes = import->maps[0].bytes,
                                               .size_bytes = import->maps[0].size_bytes};
    return BD_ERR_OK;
}

static enum bd_err map_files(struct bd_command *command, struct bd_import_files *import)
{
    if (command->body.upload) return map_body(command, import);
    struct bd_blobs *blobs = bd_grant_blobs(command->steps.loop->serving->blobs, command->grant);
    if (command->envelope->body_case == BOUNCED__ENVELOPE__BODY_SCENE_ADD) {
        enum bd_err err = bd_blobs_check_room(blobs, 0, &command->steps.detail);
        if (err) return err;
        const Bounced__SceneAdd *add = command->envelope->scene_add;
        return bd_import_files_map(import, blobs, add->name, add->blob, add->files, add->n_files,
                                   &command->steps.detail);
    }
    const Bounced__Render *render = command->envelope->render;
    return bd_import_files_map(import, blobs, render->name, render->blob, render->files,
                               render->n_files, &command->steps.detail);
}

static const Bounced__Environment *environment_of(const Bounced__Envelope *envelope)
{
    return envelope->body_case == BOUNCED__ENVELOPE__BODY_SCENE_ADD
               ? envelope->scene_add->environment
               : envelope->render->environment;
}

static enum bd_err import_files(struct bd_command *command, const struct bd_import_files *import,
                                const struct bd_net_environment *sky)
{
    struct bd_commands *commands = command->commands;
    struct bd_import_limits limits = bd_import_limits_of(&command->steps.loop->serving->limits);
    uint8_t key[BD_SHA256_BYTES];
    const struct bd_environment *environment = sky ? &sky->environment : NULL;
    bd_import_cache_key(import->files, import->file_count, environment, key);
    command->scene = bd_import_cache_get(commands->import_cache, key);
    if (command->scene) return BD_ERR_OK;
    enum bd_err err =
        bd_import_under(commands->import_pool, import->files, import->file_count, &limits,
                        environment, &command->scene, &command->steps.detail);
    if (err) return err;
    // Behind authored_flag_count: in no hash, no flat form and no journal, and gone after the first
    // edit or a restart.
    if (sky && sky->negative_count)
        bd_scene_flag(command->scene, "environment_negative: %llu texels raised to 0",
                      (unsigned long long)sky->negative_count);
    uint64_t file_bytes = 0;
    for (uint32_t i = 0; i < import->file_count; i++) file_bytes += import->files[i].size_bytes;
    const struct bd_sky_map *map = sky ? sky->environment.map : NULL;
    if (map) file_bytes += (uint64_t)map->width_px * map->height_px * 3 * sizeof *map->rgb;
    bd_import_cache_put(commands->import_cache, key, file_bytes, command->scene);
    return BD_ERR_OK;
}

enum bd_err bd_command_import(struct bd_command *command)
{
    uint64_t start_ns = bd_clock_ns();
    struct bd_import_files import = {0};
    struct bd_net_environment sky = {0};
    const Bounced__Environment *environment = environment_of(command->envelope);
    enum bd_err err = map_files(command, &import);
    if (!err && environment)
        err = bd_net_environment_read(
            environment, bd_grant_blobs(command->steps.loop->serving->blobs, command->grant),
            command->commands->import_pool, &command->steps.loop->serving->limits, &sky,
            &command->steps.detail);
    if (!err && sky.turns_alone)
        err = bd_err_set(&command->steps.detail, BD_ERR_USAGE, "environment.rotation",
                         "there is no environment to turn: radiance, a map, or both");
    if (!err) err = import_files(command, &import, environment ? &sky : NULL);
    bd_net_environment_finish(&sky);
    bd_import_files_finish(&import);
    bd_blob_upload_abort(&command->body.upload);
    command->load_ms = bd_ms_since(start_ns);
    return err;
}

static size_t file_table_size(const Bounced__Envelope *envelope)
{
    return envelope->body_case == BOUNCED__ENVELOPE__BODY_SCENE_ADD ? envelope->scene_add->n_files
                                                                    : envelope->render->n_files;
}

enum bd_err bd_command_check_files(struct bd_command *command)
{
    uint64_t files_max = command->steps.loop->serving->limits.scene_files;
    if (file_table_size(command->envelope) > files_max)
        return bd_err_set(&command->steps.detail, BD_ERR_LIMIT, "scene_files",
                          "the table has more than %llu files (limit scene_files)",
                          (unsigned long long)files_max);
    return BD_ERR_OK;
}
