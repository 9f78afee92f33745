#include "clients/cli/help.h"

#include <stdio.h>
#include <string.h>

#include "base/flags.h"
#include "clients/cli/options_common.h"
#include "clients/cli/print.h"
#include "image/metric.h"

#define COMMON_HELP                                                                                \
    "  --server URL         unix:PATH or tcp:HOST:PORT (default: the daemon of this user, at\n"    \
    "                       $XDG_RUNTIME_DIR/bounced.sock)\n"                                      \
    "  --token-file FILE    the server's token, in the first line\n"

#define START_HELP                                                                                 \
    "  --device SPEC        start a private daemon on this device: auto, software, egl:N,\n"       \
    "                       uuid:HEX, pci:ID\n"

#define END_HELP                                                                                   \
    "  --json               the answer, or the error, as JSON on standard output\n"                \
    "  -q, --quiet          no progress and no notes\n"                                            \
    "  -h, --help           this text\n"

#define TEXT_COLUMN 23
#define LINE_END    90

// Words between that column and the end of a line, from `column` on.
static void print_wrapped(const char *text, int *column)
{
    while (*text) {
        const int length = (int)strcspn(text, " ");
        if (*column + 1 + length > LINE_END) *column = printf("\n%*s", TEXT_COLUMN - 1, "") - 1;
        *column += printf(" %.*s", length, text);
        text += length + (text[length] == ' ');
    }
}

// Words that the form says already are not said again.
static bool says_takes(const struct bd_frame_option *option)
{
    if (option->words && !option->or_number) return !strchr(option->form, '|');
    return option->least < option->most;
}

// "--name FORM", what it is, what it takes, and what holds without it.
static void print_frame_option(const struct bd_frame_option *option)
{
    char name[80], takes[BD_FRAME_OPTION_TAKES_BYTES];
    snprintf(name, sizeof name, "%s", option->name);
    for (char *c = name; *c; c++) *c = *c == '_' ? '-' : *c;
    int column =
        printf("  --%s%s%s", name, option->form ? " " : "", option->form ? option->form : "");
    if (column >= TEXT_COLUMN) column = printf("\n") - 1;
    column += printf("%*s", TEXT_COLUMN - 1 - column, "");
    if (option->alias) {
        char also[80];
        snprintf(also, sizeof also, "or --%s:", option->alias);
        print_wrapped(also, &column);
    }
    print_wrapped(option->help, &column);
    if (says_takes(option)) {
        column += printf(":");
        print_wrapped(bd_frame_option_takes(option, takes), &column);
    }
    if (option->standard) {
        print_wrapped("(default", &column);
        print_wrapped(option->standard, &column);
        printf(")");
    }
    putchar('\n');
}

static void print_frame_options(bool (*has)(const struct bd_frame_option *option))
{
    for (uint32_t i = 0; i < bd_frame_option_count; i++)
        if (has(&bd_frame_options[i])) print_frame_option(&bd_frame_options[i]);
}

int bd_help(void)
{
    fputs(
        "usage: bounce COMMAND ...\n"
        "\n"
        "  render SCENE -o FILE   one frame of a .glb or .gltf as PNG, JPEG or EXR\n"
        "  reference SCENE -o F   the same, path-traced: EXR with halves and variances, resumable\n"
        "  compare REF IMAGE      how wrong an image is against a reference, with intervals\n"
        "  devices                the devices that frames can be rendered on\n"
        "  techniques             what frames can be rendered with, and its parameters\n"
        "  scenes                 the scenes that the daemon holds\n"
        "  scene add FILE         gives the daemon a scene; its line begins with the id\n"
        "  scene rm ID            takes it away\n"
        "  scene log|export|revert|name|undo|redo|commit ID    its history\n"
        "  edit ID FILE.json|-    changes it, batch by batch\n"
        "  watch [ID]             says what becomes of it\n"
        "  replay JOURNAL         plays what a data directory's journal holds, edit by edit\n"
        "  stability              every technique through the inputs that break renderers\n"
        "  bench                  error against run time, as tables and one HTML page\n"
        "\n"
        "  bounce COMMAND --help  the options of one\n"
        "  bounce --version\n"
        "\n"
        "Exit codes: 0 ok, 1 images differ or a technique failed, 2 usage, 3 no reference,\n"
        "4 bad input, 5 budget missed or no room, 6 device wrong or missing, 7 server not\n"
        "reached or token refused, 130 interrupted.\n",
        stdout);
    return 0;
}

static json_t *option_json(const struct bd_frame_option *option)
{
    char takes[BD_FRAME_OPTION_TAKES_BYTES];
    bool has_many;
    const char *type = bd_frame_option_type(option, &has_many);
    return json_pack("{s:s, s:s, s:b, s:i, s:s, s:s?, s:s}", "name", option->name, "type", type,
                     "many", has_many, "count", (int)option->count, "takes",
                     bd_frame_option_takes(option, takes), "standard", option->standard, "help",
                     option->help);
}

