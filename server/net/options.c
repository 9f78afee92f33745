#include "net/options.h"

#include <errno.h>
#include <grp.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "base/nearest.h"

#define CONFIG_LINE_MAX 4096

static enum bd_err read_config(struct bd_options *options, const char *path,
                               struct bd_err_detail *detail);

static const char *keep(struct bd_options *options, const char *text)
{
    char *copy = strdup(text);
    char **owned = realloc(options->owned, (options->owned_count + 1) * sizeof *owned);
    BD_ASSERT(copy && owned);
    options->owned = owned;
    owned[options->owned_count++] = copy;
    return copy;
}

static enum bd_err read_number(const char *name, const char *text, unsigned long most,
                               unsigned long *out, struct bd_err_detail *detail)
{
    char *end;
    errno = 0;
    *out = strtoul(text, &end, 10);
    if (*text >= '0' && *text <= '9' && *end == 0 && !errno && *out <= most) return BD_ERR_OK;
    return bd_err_set(detail, BD_ERR_USAGE, name, "--%s takes a number from 0 to %lu, not \"%s\"",
                      name, most, text);
}

static enum bd_err set_http(struct bd_options *options, const char *value,
                            struct bd_err_detail *detail)
{
    (void)detail;
    options->http = keep(options, value);
    return BD_ERR_OK;
}

static enum bd_err set_listen(struct bd_options *options, const char *value,
                              struct bd_err_detail *detail)
{
    if (options->listen_count == BD_NET_LISTEN_MAX)
        return bd_err_set(detail, BD_ERR_USAGE, "listen", "there are more than %d listens",
                          BD_NET_LISTEN_MAX);
    options->listens[options->listen_count++] = keep(options, value);
    return BD_ERR_OK;
}

static enum bd_err set_data(struct bd_options *options, const char *value,
                            struct bd_err_detail *detail)
{
    (void)detail;
    options->data = keep(options, value);
    return BD_ERR_OK;
}

static enum bd_err set_device(struct bd_options *options, const char *value,
                              struct bd_err_detail *detail)
{
    (void)detail;
    options->device = keep(options, value);
    return BD_ERR_OK;
}

static enum bd_err set_token_file(struct bd_options *options, const char *value,
                                  struct bd_err_detail *detail)
{
    (void)detail;
    options->token_file = keep(options, value);
    return BD_ERR_OK;
}

// Reading and writing are what it takes to connect, and never less than for ourselves.
static enum bd_err set_socket_mode(struct bd_options *options, const char *value,
                                   struct bd_err_detail *detail)
{
    char *end;
    unsigned long mode = strtoul(value, &end, 8);
    if (*value >= '0' && *value <= '7' && *end == 0 && (mode & 0600) == 0600 && mode <= 0666 &&
        (mode & 0111) == 0) {
        options->socket_mode = (mode_t)mode;
        return BD_ERR_OK;
    }
    return bd_err_set(detail, BD_ERR_USAGE, "socket-mode",
                      "--socket-mode takes 0600, 0660 or 0666, not \"%.40s\"", value);
}

static enum bd_err set_socket_group(struct bd_options *options, const char *value,
                                    struct bd_err_detail *detail)
{
    const struct group *group = getgrnam(value);
    unsigned long number = 0;
    if (!group && (*value < '0' || *value > '9' ||
                   read_number("socket-group", value, UINT32_MAX - 1, &number, detail)))
        return bd_err_set(detail, BD_ERR_USAGE, "socket-group",
                          "this machine has no group \"%.40s\"", value);
    options->has_socket_group = true;
    options->socket_group = group ? group->gr_gid : (gid_t)number;
    return BD_ERR_OK;
}

static enum bd_err set_public_name(struct bd_options *options, const char *value,
                                   struct bd_err_detail *detail)
{
    // One place stays free: the list ends with a NULL.
    if (options->public_name_count == BD_NET_PUBLIC_NAME_MAX - 1)
        return bd_err_set(detail, BD_ERR_USAGE, "public-name", "there are more than %d names",
                          BD_NET_PUBLIC_NAME_MAX - 1);
    options->public_names[options->public_name_count++] = keep(options, value);
    return BD_ERR_OK;
}

static enum bd_err set_proxy(struct bd_options *options, const char *value,
                             struct bd_err_detail *detail)
{
    if (options->proxy_count == BD_PROXY_RANGE_MAX)
        return bd_err_set(detail, BD_ERR_USAGE, "proxy", "there are more than %d proxies",
                          BD_PROXY_RANGE_MAX);
    return bd_proxy_parse(value, &options->proxies[options->proxy_count++], detail);
}

static enum bd_err set_gpu_memory(struct bd_options *options, const char *value,
                                  struct bd_err_detail *detail)
{
    unsigned long mib = 0;
    enum bd_err err = read_number("gpu-memory", value, 1u << 24, &mib, detail);
    options->gpu_memory_mib = (uint32_t)mib;
    return err;
}

