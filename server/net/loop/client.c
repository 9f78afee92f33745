#include "net/loop/client.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "base/clock.h"

struct bd_clients {
    const struct bd_limits *limits;
    struct bd_client *first;
};

struct bd_clients *bd_clients_create(const struct bd_limits *limits)
{
    struct bd_clients *clients = calloc(1, sizeof *clients);
    BD_ASSERT(clients);
    clients->limits = limits;
    return clients;
}

void bd_clients_destroy(struct bd_clients **clients)
{
    if (!*clients) return;
    while ((*clients)->first) {
        struct bd_client *client = (*clients)->first;
        BD_ASSERT_CMP(client->references, ==, 0);
        (*clients)->first = client->next;
        free(client);
    }
    free(*clients);
    *clients = NULL;
}

// What a bucket is filled with in a second, and what it holds.
struct rate {
    double per_second, size;
};

static struct rate request_rate(const struct bd_clients *clients)
{
    const double per_second = (double)clients->limits->requests_per_second;
    return (struct rate){.per_second = per_second, .size = 2 * per_second};
}

static struct rate login_rate(const struct bd_clients *clients)
{
    const double per_minute = (double)clients->limits->failed_logins_per_minute;
    return (struct rate){.per_second = per_minute / 60, .size = per_minute / 2};
}

static void refill(struct bd_bucket *bucket, struct rate rate)
{
    uint64_t now_ns = bd_clock_ns();
    bucket->left += (double)(now_ns - bucket->refilled_ns) * 1e-9 * rate.per_second;
    bucket->refilled_ns = now_ns;
    if (bucket->left > rate.size) bucket->left = rate.size;
}

static bool take(struct bd_bucket *bucket, struct rate rate)
{
    refill(bucket, rate);
    if (bucket->left < 1) return false;
    bucket->left -= 1;
    return true;
}

static bool is_full(struct bd_bucket *bucket, struct rate rate)
{
    refill(bucket, rate);
    return bucket->left >= rate.size;
}

struct bd_client *bd_client_get(struct bd_clients *clients, const char *key)
{
    struct bd_client *client = clients->first;
    while (client && strcmp(client->key, key) != 0) client = client->next;
    if (!client) {
        client = calloc(1, sizeof *client);
        BD_ASSERT(client);
        snprintf(client->key, sizeof client->key, "%s", key);
        client->requests.left = request_rate(clients).size;
        client->failed_logins.left = login_rate(clients).size;
        client->requests.refilled_ns = client->failed_logins.refilled_ns = bd_clock_ns();
        client->next = clients->first;
        clients->first = client;
    }
    client->references++;
    return client;
}

void bd_client_retain(struct bd_client *client)
{
    client->references++;
}

void bd_client_release(struct bd_client **client)
{
    if (!*client) return;
    BD_ASSERT_CMP((*client)->references, >, 0);
    (*client)->references--;
    *client = NULL;
}

enum bd_err bd_client_take_request(struct bd_clients *clients, struct bd_client *client,
                                   struct bd_err_detail *detail)
{
    if (take(&client->requests, request_rate(clients))) return BD_ERR_OK;
    return bd_err_set(detail, BD_ERR_BUSY, "requests_per_second",
                      "more than %llu requests a second (limit requests_per_second)",
                      (unsigned long long)clients->limits->requests_per_second);
}

enum bd_err bd_client_take_failed_login(struct bd_clients *clients, struct bd_client *client,
                                        struct bd_err_detail *detail)
{
    if (take(&client->failed_logins, login_rate(clients))) return BD_ERR_OK;
    return bd_err_set(detail, BD_ERR_BUSY, "failed_logins_per_minute",
                      "the token is not one of ours, and more than %llu such came in a minute "
                      "(limit failed_logins_per_minute)",
                      (unsigned long long)clients->limits->failed_logins_per_minute);
}

enum bd_err bd_client_begin_job(struct bd_clients *clients, struct bd_client *client,
                                struct bd_err_detail *detail)
{
    if (client->jobs >= clients->limits->jobs_per_client)
        return bd_err_set(detail, BD_ERR_BUSY, "jobs_per_client",
                          "%u jobs of this client are under way (limit jobs_per_client)",
                          client->jobs);
    client->jobs++;
    return BD_ERR_OK;
}

void bd_client_end_job(struct bd_client *client)
{
    BD_ASSERT_CMP(client->jobs, >, 0);
    client->jobs--;
}

enum bd_err bd_client_begin_edit(struct bd_clients *clients, struct bd_client *client,
                                 uint64_t bytes, struct bd_err_detail *detail)
{
    const uint64_t most = clients->limits->edit_bytes_per_client;
    if (bytes > 0 && client->edit_bytes > 0 && client->edit_bytes + bytes > most)
        return bd_err_set(detail, BD_ERR_BUSY, "edit_bytes_per_client",
                          "edits of this client with %llu bytes are under way (limit "
                          "edit_bytes_per_client)",
                          (unsigned long long)client->edit_bytes);
    client->edit_bytes += bytes;
    return BD_ERR_OK;
}

void bd_client_end_edit(struct bd_client *client, uint64_t bytes)
{
    BD_ASSERT_CMP(client->edit_bytes, >=, bytes);
    client->edit_bytes -= bytes;
}

void bd_clients_sweep(struct bd_clients *clients)
{
    for (struct bd_client **at = &clients->first; *at;) {
        struct bd_client *client = *at;
        const bool is_rested = is_full(&client->requests, request_rate(clients)) &&
                               is_full(&client->failed_logins, login_rate(clients));
        if (client->references > 0 || !is_rested) {
            at = &client->next;
        } else {
            *at = client->next;
            free(client);
        }
    }
}
