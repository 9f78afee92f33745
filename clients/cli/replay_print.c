// What `bounce replay` says of each revision.

#include <inttypes.h>
#include <jansson.h>
#include <stdio.h>
#include <string.h>

#include "clients/cli/print.h"
#include "clients/cli/replay.h"

#define HASH_SHOWN ((int)strlen("sha256:") + 12)

void bd_cli_replay_print_scene(const struct bd_cli_player *player)
{
    if (player->options->frame.common.json) return;
    bd_cli_print_line(stdout, "%s \"%s\" is played into %s", player->scene->id, player->scene->name,
                      player->into);
}

static void print_changes(const struct bd_journal_bytes *summary)
{
    const char *at = summary->data, *end = at + summary->size;
    while (at < end) {
        const char *stop = memchr(at, '\n', (size_t)(end - at));
        int length = (int)((stop ? stop : end) - at);
        bd_cli_print(stdout, "%s%.*s", at == (const char *)summary->data ? "  (" : ", ", length,
                     at);
        at += length + 1;
    }
    if (summary->size) putchar(')');
}

static void print_text(const struct bd_cli_player *player, const struct bd_cli_replay_line *line)
{
    bd_cli_print(stdout, "%-6" PRIu64 " %-7s %.*s", line->revision, line->kind, HASH_SHOWN,
                 line->hash);
    if (player->options->check) printf("  %s", line->is_same ? "same" : "DIFFERS");
    if (line->of) printf("  of %" PRIu64, line->of);
    if (line->message[0]) bd_cli_print(stdout, "  %s", line->message);
    print_changes(&line->summary);
    if (line->frame) printf("  -> %s", line->frame);
    putchar('\n');
}

static json_t *changes_json(const struct bd_journal_bytes *summary)
{
    json_t *list = json_array();
    const char *at = summary->data, *end = at + summary->size;
    while (list && at < end) {
        const char *stop = memchr(at, '\n', (size_t)(end - at));
        size_t length = (size_t)((stop ? stop : end) - at);
        json_array_append_new(list, json_stringn(at, length));
        at += length + 1;
    }
    return list;
}

static bool print_json(const struct bd_cli_player *player, const struct bd_cli_replay_line *line)
{
    json_t *object =
        json_pack("{s:s, s:s, s:I, s:s, s:s, s:s, s:s, s:o}", "scene", player->scene->id, "into",
                  player->into, "revision", (json_int_t)line->revision, "kind", line->kind,
                  "client_edit_id", line->client_edit_id, "message", line->message, "hash",
                  line->hash, "changes", changes_json(&line->summary));
    if (!object) return false;
    if (line->of) json_object_set_new(object, "of", json_integer((json_int_t)line->of));
    if (player->options->check) json_object_set_new(object, "same", json_boolean(line->is_same));
    if (line->frame) json_object_set_new(object, "frame", json_string(line->frame));
    bool printed = bd_cli_print_json_line(stdout, object, JSON_COMPACT);
    json_decref(object);
    return printed;
}

enum bd_err bd_cli_replay_print(const struct bd_cli_player *player,
                                const struct bd_cli_replay_line *line, struct bd_err_detail *detail)
{
    if (!player->options->frame.common.json)
        print_text(player, line);
    else if (!print_json(player, line))
        return bd_err_set(detail, BD_ERR_NO_MEMORY, "", "no memory for a line");
    if (fflush(stdout) == 0) return BD_ERR_OK;
    return bd_err_set(detail, BD_ERR_IO, "", "standard output cannot be written to");
}