static enum bd_err set_code(struct bd_options *options, const char *value,
                            struct bd_err_detail *detail)
{
    options->quick_code = strcmp(value, "quick") == 0;
    if (options->quick_code || strcmp(value, "fast") == 0) return BD_ERR_OK;
    return bd_err_set(detail, BD_ERR_USAGE, "code", "--code is quick or fast, not \"%.40s\"",
                      value);
}

static enum bd_err set_sandbox(struct bd_options *options, const char *value,
                               struct bd_err_detail *detail)
{
    static const char *const names[] = {[BD_SANDBOX_AUTO] = "auto",
                                        [BD_SANDBOX_ON] = "on",
                                        [BD_SANDBOX_OFF] = "off",
                                        [BD_SANDBOX_LOG] = "log"};
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++)
        if (strcmp(value, names[i]) == 0) {
            options->sandbox = (enum bd_sandbox)i;
            return BD_ERR_OK;
        }
    return bd_err_set(detail, BD_ERR_USAGE, "sandbox",
                      "--sandbox is auto, on, off or log, not \"%.40s\"", value);
}

static enum bd_err set_limit(struct bd_options *options, const char *value,
                             struct bd_err_detail *detail)
{
    return bd_limits_set(&options->limits, value, detail);
}

static enum bd_err set_log(struct bd_options *options, const char *value,
                           struct bd_err_detail *detail)
{
    options->log_json = strcmp(value, "json") == 0;
    options->log_errors = strcmp(value, "errors") == 0;
    if (options->log_json || options->log_errors || strcmp(value, "text") == 0) return BD_ERR_OK;
    return bd_err_set(detail, BD_ERR_USAGE, "log", "--log is text, json or errors, not \"%s\"",
                      value);
}

static enum bd_err set_private(struct bd_options *options, const char *value,
                               struct bd_err_detail *detail)
{
    unsigned long fd = 0;
    enum bd_err err = read_number("private", value, 65535, &fd, detail);
    options->private_fd = (int)fd;
    return err;
}

static const struct option {
    const char *name;
    enum bd_err (*set)(struct bd_options *options, const char *value, struct bd_err_detail *detail);
    const char *help;
} table[] = {
    {"http", set_http,
     "HOST:PORT          the HTTP transport (default 127.0.0.1:7480; none = off)"},
    {"listen", set_listen, "unix:PATH|tcp:HOST:PORT  a framed transport, repeatable"},
    {"data", set_data, "DIR                scenes, blobs, shader caches"},
    {"device", set_device, "auto|software|egl:N|uuid:HEX|pci:ID"},
    {"code", set_code,
     "quick|fast          of a software device: generated sooner, for few small frames, or\n"
     "                            running faster (default)"},
    {"socket-mode", set_socket_mode,
     "0600|0660|0666  who may reach a Unix socket's file (default 0600)"},
    {"socket-group", set_socket_group,
     "GROUP      and the group that 0660 means (default our own)"},
    {"token-file", set_token_file,
     "FILE         who may do what: lines of TOKEN, uid:USER, gid:GROUP or uid:* and, behind it,\n"
     "                            role=read|edit|admin scenes=PREFIX max_scenes=N max_bytes=N "
     "max_jobs=N;\n"
     "                            not readable by others. On a Unix socket our own user and root "
     "need no line"},
    {"public-name", set_public_name, "NAME        a host name that browsers may call us by"},
    {"proxy", set_proxy,
     "ADDRESS[/BITS]|unix:PATH  whose connections begin with a PROXY header of version 2, "
     "repeatable"},
    {"gpu-memory", set_gpu_memory, "MIB          what may be taken of the device's memory"},
    {"sandbox", set_sandbox,
     "auto|on|off|log  files and system calls that the daemon needs, and no others: auto = as far "
     "as\n"
     "                            the kernel can, calls with software devices alone; on = all, or "
     "no start;\n"
     "                            log = calls are named in the kernel's log, and done"},
    {"limit", set_limit, "NAME=VALUE        see protocol/limits.h; repeatable"},
    {"config", read_config, "FILE             more options, one `key value` a line"},
    {"log", set_log, "text|json|errors     lines of text, or of JSON; or text of errors alone"},
    {"private", set_private, "FD              serve one inherited socket, then end"},
};
#define OPTION_COUNT (sizeof table / sizeof table[0])

static enum bd_err set_option(struct bd_options *options, const char *name, size_t length,
                              const char *value, struct bd_err_detail *detail)
{
    for (size_t i = 0; i < OPTION_COUNT; i++)
        if (strlen(table[i].name) == length && strncmp(table[i].name, name, length) == 0) {
            if (value) return table[i].set(options, value, detail);
            return bd_err_set(detail, BD_ERR_USAGE, table[i].name, "--%s takes a value",
                              table[i].name);
        }
    char word[64], hint[BD_NEAREST_HINT_BYTES];
    struct bd_nearest nearest;
    snprintf(word, sizeof word, "%.*s", (int)length, name);
    bd_nearest_begin(&nearest, word);
    for (size_t i = 0; i < OPTION_COUNT; i++) bd_nearest_consider(&nearest, table[i].name);
    return bd_err_set(detail, BD_ERR_USAGE, "", "there is no option \"%s\"%s", word,
                      bd_nearest_hint(&nearest, hint));
}

