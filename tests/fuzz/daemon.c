#include "tests/fuzz/daemon.h"

#include <arpa/inet.h>
#include <errno.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include "base/assert.h"
#include "net/net_internal.h"
#include "protocol/framing.h"
#include "protocol/wire.h"
#include "scene/journal/journal_identity.h"
#include "scene/store/store_journal.h"
#include "tests/fuzz/frames.h"
#include "tests/fuzz/golden.h"
#include "tests/fuzz/machine.h"
#include "tests/fuzz/pool.h"
#include "tests/journal/kit.h"

#define SETTLE_ROUNDS 4096
#define PUMP_ROUNDS   64

struct peer {
    bool is_connected;
    enum peer_kind kind;
    int fd;
    char start[16]; // of what it was sent
    size_t start_bytes;
    struct bd_decoder decoder;
};

static struct {
    char directory[64]; // for as long as the process
    struct bd_net_options options;
    struct bd_net *net;
    struct sockaddr_in http;
    struct sockaddr_un framed;
    struct peer peers[DAEMON_PEERS];
    uint64_t received_bytes;
    struct sigaction old_int, old_term;
} world;

static void expect(enum bd_err err, const struct bd_err_detail *detail)
{
    if (err) fprintf(stderr, "the daemon: %s: %s\n", detail->field, detail->message);
    BD_ASSERT_CMP(err, ==, BD_ERR_OK);
}

// --- what it stands on ------------------------------------------------------------------------

static char token_path[80], blobs_path[80], listen_text[96];

static void remove_directory(void)
{
    kit_remove_directory(world.directory);
}

static void make_directory(void)
{
    static const char tokens[] = DAEMON_TOKEN_READ
        " role=read name=reader scenes=first\n" DAEMON_TOKEN_EDIT
        " role=edit name=editor max_scenes=2 max_bytes=64K max_jobs=2\n" DAEMON_TOKEN_ADMIN
        " role=admin\n";
    kit_make_directory(world.directory);
    atexit(remove_directory);
    snprintf(token_path, sizeof token_path, "%s/tokens", world.directory);
    snprintf(blobs_path, sizeof blobs_path, "%s/blobs", world.directory);
    snprintf(listen_text, sizeof listen_text, "unix:%s/socket", world.directory);
    file_write(world.directory, "tokens", tokens, strlen(tokens));
    chmod(token_path, 0600);
    mkdir(blobs_path, 0700);
    world.framed.sun_family = AF_UNIX;
    snprintf(world.framed.sun_path, sizeof world.framed.sun_path, "%s", listen_text + 5);
}

static void put_files(void)
{
    static const char *const others[] = {BD_JOURNAL_FILE "-wal", BD_JOURNAL_FILE "-shm",
                                         BD_IDENTITY_FILE};
    const struct golden *golden = golden_get();
    for (size_t i = 0; i < sizeof others / sizeof others[0]; i++) {
        char path[128];
        snprintf(path, sizeof path, "%s/%s", world.directory, others[i]);
        unlink(path);
    }
    files_remove(blobs_path);
    file_write(world.directory, BD_JOURNAL_FILE, golden->whole.data, golden->whole.size);
}

static void set_limits(struct bd_limits *limits)
{
    *limits = bd_limits_default;
    limits->message_bytes = 65536;
    limits->header_bytes = 16384;
    limits->blob_bytes = 65536;
    limits->scenes = 4;
    limits->scene_files = 4;
    limits->picture_side_px = 64;
    limits->picture_texels = 65536;
    limits->scene_triangles = 65536;
    limits->image_side_px = 32;
    limits->image_pixels = 512;
    limits->jobs_waiting = 4;
    limits->jobs_per_client = 8;
    limits->requests_per_second = 100;
    limits->views_per_connection = 2;
    limits->views_per_client = 3;
    limits->view_credits = 4;
    limits->connections = DAEMON_PEERS;
    limits->resume_bytes = 1024;
    limits->cookies = 2;
}

static char *list_devices(void)
{
    return strdup("[{\"name\":\"none\",\"in_use\":true}]");
}

