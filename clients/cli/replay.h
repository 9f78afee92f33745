// One scene of a journal, played into a daemon revision by revision.
//
// The journal keeps what each revision changed as the daemon itself wrote it, and content by
// SHA-256: both go over as they are (SceneReplay), so that every revision comes out with the hash
// that it had. Imports need no glTF. Kinds, messages, authors, ids, times and names go along: undo
// works on from there. What is lost is the ids in a repeated edit's first answer. The same
// revision, frame options and device class give the same bytes, live, after a restart, and replayed
// (tests/e2e/test_replay.py). Thread: main.

#ifndef BD_CLI_REPLAY_H
#define BD_CLI_REPLAY_H

#include "clients/cli/conn.h"
#include "clients/cli/options.h"
#include "clients/cli/progress.h"
#include "scene/journal/journal.h"

struct bd_cli_replay_scene {
    char *id, *name;   // the journal's
    uint64_t revision; // its newest
};

// What is being played; the first four are the caller's.
struct bd_cli_player {
    const struct bd_cli_replay *options;
    struct bd_journal *journal;
    struct bd_cli_conn *conn;
    struct bd_cli_progress *progress;
    // Of all scenes together
    uint64_t played, differing, frames;
    char first_differing[96]; // "revision 7 of SCENE"
    // The scene under way
    const struct bd_cli_replay_scene *scene;
    char *into;    // its id at the daemon
    uint64_t last; // the revision to end with
    struct bd_cli_replay_name *names;
    uint32_t name_count;
};

// Plays one scene from the oldest state that the journal keeps to where the options say, prints a
// line for each revision, renders what is asked for. Ctrl-C: BD_ERR_CANCELLED. What was played
// stays.
BD_MUST_CHECK
enum bd_err bd_cli_replay_scene(struct bd_cli_player *player,
                                const struct bd_cli_replay_scene *scene,
                                struct bd_err_detail *detail);

// --- replay_print.c

// A revision that was played.
struct bd_cli_replay_line {
    uint64_t revision, of;
    const char *kind, *client_edit_id, *message;
    struct bd_journal_bytes summary; // entries, one a line
    const char *hash;                // what it came out as: "sha256:HEX"
    bool is_same;                    // as the journal's
    const char *frame;               // the file of a frame; NULL: none
};

// Before the first revision, where the line goes.
void bd_cli_replay_print_scene(const struct bd_cli_player *player);
BD_MUST_CHECK
enum bd_err bd_cli_replay_print(const struct bd_cli_player *player,
                                const struct bd_cli_replay_line *line,
                                struct bd_err_detail *detail);

#endif
