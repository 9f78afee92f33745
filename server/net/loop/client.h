// Who asks: one record for each token, user of a Unix socket or, of strangers, address, however
// many connections it has. Holds its share of what is limited: requests a second, jobs under way,
// bytes of edits. Tokens that are none of ours are an address's affair, and count apart from its
// requests: whoever guesses takes nothing from those who share the address with it.
//
// Thread: the event loop's.

#ifndef BD_NET_LOOP_CLIENT_H
#define BD_NET_LOOP_CLIENT_H

#include <stdbool.h>
#include <stdint.h>

#include "base/err.h"
#include "protocol/limits.h"

struct bd_clients;

struct bd_bucket {
    double left;
    uint64_t refilled_ns;
};

struct bd_client {
    char key[80];         // "192.0.2.7", "uid:1000", "token:editor"
    uint32_t references;  // of connections, sessions, commands and views
    uint32_t connections; // open
    uint32_t jobs;        // under way: imports, exports and renders
    uint32_t views;       // open
    uint64_t edit_bytes;  // that edits under way have brought
    struct bd_bucket requests, failed_logins;
    struct bd_client *next;
};

struct bd_clients *bd_clients_create(const struct bd_limits *limits);
void bd_clients_destroy(struct bd_clients **clients);

// The record of `key`, made if need be, with a reference for the caller.
struct bd_client *bd_client_get(struct bd_clients *clients, const char *key);
void bd_client_retain(struct bd_client *client);
// Nulls. A record without references is kept until its bucket is full again: going away and coming
// back is no way around the rate.
void bd_client_release(struct bd_client **client);

// Takes one request out of the bucket. BD_ERR_BUSY, naming requests_per_second.
BD_MUST_CHECK
enum bd_err bd_client_take_request(struct bd_clients *clients, struct bd_client *client,
                                   struct bd_err_detail *detail);

// The same of a token that is none of ours. BD_ERR_BUSY, naming failed_logins_per_minute.
BD_MUST_CHECK
enum bd_err bd_client_take_failed_login(struct bd_clients *clients, struct bd_client *client,
                                        struct bd_err_detail *detail);

// Counts a job that starts. BD_ERR_BUSY, naming jobs_per_client. Paired with bd_client_end_job.
BD_MUST_CHECK
enum bd_err bd_client_begin_job(struct bd_clients *clients, struct bd_client *client,
                                struct bd_err_detail *detail);
void bd_client_end_job(struct bd_client *client);

// Counts what an edit brings, for as long as it is kept. BD_ERR_BUSY, naming edit_bytes_per_client,
// unless it is the only one: that is for message_bytes to say. Paired with bd_client_end_edit.
BD_MUST_CHECK
enum bd_err bd_client_begin_edit(struct bd_clients *clients, struct bd_client *client,
                                 uint64_t bytes, struct bd_err_detail *detail);
void bd_client_end_edit(struct bd_client *client, uint64_t bytes);

// Forgets records that nobody refers to and whose bucket is full. Call now and then.
void bd_clients_sweep(struct bd_clients *clients);

#endif