static enum bd_err read_config_line(struct bd_options *options, char *line,
                                    struct bd_err_detail *detail)
{
    char *key = line + strspn(line, " \t");
    key[strcspn(key, "\r\n")] = 0;
    if (*key == 0 || *key == '#') return BD_ERR_OK;
    size_t length = strcspn(key, " \t");
    char *value = key + length + strspn(key + length, " \t");
    if (length == strlen("config") && strncmp(key, "config", length) == 0)
        return bd_err_set(detail, BD_ERR_USAGE, "config", "a config file cannot name another");
    return set_option(options, key, length, *value ? value : NULL, detail);
}

// The error of a line, with where it stands.
static enum bd_err at_line(const char *path, unsigned number, struct bd_err_detail *detail)
{
    if (!detail) return BD_ERR_USAGE;
    struct bd_err_detail inner = *detail;
    return bd_err_set(detail, inner.err, inner.field, "%s, line %u: %s", path, number,
                      inner.message);
}

static enum bd_err read_config(struct bd_options *options, const char *path,
                               struct bd_err_detail *detail)
{
    if (options->config_count == BD_NET_CONFIG_MAX)
        return bd_err_set(detail, BD_ERR_USAGE, "config", "there are more than %d config files",
                          BD_NET_CONFIG_MAX);
    options->configs[options->config_count++] = keep(options, path);
    FILE *file = fopen(path, "re");
    if (!file) return bd_err_set(detail, BD_ERR_USAGE, "config", "%s: %s", path, strerror(errno));
    char line[CONFIG_LINE_MAX];
    enum bd_err err = BD_ERR_OK;
    unsigned number = 0;
    while (!err && fgets(line, sizeof line, file)) {
        err = read_config_line(options, line, detail);
        number++;
    }
    fclose(file);
    return err ? at_line(path, number, detail) : BD_ERR_OK;
}

static bool read_flag(struct bd_options *options, const char *argument)
{
    if (strcmp(argument, "--version") == 0)
        options->shows_version = true;
    else if (strcmp(argument, "--help") == 0)
        options->shows_help = true;
    else if (strcmp(argument, "--list-devices") == 0)
        options->lists_devices = true;
    else if (strcmp(argument, "--accept-journal") == 0)
        options->accepts_journal = true; // for one start: no config file can say so
    else if (strcmp(argument, "--debug") == 0)
        options->log_debug = true;
    else
        return false;
    return true;
}

enum bd_err bd_options_read(struct bd_options *options, int argc, char **argv,
                            struct bd_err_detail *detail)
{
    *options = (struct bd_options){.http = "127.0.0.1:7480",
                                   .device = "auto",
                                   .socket_mode = BD_NET_SOCKET_MODE,
                                   .limits = bd_limits_default,
                                   .private_fd = -1,
                                   .argc = argc,
                                   .argv = argv};
    for (int i = 1; i < argc; i++) {
        if (read_flag(options, argv[i])) continue;
        if (strncmp(argv[i], "--", 2) != 0)
            return bd_err_set(detail, BD_ERR_USAGE, "", "\"%s\" is no option", argv[i]);
        const char *name = argv[i] + 2;
        size_t length = strcspn(name, "=");
        const char *value = name[length] == '=' ? name + length + 1 : NULL;
        if (!value && i + 1 < argc) value = argv[++i];
        enum bd_err err = set_option(options, name, length, value, detail);
        if (err) return err;
    }
    return BD_ERR_OK;
}

void bd_options_finish(struct bd_options *options)
{
    for (uint32_t i = 0; i < options->owned_count; i++) free(options->owned[i]);
    free(options->owned);
    *options = (struct bd_options){0};
}

void bd_options_print_help(FILE *out)
{
    fputs("usage: bounced [OPTION]...\n\n", out);
    for (size_t i = 0; i < OPTION_COUNT; i++)
        fprintf(out, "  --%s %s\n", table[i].name, table[i].help);
    fputs("  --accept-journal          once, where a start says that the journal or its log is "
          "missing "
          "or old:\n"
          "                            what is there is taken for all that there was\n",
          out);
    fputs("  --debug --list-devices --version --help\n", out);
    fputs("\n"
          "SIGHUP reads --config files and the token file again. Tokens, public names,\n"
          "proxies and the limits of peers and requests count from then on; connections\n"
          "and sessions of tokens that are gone, or have other rights, end. What else has\n"
          "changed is named in the log and needs a restart: listeners, data, device,\n"
          "memory, the log's form, limits of scenes, pictures and what imports may use. A file with a\n"
          "fault changes nothing: one line says where it is. SIGTERM ends the daemon in\n"
          "good order.\n",
          out);
}