static int print_options_json(void)
{
    json_t *options = json_array();
    for (uint32_t i = 0; i < bd_frame_option_count; i++)
        json_array_append_new(options, option_json(&bd_frame_options[i]));
    const bool ok = bd_cli_print_json_line(stdout, options, JSON_INDENT(1));
    json_decref(options);
    return ok ? 0 : bd_err_exit_code(BD_ERR_NO_MEMORY);
}

int bd_help_render(bool as_json)
{
    if (as_json) return print_options_json();
    fputs("usage: bounce render SCENE -o FILE [options]\n"
          "\n"
          "Renders one frame. SCENE is a .glb or .gltf file, or scene:ID for one that the daemon\n"
          "holds. Where no daemon runs, a private one is started and ended. Without -o one of\n"
          "--plan, --report and --json must say what is wanted instead of a picture.\n"
          "\n"
          "  -o, --output FILE    .png, .jpg (.jpeg) or .exr; - writes PNG to standard output\n",
          stdout);
    print_frame_options(bd_cli_of_render);
    fputs("  --fail-on FLAG[,FLAG]\n"
          "                       exit code 5 where the frame has such a flag, as for blank_frame\n"
          "                       anyway (none,FLAG: for these alone), for a deadline and for a "
          "target\n"
          "                       that are missed; repeatable\n"
          "  --strict             exit code 5 for any flag\n"
          "  --environment R,G,B|FILE\n"
          "                       light from infinitely far away: cd/m^2, or an .exr or .hdr\n"
          "  --report FILE.json   write the frame's report\n" START_HELP COMMON_HELP END_HELP "\n"
          "Flags of frames, whose names --fail-on takes:\n",
          stdout);
    for (int f = 0; f < BD_FLAG_COUNT; f++)
        printf("  %-24s %s\n", bd_flag_name((enum bd_flag)f), bd_flag_what((enum bd_flag)f));
    return 0;
}

int bd_help_reference(void)
{
    fputs(
        "usage: bounce reference SCENE -o FILE.exr [options]\n"
        "\n"
        "Path-traces the scene on the processor. The file holds the light in its parts, twice: "
        "two\n"
        "halves of the samples that share no random number; and the variances of the means. It is\n"
        "written every now and then; Ctrl-C keeps what there is, and the same command with the\n"
        "same or a larger --spp goes on from the file.\n"
        "\n"
        "  -o, --output FILE.exr\n"
        "  --spp N              samples a pixel, both halves together (default 64; with\n"
        "                       --time-limit alone as many as fit)\n"
        "  --time-limit SECONDS stop tracing then, and keep what there is\n"
        "  --force              start anew, whatever FILE.exr is\n"
        "  --bounces N|inf      of indirect light (default inf)\n"
        "  --indirect-visibility on|off    (default on)\n"
        "  --lights KINDS       punctual, emissive, environment, joined by +; all (default)\n"
        "  --filter point|box   through the pixel's centre (default), or over the pixel\n"
        "  --alpha mask|coverage   BLEND as the rasterizer draws it, or as coverage (default)\n"
        "  --filter-noise       smooth direct, indirect and beauty as far as their noise goes;\n"
        "                       halves and variances stay as they were traced\n"
        "  --clamp B            bound on cos cos / r^2 between surfaces, 1/m^2 (default inf)\n"
        "  --model-of TECHNIQUE presets bounces, visibility, lights, alpha and more to what that\n"
        "                       technique's model says: its own limit\n",
        stdout);
    print_frame_options(bd_cli_of_reference);
    fputs("  --environment R,G,B|FILE\n"
          "                       light from infinitely far away: cd/m^2, or an .exr or .hdr\n"
          "  --report FILE.json   write the report\n" START_HELP COMMON_HELP END_HELP,
          stdout);
    return 0;
}

int bd_help_compare(void)
{
    fputs(
        "usage: bounce compare REFERENCE IMAGE [options]\n"
        "\n"
        "How wrong IMAGE is, each figure with an interval of 95 %. Both are EXR, PNG (8 or 16\n"
        "bits) or JPEG. A reference with two halves (bounce reference writes them) does not count\n"
        "its own noise as error; an IMAGE with halves loses its noise too. PNG and JPEG are what\n"
        "a display shows: sRGB, decoded to linear, 0 to 1; an EXR beside one is shown with the\n"
        "other's exposure and tone curve, where it says so.\n"
        "\n"
        "  --half FILE          the second half of a REFERENCE that is a plain EXR\n"
        "  --layer NAME         beauty (default), direct, indirect, emission, ...; repeatable\n"
        "  --map FILE.png       where the error is: |I - R| over the mean, 0.001 to 10\n"
        "  --tolerance N=VALUE  exit 1 if the figure N of this list is worse; repeatable. It\n"
        "                       looks at the value; N.high (of psnr and ssim N.low) at the "
        "interval's\n"
        "                       worse end. Pixels that are NaN or infinite miss any tolerance\n"
        "                       but nonfinite=COUNT\n"
        "  --ppd N              pixels per degree of FLIP's observer (default 67.02)\n"
        "  --ignore filter      compare although the pixel filters differ\n" END_HELP "\n"
        "With --json one layer's figures are the object's own members, several layers' lie under\n"
        "their names in `layers`; null is infinite, or what cannot be said.\n"
        "\n"
        "Figures, and with --json names of objects {value, low, high}:\n",
        stdout);
    for (int i = 0; i < BD_METRIC_COUNT; i++)
        printf("  %-20s %s\n", bd_metric_name((enum bd_metric)i),
               bd_metric_what((enum bd_metric)i));
    fputs("\n"
          "Exit codes: 0 measured, 1 a tolerance missed, or sizes, layers or filters differ,\n"
          "2 usage, 3 no reference there, 4 a file that cannot be read.\n",
          stdout);
    return 0;
}

