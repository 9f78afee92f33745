// bounced: options, then the rooms opened in order and closed in reverse.

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/log.h"
#include "confine/confine.h"
#include "gpu/gpu.h"
#include "net/net.h"
#include "net/options.h"
#include "scene/blobs/blobs.h"
#include "scene/import/import.h"
#include "scene/journal/data_dir.h"
#include "scene/journal/journal.h"
#include "scene/store/store_journal.h"
#include "sched/sched.h"

static int fail(const struct bd_err_detail *detail)
{
    bd_log(BD_LOG_ERROR, "main", "%s", detail->message);
    return bd_err_exit_code(detail->err);
}

static char *list_devices_json(void)
{
    return bd_gpu_list_devices(true);
}

static int print_devices(const struct bd_options *options)
{
    char *text = bd_gpu_list_devices(options->log_json);
    if (text) puts(text);
    free(text);
    return text ? 0 : bd_err_exit_code(BD_ERR_DEVICE);
}

// Without --listen, a socket where only this user gets: its runtime directory.
static void add_default_listen(struct bd_options *options, char *buffer, size_t size)
{
    const char *runtime = getenv("XDG_RUNTIME_DIR");
    if (options->listen_count > 0 || options->private_fd >= 0 || !runtime) return;
    if ((size_t)snprintf(buffer, size, "unix:%s/bounced.sock", runtime) < size)
        options->listens[options->listen_count++] = buffer;
}

static enum bd_err check_listens(const struct bd_options *options, struct bd_err_detail *detail)
{
    if (options->listen_count > 0 || options->private_fd >= 0 || strcmp(options->http, "none") != 0)
        return BD_ERR_OK;
    return bd_err_set(detail, BD_ERR_USAGE, "listen",
                      "nothing to listen on: no --listen, no XDG_RUNTIME_DIR, and --http none");
}

static enum bd_err open_sched(const struct bd_options *options, const char *data_directory,
                              struct bd_sched **out, struct bd_err_detail *detail)
{
    const struct bd_limits *limits = &options->limits;
    struct bd_sched_options sched = {
        .device = options->device,
        .data_directory = data_directory,
        .disk_reserve_bytes = limits->disk_reserve_bytes,
        .quick_code = options->quick_code,
        .gpu_memory_mib = options->gpu_memory_mib,
        .queue_length_max = (uint32_t)limits->jobs_waiting,
        .frame_limits = {.side_px_max = (uint32_t)limits->image_side_px,
                         .pixel_count_max = limits->image_pixels,
                         .reply_bytes_max = limits->reply_bytes},
        .lose_device_after_slices = (uint32_t)limits->debug_lose_device_after_slices,
    };
    return bd_sched_create(&sched, out, detail);
}

static enum bd_err serve(const struct bd_options *options, struct bd_sched *sched,
                         struct bd_blobs *blobs, struct bd_store *store, struct bd_journal *journal,
                         struct bd_err_detail *detail)
{
    struct bd_net_options net_options = {
        .http =
            options->private_fd >= 0 || strcmp(options->http, "none") == 0 ? NULL : options->http,
        .private_fd = options->private_fd,
        .token_file = options->token_file,
        .socket_mode = options->socket_mode,
        .has_socket_group = options->has_socket_group,
        .socket_group = options->socket_group,
        .argc = options->argc,
        .argv = options->argv,
        .fixed = {options->data, options->device, options->gpu_memory_mib, options->log_json,
                  (int)options->sandbox, options->quick_code},
        .serving = {.limits = options->limits,
                    .proxy_count = options->proxy_count,
                    .sched = sched,
                    .blobs = blobs,
                    .store = store,
                    .journal = journal,
                    .list_devices = list_devices_json},
    };
    memcpy(net_options.listens, options->listens, sizeof net_options.listens);
    memcpy(net_options.public_names, options->public_names, sizeof net_options.public_names);
    memcpy(net_options.serving.proxies, options->proxies, sizeof net_options.serving.proxies);
    struct bd_net *net;
    enum bd_err err = bd_net_create(&net_options, &net, detail);
    if (err) return err;
    bd_net_run(net);
    bd_net_destroy(&net);
    return BD_ERR_OK;
}

