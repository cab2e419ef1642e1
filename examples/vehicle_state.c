/* SPDX-License-Identifier: GPL-3.0-or-later
 * Prints a vehicle's flight controller and battery once: vehicle_state HOST PORT, those of the status page.
 * cc -o vehicle_state vehicle_state.c. Fields: docs/status-page.md, "For programs". A real program uses a JSON library. */
#include <netdb.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

static char reply[65536];

static int ask(const char *host, const char *port)
{
    struct addrinfo hints = {.ai_socktype = SOCK_STREAM}, *found;
    char request[256];
    size_t size = 0;
    ssize_t got;
    int connection;

    if (getaddrinfo(host, port, &hints, &found))
        return -1;
    connection = socket(found->ai_family, found->ai_socktype, 0);
    if (connection < 0 || connect(connection, found->ai_addr, found->ai_addrlen))
        return -1;
    snprintf(request, sizeof request, "GET /api/state HTTP/1.1\r\nHost: %s\r\n\r\n", host);
    if (write(connection, request, strlen(request)) < 0)
        return -1;
    /* The Pi closes the connection after its reply. */
    while (size < sizeof reply - 1 && (got = read(connection, reply + size, sizeof reply - 1 - size)) > 0)
        size += (size_t)got;
    close(connection);
    freeaddrinfo(found);
    return size > 0 ? 0 : -1;
}

/* The value of the first key of this name, up to the next comma. */
static void print(const char *key)
{
    char quoted[64];
    const char *value;

    snprintf(quoted, sizeof quoted, "\"%s\":", key);
    value = strstr(reply, quoted);
    if (value)
        printf("%s:%.*s\n", key, (int)strcspn(value + strlen(quoted), ",}"), value + strlen(quoted));
}

int main(int count, char **words)
{
    if (count != 3 || ask(words[1], words[2])) {
        fprintf(stderr, "vehicle_state HOST PORT: no reply\n");
        return 1;
    }
    print("flight_controller");
    print("voltage_v");
    return 0;
}
