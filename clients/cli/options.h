// What was asked on the command line, decoded and range-checked. Strings are borrowed from argv,
// but for those of a frame.
//
// Names that the server knows better (techniques, cameras, layers, keys of --set) are passed on
// unchecked: it refuses them with the list that holds for it. Thread: main.

#ifndef BD_CLI_OPTIONS_H
#define BD_CLI_OPTIONS_H

#include <stdbool.h>
#include <stdint.h>

#include "base/err.h"
#include "protocol/bounced.pb-c.h"

#define BD_CLI_AT_MAX 64

// Where to, and how to speak: every command has these.
struct bd_cli_common {
    const char *server;     // NULL: the default socket, else a private daemon
    const char *token_file; // NULL: none
    const char *device;     // of the private daemon; NULL: its default
    bool quick_code;        // of the private daemon: for one that renders little
    bool json, quiet;
};

enum bd_cli_format { BD_CLI_NONE, BD_CLI_PNG, BD_CLI_JPEG, BD_CLI_EXR };
// "none", "png", "jpeg", "exr": FrameRequest.encoding on the wire.
const char *bd_cli_format_name(enum bd_cli_format format);

struct bd_cli_render {
    struct bd_cli_common common;
    const char *scene;  // a path, or "scene:ID"
    const char *output; // path, "-" for standard output, NULL for none
    enum bd_cli_format format;
    const char *report; // path, NULL for none
    Bounced__FrameRequest *frame; // what it is to be; bd_cli_frame_finish frees it
    const char *environment; // "R,G,B" or an .exr or .hdr; NULL = none
    uint64_t fail_on;        // flags that make the exit code 5, bits of enum bd_flag
    bool strict;             // any flag does
    bool help;
};

struct bd_cli_reference {
    struct bd_cli_common common;
    const char *scene, *output, *report, *environment;
    Bounced__FrameRequest *frame; // without samples; bd_cli_frame_finish frees it
    uint32_t spp; // what the file is to have
    bool has_spp;
    double time_limit_s; // 0 = none
    bool filter_noise, force, help;
};

// Takes NULL: options that were not read.
void bd_cli_frame_finish(Bounced__FrameRequest **frame);

// Decodes the words behind `bounce reference`.
BD_MUST_CHECK
enum bd_err bd_cli_parse_reference(const char *const *words, int count,
                                   struct bd_cli_reference *out, struct bd_err_detail *detail);

#define BD_CLI_SCENE_OPERANDS 4

// Of `scene`, `edit` and `watch`: what they are about, and the options of each.
struct bd_cli_scene {
    struct bd_cli_common common;
    const char *operands[BD_CLI_SCENE_OPERANDS]; // verb and objects; "" where there is none
    int operand_count;
    const char *environment; // of add; NULL = none
    bool has_after;          // of log
    uint64_t after;
    uint32_t limit;  // of log; 0 = the server's default
    bool remove;     // of name
    bool keep_going; // of edit
    bool help_ops;   // of edit
    const char *by;  // of edit, undo, redo, commit, revert: within the token or user; NULL = none
    bool all;        // of undo and redo: whoever did it
    uint64_t count;  // of watch: events; 0 = no end
    bool help;
};

// Decodes the words behind `bounce scene`, `bounce edit`, `bounce watch`.
BD_MUST_CHECK
enum bd_err bd_cli_parse_scene(const char *const *words, int count, struct bd_cli_scene *out,
                               struct bd_err_detail *detail);
BD_MUST_CHECK
enum bd_err bd_cli_parse_edit(const char *const *words, int count, struct bd_cli_scene *out,
                              struct bd_err_detail *detail);
BD_MUST_CHECK
enum bd_err bd_cli_parse_watch(const char *const *words, int count, struct bd_cli_scene *out,
                               struct bd_err_detail *detail);

struct bd_cli_replay {
    const char *journal; // a file, or a data directory
    const char *scene;   // the journal's id; NULL: all
    uint64_t to;         // the last revision; 0: the newest
    bool check;          // each revision's hash against the journal's
    const char *render;  // a frame of the end; NULL: none
    const char *frames;  // a directory for one of every `every`th revision; NULL: none
    uint64_t every;
    uint64_t at[BD_CLI_AT_MAX]; // of these instead
    uint32_t at_count;
    // How frames are rendered, and the common options; its `scene`, `output` and `report` are
    // unset.
    struct bd_cli_render frame;
    bool help;
};

// Decodes the words behind `bounce replay`. Fills `out` in place, as bd_cli_parse_render does.
BD_MUST_CHECK
enum bd_err bd_cli_parse_replay(const char *const *words, int count, struct bd_cli_replay *out,
                                struct bd_err_detail *detail);

// Decodes the words behind `bounce render`. BD_ERR_USAGE names the option and what it allows.
BD_MUST_CHECK
enum bd_err bd_cli_parse_render(const char *const *words, int count, struct bd_cli_render *out,
                                struct bd_err_detail *detail);

// Decodes the words of a command that takes only the common options and operands: at most
// `operand_max` of them, which `*operand_count` then counts.
BD_MUST_CHECK
enum bd_err bd_cli_parse_plain(const char *const *words, int count, struct bd_cli_common *out,
                               const char **operands, int operand_max, int *operand_count,
                               bool *help, struct bd_err_detail *detail);

#endif