// Before the first thread starts, for Landlock holds for those that come after it.
static enum bd_err confine_paths(const struct bd_options *options, const struct bd_data_dir *data,
                                 struct bd_err_detail *detail)
{
    const char *sockets[BD_NET_LISTEN_MAX + 1] = {NULL}, *again[BD_NET_CONFIG_MAX + 2] = {NULL};
    uint32_t socket_count = 0, again_count = 0;
    // What SIGHUP reads.
    for (uint32_t i = 0; i < options->config_count; i++) again[again_count++] = options->configs[i];
    if (options->token_file) again[again_count++] = options->token_file;
    for (uint32_t i = 0; i < options->listen_count; i++)
        if (strncmp(options->listens[i], "unix:", 5) == 0)
            sockets[socket_count++] = options->listens[i] + 5;
    const struct bd_confine_paths paths = {
        .data = data->path,
        .data_is_temporary = data->is_temporary,
        .read_again = again,
        .sockets = sockets,
    };
    bd_confine_privileges();
    return bd_confine_paths(options->sandbox, &paths, detail);
}

// After it, for what a driver does once it may do.
static enum bd_err confine_calls(const struct bd_options *options, struct bd_sched *sched,
                                 struct bd_err_detail *detail)
{
    struct bd_sched_stats stats;
    bd_sched_stats(sched, &stats);
    return bd_confine_calls(options->sandbox, stats.software, detail);
}

// The rooms, lowest first.
static enum bd_err run(const struct bd_options *options, struct bd_err_detail *detail)
{
    struct bd_data_dir data;
    bool is_temporary = options->private_fd >= 0 && !options->data;
    enum bd_err err = is_temporary ? bd_data_dir_open_temporary(&data, detail)
                                   : bd_data_dir_open(options->data, &data, detail);
    if (err) return err;

    struct bd_blobs *blobs = NULL;
    err = confine_paths(options, &data, detail);
    if (err) goto close_data;
    err = bd_blobs_open(data.path, &blobs, detail);
    if (err) goto close_data;
    struct bd_journal *journal = NULL;
    struct bd_store *store = bd_store_create((uint32_t)options->limits.scenes);
    err = options->accepts_journal ? bd_journal_open_as_it_is(data.path, &journal, detail)
                                   : bd_journal_open(data.path, &journal, detail);
    if (!err) err = bd_store_load(store, journal, detail);
    if (err) goto close_store;

    // A directory that is about to go keeps no shaders warm: the drivers' own place does.
    struct bd_sched *sched = NULL;
    err = open_sched(options, is_temporary ? NULL : data.path, &sched, detail);
    if (err) goto close_store;
    err = confine_calls(options, sched, detail);
    if (!err) err = serve(options, sched, blobs, store, journal, detail);
    bd_sched_destroy(&sched);
close_store:
    bd_store_destroy(&store);
    bd_journal_close(&journal);
    bd_blobs_close(&blobs);
close_data:
    bd_data_dir_close(&data);
    return err;
}

int main(int argc, char **argv)
{
    if (argc >= 2 && strcmp(argv[1], "--import") == 0) return bd_import_child_main(argc, argv);

    struct bd_options options;
    struct bd_err_detail detail = {0};
    enum bd_err err = bd_options_read(&options, argc, argv, &detail);
    bd_log_setup(options.log_debug    ? BD_LOG_DEBUG
                 : options.log_errors ? BD_LOG_ERROR
                                      : BD_LOG_INFO,
                 options.log_json);
    int status = 0;
    char default_listen[160];
    if (err) {
        status = fail(&detail);
    } else if (options.shows_version) {
        puts("bounced " BD_VERSION);
    } else if (options.shows_help) {
        bd_options_print_help(stdout);
    } else if (options.lists_devices) {
        status = print_devices(&options);
    } else {
        add_default_listen(&options, default_listen, sizeof default_listen);
        if (check_listens(&options, &detail) || run(&options, &detail)) status = fail(&detail);
    }
    bd_options_finish(&options);
    return status;
}