static void open_rooms(struct bd_serving *serving)
{
    struct bd_err_detail detail = {0};
    const struct bd_sched_options sched = {
        .queue_length_max = (uint32_t)serving->limits.jobs_waiting,
        .frame_limits = {.side_px_max = (uint32_t)serving->limits.image_side_px,
                         .pixel_count_max = serving->limits.image_pixels}};
    expect(bd_blobs_open(world.directory, &serving->blobs, &detail), &detail);
    serving->store = bd_store_create((uint32_t)serving->limits.scenes);
    expect(bd_journal_open(world.directory, &serving->journal, &detail), &detail);
    expect(bd_store_load(serving->store, serving->journal, &detail), &detail);
    expect(bd_sched_create(&sched, &serving->sched, &detail), &detail);
}

static void close_rooms(struct bd_serving *serving)
{
    bd_sched_destroy(&serving->sched);
    bd_store_destroy(&serving->store);
    bd_journal_close(&serving->journal);
    bd_blobs_close(&serving->blobs);
}

// Which port the system gave.
static void note_http(uv_handle_t *handle, void *user)
{
    int size = sizeof world.http;
    (void)user;
    if (handle->type == UV_TCP)
        uv_tcp_getsockname((uv_tcp_t *)handle, (struct sockaddr *)&world.http, &size);
}

void daemon_begin(bool has_tokens)
{
    if (!world.directory[0]) make_directory();
    put_files();
    sigaction(SIGINT, NULL, &world.old_int);
    sigaction(SIGTERM, NULL, &world.old_term);
    machine_begin(2);
    pool_begin();
    struct bd_err_detail detail = {0};
    world.options = (struct bd_net_options){.http = "127.0.0.1:0",
                                            .listens = {listen_text},
                                            .socket_mode = BD_NET_SOCKET_MODE,
                                            .private_fd = -1,
                                            .token_file = has_tokens ? token_path : NULL,
                                            .serving.list_devices = list_devices};
    set_limits(&world.options.serving.limits);
    open_rooms(&world.options.serving);
    expect(bd_net_create(&world.options, &world.net, &detail), &detail);
    uv_walk(&world.net->loop.uv, note_http, NULL);
}

void daemon_end(void)
{
    for (uint32_t i = 0; i < DAEMON_PEERS; i++) daemon_reset(i);
    daemon_settle();
    // Sessions that could be resumed end, quiet is over, and closing connections lose patience.
    for (int i = 0; i < 3; i++) {
        daemon_pass_ms(1000 * (world.options.serving.limits.resume_seconds + 1));
        daemon_settle();
    }
    BD_ASSERT_CMP(world.net->loop.conn_count, ==, 0);
    BD_ASSERT_CMP(world.net->commands.count, ==, 0);
    BD_ASSERT_CMP(world.net->live.view_count, ==, 0);
    BD_ASSERT_CMP(world.net->sessions.kept_bytes, ==, 0);
    BD_ASSERT_CMP(pool_count(), ==, 0);
    bd_net_destroy(&world.net);
    close_rooms(&world.options.serving);
    machine_end();
    sigaction(SIGINT, &world.old_int, NULL);
    sigaction(SIGTERM, &world.old_term, NULL);
}

// --- peers ------------------------------------------------------------------------------------

