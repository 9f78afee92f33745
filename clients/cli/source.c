#include "clients/cli/source.h"

#include <float.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <unistd.h>

#include "clients/cli/print.h"
#include "clients/cli/upload.h"

#define HELD_SCENE "scene:" // SCENE is an id that the daemon knows, not a file

static bool is_held(const char *scene)
{
    return strncmp(scene, HELD_SCENE, strlen(HELD_SCENE)) == 0;
}

static bool is_map(const char *environment)
{
    const char *dot = strrchr(environment, '.');
    return dot && (strcasecmp(dot, ".exr") == 0 || strcasecmp(dot, ".hdr") == 0);
}

static bool read_radiance(const char *text, double out[3])
{
    for (int c = 0; c < 3; c++) {
        char *end;
        out[c] = strtod(text, &end);
        if (end == text || *end != (c < 2 ? ',' : 0)) return false;
        if (!(out[c] >= 0 && out[c] <= (double)FLT_MAX)) return false;
        text = end + 1;
    }
    return true;
}

static enum bd_err check_file(const char *path, struct bd_err_detail *detail)
{
    uint64_t size_bytes = 0;
    int fd = bd_cli_open_regular(path, &size_bytes, detail);
    if (fd < 0) return detail->err;
    close(fd);
    return BD_ERR_OK;
}

static enum bd_err check_environment(const char *scene, const char *environment,
                                     struct bd_err_detail *detail)
{
    double radiance[3];
    if (is_held(scene))
        return bd_err_set(detail, BD_ERR_USAGE, "environment",
                          "--environment goes with a file; a held scene has its own");
    if (is_map(environment)) return check_file(environment, detail);
    if (read_radiance(environment, radiance)) return BD_ERR_OK;
    return bd_err_set(detail, BD_ERR_USAGE, "environment",
                      "--environment %.60s: R,G,B in cd/m^2, each 0 or more, or a FILE.exr "
                      "or FILE.hdr",
                      environment);
}

enum bd_err bd_cli_source_check(const char *scene, const char *environment,
                                struct bd_err_detail *detail)
{
    enum bd_err err = is_held(scene) ? BD_ERR_OK : check_file(scene, detail);
    if (!err && environment) err = check_environment(scene, environment, detail);
    return err;
}

static void warn_missing(const struct bd_cli_files *files)
{
    for (const char *uri = files->missing; uri && *uri;) {
        int length = (int)strcspn(uri, "\n");
        bd_cli_print_line(stderr, "bounce: %.*s: no such file beside the scene", length, uri);
        uri += length + 1;
    }
}

static enum bd_err send_environment(struct bd_cli_source *source, const char *environment,
                                    struct bd_cli_conn *conn, struct bd_cli_progress *progress,
                                    struct bd_err_detail *detail)
{
    source->has_environment = true;
    bounced__environment__init(&source->environment);
    if (!is_map(environment)) {
        if (!read_radiance(environment, source->radiance))
            return check_environment(source->scene, environment, detail);
        source->environment.n_radiance = 3;
        source->environment.radiance = source->radiance;
        return BD_ERR_OK;
    }
    enum bd_err err = bd_cli_files_one(environment, &source->sky, detail);
    if (!err) err = bd_cli_upload(conn, &source->sky, progress, detail);
    if (!err) source->environment.map = source->sky.items[0].blob;
    return err;
}

enum bd_err bd_cli_source_send(struct bd_cli_source *out, const char *scene,
                               const char *environment, struct bd_cli_conn *conn,
                               struct bd_cli_progress *progress, struct bd_err_detail *detail)
{
    *out = (struct bd_cli_source){.scene = scene};
    if (is_held(scene)) return BD_ERR_OK;
    enum bd_err err = bd_cli_files_collect(scene, &out->files, detail);
    if (err) return err;
    warn_missing(&out->files);
    err = bd_cli_upload(conn, &out->files, progress, detail);
    if (!err && bd_cli_upload_table(&out->files, &out->table, &out->table_count))
        err = bd_err_set(detail, BD_ERR_NO_MEMORY, "scene", "no memory for the table of files");
    if (!err && environment) err = send_environment(out, environment, conn, progress, detail);
    return err;
}

void bd_cli_source_finish(struct bd_cli_source *source)
{
    bd_cli_upload_table_free(source->table);
    bd_cli_files_finish(&source->files);
    bd_cli_files_finish(&source->sky);
    source->table = NULL;
}

static char *name_of(const struct bd_cli_source *source)
{
    const char *slash = strrchr(source->scene, '/');
    return (char *)(slash ? slash + 1 : source->scene);
}

static Bounced__Environment *environment_of(const struct bd_cli_source *source)
{
    return source->has_environment ? (Bounced__Environment *)&source->environment : NULL;
}

void bd_cli_source_fill_render(const struct bd_cli_source *source, Bounced__Render *render)
{
    if (is_held(source->scene)) {
        render->scene = (char *)source->scene + strlen(HELD_SCENE);
        return;
    }
    render->name = name_of(source);
    render->blob = source->files.items[0].blob;
    render->files = source->table;
    render->n_files = source->table_count;
    render->environment = environment_of(source);
}

void bd_cli_source_fill_add(const struct bd_cli_source *source, Bounced__SceneAdd *add)
{
    add->name = name_of(source);
    add->blob = source->files.items[0].blob;
    add->files = source->table;
    add->n_files = source->table_count;
    add->environment = environment_of(source);
}