int bd_help_scenes(void)
{
    fputs("usage: bounce scenes [options]\n"
          "       bounce scene add FILE [--environment R,G,B|FILE] [options]\n"
          "       bounce scene rm ID [options]\n"
          "       bounce scene log ID [--after REVISION] [--limit N] [options]\n"
          "       bounce scene undo ID | redo ID [--all] [--by NAME] [options]\n"
          "       bounce scene commit ID [--by NAME] [options]\n"
          "       bounce scene revert ID REVISION|NAME [--by NAME] [options]\n"
          "       bounce scene name ID NAME [REVISION] [--remove] [options]\n"
          "       bounce scene export ID FILE.glb|- [REVISION|NAME] [options]\n"
          "\n"
          "undo, redo and revert make a new revision; nothing is lost. undo and redo are of\n"
          "one's own edits, and refused where others changed the same since; --all takes back\n"
          "whatever was done last. Whose an edit is says the log: the token or the user, and the\n"
          "NAME of --by. commit makes one revision of what they laid transient. A name keeps the state that it names;\n"
          "revert and export take a word of digits as a revision. An export is the scene as it is\n"
          "shown, or as it was, in one file; what glTF cannot hold is said as flags.\n"
          "\n" COMMON_HELP END_HELP,
          stdout);
    return 0;
}

int bd_help_edit(void)
{
    fputs(
        "usage: bounce edit SCENE_ID FILE.json|- [options]\n"
        "\n"
        "Applies batches of edits: one JSON document after the other, each wholly or not at\n"
        "all, each answered by a line of JSON on standard output before the next is read.\n"
        "\n"
        "  {\"message\": \"a lamp\",\n"
        "   \"ops\": [{\"add_light\": {\"kind\": \"point\", \"intensity\": 5}},\n"
        "           {\"add_node\": {\"light\": -2}}]}\n"
        "\n"
        "The form is EditBatch of protocol/bounced.proto; -2 - k names what operation k adds.\n"
        "Names that are not in it are refused. The first batch that fails ends it, with its\n"
        "exit code.\n"
        "\n"
        "  -k, --keep-going     a failure is a line too, and the next batch is read;\n"
        "                       the exit code is that of the first\n"
        "  --by NAME            who does it, where a document does not say: for log and undo\n"
        "  --help-ops           every operation, with what its fields take\n" COMMON_HELP END_HELP,
        stdout);
    return 0;
}

int bd_help_watch(void)
{
    fputs("usage: bounce watch [SCENE_ID] [options]\n"
          "\n"
          "A line for each change of the scene, or of all scenes, until Ctrl-C.\n"
          "\n"
          "  --count N            end after N events\n" COMMON_HELP END_HELP,
          stdout);
    return 0;
}

int bd_help_replay(void)
{
    fputs("usage: bounce replay JOURNAL [options]\n"
          "\n"
          "Plays every scene of a journal (journal.sqlite, or the data directory around it, of no\n"
          "running daemon) into a daemon, revision by revision, and prints a line for each. The\n"
          "journal is only read. Where no daemon runs, a private one with a fresh data directory\n"
          "is started and ended.\n"
          "\n"
          "  --scene ID           this scene alone, by its id in the journal\n"
          "  --to REVISION        end there (default: the newest)\n"
          "  --check              compare each revision's hash with the journal's: exit 1 if any\n"
          "                       differs\n"
          "  --render FILE        one frame at the end: .png, .jpg (.jpeg) or .exr\n"
          "  --frames DIR         one of each revision, DIR/SCENE-REVISION.png\n"
          "  --every N            of revisions that N divides, and of the last\n"
          "  --at REVISION        of this one instead; repeatable\n"
          "  --format png|jpg|exr of --frames (default png)\n",
          stdout);
    print_frame_options(bd_cli_of_replay);
    fputs(START_HELP COMMON_HELP END_HELP, stdout);
    return 0;
}

int bd_help_devices(void)
{
    fputs("usage: bounce devices [options]\n"
          "\n"
          "Lists the devices of the running daemon's machine, or of this one. * is in use.\n"
          "\n" START_HELP COMMON_HELP END_HELP,
          stdout);
    return 0;
}

int bd_help_techniques(void)
{
    fputs("usage: bounce techniques [options]\n"
          "\n"
          "Lists the techniques of the running daemon, or of this one: their model of light\n"
          "transport, the tolerance that they declare, their parameters with ranges.\n"
          "\n" START_HELP COMMON_HELP END_HELP,
          stdout);
    return 0;
}