void daemon_connect(uint32_t at, enum peer_kind kind)
{
    struct peer *peer = &world.peers[at];
    daemon_reset(at);
    // Once it drains it does not listen any more.
    if (world.net->loop.draining) return;
    const bool is_http = kind == PEER_HTTP;
    int fd = socket(is_http ? AF_INET : AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    BD_ASSERT(fd >= 0);
    int result = is_http ? connect(fd, (struct sockaddr *)&world.http, sizeof world.http)
                         : connect(fd, (struct sockaddr *)&world.framed, sizeof world.framed);
    BD_ASSERT_CMP(result, ==, 0);
    *peer = (struct peer){.is_connected = true, .kind = kind, .fd = fd};
    bd_decoder_init(&peer->decoder, UINT32_MAX, UINT32_MAX);
    daemon_pump();
}

bool daemon_is_connected(uint32_t at)
{
    return world.peers[at].is_connected;
}

enum peer_kind daemon_peer_kind(uint32_t at)
{
    return world.peers[at].kind;
}

void daemon_send(uint32_t at, const void *bytes, size_t size)
{
    const struct peer *peer = &world.peers[at];
    // What does not fit into the socket is more than an input has; one that was closed takes none.
    if (peer->is_connected && size > 0) {
        ssize_t sent = send(peer->fd, bytes, size, MSG_NOSIGNAL | MSG_DONTWAIT);
        (void)sent;
    }
    daemon_pump();
}

void daemon_half_close(uint32_t at)
{
    if (world.peers[at].is_connected) shutdown(world.peers[at].fd, SHUT_WR);
    daemon_pump();
}

void daemon_reset(uint32_t at)
{
    // No port is left to wait for late packets.
    const struct linger now = {.l_onoff = 1};
    struct peer *peer = &world.peers[at];
    if (!peer->is_connected) return;
    setsockopt(peer->fd, SOL_SOCKET, SO_LINGER, &now, sizeof now);
    close(peer->fd);
    bd_decoder_finish(&peer->decoder);
    *peer = (struct peer){0};
    daemon_pump();
}

// --- what they are sent -----------------------------------------------------------------------

static void take_messages(struct peer *peer, const uint8_t *bytes, size_t size)
{
    while (size > 0) {
        size_t taken;
        struct bd_err_detail detail = {0};
        expect(bd_decoder_feed(&peer->decoder, bytes, size, &taken, &detail), &detail);
        bytes += taken;
        size -= taken;
        struct bd_message message;
        if (!bd_decoder_take(&peer->decoder, &message)) continue;
        Bounced__Envelope *envelope = NULL;
        expect(bd_envelope_decode(message.header, message.header_bytes, &envelope, &detail),
               &detail);
        BD_ASSERT(envelope->body_case != BOUNCED__ENVELOPE__BODY__NOT_SET);
        bd_envelope_free(&envelope);
        bd_message_finish(&message);
    }
}

static void look_at_start(struct peer *peer, const uint8_t *bytes, size_t size)
{
    static const char expected[] = "HTTP/1.1 ";
    for (size_t i = 0; i < size && peer->start_bytes < strlen(expected); i++) {
        BD_ASSERT_CMP(bytes[i], ==, expected[peer->start_bytes]);
        peer->start_bytes++;
    }
}

static void read_peer(struct peer *peer)
{
    static uint8_t bytes[65536];
    if (!peer->is_connected) return;
    for (ssize_t size; (size = recv(peer->fd, bytes, sizeof bytes, MSG_DONTWAIT)) > 0;) {
        world.received_bytes += (size_t)size;
        if (peer->kind == PEER_FRAMED)
            take_messages(peer, bytes, (size_t)size);
        else
            look_at_start(peer, bytes, (size_t)size);
    }
}

// --- the loop ---------------------------------------------------------------------------------

// Whatever changes when something happens.
static uint64_t progress(void)
{
    const struct bd_net *net = world.net;
    return net->loop.counts.bytes_in + net->loop.counts.bytes_out + net->loop.counts.requests +
           world.received_bytes + net->loop.conn_count + net->commands.count +
           net->live.view_count + pool_count();
}

void daemon_pump(void)
{
    uint64_t before;
    int quiet = 0;
    for (int i = 0; i < PUMP_ROUNDS && quiet < 2; i++) {
        before = progress();
        pool_pass_ms(0); // timers that do not wait
        uv_run(&world.net->loop.uv, UV_RUN_NOWAIT);
        for (uint32_t at = 0; at < DAEMON_PEERS; at++) read_peer(&world.peers[at]);
        quiet = progress() == before ? quiet + 1 : 0;
    }
}

void daemon_run_one(void)
{
    pool_run_one();
    daemon_pump();
}

void daemon_return_one(void)
{
    pool_return_one();
    daemon_pump();
}

void daemon_end_frame(void)
{
    frames_end_one(world.options.serving.sched);
    daemon_pump();
}

void daemon_settle(void)
{
    daemon_pump();
    for (int i = 0; i < SETTLE_ROUNDS; i++) {
        bool is_busy = pool_run_one();
        is_busy |= pool_return_one();
        is_busy |= frames_end_one(world.options.serving.sched);
        if (!is_busy) return;
        daemon_pump();
    }
    BD_ASSERT(!"the daemon never comes to rest");
}

void daemon_pass_ms(uint64_t ms)
{
    pool_pass_ms(ms);
    daemon_pump();
}

void daemon_drain(void)
{
    bd_net_begin_drain(world.net);
    daemon_pump();
}
